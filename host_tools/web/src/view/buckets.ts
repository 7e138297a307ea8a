/** The last minutes in as many intervals as a plot has room for: of each the lowest and the highest
 * value, so that no peak is lost. Only new frames are read from one drawing to the next; moving back
 * or another interval reads the span again. */
import { WARNING_FLAGS } from '../model/flags';
import type { History } from '../model/history';

/** A column of the history, and its standard deviation. */
const COLUMNS = [
  ['force_N', 'force_sd_N'],
  ['x_mm', 'location_sd_mm'],
  ['y_mm', 'location_sd_mm'],
  ['slip_mm', null],
  ['qx_N', 'q_sd_N'],
  ['qy_N', 'q_sd_N'],
] as const;
export type ColumnName = (typeof COLUMNS)[number][0];

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
  readonly lost: Uint32Array;
  readonly tracks: ReadonlyMap<ColumnName, Track>;
  width_s = 0;
  private history: History | null = null;
  private next = 0; // row of the history
  private from = 0; // oldest interval that was read whole
  private newest = NOTHING;

  /** size: intervals that are kept, more than are shown. */
  constructor(readonly size: number) {
    this.number = new Float64Array(size).fill(NOTHING);
    this.flags = new Uint32Array(size);
    this.lost = new Uint32Array(size);
    this.tracks = new Map(
      COLUMNS.map(([name]) => [
        name,
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
    const moved = history !== this.history || width_s !== this.width_s || first < this.from || this.next < history.begin;
    if (moved) {
      this.number.fill(NOTHING);
      this.history = history;
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
    const b = Math.floor(history.t_s[row] / this.width_s);
    const slot = b % this.size;
    const flags = history.flags[row];
    if (this.number[slot] !== b) {
      this.number[slot] = b;
      this.flags[slot] = this.lost[slot] = 0;
      for (const track of this.tracks.values()) {
        track.trust[slot] = Trust.none;
      }
      this.newest = Math.max(this.newest, b);
    }
    this.flags[slot] |= flags;
    this.lost[slot] += history.lost[row];
    const trust = flags & WARNING_FLAGS ? Trust.doubtful : Trust.good;
    for (const [name, sdName] of COLUMNS) {
      const track = this.tracks.get(name)!;
      const value = history.columns[name][row];
      if (Number.isNaN(value) || trust < track.trust[slot]) {
        continue;
      }
      const sd = sdName === null ? NaN : history.columns[sdName][row];
      if (trust > track.trust[slot]) {
        track.trust[slot] = trust;
        track.low[slot] = Infinity;
        track.high[slot] = -Infinity;
        track.sdLow[slot] = track.sdHigh[slot] = NaN;
      }
      if (value < track.low[slot]) {
        track.low[slot] = value;
        track.rises[slot] = 0;
      }
      if (value > track.high[slot]) {
        track.high[slot] = value;
        track.rises[slot] = 1;
      }
      track.sdLow[slot] = lower(track.sdLow[slot], value - sd);
      track.sdHigh[slot] = -lower(-track.sdHigh[slot], -(value + sd));
    }
  }
}

/** A round interval for a span on a number of pixels, so that it seldom changes; and no shorter than 1 ms. */
export function intervalOf(span_s: number, pixels: number): number {
  return roundAbove(Math.max(span_s / Math.max(pixels, 1), 0.001));
}

/** 1, 2 or 5 times a power of ten, not below value. */
export function roundAbove(value: number): number {
  if (!(value > 0)) {
    return 1;
  }
  const decade = 10 ** Math.floor(Math.log10(value) + 1e-9);
  return decade * ([1, 2, 5].find((step) => step * decade >= value * (1 - 1e-9)) ?? 10);
}

function lower(a: number, b: number): number {
  return Number.isNaN(a) || b < a ? b : a;
}
