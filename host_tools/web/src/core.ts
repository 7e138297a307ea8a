/**
 * The library in the page: core.wasm by its C interface, libfingertip/fingertip.h, which explains its parts. It is there once
 * loadCore resolved, which is before anything else of the page starts.
 */
import { start } from '../wasm/module.mjs';
import { PacketType, type Contact, type DevicePacket, type Info, type Raw } from './line/line_facts';

const OK = 0;
const END = 1;
const WAIT = 2;
const ERR_VALUE = -2;
/** Values of some hundred packets; one has 416 at most. */
const VALUES = 8192;
const BYTES = 1 << 16;
const TEXT_BYTES = 512;
const COUNTS = [
  'bytes',
  'packets',
  'dropped_packets',
  'out_of_order',
  'crc_errors',
  'format_errors',
  'version_errors',
  'unknown_types',
] as const;

/** The counts of a line, as at the end of a recording. */
export type LineCounts = Record<(typeof COUNTS)[number], number>;

/** What was counted between the two. */
export function countsSince(before: LineCounts, now: LineCounts): LineCounts {
  return Object.fromEntries(COUNTS.map((name) => [name, now[name] - before[name]])) as LineCounts;
}

/** A packet by the names of its fields: numbers, texts, arrays. */
type Packet = object & { type: number; sequence?: number; t_us?: number };
type Fields = Record<string, number | string | ArrayLike<number>>;

interface PacketFormat {
  number: number;
  count: number;
  fields: { name: string; at: number; count: number; is_text: boolean; of_sensors: boolean }[];
}

/** What the library refused: its words, and enum fingertip_status. */
export class CoreError extends Error {
  constructor(
    message: string,
    readonly status: number,
  ) {
    super(message);
  }
}

let wasm: Awaited<ReturnType<typeof start>>;
let formats: Map<number, PacketFormat>;
/** Where arguments and results are in the module's memory. */
let at: { bytes: number; values: number; text: number; item: number; count: number };

/** Unpacks zstd in MCAP files of other programs; a reader of files sets it. */
let unpack: ((packed: Uint8Array, size: number) => Uint8Array) | null = null;
export function setUnpack(of_zstd: (packed: Uint8Array, size: number) => Uint8Array): void {
  unpack = of_zstd;
}

/** From the bytes of core.wasm. */
export async function loadCore(bytes: BufferSource): Promise<void> {
  wasm = await start(await WebAssembly.compile(bytes), (packed: Uint8Array, size: number) => unpack!(packed, size));
  const room = (size: number): number => wasm.call('malloc', size);
  at = { bytes: room(BYTES), values: room(8 * VALUES), text: room(TEXT_BYTES), item: room(16), count: room(4) };
  formats = new Map();
  for (let number = 1; number < 256; number++) {
    const count = wasm.call('fingertip_value_count', number);
    if (count > 0) {
      formats.set(number, { number, count, fields: fieldsOf(number) });
    }
  }
  const sensors = formats.get(PacketType.RAW)!.fields.find(({ name }) => name === 'pressure_Pa_q10')!.count;
  for (const { fields } of formats.values()) {
    fields.forEach((field) => (field.of_sensors = field.count === sensors));
  }
}

function fieldsOf(number: number): PacketFormat['fields'] {
  const fields: PacketFormat['fields'] = [];
  while (wasm.call('fingertip_field_of', number, fields.length, at.item) === OK) {
    const [name, begin, count, is_text] = wasm.words(at.item, 4);
    fields.push({ name: wasm.textAt(name), at: begin, count, is_text: is_text !== 0, of_sensors: false });
  }
  return fields;
}

/** A packet whose numbers are 0. */
export function blank(type: number): { type: number; sequence: number; t_us: number } {
  const packet: Record<string, unknown> = { type };
  for (const { name, count, is_text } of formats.get(type)!.fields) {
    packet[name] = is_text ? '' : count > 1 ? new Float64Array(count) : 0;
  }
  return packet as ReturnType<typeof blank>;
}

/** From values on. Of an info packet arrays of sensors then have as many elements as there are sensors. */
function fill(packet: Packet, { number, fields }: PacketFormat, values: Float64Array, from: number): void {
  const to = packet as unknown as Record<string, unknown>;
  for (const { name, at, count, is_text, of_sensors } of fields) {
    const found = values.subarray(from + at, from + at + count);
    if (count === 1) {
      to[name] = found[0];
    } else if (is_text) {
      to[name] = String.fromCharCode(...found).replace(/\0.*/s, '');
    } else {
      const array = to[name] as Float64Array;
      array.set(found);
      if (of_sensors && number === PacketType.INFO) {
        to[name] = array.subarray(0, to['sensor_count'] as number);
      }
    }
  }
}

/** To at.values. */
function put({ count, fields }: PacketFormat, packet: Packet): void {
  const values = wasm.doubles(at.values, count);
  values.fill(0);
  for (const { name, at, count, is_text } of fields) {
    const value = (packet as unknown as Fields)[name] ?? 0;
    if (typeof value === 'number') {
      values[at] = value;
      continue;
    }
    if (value.length > count) {
      throw new CoreError(`${name} is longer than ${count}`, ERR_VALUE);
    }
    values.set(is_text ? Array.from(value as string, (letter) => letter.charCodeAt(0)) : (value as ArrayLike<number>), at);
  }
}

/** The frame of a packet or command, delimiter included. Throws CoreError, which names the field, on a value that none may hold. */
export function encode(packet: Packet): Uint8Array<ArrayBuffer> {
  const format = formats.get(packet.type);
  if (!format) {
    throw new CoreError(`there is no packet of type ${packet.type}`, ERR_VALUE);
  }
  put(format, packet);
  return encoded('fingertip_encode', packet.type, at.values, format.count);
}

/** A packet as the judges take it: its frame without the delimiter. */
export const frameOf = (packet: DevicePacket): Uint8Array => encode(packet).slice(0, -1);

/** The info command as another version of the protocol has it: who speaks that version answers. */
export const infoFrameOfVersion = (version: number): Uint8Array<ArrayBuffer> => encoded('fingertip_encode_info_of', version);

function encoded(name: string, ...values: number[]): Uint8Array<ArrayBuffer> {
  checked(wasm.call(name, ...values, at.bytes, BYTES, at.count));
  return wasm.bytes(at.bytes, counted()).slice();
}

/** An object of the library, freed once the page has forgotten this one. */
class Handle {
  private static readonly forgotten = new FinalizationRegistry(({ kind, handle }: { kind: string; handle: number }) =>
    wasm.call(`fingertip_${kind}_free`, handle),
  );
  private readonly handle: number;

  constructor(
    private readonly kind: string,
    make: (name: string) => number,
  ) {
    this.handle = make(`fingertip_${kind}_new`);
    if (this.handle === 0) {
      throw error(0);
    }
    Handle.forgotten.register(this, { kind, handle: this.handle }, this);
  }

  protected call(name: string, ...values: number[]): number {
    return wasm.call(`fingertip_${this.kind}_${name}`, this.handle, ...values);
  }

  protected lineCounts(): LineCounts {
    this.call('counts', at.values);
    const values = wasm.doubles(at.values, COUNTS.length);
    return Object.fromEntries(COUNTS.map((name, i) => [name, values[i]])) as LineCounts;
  }

  free(): void {
    Handle.forgotten.unregister(this);
    this.call('free');
  }
}

export class Decoder extends Handle {
  /** The last of their kind, overwritten by the next. */
  readonly contact = blank(PacketType.CONTACT) as Contact;
  readonly raw = blank(PacketType.RAW) as Raw;
  private readonly values = new Float64Array(VALUES);
  private waiting = 0; // packets that are decoded, and not handed out yet

  constructor() {
    super('decoder', (name) => wasm.call(name));
  }

  /** handler: called for each packet that these bytes complete; info, health, ack and crash are objects of their own. */
  feed(bytes: Uint8Array, handler: (packet: DevicePacket) => void): void {
    const { values } = this;
    for (let from = 0; from < bytes.length; ) {
      const length = give(bytes.subarray(from, from + BYTES));
      from += this.call('feed', at.bytes, length, at.values, VALUES, at.count);
      const filled = counted();
      values.set(wasm.doubles(at.values, filled));
      for (let i = 0; i < filled; i += 1 + formats.get(values[i])!.count) {
        this.waiting++;
      }
      for (let i = 0; i < filled; ) {
        const format = formats.get(values[i])!;
        const { number } = format;
        const packet = number === PacketType.CONTACT ? this.contact : number === PacketType.RAW ? this.raw : blank(number);
        fill(packet, format, values, i + 1);
        i += 1 + format.count;
        this.waiting--;
        handler(packet as DevicePacket);
      }
    }
  }

  /** Those in the packets that were handed out. */
  get counts(): LineCounts {
    const counts = this.lineCounts();
    counts.packets -= this.waiting;
    return counts;
  }

  /** The version of the last packet that counted as a version error; 0: none yet. */
  get other_version(): number {
    return this.call('other_version');
  }

  /** The line was interrupted: join again, and expect no particular sequence number. */
  restart(): void {
    this.call('restart');
  }
}

/** Reads a file's bytes, fed as it wants them; a CoreError states what is wrong with them. */
export class Reader extends Handle {
  /** size: of the file in bytes. */
  constructor(file_name: string, size: number) {
    super('reader', (name) => wasm.lend([file_name], (text) => wasm.call(name, text, BigInt(size), 0)));
  }

  /** Where in the file the bytes to feed next begin. */
  get wants(): number {
    return Number(this.call('wants'));
  }

  feed(bytes: Uint8Array): void {
    for (let from = 0; from < bytes.length; from += BYTES) {
      checked(this.call('feed', at.bytes, give(bytes.subarray(from, from + BYTES))));
    }
  }

  /** null: feed more. undefined: that was all. packet is null for an event, which has a text. time_us: of a row, else NaN. */
  next(): { device: number; time_us: number; packet: DevicePacket | null; event: string } | null | undefined {
    const status = this.call('next', at.item, at.values, VALUES, at.count);
    if (status === WAIT || status === END) {
      return status === WAIT ? null : undefined;
    }
    checked(status);
    const [time_us] = wasm.doubles(at.item, 1);
    const [device, type] = wasm.words(at.item + 8, 2);
    if (type === 0) {
      return { device, time_us, packet: null, event: wasm.textAt(this.call('event')) };
    }
    const packet = blank(type);
    fill(packet, formats.get(type)!, wasm.doubles(at.values, counted()), 0);
    return { device, time_us, packet: packet as DevicePacket, event: '' };
  }

  /** It is a capture of a line, no recording. */
  get is_capture(): boolean {
    return this.call('is_capture') !== 0;
  }

  get has_end(): boolean {
    return this.call('has_end') !== 0;
  }

  get counts(): LineCounts {
    return this.lineCounts();
  }

  get other_version(): number {
    return this.call('other_version');
  }
}

export class Writer extends Handle {
  /** comments: the recorder's own keys. */
  constructor(kind: 'csv' | 'mcap', info: Info, comments: [string, string][]) {
    put(formats.get(PacketType.INFO)!, info);
    const lines = comments.map(([key, value]) => `${key}: ${value}\n`).join('');
    super('writer', (name) => wasm.lend([lines], (text) => wasm.call(name, kind === 'mcap' ? 1 : 0, at.values, text)));
  }

  packet(packet: DevicePacket): void {
    const format = formats.get(packet.type)!;
    put(format, packet);
    checked(this.call('packet', 0, packet.type, at.values, format.count, 0));
  }

  event(text: string): void {
    checked(wasm.lend([text], (text_at) => this.call('event', 0, text_at)));
  }

  /** Last of all, before the last take. */
  finish(reason: string, counts: LineCounts): void {
    wasm.doubles(at.values, COUNTS.length).set(COUNTS.map((name) => counts[name]));
    checked(wasm.lend([reason], (text_at) => this.call('finish', text_at, at.values)));
  }

  get frames(): number {
    return Number(this.call('frames'));
  }

  /** The next bytes of the file; null: none until now. */
  take(): Uint8Array<ArrayBuffer> | null {
    const count = this.call('take', at.bytes, BYTES);
    return count > 0 ? wasm.bytes(at.bytes, count).slice() : null;
  }
}

const textOf =
  (name: string) =>
  (value: number): string => {
    wasm.call(`fingertip_${name}`, value, at.text, TEXT_BYTES);
    return wasm.textAt(at.text);
  };
export const commandName = textOf('command_name');
/** For the end of a sentence. */
export const resultText = textOf('result_text');
/** "fit,slip,raw,tangential": what a firmware can do; "none". */
export const capabilitiesText = textOf('capabilities_text');
/** "calibration,settings,pad": what a fingertip keeps without power; "nothing". */
export const storedText = textOf('stored_text');
/** The shortest decimal that reads back as the same float. */
export const shortest = textOf('number_text');

/** What a UF2 file is the firmware of. Throws CoreError unless it is whole, undamaged, and for the RP2040. */
export function firmwareOf(name: string, bytes: Uint8Array): { board: string; version: string; git_hash: string } {
  const SIZE = TEXT_BYTES / 4;
  const texts = [0, 1, 2].map((i) => at.text + SIZE * i);
  checked(wasm.lend([name, bytes], (name_at, begin) => wasm.call('fingertip_firmware', name_at, begin, bytes.length, ...texts, SIZE)));
  const [board, version, git_hash] = texts.map(wasm.textAt);
  return { board, version, git_hash };
}

/** To at.bytes; their number. */
function give(bytes: Uint8Array): number {
  wasm.bytes(at.bytes, bytes.length).set(bytes);
  return bytes.length;
}

function counted(): number {
  return wasm.words(at.count, 1)[0];
}

function error(status: number): CoreError {
  return new CoreError(wasm.textAt(wasm.call('fingertip_error')), status);
}

function checked(status: number): void {
  if (status !== OK) {
    throw error(status);
  }
}
