/** The last minutes in as many intervals as a plot has room for: of each the lowest and the highest
 * value, so that no peak is lost. Only new frames are read from one drawing to the next; moving back
 * or another interval reads the span again. */
import { Flag } from '../line/line_facts';
import { WARNING_FLAGS } from '../model/flags';
import type { History } from '../model/history';

export type ColumnName = 'force_N' | 'x_mm' | 'y_mm' | 'slip_mm' | 'qx_N' | 'qy_N';

/** sd: the standard deviation beside it; valid: the flags without which it is no value. */
interface Column {
  readonly name: ColumnName;
  readonly sd: 'force_sd_N' | 'location_sd_mm' | 'q_sd_N' | null;
  readonly valid: number;
  /** Flag without which sd is none. */
  readonly sdValid: number;
}

export const COLUMNS: readonly Column[] = [
  { name: 'force_N', sd: 'force_sd_N', valid: Flag.FIT_VALID, sdValid: Flag.UNCERTAINTY_VALID },
  { name: 'x_mm', sd: 'location_sd_mm', valid: Flag.FIT_VALID, sdValid: Flag.UNCERTAINTY_VALID },
  { name: 'y_mm', sd: 'location_sd_mm', valid: Flag.FIT_VALID, sdValid: Flag.UNCERTAINTY_VALID },
  { name: 'slip_mm', sd: null, valid: Flag.SLIP_VALID, sdValid: 0 },
  { name: 'qx_N', sd: 'q_sd_N', valid: Flag.TANGENTIAL_VALID, sdValid: Flag.TANGENTIAL_VALID },
  { name: 'qy_N', sd: 'q_sd_N', valid: Flag.TANGENTIAL_VALID, sdValid: Flag.TANGENTIAL_VALID },
];

export enum Trust {
  none = 0,
  doubtful = 1,
  good = 2,
}

/** The intervals of one column. Frames with a warning count only in intervals without another. */
export interface Track {
  readonly trust: Uint8Array;
  readonly low: Float32Array;
  readonly high: Float32Array;
  /** Whether low came first. */
  readonly rises: Uint8Array;
  /** With one standard deviation around; NaN where there is none. */
  readonly sdLow: Float32Array;
  readonly sdHigh: Float32Array;
}

const NOTHING = -1;

/** An interval b, from b width_s on, is at b % size. */
export class Buckets {
  readonly number: Float64Array;
  readonly flags: Uint32Array;
  readonly frames: Uint32Array;
  readonly lost: Uint32Array;
  readonly tracks: ReadonlyMap<ColumnName, Track>;
  width_s = 0;
  private next = 0; // row of the history
  private from = 0; // oldest interval that was read whole
  private newest = NOTHING;

  /** size: intervals that are kept, more than are shown. */
  constructor(readonly size: number) {
    this.number = new Float64Array(size).fill(NOTHING);
    this.flags = new Uint32Array(size);
    this.frames = new Uint32Array(size);
    this.lost = new Uint32Array(size);
    this.tracks = new Map(
      COLUMNS.map((column) => [
        column.name,
        {
          trust: new Uint8Array(size),
          low: new Float32Array(size),
          high: new Float32Array(size),
          rises: new Uint8Array(size),
          sdLow: new Float32Array(size),
          sdHigh: new Float32Array(size),
        },
      ]),
    );
  }

  /** Reads what is new of from_s..to_s; returns the intervals that cover it: first to last. At most
   * size of them. */
  read(history: History, width_s: number, from_s: number, to_s: number): { first: number; last: number } {
    const last = Math.floor(to_s / width_s);
    const first = Math.max(Math.floor(from_s / width_s), last - this.size + 1);
    const moved = width_s !== this.width_s || first < this.from || this.next < history.begin;
    if (moved) {
      this.number.fill(NOTHING);
      this.width_s = width_s;
      this.from = first;
      this.newest = NOTHING;
      this.next = history.rowAt(first * width_s);
    }
    /* Rows beyond `last` stay unread, else they would push out what is shown. */
    const end = history.rowAt((last + 1) * width_s);
    for (; this.next < end; this.next++) {
      this.take(history, this.next);
    }
    this.from = Math.max(this.from, this.newest - this.size + 1);
    return { first, last };
  }

  /** Where interval b is, or -1 if no frame fell into it. */
  slot(b: number): number {
    const slot = b % this.size;
    return b >= 0 && this.number[slot] === b ? slot : NOTHING;
  }

  private take(history: History, number: number): void {
    const row = history.slot(number);
    const b = Math.floor((history.t_s[row] ?? 0) / this.width_s);
    const slot = b % this.size;
    const flags = history.flags[row] ?? 0;
    if (this.number[slot] !== b) {
      this.number[slot] = b;
      this.flags[slot] = this.frames[slot] = this.lost[slot] = 0;
      for (const track of this.tracks.values()) {
        track.trust[slot] = Trust.none;
      }
      this.newest = Math.max(this.newest, b);
    }
    this.flags[slot] = (this.flags[slot] ?? 0) | flags;
    this.frames[slot] = (this.frames[slot] ?? 0) + 1;
    this.lost[slot] = (this.lost[slot] ?? 0) + lostBefore(history, number);
    const trust = flags & WARNING_FLAGS ? Trust.doubtful : Trust.good;
    for (const column of COLUMNS) {
      const track = this.tracks.get(column.name);
      if (!track || (flags & column.valid) !== column.valid || trust < (track.trust[slot] ?? 0)) {
        continue;
      }
      const value = history.columns[column.name][row] ?? 0;
      const hasSd = column.sd !== null && (flags & column.sdValid) !== 0;
      const sd = hasSd && column.sd ? (history.columns[column.sd][row] ?? NaN) : NaN;
      if (trust > (track.trust[slot] ?? 0)) {
        track.trust[slot] = trust;
        track.low[slot] = track.high[slot] = value;
        track.rises[slot] = 1;
        track.sdLow[slot] = value - sd;
        track.sdHigh[slot] = value + sd;
        continue;
      }
      if (value < (track.low[slot] ?? 0)) {
        track.low[slot] = value;
        track.rises[slot] = 0;
      } else if (value > (track.high[slot] ?? 0)) {
        track.high[slot] = value;
        track.rises[slot] = 1;
      }
      track.sdLow[slot] = lower(track.sdLow[slot] ?? NaN, value - sd);
      track.sdHigh[slot] = -lower(-(track.sdHigh[slot] ?? NaN), -(value + sd));
    }
  }
}

/** A jump of more is a fingertip that restarted. */
const MOST_LOST = 1 << 24;

/** Frames that are missing right before a row. */
export function lostBefore(history: History, row: number): number {
  if (row <= history.begin) {
    return 0;
  }
  const frame = history.frame[history.slot(row)] ?? 0;
  const before = history.frame[history.slot(row - 1)] ?? 0;
  const lost = (frame - before - 1) >>> 0;
  return lost < MOST_LOST ? lost : 0;
}

/** An interval of 1, 2 or 5 times a power of ten for a span on a number of pixels, so that it seldom
 * changes; and no shorter than 1 ms. */
export function intervalOf(span_s: number, pixels: number): number {
  const least = Math.max(span_s / Math.max(pixels, 1), 0.001);
  const decade = 10 ** Math.floor(Math.log10(least) + 1e-9);
  for (const step of [1, 2, 5]) {
    if (step * decade >= least * (1 - 1e-9)) {
      return step * decade;
    }
  }
  return 10 * decade;
}

function lower(a: number, b: number): number {
  return Number.isNaN(a) || b < a ? b : a;
}
