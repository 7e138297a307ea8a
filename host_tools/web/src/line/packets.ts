/** The packets of the wire protocol, both ways (firmware/wire/PROTOCOL.md, packet.h). */
import { CRC_BYTES, HEADER_BYTES, cobsEncode, crc32 } from './framing';
import {
  CONTACT_FLAG,
  Capability,
  Flag,
  HEALTH_WORDS,
  MAX_SENSORS,
  PacketType,
  STAGES,
  Stored,
  WIRE_VERSION,
} from './line_facts';

export * from './line_facts';

/** The quantities of a contact that hold under a flag, in the order of a recording's columns. */
export const CONTACT_FIELDS = Object.keys(CONTACT_FLAG) as ContactField[];
export type ContactField = keyof typeof CONTACT_FLAG;

interface Header {
  sequence: number;
  /** Device time since start; in commands the host's own clock. */
  t_us: number;
}

/** One judged frame. Without its flag a quantity is 0. */
export type Contact = Header & { type: 0x01; frame: number; flags: number; sensors_used: number } & Record<
    ContactField | (typeof STAGES)[number],
    number
  >;

/** The readings of one frame; bitmaps: bit k is sensor k. */
export interface Raw extends Header {
  type: 0x02;
  frame: number;
  flags: number;
  valid: number;
  saturated: number;
  doubtful: number;
  temperature_cC: number;
  sensor_count: number;
  /** [sensor], 1/1024 Pa; absolute pressure, and the tare. */
  pressure_Pa_q10: Int32Array;
  baseline_Pa_q10: Int32Array;
}

export interface Info extends Header {
  type: 0x03;
  major: number;
  minor: number;
  patch: number;
  sensor_count: number;
  /** Capability. */
  capabilities: number;
  git_hash: string;
  board: string;
  scene: string;
  serial: string;
  /** 0: as fast as the sensors allow. */
  rate_mHz: number;
  measured_rate_mHz: number;
  osr: number;
  temperature_interval_ms: number;
  /** Stream. */
  streams: number;
  fit_iterations: number;
  slip_window_ms: number;
  slip_threshold_mm: number;
  /** 0 for a free layout. */
  pitch_mm: number;
  /** [sensor_count] */
  x_mm: Float32Array;
  y_mm: Float32Array;
  /** Both 0: none. */
  prior_sigma_mm: number;
  prior_width_mm: number;
  location_limit_mm: number;
  /** Stored. */
  stored: number;
  /** With Stored.CALIBRATION, else 0. */
  calibration_date_s: number;
  calibration_placements: number;
  force_scale: number;
  force_scale_sd: number;
  /** [sensor_count] */
  gain: Float32Array;
  gain_sd: Float32Array;
  /** With Stored.PAD, else 0: pad_profile.h, in its order; PAD says where is what. */
  pad: Float32Array;
  pad_from_touch: number;
}

/** Counters since start, modulo 2^32, and present state. */
export type Health = Header & { type: 0x04 } & Record<
    | (typeof HEALTH_WORDS)[number]
    | 'cpu_busy_permille'
    | 'stack_free_bytes'
    | 'fit_failures',
    number
  >;

export interface Ack extends Header {
  type: 0x05;
  command: number;
  /** Result. */
  result: number;
  command_sequence: number;
  host_time_us: bigint;
}

/** crash.h; kind 0: it never came to an end. */
export interface Crash extends Header {
  type: 0x06;
  kind: number;
  exception: number;
  vector: number;
  activity: number;
  stuck: number;
  event_codes: Uint8Array;
  event_details: Uint8Array;
  /** r0, r1, r2, r3, r12, lr, pc, xpsr, sp */
  registers: Uint32Array;
  event_ages_1024us: Uint32Array;
  end_us: bigint;
}

export type DevicePacket = Contact | Raw | Info | Health | Ack | Crash;

/** Where the values of a pad's profile are: [first, count]. */
export const PAD = {
  thickness_mm: [0, 1],
  overhang_mm: [1, 1],
  normal: [2, 4], // share, sd_mm, ...
  tangential: [6, 6], // moment_mm, sd_mm, ...
  spread_mm2: [12, 1],
  spread_sd_mm2: [13, 1],
  force_ratio: [14, 1],
  tangential_scale: [15, 1],
  tangential_scale_sd: [16, 1],
  edges: [17, 27],
} as const;
const PAD_FLOATS = 44;

/** What a command carries. */
export type Command =
  | { type: 0x80; streams: number }
  | { type: 0x81; force: number }
  | { type: 0x82; rate_mHz: number }
  | { type: 0x83; osr: number }
  | { type: 0x84; threshold_mm: number; window_ms: number }
  | { type: 0x85 | 0x86 | 0x89 | 0x8e | 0x8f }
  | { type: 0x87; magic: number }
  | {
      type: 0x88;
      sensor_count: number;
      calibration_date_s: number;
      calibration_placements: number;
      force_scale: number;
      force_scale_sd: number;
      gain: ArrayLike<number>;
      gain_sd: ArrayLike<number>;
    }
  | { type: 0x8a; keep: number }
  | { type: 0x8b; sigma_mm: number; width_mm: number }
  | { type: 0x8c; limit_mm: number }
  | { type: 0x8d; pad: ArrayLike<number>; pad_from_touch: number };

type Kind = 'u8' | 'u16' | 'i16' | 'u32' | 'u64' | 'f32' | 'text';
/** Consecutive fields on the line. */
type Run =
  | { kind: Kind; fields: readonly string[] }
  /** The runs are there if a bit of a field before is set. */
  | { kind: 'when'; field: string; bit: number; runs: Run[] }
  | { kind: 'count' }
  | { kind: 'array'; of: 'u8' | 'u32' | 'f32'; field: string; count: number }
  /** For each sensor an element of either. */
  | { kind: 'pairs'; of: 'i32' | 'f32'; fields: [string, string] };

const run = (kind: Kind, ...fields: string[]): Run => ({ kind, fields });
const when = (field: string, bit: number, ...runs: Run[]): Run => ({ kind: 'when', field, bit, runs });
const pairs = (of: 'i32' | 'f32', a: string, b: string): Run => ({ kind: 'pairs', of, fields: [a, b] });
const array = (of: 'u8' | 'u32' | 'f32', field: string, count: number): Run => ({
  kind: 'array',
  of,
  field,
  count,
});
const COUNT: Run = { kind: 'count' };

const CALIBRATION: Run[] = [
  run('u32', 'calibration_date_s'),
  run('u16', 'calibration_placements'),
  run('f32', 'force_scale', 'force_scale_sd'),
  pairs('f32', 'gain', 'gain_sd'),
];
const PROFILE: Run[] = [array('f32', 'pad', PAD_FLOATS), run('u8', 'pad_from_touch')];

const LAYOUTS = new Map<number, Run[]>([
  [
    PacketType.CONTACT,
    [
      run('u32', 'frame', 'flags'),
      run('u16', ...STAGES),
      when(
        'flags',
        Flag.FIT_VALID,
        run('u32', 'sensors_used'),
        run('f32', 'x_mm', 'y_mm', 'p0_Pa', 'sigma_mm', 'force_N', 'residual_rms_Pa'),
      ),
      when('flags', Flag.UNCERTAINTY_VALID, run('f32', 'location_sd_mm', 'force_sd_N')),
      when('flags', Flag.SLIP_VALID, run('f32', 'slip_mm')),
      when('flags', Flag.WIDTHS_VALID, run('f32', 'sigma_x_mm', 'sigma_y_mm', 'width_correlation')),
      when('flags', Flag.TANGENTIAL_VALID, run('f32', 'qx_N', 'qy_N', 'q_sd_N', 'tangential_ratio')),
      when('flags', Flag.VELOCITY_VALID, run('f32', 'vx_mm_s', 'vy_mm_s')),
    ],
  ],
  [
    PacketType.RAW,
    [
      run('u32', 'frame', 'flags', 'valid', 'saturated', 'doubtful'),
      run('i16', 'temperature_cC'),
      COUNT,
      pairs('i32', 'pressure_Pa_q10', 'baseline_Pa_q10'),
    ],
  ],
  [
    PacketType.INFO,
    [
      run('u8', 'major', 'minor', 'patch'),
      COUNT,
      run('u32', 'capabilities'),
      run('text', 'git_hash', 'board', 'scene', 'serial'),
      run('u32', 'rate_mHz', 'measured_rate_mHz'),
      run('u16', 'osr', 'temperature_interval_ms'),
      run('u8', 'streams'),
      when('capabilities', Capability.FIT, run('u8', 'fit_iterations')),
      when('capabilities', Capability.SLIP, run('u16', 'slip_window_ms'), run('f32', 'slip_threshold_mm')),
      run('f32', 'pitch_mm'),
      pairs('f32', 'x_mm', 'y_mm'),
      when(
        'capabilities',
        Capability.FIT,
        run('f32', 'prior_sigma_mm', 'prior_width_mm', 'location_limit_mm'),
      ),
      run('u32', 'stored'),
      when('stored', Stored.CALIBRATION, ...CALIBRATION),
      when('stored', Stored.PAD, ...PROFILE),
    ],
  ],
  [
    PacketType.HEALTH,
    [
      run('u32', ...HEALTH_WORDS),
      run('u16', 'cpu_busy_permille', 'stack_free_bytes'),
      when('capabilities', Capability.FIT, run('u32', 'fit_failures')),
    ],
  ],
  [
    PacketType.ACK,
    [run('u8', 'command', 'result'), run('u16', 'command_sequence'), run('u64', 'host_time_us')],
  ],
  [
    PacketType.CRASH,
    [
      run('u8', 'kind', 'exception', 'vector', 'activity', 'stuck'),
      array('u8', 'event_codes', 8),
      array('u8', 'event_details', 8),
      array('u32', 'registers', 9),
      array('u32', 'event_ages_1024us', 8),
      run('u64', 'end_us'),
    ],
  ],
  [PacketType.CMD_STREAM, [run('u8', 'streams')]],
  [PacketType.CMD_TARE, [run('u8', 'force')]],
  [PacketType.CMD_RATE, [run('u32', 'rate_mHz')]],
  [PacketType.CMD_OSR, [run('u16', 'osr')]],
  [PacketType.CMD_SLIP, [run('f32', 'threshold_mm'), run('u16', 'window_ms')]],
  [PacketType.CMD_INFO, []],
  [PacketType.CMD_HEALTH, []],
  [PacketType.CMD_LOADER, [run('u32', 'magic')]],
  [PacketType.CMD_CALIBRATE, [COUNT, ...CALIBRATION]],
  [PacketType.CMD_ERASE_CALIBRATION, []],
  [PacketType.CMD_KEEP, [run('u8', 'keep')]],
  [PacketType.CMD_PRIOR, [run('f32', 'sigma_mm', 'width_mm')]],
  [PacketType.CMD_LOCATION_LIMIT, [run('f32', 'limit_mm')]],
  [PacketType.CMD_PAD, PROFILE],
  [PacketType.CMD_ERASE_PAD, []],
  [PacketType.CMD_CRASH, []],
]);

type Value = number | bigint | string | Uint8Array | Int32Array | Uint32Array | Float32Array;
type Fields = Record<string, Value>;

function blankRuns(runs: Run[], to: Fields): Fields {
  for (const each of runs) {
    switch (each.kind) {
      case 'when':
        blankRuns(each.runs, to);
        break;
      case 'count':
        to['sensor_count'] = 0;
        break;
      case 'array':
        to[each.field] = new { u8: Uint8Array, u32: Uint32Array, f32: Float32Array }[each.of](each.count);
        break;
      case 'pairs':
        for (const field of each.fields) {
          to[field] = new (each.of === 'i32' ? Int32Array : Float32Array)(MAX_SENSORS);
        }
        break;
      default:
        for (const field of each.fields) {
          to[field] = each.kind === 'text' ? '' : each.kind === 'u64' ? 0n : 0;
        }
    }
  }
  return to;
}

/** A packet of this type, all 0; of types that are known. */
export function blank(type: number): Fields {
  return blankRuns(LAYOUTS.get(type) ?? [], { type, sequence: 0, t_us: 0 });
}

/** Sets all of what a bit left out to 0, or the values of a packet before stayed. */
function clearRuns(runs: Run[], to: Fields): void {
  for (const each of runs) {
    if (each.kind === 'array') {
      (to[each.field] as Float32Array).fill(0);
    } else if (each.kind === 'pairs') {
      each.fields.forEach((field) => (to[field] as Float32Array).fill(0));
    } else if (each.kind !== 'when' && each.kind !== 'count') {
      each.fields.forEach((field) => (to[field] = 0));
    }
  }
}

const TEXT_BYTES = 16;
const BYTES_OF = { u8: 1, u16: 2, i16: 2, u32: 4, i32: 4, u64: 8, f32: 4, text: TEXT_BYTES };

class Body {
  at = HEADER_BYTES;
  constructor(
    readonly view: DataView,
    readonly end: number,
  ) {}

  /** False: it is too short, or a value is one that no encoder writes. */
  get(runs: Run[], to: Fields): boolean {
    const { view } = this;
    for (const each of runs) {
      switch (each.kind) {
        case 'when':
          if ((to[each.field] as number) & each.bit) {
            if (!this.get(each.runs, to)) {
              return false;
            }
          } else {
            clearRuns(each.runs, to);
          }
          break;
        case 'count': {
          if (this.at + 1 > this.end) {
            return false;
          }
          const count = view.getUint8(this.at++);
          if (count < 1 || count > MAX_SENSORS) {
            return false;
          }
          to['sensor_count'] = count;
          break;
        }
        case 'array':
        case 'pairs': {
          const sensors = to['sensor_count'] as number;
          const [first, second] =
            each.kind === 'array'
              ? [to[each.field] as Float32Array, null]
              : [to[each.fields[0]] as Float32Array, to[each.fields[1]] as Float32Array];
          const count = each.kind === 'array' ? each.count : 2 * sensors;
          const size = BYTES_OF[each.of];
          if (this.at + count * size > this.end) {
            return false;
          }
          for (let k = 0; k < count; k++, this.at += size) {
            const value = this.value(each.of);
            if (each.of === 'f32' && !Number.isFinite(value)) {
              return false;
            }
            if (second) {
              (k & 1 ? second : first)[k >> 1] = value;
            } else {
              first[k] = value;
            }
          }
          break;
        }
        default:
          if (this.at + each.fields.length * BYTES_OF[each.kind] > this.end) {
            return false;
          }
          for (const field of each.fields) {
            if (each.kind === 'text') {
              const text = this.text();
              if (text === null) {
                return false;
              }
              to[field] = text;
            } else if (each.kind === 'u64') {
              to[field] = view.getBigUint64(this.at, true);
            } else {
              const value = this.value(each.kind);
              if (each.kind === 'f32' && !Number.isFinite(value)) {
                return false;
              }
              to[field] = value;
            }
            this.at += BYTES_OF[each.kind];
          }
      }
    }
    return true;
  }

  private value(kind: 'u8' | 'u16' | 'i16' | 'u32' | 'i32' | 'f32'): number {
    switch (kind) {
      case 'u8':
        return this.view.getUint8(this.at);
      case 'u16':
        return this.view.getUint16(this.at, true);
      case 'i16':
        return this.view.getInt16(this.at, true);
      case 'u32':
        return this.view.getUint32(this.at, true);
      case 'i32':
        return this.view.getInt32(this.at, true);
      case 'f32':
        return this.view.getFloat32(this.at, true);
    }
  }

  private text(): string | null {
    let text = '';
    let padding = false;
    for (let i = 0; i < TEXT_BYTES; i++) {
      const byte = this.view.getUint8(this.at + i);
      if (byte !== 0 && (padding || byte < 0x20 || byte > 0x7e)) {
        return null;
      }
      padding = byte === 0;
      text += padding ? '' : String.fromCharCode(byte);
    }
    return text;
  }

  /** Throws Error on a value that no packet may hold. */
  put(runs: Run[], from: Fields): void {
    for (const each of runs) {
      switch (each.kind) {
        case 'when':
          if ((from[each.field] as number) & each.bit) {
            this.put(each.runs, from);
          }
          break;
        case 'count': {
          const count = from['sensor_count'] as number;
          if (!(count >= 1 && count <= MAX_SENSORS)) {
            throw new Error(`sensor_count is ${count}`);
          }
          this.view.setUint8(this.at++, count);
          break;
        }
        case 'array':
          for (let k = 0; k < each.count; k++) {
            this.putValue(each.of, (from[each.field] as Float32Array)[k], each.field);
          }
          break;
        case 'pairs':
          for (let k = 0; k < (from['sensor_count'] as number); k++) {
            for (const field of each.fields) {
              this.putValue(each.of, (from[field] as Float32Array)[k], field);
            }
          }
          break;
        default:
          for (const field of each.fields) {
            const value = from[field];
            if (each.kind === 'text') {
              this.putText(value as string, field);
            } else if (each.kind === 'u64') {
              this.view.setBigUint64(this.at, value as bigint, true);
              this.at += 8;
            } else {
              this.putValue(each.kind, value as number, field);
            }
          }
      }
    }
  }

  private putText(text: string, field: string): void {
    if (text.length > TEXT_BYTES || !/^[ -~]*$/.test(text)) {
      throw new Error(`${field} is no text of ${TEXT_BYTES} characters`);
    }
    for (let i = 0; i < TEXT_BYTES; i++) {
      this.view.setUint8(this.at++, i < text.length ? text.charCodeAt(i) : 0);
    }
  }

  private putValue(
    kind: 'u8' | 'u16' | 'i16' | 'u32' | 'i32' | 'f32',
    value: number,
    field: string,
  ): void {
    const { view, at } = this;
    this.at += BYTES_OF[kind];
    if (kind === 'f32') {
      if (!Number.isFinite(Math.fround(value))) {
        throw new Error(`${field} is no finite number`);
      }
      view.setFloat32(at, value, true);
      return;
    }
    const bits = 8 * BYTES_OF[kind];
    const least = kind.startsWith('i') ? -(2 ** (bits - 1)) : 0;
    if (!Number.isInteger(value) || value < least || value >= least + 2 ** bits) {
      throw new Error(`${field} is out of range`);
    }
    switch (bits) {
      case 8:
        view.setUint8(at, value);
        break;
      case 16:
        view.setUint16(at, value, true);
        break;
      default:
        view.setUint32(at, value, true);
    }
  }
}

/** Decodes the body of a packet into one of its type; false: no encoder writes such a body. */
export function decodeBody(view: DataView, end: number, packet: Fields): boolean {
  const body = new Body(view, end);
  const runs = LAYOUTS.get(packet['type'] as number);
  return runs !== undefined && body.get(runs, packet) && body.at === end;
}

/** Of an info packet, whose arrays then have an element for each sensor. */
export function trimInfo(info: Info): Info {
  for (const field of ['x_mm', 'y_mm', 'gain', 'gain_sd'] as const) {
    info[field] = info[field].subarray(0, info.sensor_count);
  }
  return info;
}

const SCRATCH = new Uint8Array(1024);
const SCRATCH_VIEW = new DataView(SCRATCH.buffer);

/** The frame of a packet, delimiter included. Throws Error, a sentence, on a value out of range. */
export function encodePacket(packet: object & { type: number; sequence: number; t_us: number | bigint }): Uint8Array<ArrayBuffer> {
  const runs = LAYOUTS.get(packet.type);
  if (!runs) {
    throw new Error(`there is no packet of type ${packet.type}`);
  }
  SCRATCH[0] = WIRE_VERSION;
  SCRATCH[1] = packet.type;
  SCRATCH_VIEW.setUint16(2, packet.sequence, true);
  SCRATCH_VIEW.setBigUint64(4, BigInt(packet.t_us), true);
  const body = new Body(SCRATCH_VIEW, SCRATCH.length);
  body.put(runs, packet as unknown as Fields);
  SCRATCH_VIEW.setUint32(body.at, crc32(SCRATCH, body.at), true);
  return cobsEncode(SCRATCH, body.at + CRC_BYTES);
}

/** The info command as another version of the protocol has it: who speaks that version answers. */
export function infoFrameOfVersion(version: number): Uint8Array<ArrayBuffer> {
  SCRATCH.fill(0, 0, HEADER_BYTES);
  SCRATCH[0] = version;
  SCRATCH[1] = PacketType.CMD_INFO;
  SCRATCH_VIEW.setUint32(HEADER_BYTES, crc32(SCRATCH, HEADER_BYTES), true);
  return cobsEncode(SCRATCH, HEADER_BYTES + CRC_BYTES);
}
