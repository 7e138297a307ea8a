/** What the view shows of a fingertip: its model in short names, words and bitmaps. Read when a
 * picture is drawn; nothing happens here for a packet. */
import { Flag, Stored, type Contact, type ContactField } from '../line/line_facts';
import type { Fingertip } from '../model/fingertip';
import type { History } from '../model/history';
import { FINGERS } from './palette';

/** The newest contact, or that of a moment in the past. A value whose flag is off is 0. */
export type ShownContact = Pick<Contact, 'flags' | ContactField>;

/** Bitmaps by sensor; pressure_Pa as the fit gets it: above the zero, over the gain. */
export interface ShownReadings {
  valid: number;
  saturated: number;
  doubtful: number;
  readonly pressure_Pa: Float32Array;
}

/** Where the sensors are, origin in the middle of the pad, x across the strips, y along them. */
export interface ShownLayout {
  readonly x_mm: ArrayLike<number>;
  readonly y_mm: ArrayLike<number>;
}

/** Level: how much it matters, and so its colour. */
export type Level = 'plain' | 'good' | 'warning' | 'bad';

/** What is true of a simulated fingertip, some 30 ms old at most; the pull only where it is known. */
export interface ShownTruth {
  readonly contact: boolean;
  readonly x_mm: number;
  readonly y_mm: number;
  readonly force_N: number;
  readonly qx_N?: number;
  readonly qy_N?: number;
}

/** The hand that presses on a simulated fingertip: SimulatedFingertip of src/simulated is one, and
 * ServedFingertip, whose hand can press only. */
export interface Hand {
  readonly objects?: readonly { readonly name: string; readonly title: string }[];
  press(hand: { x_mm: number; y_mm: number; force_N: number } | null): void;
  choose?(name: string): void;
  drop?(x_mm: number, y_mm: number): void;
  hold?(grip: { x_mm: number; y_mm: number; force_N: number; load_N: number; angle_deg: number } | null): void;
  setFriction?(friction: number): void;
}

/** A longer time without a frame is shown as a stall, as in the terminal's monitor. */
const STALLED_ms = 700;

export class Shown {
  private readonly kept: ShownReadings = {
    valid: 0,
    saturated: 0,
    doubtful: 0,
    pressure_Pa: new Float32Array(32),
  };
  private readKept = 0;

  constructor(
    readonly fingertip: Fingertip,
    private readonly place: number,
  ) {}

  get finger(): number {
    return this.place % FINGERS;
  }

  /** Short: the end of the serial number distinguishes several. */
  get name(): string {
    const { info, line, is_replay } = this.fingertip;
    if (this.truth) {
      return this.hand?.objects ? `simulated ${this.place + 1}` : line.label;
    }
    return is_replay || !info ? line.label : `fingertip ${info.serial.slice(-4)}`;
  }

  get isReplay(): boolean {
    return this.fingertip.is_replay;
  }

  get hand(): Hand | null {
    const line = this.fingertip.line as Partial<Hand>;
    return line.press ? (line as Hand) : null;
  }

  /** null: it is no simulated one. */
  get truth(): ShownTruth | null {
    return (this.fingertip.line as { truth?: ShownTruth }).truth ?? null;
  }

  get layout(): ShownLayout | null {
    return this.fingertip.info;
  }

  get history(): History | null {
    return this.fingertip.history;
  }

  /** Its firmware estimates tangential force and has a pad profile. */
  get tangential(): boolean {
    return ((this.fingertip.info?.stored ?? 0) & Stored.PAD) !== 0;
  }

  get slip_threshold_mm(): number {
    return this.fingertip.info?.slip_threshold_mm ?? 0;
  }

  get location_limit_mm(): number {
    return this.fingertip.info?.location_limit_mm ?? 0;
  }

  /** Over the last second of what is kept. */
  get frames_per_s(): number {
    const { history } = this;
    if (!history || history.end - history.begin < 2) {
      return 0;
    }
    const newest_s = history.t_s[history.slot(history.end - 1)] ?? 0;
    const row = history.rowAt(newest_s - 1);
    const span_s = newest_s - (history.t_s[history.slot(row)] ?? 0);
    return span_s > 0 ? (history.end - 1 - row) / span_s : 0;
  }

  /** Whether the newest frame's report still holds. now_ms: performance.now(). */
  isCurrent(now_ms: number): boolean {
    const { is_replay, state, heard_ms, contacts, raws } = this.fingertip;
    const reported = contacts + raws > 0;
    return reported && (is_replay || (state === 'live' && now_ms - heard_ms < STALLED_ms));
  }

  get contact(): ShownContact | null {
    return this.fingertip.contacts > 0 ? this.fingertip.contact : null;
  }

  /** Readings of the last frame that was not held: a held one is no measurement. */
  get readings(): ShownReadings | null {
    const { raw, raws } = this.fingertip;
    if (raws === 0) {
      return null;
    }
    if (raws !== this.readKept && !(raw.flags & Flag.HELD)) {
      this.readKept = raws;
      const { kept } = this;
      kept.valid = raw.valid;
      kept.saturated = raw.saturated;
      kept.doubtful = raw.doubtful;
      for (let k = 0; k < raw.sensor_count; k++) {
        const above_Pa = ((raw.pressure_Pa_q10[k] ?? 0) - (raw.baseline_Pa_q10[k] ?? 0)) / 1024;
        kept.pressure_Pa[k] = above_Pa / this.gain(k);
      }
    }
    return this.kept;
  }

  /** Readings of a row that is kept; null if its raw packet is missing. */
  readingsAt(row: number): ShownReadings | null {
    const { history } = this;
    if (!history) {
      return null;
    }
    const count = history.sensor_count;
    const from = history.slot(row) * count;
    const pressure_Pa = history.pressure_Pa.slice(from, from + count);
    let valid = 0;
    pressure_Pa.forEach((above_Pa, k) => {
      if (!Number.isNaN(above_Pa)) {
        valid |= 1 << k;
        pressure_Pa[k] = above_Pa / this.gain(k);
      }
    });
    return valid === 0 ? null : { valid, saturated: 0, doubtful: 0, pressure_Pa };
  }

  /** In words, and how much it matters. */
  state(now_ms: number): { words: string; level: Level } {
    const { state, is_replay, why, heard_ms, health } = this.fingertip;
    if (state === 'closed') {
      return { words: why || 'disconnected', level: is_replay ? 'plain' : 'bad' };
    }
    if (is_replay) {
      return { words: 'replay', level: 'plain' };
    }
    if (state === 'opening') {
      return { words: 'waiting for an answer', level: 'warning' };
    }
    if (health && health.sensors_present === 0) {
      return { words: 'no sensor answers', level: 'bad' };
    }
    const silent_ms = now_ms - heard_ms;
    if (silent_ms > STALLED_ms) {
      return { words: `stalled for ${Math.floor(silent_ms / 1000)} s`, level: 'bad' };
    }
    const flags = this.contact?.flags;
    if (flags !== undefined && !(flags & Flag.TARED)) {
      return { words: 'taring', level: 'warning' };
    }
    return { words: 'live', level: 'good' };
  }

  private gain(k: number): number {
    const { info } = this.fingertip;
    return info && info.stored & Stored.CALIBRATION ? info.gain[k] || 1 : 1;
  }
}
