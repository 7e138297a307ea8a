// libfingertip from core.wasm, by its C interface (libfingertip/fingertip.h): src/core.ts is the page's view of it.
import { start } from './module.mjs';

const OK = 0;
const END = 1;
const WAIT = 2;
const ERR_VALUE = -2;
const CSV = 0;
const MCAP = 1;
const INFO = 0x03;
// Values of some hundred packets; one has 416 at most.
const VALUES = 8192;
const BYTES = 1 << 16;
const TEXT_BYTES = 512;
const COUNTS = ['bytes', 'packets', 'dropped_packets', 'out_of_order', 'crc_errors', 'format_errors', 'version_errors', 'unknown_types'];

/** What the library refused: its words, and enum fingertip_status. */
export class CoreError extends Error {
  constructor(message, status) {
    super(message);
    this.status = status;
  }
}

/** What a handle was for is over once the page forgot its object. */
class Handles {
  constructor(wasm) {
    this.wasm = wasm;
    this.forgotten = new FinalizationRegistry(({ kind, handle }) => this.free(kind, handle));
  }

  keep(object, kind, handle) {
    object.handle = handle;
    this.forgotten.register(object, { kind, handle }, object);
  }

  end(object, kind) {
    if (object.handle !== 0) {
      this.forgotten.unregister(object);
      this.free(kind, object.handle);
      object.handle = 0;
    }
  }

  free(kind, handle) {
    this.wasm.call(`fingertip_${kind}_free`, handle);
  }
}

class Decoder {
  constructor(core) {
    this.core = core;
    this.contact = core.blank(0x01);
    this.raw = core.blank(0x02);
    this.values = new Float64Array(VALUES);
    this.waiting = 0; // packets that are decoded, and not handed out yet
    core.handles.keep(this, 'decoder', core.wasm.call('fingertip_decoder_new'));
  }

  feed(bytes, handler) {
    const { core, values } = this;
    for (let from = 0; from < bytes.length; ) {
      const part = bytes.subarray(from, from + BYTES);
      core.wasm.bytes(core.bytes, part.length).set(part);
      from += core.wasm.call('fingertip_decoder_feed', this.handle, core.bytes, part.length, core.values, VALUES, core.count);
      const filled = core.counted();
      values.set(core.wasm.doubles(core.values, filled));
      for (let at = 0; at < filled; at += 1 + core.types.get(values[at]).count) {
        this.waiting++;
      }
      for (let at = 0; at < filled; ) {
        const type = core.types.get(values[at]);
        const packet = type.number === 0x01 ? this.contact : type.number === 0x02 ? this.raw : core.blank(type.number);
        core.fill(type, values, at + 1, packet);
        at += 1 + type.count;
        this.waiting--;
        handler(packet);
      }
    }
  }

  /** Those in the packets that were handed out. */
  get counts() {
    const counts = this.core.countsOf('decoder', this.handle);
    counts.packets -= this.waiting;
    return counts;
  }

  get other_version() {
    return this.core.wasm.call('fingertip_decoder_other_version', this.handle);
  }

  restart() {
    this.core.wasm.call('fingertip_decoder_restart', this.handle);
  }
}

class ClockFit {
  constructor(core) {
    this.core = core;
    core.handles.keep(this, 'clock', core.wasm.call('fingertip_clock_new'));
  }

  add({ sent_us, received_us, device_us }) {
    this.core.wasm.call('fingertip_clock_add', this.handle, sent_us, received_us, device_us);
  }

  get estimate() {
    const { core } = this;
    if (core.wasm.call('fingertip_clock_estimate', this.handle, core.values) !== OK) {
      return null;
    }
    const [device_us, host_us, drift_ppm, uncertainty_us] = core.wasm.doubles(core.values, 4);
    return { device_us, host_us, drift_ppm, uncertainty_us };
  }

  get jumps() {
    return this.core.wasm.call('fingertip_clock_jumps', this.handle);
  }

  restart() {
    this.core.wasm.call('fingertip_clock_restart', this.handle);
  }
}

class Reader {
  constructor(core, name, size) {
    this.core = core;
    const handle = core.withText(name, (text) => core.wasm.call('fingertip_reader_new', text, BigInt(size), 0));
    core.handles.keep(this, 'reader', handle);
  }

  feed(bytes) {
    const { core } = this;
    for (let from = 0; from < bytes.length; from += BYTES) {
      const part = bytes.subarray(from, from + BYTES);
      core.wasm.bytes(core.bytes, part.length).set(part);
      core.checked(core.wasm.call('fingertip_reader_feed', this.handle, core.bytes, part.length));
    }
  }

  /** null: feed more; undefined: that was all. Events have no packet. */
  next() {
    const { core } = this;
    const status = core.wasm.call('fingertip_reader_next', this.handle, core.item, core.values, VALUES, core.count);
    if (status === WAIT || status === END) {
      return status === WAIT ? null : undefined;
    }
    core.checked(status);
    const [time_us] = core.wasm.doubles(core.item, 1);
    const [device, type] = core.wasm.words(core.item + 8, 2);
    if (type === 0) {
      return { device, time_us, packet: null };
    }
    const packet = core.blank(type);
    core.fill(core.types.get(type), core.wasm.doubles(core.values, core.counted()), 0, packet);
    return { device, time_us, packet };
  }

  get is_capture() {
    return this.core.wasm.call('fingertip_reader_is_capture', this.handle) !== 0;
  }

  get has_end() {
    return this.core.wasm.call('fingertip_reader_has_end', this.handle) !== 0;
  }

  get counts() {
    return this.core.countsOf('reader', this.handle);
  }

  get other_version() {
    return this.core.wasm.call('fingertip_reader_other_version', this.handle);
  }

  free() {
    this.core.handles.end(this, 'reader');
  }
}

class Writer {
  constructor(core, kind, info, comments) {
    this.core = core;
    core.put(core.types.get(INFO), info);
    const lines = comments.map(([key, value]) => `${key}: ${value}\n`).join('');
    const handle = core.withText(lines, (text) => core.wasm.call('fingertip_writer_new', kind === 'mcap' ? MCAP : CSV, core.values, text));
    if (handle === 0) {
      throw core.error(0);
    }
    core.handles.keep(this, 'writer', handle);
  }

  packet(packet) {
    const { core } = this;
    const type = core.types.get(packet.type);
    core.put(type, packet);
    core.checked(core.wasm.call('fingertip_writer_packet', this.handle, 0, packet.type, core.values, type.count, 0));
  }

  event(text) {
    const { core } = this;
    core.checked(core.withText(text, (at) => core.wasm.call('fingertip_writer_event', this.handle, 0, at)));
  }

  finish(reason, counts) {
    const { core } = this;
    core.wasm.doubles(core.values, COUNTS.length).set(COUNTS.map((name) => counts[name]));
    core.checked(core.withText(reason, (at) => core.wasm.call('fingertip_writer_finish', this.handle, at, core.values)));
  }

  get frames() {
    return Number(this.core.wasm.call('fingertip_writer_frames', this.handle));
  }

  /** The next bytes of the file; null: none yet. */
  take() {
    const { core } = this;
    const count = core.wasm.call('fingertip_writer_take', this.handle, core.bytes, BYTES);
    return count > 0 ? core.wasm.bytes(core.bytes, count).slice() : null;
  }

  free() {
    this.core.handles.end(this, 'writer');
  }
}

class Core {
  constructor(wasm) {
    this.wasm = wasm;
    this.handles = new Handles(wasm);
    this.encoder = new TextEncoder();
    this.decoder = new TextDecoder();
    this.bytes = wasm.call('malloc', BYTES);
    this.values = wasm.call('malloc', 8 * VALUES);
    this.text = wasm.call('malloc', TEXT_BYTES);
    this.item = wasm.call('malloc', 16);
    this.count = wasm.call('malloc', 4);
    this.types = new Map();
    for (let number = 1; number < 256; number++) {
      const count = wasm.call('fingertip_value_count', number);
      if (count > 0) {
        this.types.set(number, { number, count, fields: this.fieldsOf(number) });
      }
    }
    const sensors = this.types.get(0x02).fields.find(({ name }) => name === 'pressure_Pa_q10').count;
    for (const { fields } of this.types.values()) {
      fields.forEach((field) => (field.of_sensors = field.count === sensors));
    }
  }

  fieldsOf(number) {
    const fields = [];
    while (this.wasm.call('fingertip_field_of', number, fields.length, this.item) === OK) {
      const [name, at, count, is_text] = this.wasm.words(this.item, 4);
      fields.push({ name: this.textAt(name), at, count, is_text: is_text !== 0, of_sensors: false });
    }
    return fields;
  }

  /** A packet whose numbers are 0. */
  blank(number) {
    const packet = { type: number };
    for (const { name, count, is_text } of this.types.get(number).fields) {
      packet[name] = is_text ? '' : count > 1 ? new Float64Array(count) : 0;
    }
    return packet;
  }

  /** From values on. Of an info packet arrays of sensors then have as many elements as there are sensors. */
  fill({ number, fields }, values, from, packet) {
    for (const { name, at, count, is_text, of_sensors } of fields) {
      const begin = from + at;
      if (count === 1) {
        packet[name] = values[begin];
      } else if (is_text) {
        const codes = values.subarray(begin, begin + count);
        packet[name] = String.fromCharCode(...codes.subarray(0, (codes.indexOf(0) + count + 1) % (count + 1)));
      } else {
        packet[name].set(values.subarray(begin, begin + count));
        if (of_sensors && number === INFO) {
          packet[name] = packet[name].subarray(0, packet.sensor_count);
        }
      }
    }
  }

  /** To this.values. */
  put({ count, fields }, packet) {
    const values = this.wasm.doubles(this.values, count);
    values.fill(0);
    for (const { name, at, count, is_text } of fields) {
      const value = packet[name] ?? 0;
      if (count === 1) {
        values[at] = value;
        continue;
      }
      if (value.length > count) {
        throw new CoreError(`${name} is longer than ${count}`, ERR_VALUE);
      }
      for (let i = 0; i < value.length; i++) {
        values[at + i] = is_text ? value.charCodeAt(i) : value[i];
      }
    }
  }

  /** The frame of a packet, delimiter included. Throws CoreError on a value that no packet may hold. */
  encode(packet) {
    const type = this.types.get(packet.type);
    if (!type) {
      throw new CoreError(`there is no packet of type ${packet.type}`, ERR_VALUE);
    }
    this.put(type, packet);
    const { wasm, bytes, values, count } = this;
    this.checked(wasm.call('fingertip_encode', packet.type, values, type.count, bytes, BYTES, count));
    return wasm.bytes(bytes, this.counted()).slice();
  }

  infoFrameOfVersion(version) {
    const { wasm, bytes, count } = this;
    this.checked(wasm.call('fingertip_encode_info_of', version, bytes, BYTES, count));
    return wasm.bytes(bytes, this.counted()).slice();
  }

  newDecoder() {
    return new Decoder(this);
  }
  newClockFit() {
    return new ClockFit(this);
  }
  newReader(name, size) {
    return new Reader(this, name, size);
  }
  newWriter(kind, info, comments) {
    return new Writer(this, kind, info, comments);
  }

  flagsText(flags) {
    return this.textOf('flags_text', flags);
  }
  commandName(type) {
    return this.textOf('command_name', type);
  }
  resultText(result) {
    return this.textOf('result_text', result);
  }
  capabilitiesText(capabilities) {
    return this.textOf('capabilities_text', capabilities);
  }
  storedText(stored) {
    return this.textOf('stored_text', stored);
  }
  shortest(value) {
    return this.textOf('number_text', value);
  }

  firmwareOf(name, bytes) {
    const { wasm, text } = this;
    const SIZE = TEXT_BYTES / 4;
    const at = wasm.call('malloc', bytes.length + 1);
    wasm.bytes(at, bytes.length).set(bytes);
    const texts = [0, 1, 2].map((i) => text + SIZE * i);
    try {
      this.checked(this.withText(name, (name_at) => wasm.call('fingertip_firmware', name_at, at, bytes.length, ...texts, SIZE)));
    } finally {
      wasm.call('free', at);
    }
    const [board, version, git_hash] = texts.map((each) => this.textAt(each));
    return { board, version, git_hash };
  }

  // What the above is made of.

  counted() {
    return this.wasm.words(this.count, 1)[0];
  }

  countsOf(kind, handle) {
    this.wasm.call(`fingertip_${kind}_counts`, handle, this.values);
    const values = this.wasm.doubles(this.values, COUNTS.length);
    return Object.fromEntries(COUNTS.map((name, i) => [name, values[i]]));
  }

  textAt(at) {
    const bytes = this.wasm.bytes(at, this.wasm.exports.memory.buffer.byteLength - at);
    return this.decoder.decode(bytes.subarray(0, bytes.indexOf(0)));
  }

  textOf(name, value) {
    this.wasm.call(`fingertip_${name}`, value, this.text, TEXT_BYTES);
    return this.textAt(this.text);
  }

  withText(text, call) {
    const bytes = this.encoder.encode(text);
    const at = this.wasm.call('malloc', bytes.length + 1);
    const room = this.wasm.bytes(at, bytes.length + 1);
    room.set(bytes);
    room[bytes.length] = 0;
    try {
      return call(at);
    } finally {
      this.wasm.call('free', at);
    }
  }

  error(status) {
    return new CoreError(this.textAt(this.wasm.call('fingertip_error')), status);
  }

  checked(status) {
    if (status !== OK) {
      throw this.error(status);
    }
  }
}

/** From the bytes of core.wasm. unpack(packed, size): of zstd, for MCAP files of other programs. */
export async function load(bytes, unpack) {
  return new Core(await start(await WebAssembly.compile(bytes), unpack));
}
