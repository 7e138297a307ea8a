/**
 * The packets of a file, one after the other: recordings in CSV and MCAP (of one fingertip or of
 * several), and captures of the line (.ftr). Whatever is wrong with a file is a ReadError, a
 * sentence with the place; what came before it was handed out.
 */
import { McapStreamReader } from '@mcap/core';
import { decompress } from 'fzstd';
import { Decoder } from '../line/decoder';
import {
  CONTACT_FIELDS,
  MAX_SENSORS,
  PacketType,
  STAGES,
  blank,
  trimInfo,
  type Contact,
  type DevicePacket,
  type Info,
  type Raw,
} from '../line/packets';
import {
  CALIBRATION_KEYS,
  FIRST_WORDS,
  INFO_KEYS,
  JOINT_COLUMNS,
  PACKET_KEYS,
  PAD_KEYS,
  PAD_LISTS,
  SENSOR_LISTS,
  columnsOf,
  contactColumns,
  type Columns,
  type Key,
} from './fields';
import { CONTACT, LINE, decodeContact, decodeLine, fullName } from './ros_messages';
import { numberOf } from './text';

export class ReadError extends Error {}

export interface Item {
  /** Number of the fingertip in the file, from 0. */
  device: number;
  /** Of the recorder's clock in a recording of several, else of the fingertip's; NaN for what has no
   * time of its own. */
  time_us: number;
  packet: DevicePacket;
}

/** What is wrong with a line, without its place. */
class Damage extends Error {}

function whole(key: string, cell: string, least: number, most: number): number {
  const value = /^-?\d+$/.test(cell) ? Number(cell) : NaN;
  if (Number.isNaN(value)) {
    throw new Damage(`${key} is "${cell}"`);
  }
  if (value < least || value > most) {
    throw new Damage(`${key} is out of range`);
  }
  return value;
}

function unsigned(key: string, cell: string, bits = 32): number {
  return whole(key, cell, 0, bits > 52 ? Number.MAX_SAFE_INTEGER : 2 ** bits - 1);
}

function floating(key: string, cell: string): number {
  const value = numberOf(cell);
  if (!Number.isFinite(value)) {
    throw new Damage(`${key} is "${cell}"`);
  }
  return Math.fround(value);
}

function scaled(key: string, cell: string, scale: number, most: number): number {
  const value = Math.round(numberOf(cell) * scale);
  if (Number.isNaN(value)) {
    throw new Damage(`${key} is "${cell}"`);
  }
  if (value < -most - 1 || value > most) {
    throw new Damage(`${key} is out of range`);
  }
  return value;
}

/** Lines and rows of a recording to items, in their order. */
export class RecordingParser {
  /** The keys of the head that no packet holds. */
  readonly recorder = new Map<string, string>();
  has_header = false;
  has_end = false;
  private joint = false;
  private columns: Columns = { sensor_count: 0, has_tangential: true };
  private readonly infos: Info[] = [];
  private first = true;

  constructor(private readonly take: (item: Item) => void) {}

  line(text: string): void {
    if (this.first) {
      this.first = false;
      if (text !== `${FIRST_WORDS}1` && text !== `${FIRST_WORDS}2`) {
        throw new Damage(
          text.startsWith(FIRST_WORDS)
            ? 'a recording of a later version: use the page of that version'
            : 'no recording of a fingertip',
        );
      }
      this.joint = text.endsWith('2');
    } else if (text.startsWith('#')) {
      this.comment(text);
    } else if (text.trim() !== '') {
      if (this.has_header) {
        this.rowOf(text);
      } else {
        this.header(text);
      }
    }
  }

  row(device: number, time_us: number, contact: Contact | null, raw: Raw | null): void {
    for (const packet of [contact, raw]) {
      if (packet) {
        this.take({ device, time_us: Number.isNaN(time_us) ? packet.t_us : time_us, packet });
      }
    }
  }

  private info(device: number): Info {
    return (this.infos[device] ??= blank(PacketType.INFO) as unknown as Info);
  }

  private header(text: string): void {
    const own = this.joint && text.startsWith(JOINT_COLUMNS) ? text.slice(JOINT_COLUMNS.length) : text;
    const columns = columnsOf(own);
    if (!columns || this.joint !== text.startsWith(JOINT_COLUMNS)) {
      throw new Damage('unknown header');
    }
    this.columns = columns;
    this.has_header = true;
  }

  private rowOf(text: string): void {
    const cells = text.split(',');
    let device = 0;
    let time_us = NaN;
    if (this.joint) {
      device = unsigned('device', cells.shift() ?? '', 8);
      time_us = numberOf(cells.shift() ?? '');
      if (Number.isNaN(time_us)) {
        throw new Damage('time_us is no number');
      }
    }
    const { sensor_count, has_tangential } = this.columns;
    const contact_cells = contactColumns(has_tangential).length;
    const wanted = 2 + contact_cells + 6 + 2 * sensor_count;
    if (cells.length !== wanted) {
      throw new Damage(`${cells.length} columns where the header has ${wanted}`);
    }
    const t_us = unsigned('t_us', cells[0], 64);
    const frame = unsigned('frame', cells[1]);
    const of_contact = cells.slice(2, 2 + contact_cells);
    const of_raw = cells.slice(2 + contact_cells);
    const contact = of_contact.every((cell) => cell === '')
      ? null
      : this.contact(of_contact, t_us, frame, has_tangential);
    const raw = of_raw.every((cell) => cell === '') ? null : this.raw(of_raw, t_us, frame);
    if (!contact && !raw) {
      throw new Damage('a row without a packet');
    }
    this.row(device, time_us, contact, raw);
  }

  private contact(cells: string[], t_us: number, frame: number, has_tangential: boolean): Contact {
    const contact = blank(PacketType.CONTACT) as unknown as Contact;
    contact.t_us = t_us;
    contact.frame = frame;
    contactColumns(has_tangential).forEach((name, i) => {
      const cell = cells[i];
      if (name === 'sequence') {
        contact.sequence = unsigned(name, cell, 16);
      } else if (name === 'flags' || name === 'sensors_used') {
        contact[name] = unsigned(name, cell);
      } else if ((STAGES as readonly string[]).includes(name)) {
        contact[name as (typeof STAGES)[number]] = unsigned(name, cell, 16);
      } else {
        contact[name as (typeof CONTACT_FIELDS)[number]] = cell === '' ? 0 : floating(name, cell);
      }
    });
    return contact;
  }

  private raw(cells: string[], t_us: number, frame: number): Raw {
    const { sensor_count } = this.columns;
    if (sensor_count === 0) {
      throw new Damage('pressures in a recording without sensors');
    }
    const raw = blank(PacketType.RAW) as unknown as Raw;
    raw.t_us = t_us;
    raw.frame = frame;
    raw.sensor_count = sensor_count;
    raw.sequence = unsigned('raw_sequence', cells[0], 16);
    raw.flags = unsigned('raw_flags', cells[1]);
    raw.valid = unsigned('valid', cells[2]);
    raw.saturated = unsigned('saturated', cells[3]);
    raw.doubtful = unsigned('doubtful', cells[4]);
    raw.temperature_cC = scaled('temperature_degC', cells[5], 100, 2 ** 15 - 1);
    for (let k = 0; k < sensor_count; k++) {
      raw.pressure_Pa_q10[k] = scaled(`s${k}_Pa`, cells[6 + k], 1024, 2 ** 31 - 1);
      raw.baseline_Pa_q10[k] = scaled(`tare${k}_Pa`, cells[6 + sensor_count + k], 1024, 2 ** 31 - 1);
    }
    return raw;
  }

  private comment(text: string): void {
    const colon = text.indexOf(': ');
    if (colon < 0) {
      throw new Damage('neither a comment "# key: value" nor a row');
    }
    let key = text.slice(1, colon).trim();
    const value = text.slice(colon + 2);
    let device = 0;
    const slash = key.indexOf('/');
    if (this.joint && slash >= 0) {
      device = unsigned('device', key.slice(0, slash), 8);
      key = key.slice(slash + 1);
    }
    if (key === 'end') {
      this.has_end = true;
    } else if (key === 'packet') {
      this.packetOf(device, value);
    } else if (key !== 'event') {
      this.infoField(device, key, value);
    }
  }

  private packetOf(device: number, value: string): void {
    const [name, ...words] = value.split(' ');
    const pairs = new Map(
      words.map((word): [string, string] => {
        const equals = word.indexOf('=');
        if (equals < 0) {
          throw new Damage(`"${word}" is not key=value`);
        }
        return [word.slice(0, equals), word.slice(equals + 1)];
      }),
    );
    const cell = (key: string): string => {
      const text = pairs.get(key);
      if (text === undefined) {
        throw new Damage(`${key} is missing`);
      }
      return text;
    };
    let packet: DevicePacket;
    if (name === 'info') {
      const info = this.info(device);
      if (info.sensor_count < 1) {
        throw new Damage('an info packet without "# sensors:" before it');
      }
      packet = trimInfo({ ...info });
    } else if (name === 'health' || name === 'ack') {
      const type = name === 'health' ? PacketType.HEALTH : PacketType.ACK;
      const fields = blank(type);
      for (const { key, field } of PACKET_KEYS[name]) {
        fields[field] = typeof fields[field] === 'bigint' ? BigInt(cell(key)) : unsigned(key, cell(key));
      }
      packet = fields as unknown as DevicePacket;
    } else {
      throw new Damage(`packet "${name}" is unknown`);
    }
    packet.sequence = unsigned('sequence', cell('sequence'), 16);
    packet.t_us = unsigned('t_us', cell('t_us'), 64);
    this.take({ device, time_us: NaN, packet });
  }

  private infoField(device: number, key: string, value: string): void {
    const info = this.info(device);
    const values = info as unknown as Record<string, number>;
    const list = (to: { [at: number]: number }, places: number[]): void => {
      const numbers = value.trim() === '' ? [] : value.trim().split(' ');
      if (numbers.length > places.length) {
        throw new Damage(`${key} has too many values`);
      }
      numbers.forEach((number, i) => (to[places[i]] = floating(key, number)));
    };
    const sensors = Array.from({ length: MAX_SENSORS }, (_, k) => k);
    const of_sensors = new Map<string, 'x_mm' | 'y_mm' | 'gain' | 'gain_sd'>([
      ['x_mm', 'x_mm'],
      ['y_mm', 'y_mm'],
      ...SENSOR_LISTS,
    ]).get(key);
    const text = ({ serial: 'serial', board: 'board', scene: 'scene', git: 'git_hash' } as const)[key];
    const pad = PAD_LISTS.find(([name]) => name === key)?.[1];
    const of_pad = PAD_KEYS.find(([name]) => name === key)?.[1];
    const scalar: Key | undefined = [...INFO_KEYS, ...CALIBRATION_KEYS].find((each) => each.key === key);
    if (text) {
      if (!/^[ -~]*$/.test(value)) {
        throw new Damage(`${key} is no printable ASCII`);
      }
      info[text] = value.slice(0, 16);
    } else if (key === 'firmware') {
      const parts = value.split('.');
      if (parts.length !== 3) {
        throw new Damage(`firmware is "${value}"`);
      }
      [info.major, info.minor, info.patch] = parts.map((part) => unsigned(key, part, 8)) as [
        number,
        number,
        number,
      ];
    } else if (of_sensors) {
      list(info[of_sensors], sensors);
    } else if (pad) {
      list(info.pad, pad);
    } else if (of_pad !== undefined) {
      info.pad[of_pad] = floating(key, value);
    } else if (key === 'pad_from_touch') {
      info.pad_from_touch = unsigned(key, value, 8);
    } else if (scalar) {
      values[scalar.field] = scalar.float ? floating(key, value) : unsigned(key, value);
      if (key === 'sensors' && (info.sensor_count < 1 || info.sensor_count > MAX_SENSORS)) {
        throw new Damage('sensors is out of range');
      }
    } else if (!this.has_header) {
      this.recorder.set(key, value);
    }
  }
}

type Chunks = AsyncGenerator<Uint8Array, void, undefined>;

async function* chunksOf(file: Blob): Chunks {
  const reader = file.stream().getReader();
  for (;;) {
    const { value, done } = await reader.read();
    if (done) {
      return;
    }
    yield value;
  }
}

const MCAP_MAGIC = '\x89MCAP0\r\n';
/** Several frames, each of which would end with 0x00. */
const START_bytes = 4096;

/** All that is in a file. Throws ReadError. */
export async function* readItems(file: File): AsyncGenerator<Item, void, undefined> {
  const start = String.fromCharCode(
    ...new Uint8Array(await file.slice(0, START_bytes).arrayBuffer()),
  );
  if (start === '') {
    throw new ReadError(`${file.name} is empty: choose another`);
  }
  if (start.startsWith('# fingertip-')) {
    yield* readCsv(file);
  } else if (start.startsWith(MCAP_MAGIC)) {
    yield* readMcap(file);
  } else if (start.includes('\0')) {
    yield* readCapture(file);
  } else {
    throw new ReadError(
      `${file.name} is neither a recording (.csv, .mcap) nor bytes of a fingertip's line (.ftr): choose another`,
    );
  }
}

function told(file: File, place: string, error: unknown): ReadError {
  return error instanceof ReadError
    ? error
    : new ReadError(
        `${file.name}${place}: ${error instanceof Error ? error.message : String(error)}. ` +
          'What came before is shown; "fingertip convert --salvage" takes what can be read of the rest',
      );
}

async function* readCsv(file: File): AsyncGenerator<Item, void, undefined> {
  const items: Item[] = [];
  const parser = new RecordingParser((item) => items.push(item));
  const decoder = new TextDecoder();
  let number = 0;
  let rest = '';
  const take = (line: string): void => {
    number++;
    try {
      parser.line(line.endsWith('\r') ? line.slice(0, -1) : line);
    } catch (error) {
      throw told(file, `, line ${number}`, error);
    }
  };
  for await (const chunk of chunksOf(file)) {
    const lines = (rest + decoder.decode(chunk, { stream: true })).split('\n');
    rest = lines.pop() ?? '';
    for (const line of lines) {
      try {
        take(line);
      } catch (error) {
        yield* items;
        throw error;
      }
    }
    yield* items.splice(0);
  }
  if (rest !== '') {
    throw told(file, `, line ${number + 1}`, new Damage('the last line is torn'));
  }
  if (!parser.has_header) {
    throw told(file, '', new Damage('no header line'));
  }
  if (!parser.has_end) {
    throw new ReadError(
      `${file.name} has no end line: it was cut short, its recorder killed or its disk full. What there is, is shown`,
    );
  }
}

async function* readMcap(file: File): AsyncGenerator<Item, void, undefined> {
  const items: Item[] = [];
  const parser = new RecordingParser((item) => items.push(item));
  const reader = new McapStreamReader({
    decompressHandlers: { zstd: (bytes, size) => decompress(bytes, new Uint8Array(Number(size))) },
  });
  const schemas = new Map<number, string>();
  const channels = new Map<number, string>();
  let messages = 0;
  let number = 0;
  const follow = (line: number): void => {
    if (line > number + 1) {
      throw new Damage(`${line - number - 1} lines are missing before line ${line}`);
    }
    number = line;
  };
  const take = (record: ReturnType<McapStreamReader['nextRecord']>): void => {
    if (record?.type === 'Schema') {
      schemas.set(record.id, record.name);
    } else if (record?.type === 'Channel') {
      channels.set(record.id, schemas.get(record.schemaId) ?? '');
    } else if (record?.type === 'Message') {
      const type = channels.get(record.channelId);
      if (type === fullName(LINE)) {
        messages++;
        const line = decodeLine(record.data);
        follow(line.number);
        if (line.torn) {
          throw new Damage('the last line is torn');
        }
        parser.line(line.text);
      } else if (type === fullName(CONTACT)) {
        messages++;
        const row = decodeContact(record.data);
        follow(row.number);
        parser.row(row.device, row.time_us, row.contact, row.raw);
      }
    }
  };
  try {
    for await (const chunk of chunksOf(file)) {
      reader.append(chunk);
      for (;;) {
        const record = reader.nextRecord();
        if (!record) {
          break;
        }
        take(record);
      }
      yield* items.splice(0);
    }
  } catch (error) {
    yield* items;
    throw told(file, '', error);
  }
  if (messages === 0) {
    throw new ReadError(
      reader.done()
        ? `${file.name} is an MCAP file, but no recording of a fingertip: choose another`
        : `${file.name} breaks off before a recording begins: choose another`,
    );
  }
  if (!reader.done() || !parser.has_end) {
    throw new ReadError(
      `${file.name} breaks off: its recorder was killed or its disk full. What there is, is shown`,
    );
  }
}

async function* readCapture(file: File): AsyncGenerator<Item, void, undefined> {
  const decoder = new Decoder();
  const items: Item[] = [];
  let packets = 0;
  for await (const chunk of chunksOf(file)) {
    decoder.feed(chunk, (packet) => {
      packets++;
      const own =
        packet.type === PacketType.RAW
          ? {
              ...packet,
              pressure_Pa_q10: packet.pressure_Pa_q10.slice(),
              baseline_Pa_q10: packet.baseline_Pa_q10.slice(),
            }
          : { ...packet };
      const timed = packet.type === PacketType.CONTACT || packet.type === PacketType.RAW;
      items.push({ device: 0, time_us: timed ? packet.t_us : NaN, packet: own });
    });
    yield* items.splice(0);
  }
  const { version_errors, crc_errors, format_errors } = decoder.counts;
  if (packets === 0) {
    throw new ReadError(
      version_errors > 0
        ? `${file.name} is of a firmware that speaks version ${decoder.other_version} of the protocol: use the tool of that version`
        : `${file.name} holds no packet of a fingertip: choose another`,
    );
  }
  if (crc_errors + format_errors > 0) {
    throw new ReadError(
      `${file.name}: ${crc_errors + format_errors} packets are damaged and left out; the rest is shown`,
    );
  }
}
