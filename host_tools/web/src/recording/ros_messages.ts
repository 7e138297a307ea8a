/** ROS 2 messages of what a fingertip says: libfingertip/ros_messages.cpp. */
import { Flag, STAGES, type Contact, type Raw } from '../line/packets';
import { WARNING_FLAGS, flagsText } from '../model/flags';
import { flagOf } from '../model/history';
import { CdrReader, CdrWriter } from './cdr';
import { FIRST_FIELDS, LATER_FIELDS, type Pairs } from './fields';

const DEFINITIONS = new Map(
  Object.entries(
    import.meta.glob<string>('../../../python/fingertip/msg/*/msg/*.msg', {
      query: '?raw',
      import: 'default',
      eager: true,
    }),
  ).map(([path, text]) => [path.replace(/.*\/(\w+)\/msg\/(\w+)\.msg$/, '$1/$2'), text]),
);

export const CONTACT = 'fingertip_msgs/Contact';
export const LINE = 'fingertip_msgs/Line';

/** "geometry_msgs/Wrench" as ROS 2 names it in full. */
export function fullName(name: string): string {
  return name.replace('/', '/msg/');
}

/** Of a message, with all that it needs, as the schema encoding ros2msg has it. */
export function schemaOf(name: string): string {
  const needed = [name];
  let text = '';
  for (let i = 0; i < needed.length; i++) {
    const each = needed[i];
    const definition = DEFINITIONS.get(each) ?? '';
    text += (i > 0 ? `${'='.repeat(80)}\nMSG: ${each}\n` : '') + definition;
    for (const line of definition.split('\n')) {
      const type = line.split(/[ []/)[0];
      if (DEFINITIONS.has(type) && !needed.includes(type)) {
        needed.push(type);
      }
    }
  }
  return text;
}

/** As a part of topics and coordinate frames. */
export function nameInRos(serial: string): string {
  const name = (serial || 'unknown').replace(/[^A-Za-z0-9]/g, '_');
  return (/^\d/.test(name) ? 's' : '') + name;
}

export interface Header {
  time_ns: bigint;
  frame_id: string;
}

function begun(header: Header): CdrWriter {
  const writer = new CdrWriter();
  writer.u32(Number(header.time_ns / 1_000_000_000n));
  writer.u32(Number(header.time_ns % 1_000_000_000n));
  writer.text(header.frame_id);
  return writer;
}

function isTrusted(flags: number): boolean {
  return (flags & (Flag.FIT_VALID | WARNING_FLAGS)) === Flag.FIT_VALID;
}

/** Tared, and without a warning nothing presses. */
function isUntouched(flags: number): boolean {
  return (flags & (Flag.CONTACT | Flag.TARED | WARNING_FLAGS)) === Flag.TARED;
}

/** geometry_msgs/WrenchStamped */
export function wrench(header: Header, contact: Contact): Uint8Array<ArrayBuffer> {
  const writer = begun(header);
  let values = [0, 0, 0, 0, 0, 0];
  if (!isUntouched(contact.flags)) {
    const trusted = isTrusted(contact.flags);
    const sure =
      trusted &&
      (contact.flags & (Flag.TANGENTIAL_VALID | Flag.TANGENTIAL_FROM_TOUCH)) === Flag.TANGENTIAL_VALID;
    const x_m = contact.x_mm / 1000;
    const y_m = contact.y_mm / 1000;
    const fx = sure ? contact.qx_N : NaN;
    const fy = sure ? contact.qy_N : NaN;
    const fz = trusted ? -contact.force_N : NaN;
    values = [
      fx,
      fy,
      fz,
      trusted ? y_m * fz : NaN,
      trusted ? -x_m * fz : NaN,
      sure ? x_m * fy - y_m * fx : NaN,
    ];
  }
  values.forEach((value) => writer.f64(value));
  return writer.bytes();
}

/** geometry_msgs/PointStamped */
export function place(header: Header, contact: Contact): Uint8Array<ArrayBuffer> {
  const writer = begun(header);
  const trusted = isTrusted(contact.flags);
  writer.f64(trusted ? contact.x_mm / 1000 : NaN);
  writer.f64(trusted ? contact.y_mm / 1000 : NaN);
  writer.f64(trusted ? 0 : NaN);
  return writer.bytes();
}

/** sensor_msgs/PointCloud2 */
export function pressures(
  header: Header,
  raw: Raw,
  x_mm: ArrayLike<number>,
  y_mm: ArrayLike<number>,
): Uint8Array<ArrayBuffer> {
  const FLOAT32 = 7;
  const names = ['x', 'y', 'z', 'pressure_pa'];
  const step = 4 * names.length;
  const writer = begun(header);
  writer.u32(1);
  writer.u32(raw.sensor_count);
  writer.u32(names.length);
  names.forEach((name, i) => {
    writer.text(name);
    writer.u32(4 * i);
    writer.u8(FLOAT32);
    writer.u32(1);
  });
  writer.u8(false); // is_bigendian
  writer.u32(step);
  writer.u32(step * raw.sensor_count);
  writer.u32(step * raw.sensor_count);
  for (let k = 0; k < raw.sensor_count; k++) {
    writer.f32(x_mm[k] / 1000);
    writer.f32(y_mm[k] / 1000);
    writer.f32(0);
    writer.f32(
      (raw.valid >>> k) & 1 ? (raw.pressure_Pa_q10[k] - raw.baseline_Pa_q10[k]) / 1024 : NaN,
    );
  }
  writer.u8(false); // is_dense
  return writer.bytes();
}

function status(
  header: Header,
  name: string,
  trouble: string,
  otherwise: string,
  serial: string,
  values: Pairs,
): Uint8Array<ArrayBuffer> {
  const writer = begun(header);
  writer.u32(1);
  writer.u8(trouble !== ''); // OK, WARN
  writer.text(name);
  writer.text(trouble || otherwise);
  writer.text(serial);
  writer.u32(values.length);
  for (const [key, value] of values) {
    writer.text(key);
    writer.text(value);
  }
  return writer.bytes();
}

/** diagnostic_msgs/DiagnosticArray of a health packet's fields. */
export function health(
  header: Header,
  serial: string,
  sensors: number,
  fields: Pairs,
): Uint8Array<ArrayBuffer> {
  const all = new Map(fields);
  const present = Number(all.get('sensors_present') ?? 0);
  const bad = Number(all.get('sensors_prom_bad') ?? 0);
  let missing = '';
  let damaged = '';
  for (let k = 0; k < sensors; k++) {
    missing += (present >>> k) & 1 ? '' : ` ${k}`;
    damaged += (bad >>> k) & 1 ? ` ${k}` : '';
  }
  const trouble = [
    missing && `sensors missing:${missing}`,
    damaged && `damaged PROM of sensors:${damaged}`,
  ]
    .filter(Boolean)
    .join('; ');
  return status(header, `fingertip ${serial}`, trouble, 'all sensors are there', serial, fields);
}

export function warnings(header: Header, serial: string, flags: number): Uint8Array<ArrayBuffer> {
  const warned = flags & WARNING_FLAGS;
  return status(
    header,
    `fingertip ${serial} contact`,
    warned ? flagsText(warned) : '',
    'no warning',
    serial,
    [],
  );
}

export function lineMessage(header: Header, number: number, text: string): Uint8Array<ArrayBuffer> {
  const writer = begun(header);
  writer.u64(number);
  writer.text(text);
  writer.u8(false);
  return writer.bytes();
}

/** fingertip_msgs/Contact of a recording of one. */
export function contactMessage(
  header: Header,
  number: number,
  contact: Contact | null,
  raw: Raw | null,
): Uint8Array<ArrayBuffer> {
  const any = (contact ?? raw) as Contact | Raw;
  const writer = begun(header);
  writer.u64(number);
  writer.u32(0);
  writer.f64(NaN);
  writer.u64(any.t_us);
  writer.u32(any.frame);
  writer.u8(contact !== null);
  writer.u16(contact?.sequence ?? 0);
  writer.u32(contact?.flags ?? 0);
  writer.u32(contact?.sensors_used ?? 0);
  const quantity = (field: (typeof FIRST_FIELDS)[number]): void => {
    const value = contact?.[field] ?? 0;
    const empty = ((contact?.flags ?? 0) & flagOf(field)) === 0 && Object.is(value, 0);
    writer.f32(empty ? NaN : value);
  };
  FIRST_FIELDS.forEach(quantity);
  STAGES.forEach((stage) => writer.u16(contact?.[stage] ?? 0));
  LATER_FIELDS.forEach(quantity);
  writer.u8(raw !== null);
  writer.u16(raw?.sequence ?? 0);
  writer.u32(raw?.flags ?? 0);
  writer.u32(raw?.valid ?? 0);
  writer.u32(raw?.saturated ?? 0);
  writer.u32(raw?.doubtful ?? 0);
  writer.f64(raw ? raw.temperature_cC / 100 : NaN);
  const count = raw?.sensor_count ?? 0;
  for (const readings of [raw?.pressure_Pa_q10, raw?.baseline_Pa_q10]) {
    writer.u32(count);
    for (let k = 0; k < count; k++) {
      writer.f64((readings?.[k] ?? 0) / 1024);
    }
  }
  return writer.bytes();
}

/** Of fingertip_msgs/Line. Throws RangeError for what is none. */
export function decodeLine(bytes: Uint8Array): { number: number; text: string; torn: boolean } {
  const reader = afterHeader(bytes);
  return { number: reader.u64(), text: reader.text(), torn: reader.u8() !== 0 };
}

export interface Row {
  number: number;
  device: number;
  /** NaN in a recording of one. */
  time_us: number;
  contact: Contact | null;
  raw: Raw | null;
}

/** Of fingertip_msgs/Contact. Throws RangeError for what is none. */
export function decodeContact(bytes: Uint8Array): Row {
  const reader = afterHeader(bytes);
  const number = reader.u64();
  const device = reader.u32();
  const time_us = reader.f64();
  const t_us = reader.u64();
  const frame = reader.u32();
  const has_contact = reader.u8() !== 0;
  const contact: Record<string, number> = {
    type: 1,
    t_us,
    frame,
    sequence: reader.u16(),
    flags: reader.u32(),
    sensors_used: reader.u32(),
  };
  const quantity = (field: (typeof FIRST_FIELDS)[number]): void => {
    const value = reader.f32();
    if (Number.isNaN(value) && has_contact && contact['flags'] & flagOf(field)) {
      throw new RangeError(`${field} is no number although its flag is set`);
    }
    contact[field] = Number.isNaN(value) ? 0 : value;
  };
  FIRST_FIELDS.forEach(quantity);
  STAGES.forEach((stage) => (contact[stage] = reader.u16()));
  LATER_FIELDS.forEach(quantity);
  const has_raw = reader.u8() !== 0;
  const raw: Raw = {
    type: 2,
    t_us,
    frame,
    sequence: reader.u16(),
    flags: reader.u32(),
    valid: reader.u32(),
    saturated: reader.u32(),
    doubtful: reader.u32(),
    temperature_cC: scaled(reader.f64(), 100, 2 ** 15, has_raw),
    sensor_count: 0,
    pressure_Pa_q10: new Int32Array(0),
    baseline_Pa_q10: new Int32Array(0),
  };
  for (const field of ['pressure_Pa_q10', 'baseline_Pa_q10'] as const) {
    const count = reader.u32();
    if (count > 32) {
      throw new RangeError('too many sensors');
    }
    raw.sensor_count = count;
    raw[field] = Int32Array.from({ length: count }, () => scaled(reader.f64(), 1024, 2 ** 31, true));
  }
  if (!has_contact && !has_raw) {
    throw new RangeError('a row without a packet');
  }
  if (Math.abs(time_us) === Infinity) {
    throw new RangeError('a time without end');
  }
  return {
    number,
    device,
    time_us,
    contact: has_contact ? (contact as unknown as Contact) : null,
    raw: has_raw ? raw : null,
  };
}

/** A whole number of -bound to bound - 1; 0 of a packet that did not come. */
function scaled(value: number, scale: number, bound: number, is_there: boolean): number {
  const raw = Math.sign(value) * Math.round(Math.abs(value * scale)); // half away from 0
  if (!is_there) {
    return 0;
  }
  if (!(raw >= -bound && raw < bound)) {
    throw new RangeError(`${value} is out of range`);
  }
  return raw;
}

function afterHeader(bytes: Uint8Array): CdrReader {
  const reader = new CdrReader(bytes);
  reader.u32();
  reader.u32();
  reader.text();
  return reader;
}
