/**
 * The last minutes of one fingertip: columns of typed arrays, a ring, a row for each frame.
 *
 * Rows are numbered from the first one on, for good: row i, begin <= i < end, is in slot i % capacity
 * of every column. What was not told is NaN: no fit, no x; a packet that did not come. A row takes
 * what the contact and the raw packet of one frame say; nothing is allocated for it.
 */
import { CONTACT_FIELDS, Flag, type Contact, type ContactField, type Raw } from '../line/packets';

/** Rows: 3.3 minutes at 1308 frames a second, 40 MB with 15 sensors. */
export const HISTORY_ROWS = 1 << 18;

/** Which flag a quantity needs. */
const FLAG_OF_FIELD = new Map<ContactField, number>(
  CONTACT_FIELDS.map((field) => [field, flagOf(field)]),
);

function flagOf(field: ContactField): number {
  switch (field) {
    case 'location_sd_mm':
    case 'force_sd_N':
      return Flag.UNCERTAINTY_VALID;
    case 'slip_mm':
      return Flag.SLIP_VALID;
    case 'sigma_x_mm':
    case 'sigma_y_mm':
    case 'width_correlation':
      return Flag.WIDTHS_VALID;
    case 'qx_N':
    case 'qy_N':
    case 'q_sd_N':
    case 'tangential_ratio':
      return Flag.TANGENTIAL_VALID;
    case 'vx_mm_s':
    case 'vy_mm_s':
      return Flag.VELOCITY_VALID;
    default:
      return Flag.FIT_VALID;
  }
}

export class History {
  readonly capacity: number;
  readonly sensor_count: number;
  /** Device time since its start, s. Never falls from row to row. */
  readonly t_s: Float64Array;
  readonly frame: Uint32Array;
  /** contact_flags.h; of the raw packet where no contact packet came. */
  readonly flags: Uint32Array;
  /** Time from the sensors to the packet, us; 0 where no contact packet came. */
  readonly total_us: Uint16Array;
  /** Each quantity of a contact, NaN without its flag. */
  readonly columns: Readonly<Record<ContactField, Float32Array>>;
  /** Pressure above the tare, Pa, [slot * sensor_count + sensor], as measured; NaN where no raw
   * packet came or the reading is no measurement. */
  readonly pressure_Pa: Float32Array;

  private first = 0;
  private next = 0;

  constructor(sensor_count: number, capacity = HISTORY_ROWS) {
    this.capacity = capacity;
    this.sensor_count = sensor_count;
    this.t_s = new Float64Array(capacity);
    this.frame = new Uint32Array(capacity);
    this.flags = new Uint32Array(capacity);
    this.total_us = new Uint16Array(capacity);
    this.columns = Object.fromEntries(
      CONTACT_FIELDS.map((field) => [field, new Float32Array(capacity)]),
    ) as Record<ContactField, Float32Array>;
    this.pressure_Pa = new Float32Array(capacity * sensor_count);
    this.fields = CONTACT_FIELDS.map((field) => ({
      field,
      flag: FLAG_OF_FIELD.get(field) ?? 0,
      column: this.columns[field],
    }));
  }

  private readonly fields: { field: ContactField; flag: number; column: Float32Array }[];

  /** The oldest row that is kept. */
  get begin(): number {
    return this.first;
  }

  /** One after the newest row. */
  get end(): number {
    return this.next;
  }

  slot(row: number): number {
    return row % this.capacity;
  }

  /** The first kept row not before this device time; end if there is none. */
  rowAt(t_s: number): number {
    let low = this.first;
    let high = this.next;
    while (low < high) {
      const middle = Math.floor((low + high) / 2);
      if ((this.t_s[middle % this.capacity] as number) < t_s) {
        low = middle + 1;
      } else {
        high = middle;
      }
    }
    return low;
  }

  /** Forgets all rows; their numbers are not used again. */
  clear(): void {
    this.first = this.next;
  }

  addContact(contact: Contact): void {
    const slot = this.slotOf(contact.frame, contact.t_us);
    this.flags[slot] = contact.flags;
    this.total_us[slot] = contact.total_us;
    for (const { field, flag, column } of this.fields) {
      column[slot] = contact.flags & flag ? contact[field] : NaN;
    }
  }

  addRaw(raw: Raw): void {
    const known = this.next;
    const slot = this.slotOf(raw.frame, raw.t_us);
    if (this.next !== known) {
      this.flags[slot] = raw.flags;
    }
    const count = Math.min(this.sensor_count, raw.sensor_count);
    const at = slot * this.sensor_count;
    const measured = raw.flags & Flag.HELD ? ~0 : raw.valid;
    for (let k = 0; k < count; k++) {
      this.pressure_Pa[at + k] =
        (measured >>> k) & 1
          ? ((raw.pressure_Pa_q10[k] as number) - (raw.baseline_Pa_q10[k] as number)) / 1024
          : NaN;
    }
  }

  /** That of the newest row if it is of this frame, else of a new one. */
  private slotOf(frame: number, t_us: number): number {
    const t_s = t_us / 1e6;
    if (this.next > this.first) {
      const newest = (this.next - 1) % this.capacity;
      if (this.frame[newest] === frame && this.t_s[newest] === t_s) {
        return newest;
      }
      if (t_s < (this.t_s[newest] as number)) {
        this.clear(); // it started anew
      }
    }
    const slot = this.next % this.capacity;
    this.next++;
    if (this.next - this.first > this.capacity) {
      this.first = this.next - this.capacity;
    }
    this.t_s[slot] = t_s;
    this.frame[slot] = frame;
    this.total_us[slot] = 0;
    for (const { column } of this.fields) {
      column[slot] = NaN;
    }
    this.pressure_Pa.fill(NaN, slot * this.sensor_count, (slot + 1) * this.sensor_count);
    return slot;
  }
}
