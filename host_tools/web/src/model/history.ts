/**
 * The last minutes of one fingertip: columns of typed arrays, a ring, a row for each frame.
 *
 * Rows are numbered from the first one on, for good: row i, begin <= i < end, is at slot(i) of every
 * column. What was not reported is NaN: no fit, no x; a packet that did not come. A row takes what
 * the contact and the raw packet of one frame report; nothing is allocated for it.
 */
import { CONTACT_FIELDS, CONTACT_FLAG, Flag, type Contact, type ContactField, type Raw } from '../line/line_facts';

/** Rows: 3.3 minutes at 1308 frames a second, some 48 MB with 15 sensors. */
export const HISTORY_ROWS = 1 << 18;

/** The flags under which a contact packet has quantities. */
const QUANTITIES = CONTACT_FIELDS.reduce((bits, field) => bits | CONTACT_FLAG[field], 0);

/** The readings of one frame; bitmaps by sensor. pressure_Pa [sensor]: above the tare, over the gain, as the fit
 * gets it; NaN where the reading is no measurement. */
export interface Readings {
  valid: number;
  saturated: number;
  doubtful: number;
  pressure_Pa: Float32Array;
}

/** Whether a sensor is in a bitmap, which may have more bits than JavaScript shifts. */
export const hasSensor = (map: number, k: number) => Math.floor(map / 2 ** k) % 2 === 1;

export class History {
  readonly capacity: number;
  readonly sensor_count: number;
  /** Device time, s; where the fingertip restarted it goes on from before. Never falls. */
  readonly t_s: Float64Array;
  /** contact_flags.h; of the raw packet where no contact packet came, without those of quantities. */
  readonly flags: Uint32Array;
  /** Frames that are missing right before this one. */
  readonly lost: Uint32Array;
  readonly valid: Float64Array;
  readonly saturated: Float64Array;
  readonly doubtful: Float64Array;
  /** Each quantity of a contact, NaN without its flag. */
  readonly columns: Readonly<Record<ContactField, Float32Array>>;
  /** [slot * sensor_count + sensor], as Readings has it; NaN where no raw packet came. */
  readonly pressure_Pa: Float32Array;
  /** [sensor], of the calibration in use; empty: none. */
  gain: ArrayLike<number> = [];
  /** The oldest row that is kept, and one after the newest. */
  begin = 0;
  end = 0;
  /** How long nothing was heard before what comes next; counts where its clock restarts. */
  gap_s = 0;

  private offset_s = 0;
  private newest_us = 0;
  private newest_frame = 0;
  private measured = { valid: 0, saturated: 0, doubtful: 0 };
  private readonly fields: { field: ContactField; flag: number; column: Float32Array }[];

  constructor(sensor_count: number, capacity = HISTORY_ROWS) {
    this.capacity = capacity;
    this.sensor_count = sensor_count;
    this.t_s = new Float64Array(capacity);
    this.flags = new Uint32Array(capacity);
    this.lost = new Uint32Array(capacity);
    this.valid = new Float64Array(capacity);
    this.saturated = new Float64Array(capacity);
    this.doubtful = new Float64Array(capacity);
    this.pressure_Pa = new Float32Array(capacity * sensor_count);
    this.fields = CONTACT_FIELDS.map((field) => ({
      field,
      flag: CONTACT_FLAG[field],
      column: new Float32Array(capacity),
    }));
    this.columns = Object.fromEntries(this.fields.map(({ field, column }) => [field, column])) as Record<ContactField, Float32Array>;
  }

  slot(row: number): number {
    return row % this.capacity;
  }

  /** The first kept row not before this time; end if there is none. */
  rowAt(t_s: number): number {
    let low = this.begin;
    let high = this.end;
    while (low < high) {
      const middle = Math.floor((low + high) / 2);
      if (this.t_s[middle % this.capacity] < t_s) {
        low = middle + 1;
      } else {
        high = middle;
      }
    }
    return low;
  }

  /** A view of a row's readings, overwritten with it; null where no raw packet came. */
  readingsAt(row: number): Readings | null {
    if (row < this.begin || row >= this.end) {
      return null;
    }
    const slot = row % this.capacity;
    const pressure_Pa = this.pressure_Pa.subarray(slot * this.sensor_count, (slot + 1) * this.sensor_count);
    const [valid, saturated, doubtful] = [this.valid[slot], this.saturated[slot], this.doubtful[slot]];
    return pressure_Pa.every(Number.isNaN) ? null : { valid, saturated, doubtful, pressure_Pa };
  }

  addContact(contact: Contact): void {
    const slot = this.slotOf(contact.frame, contact.t_us);
    this.flags[slot] = contact.flags;
    for (const { field, flag, column } of this.fields) {
      column[slot] = contact.flags & flag ? contact[field] : NaN;
    }
  }

  addRaw(raw: Raw): void {
    const known = this.end;
    const slot = this.slotOf(raw.frame, raw.t_us);
    if (this.end !== known) {
      this.flags[slot] = raw.flags & ~QUANTITIES;
    }
    const held = (raw.flags & Flag.HELD) !== 0; // its readings are those of the frame before
    if (!held) {
      this.measured = { valid: raw.valid, saturated: raw.saturated, doubtful: raw.doubtful };
    }
    ({ valid: this.valid[slot], saturated: this.saturated[slot], doubtful: this.doubtful[slot] } = this.measured);
    const count = Math.min(this.sensor_count, raw.sensor_count);
    const at = slot * this.sensor_count;
    const measured = held ? 2 ** count - 1 : raw.valid;
    for (let k = 0; k < count; k++) {
      const above_Pa = (raw.pressure_Pa_q10[k] - raw.baseline_Pa_q10[k]) / 1024;
      this.pressure_Pa[at + k] = hasSensor(measured, k) ? above_Pa / (k < this.gain.length ? this.gain[k] : 1) : NaN;
    }
  }

  /** That of the newest row if it is of this frame, else of a new one. */
  private slotOf(frame: number, t_us: number): number {
    let t_s = t_us / 1e6 + this.offset_s;
    let lost = 0;
    if (this.end > this.begin) {
      const newest = (this.end - 1) % this.capacity;
      const newest_s = this.t_s[newest];
      if (this.newest_frame === frame && this.newest_us === t_us) {
        return newest;
      }
      if (t_s < newest_s) {
        this.offset_s += newest_s - t_s + this.gap_s; // it restarted
        t_s = newest_s + this.gap_s;
      } else {
        lost = Math.max(0, ((frame - this.newest_frame) | 0) - 1);
      }
    }
    this.gap_s = 0;
    this.newest_us = t_us;
    this.newest_frame = frame;
    const slot = this.end % this.capacity;
    this.end++;
    this.begin = Math.max(this.begin, this.end - this.capacity);
    this.t_s[slot] = t_s;
    this.lost[slot] = lost;
    this.valid[slot] = this.saturated[slot] = this.doubtful[slot] = 0;
    for (const { column } of this.fields) {
      column[slot] = NaN;
    }
    this.pressure_Pa.fill(NaN, slot * this.sensor_count, (slot + 1) * this.sensor_count);
    return slot;
  }
}
