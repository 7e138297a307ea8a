/** What the view shows of a fingertip: its model in short names, words and bitmaps. Read when a
 * picture is drawn; nothing happens here for a packet. */
import { Flag, Stored, type Contact, type ContactField, type Info } from '../line/line_facts';
import type { Fingertip } from '../model/fingertip';
import { FINGERS } from './palette';
import { NOTHING_KNOWN, momentAt, type Moment } from './recorded_contact';

/** The newest contact, or that of a moment in the past. A value whose flag is off is 0. */
export type ShownContact = Pick<Contact, 'flags' | ContactField>;

/** Where the sensors are, origin in the middle of the pad, x across the strips, y along them. */
export type ShownLayout = Pick<Info, 'x_mm' | 'y_mm'>;

/** Level: how much it matters, and so its colour. */
export type Level = 'plain' | 'good' | 'warning' | 'bad';

/** What is true of a simulated fingertip, some 30 ms old at most. Without contact all is 0. */
export interface ShownTruth {
  readonly contact: boolean;
  readonly x_mm: number;
  readonly y_mm: number;
  readonly force_N: number;
  readonly qx_N: number;
  readonly qy_N: number;
}

export const NO_TRUTH: ShownTruth = { contact: false, x_mm: 0, y_mm: 0, force_N: 0, qx_N: 0, qy_N: 0 };

interface Press {
  x_mm: number;
  y_mm: number;
  /** Down, 0..50. */
  force_N: number;
}

/** The hand that presses on a simulated fingertip: SimulatedFingertip of src/simulated is one, and
 * ServedFingertip, whose hand can press only. */
export interface Hand {
  readonly objects?: readonly { readonly name: string; readonly title: string }[];
  /** Presses, and drags along as x_mm and y_mm change. */
  press(hand: Press): void;
  /** Ends whatever touches. */
  lift(): void;
  /** An object by its name; lifts the one that was there. */
  choose?(name: string): void;
  /** Lets the object fall from 3 mm; it lies there until it is lifted or pressed. */
  drop?(x_mm: number, y_mm: number): void;
  /** A grip presses the object while a load of 0..50 N, its weight, pulls it along the pad, angle_deg from x towards y. It stays where it
   * was first held, until the load is more than friction holds; one that slid off stays lost until it is lifted. */
  hold?(grip: Press & { load_N: number; angle_deg: number }): void;
  /** Static friction, 0.1..1.5; 0.5 at first. Kinetic is 0.8 of it. */
  setFriction?(friction: number): void;
}

/** A longer time without a frame is shown as a stall, as in the terminal's monitor. */
const STALLED_ms = 700;

export class Shown {
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

  get hand(): Hand | null {
    const line = this.fingertip.line as Partial<Hand>;
    return line.press ? (line as Hand) : null;
  }

  /** null: it is no simulated one. */
  get truth(): ShownTruth | null {
    return (this.fingertip.line as { truth?: ShownTruth }).truth ?? null;
  }

  /** Its firmware estimates tangential force and has a pad profile. */
  get tangential(): boolean {
    return ((this.fingertip.info?.stored ?? 0) & Stored.PAD) !== 0;
  }

  /** Over the last second of what is kept, whether or not more comes. */
  get frames_per_s(): number {
    const { history } = this.fingertip;
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
    const { is_replay, state, contacts, raws } = this.fingertip;
    return contacts + raws > 0 && (is_replay || state === 'live') && this.silentFor_ms(now_ms) < this.stalled_ms;
  }

  /** What is known of a moment of its history; of now, Infinity, nothing once the newest frame is old. */
  moment(t_s: number, now_ms: number): Moment {
    const { history } = this.fingertip;
    return history && (t_s < Infinity || this.isCurrent(now_ms)) ? momentAt(history, t_s, this.stalled_ms / 1000) : NOTHING_KNOWN;
  }

  private silentFor_ms(now_ms: number): number {
    return (this.fingertip.line as { silent_ms?: number }).silent_ms ?? now_ms - this.fingertip.framed_ms;
  }

  /** Two frames at a rate that somebody has set. */
  private get stalled_ms(): number {
    const { info } = this.fingertip;
    return Math.max(STALLED_ms, info?.rate_mHz ? 2e6 / info.rate_mHz : 0);
  }

  /** In words, and how much it matters. */
  state(now_ms: number): { words: string; level: Level } {
    const { state, is_replay, why, health, history } = this.fingertip;
    const silent_ms = this.silentFor_ms(now_ms);
    if (state === 'closed') {
      return { words: why || 'disconnected', level: is_replay ? 'plain' : 'bad' };
    }
    if (is_replay) {
      return { words: silent_ms > this.stalled_ms ? 'nothing recorded' : 'replay', level: 'plain' };
    }
    if (state === 'opening') {
      return { words: 'waiting for an answer', level: 'warning' };
    }
    if (state === 'live' && health?.sensors_present === 0) {
      return { words: 'no sensor answers', level: 'bad' };
    }
    if (silent_ms > this.stalled_ms) {
      return { words: `stalled for ${Math.floor(silent_ms / 1000)} s`, level: 'bad' };
    }
    if (history && this.isCurrent(now_ms) && !(history.flags[history.slot(history.end - 1)] & Flag.TARED)) {
      return { words: 'taring', level: 'warning' };
    }
    return { words: 'live', level: 'good' };
  }
}
