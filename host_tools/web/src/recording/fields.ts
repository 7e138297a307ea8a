/** The columns, cells and comments of recordings: libfingertip/recording_fields.hpp. */
import {
  CONTACT_FIELDS,
  FIRST_FIELDS_COUNT,
  HEALTH_KEYS,
  MAX_SENSORS,
  STAGES,
  Stored,
  type Ack,
  type Contact,
  type Health,
  type Info,
  type Raw,
} from '../line/packets';
import { flagOf } from '../model/history';
import { centiText, pressureText, shortest } from './text';

export const FIRST_WORDS = '# fingertip-recording ';
export const JOINT_COLUMNS = 'device,time_us,';

/** Quantities before and after the stages; the latter are not in older recordings. */
export const FIRST_FIELDS = CONTACT_FIELDS.slice(0, FIRST_FIELDS_COUNT);
export const LATER_FIELDS = CONTACT_FIELDS.slice(FIRST_FIELDS_COUNT);
const CONTACT_COLUMNS = ['sequence', 'flags', 'sensors_used', ...FIRST_FIELDS, ...STAGES];
const RAW_COLUMNS = ['raw_sequence', 'raw_flags', 'valid', 'saturated', 'doubtful', 'temperature_degC'];

export interface Columns {
  sensor_count: number;
  has_tangential: boolean;
}

export function contactColumns(has_tangential: boolean): string[] {
  return has_tangential ? [...CONTACT_COLUMNS, ...LATER_FIELDS] : CONTACT_COLUMNS;
}

export function rawColumns(sensor_count: number): string[] {
  const each = (name: string): string[] =>
    Array.from({ length: sensor_count }, (_, k) => `${name}${k}_Pa`);
  return [...RAW_COLUMNS, ...each('s'), ...each('tare')];
}

export function headerText({ sensor_count, has_tangential }: Columns): string {
  return ['t_us', 'frame', ...contactColumns(has_tangential), ...rawColumns(sensor_count)].join(',');
}

/** Those of a header, from t_us on; null: it is none. */
export function columnsOf(header: string): Columns | null {
  const has_tangential = header.includes(',qx_N,');
  const others = headerText({ sensor_count: 0, has_tangential }).split(',').length;
  const sensor_count = Math.floor(Math.max(0, header.split(',').length - others) / 2);
  const columns = { sensor_count, has_tangential };
  return sensor_count <= MAX_SENSORS && header === headerText(columns) ? columns : null;
}

/** From t_us on. */
export function rowText(contact: Contact | null, raw: Raw | null, columns: Columns): string {
  const any = (contact ?? raw) as Contact | Raw;
  let text = `${any.t_us},${any.frame}`;
  if (contact) {
    text += `,${contact.sequence},${contact.flags},${contact.sensors_used}`;
    const quantity = (field: (typeof CONTACT_FIELDS)[number]): string => {
      const value = contact[field];
      return (contact.flags & flagOf(field)) === 0 && Object.is(value, 0) ? ',' : `,${shortest(value)}`;
    };
    for (const field of FIRST_FIELDS) {
      text += quantity(field);
    }
    for (const stage of STAGES) {
      text += `,${contact[stage]}`;
    }
    if (columns.has_tangential) {
      for (const field of LATER_FIELDS) {
        text += quantity(field);
      }
    }
  } else {
    text += ','.repeat(contactColumns(columns.has_tangential).length);
  }
  if (raw) {
    text += `,${raw.sequence},${raw.flags},${raw.valid},${raw.saturated},${raw.doubtful},${centiText(raw.temperature_cC)}`;
    for (let k = 0; k < columns.sensor_count; k++) {
      text += `,${pressureText(raw.pressure_Pa_q10[k])}`;
    }
    for (let k = 0; k < columns.sensor_count; k++) {
      text += `,${pressureText(raw.baseline_Pa_q10[k])}`;
    }
  } else {
    text += ','.repeat(RAW_COLUMNS.length + 2 * columns.sensor_count);
  }
  return text;
}

/** A key of the file, the field of the packet behind it; floats are floats. */
export interface Key {
  key: string;
  field: string;
  float: boolean;
}
const whole = (key: string, field = key): Key => ({ key, field, float: false });
const float = (key: string, field = key): Key => ({ key, field, float: true });

export const PACKET_KEYS: Record<'health' | 'ack' | 'info', Key[]> = {
  health: HEALTH_KEYS.map((field) => whole(field)),
  ack: [whole('command'), whole('result'), whole('command_sequence'), whole('host_time_us')],
  info: [],
};

export const INFO_KEYS: Key[] = [
  whole('sensors', 'sensor_count'),
  whole('capabilities'),
  whole('rate_mHz'),
  whole('measured_rate_mHz'),
  whole('osr'),
  whole('temperature_interval_ms'),
  float('slip_threshold_mm'),
  whole('slip_window_ms'),
  whole('fit_iterations'),
  whole('streams'),
  float('pitch_mm'),
  float('prior_sigma_mm'),
  float('prior_width_mm'),
  float('location_limit_mm'),
  whole('stored'),
];

export const CALIBRATION_KEYS: Key[] = [
  whole('calibration_date_s'),
  whole('calibration_placements'),
  float('force_scale'),
  float('force_scale_sd'),
];

/** Key, and where its values are in the pad's profile. */
export const PAD_KEYS: [string, number][] = [
  ['pad_thickness_mm', 0],
  ['pad_overhang_mm', 1],
  ['pad_spread_mm2', 12],
  ['pad_spread_sd_mm2', 13],
  ['pad_force_ratio', 14],
  ['pad_tangential_scale', 15],
  ['pad_tangential_scale_sd', 16],
];
export const PAD_LISTS: [string, number[]][] = [
  ['pad_shares', [2, 4]],
  ['pad_sds_mm', [3, 5]],
  ['pad_moments_mm', [6, 8, 10]],
  ['pad_moment_sds_mm', [7, 9, 11]],
  ...(
    [
      'ratio_x',
      'ratio_y',
      'gain_x',
      'gain_y',
      'place_x_mm',
      'place_y_mm',
      'pull_x_mm',
      'pull_y_mm',
      'force',
    ] as const
  ).map((name, i): [string, number[]] => [
    `pad_edge_${name}`,
    [17 + 3 * i, 18 + 3 * i, 19 + 3 * i],
  ]),
];
export const SENSOR_LISTS: [string, 'gain' | 'gain_sd'][] = [
  ['gains', 'gain'],
  ['gain_sds', 'gain_sd'],
];

/** Whether its value is a list. */
export function isList(key: string): boolean {
  return SENSOR_LISTS.some(([name]) => name === key) || PAD_LISTS.some(([name]) => name === key);
}

export type Pairs = [string, string][];

function listText(values: ArrayLike<number>): string {
  return Array.from(values, shortest).join(' ');
}

/** What an info packet says, as comments of a recording. */
export function infoPairs(info: Info): Pairs {
  const values = info as unknown as Record<string, number>;
  const cell = ({ key, field, float: is_float }: Key): [string, string] => [
    key,
    is_float ? shortest(values[field]) : String(values[field]),
  ];
  const pairs: Pairs = [
    ['serial', info.serial],
    ['board', info.board],
    ['scene', info.scene],
    ['firmware', `${info.major}.${info.minor}.${info.patch}`],
    ['git', info.git_hash],
    ...INFO_KEYS.map(cell),
    ['x_mm', listText(info.x_mm)],
    ['y_mm', listText(info.y_mm)],
  ];
  if (info.stored & Stored.CALIBRATION) {
    pairs.push(...CALIBRATION_KEYS.map(cell));
    pairs.push(...SENSOR_LISTS.map(([key, field]): [string, string] => [key, listText(info[field])]));
  }
  if (info.stored & Stored.PAD) {
    pairs.push(...PAD_KEYS.map(([key, at]): [string, string] => [key, shortest(info.pad[at])]));
    pairs.push(['pad_from_touch', String(info.pad_from_touch)]);
    pairs.push(
      ...PAD_LISTS.map(([key, at]): [string, string] => [key, listText(at.map((i) => info.pad[i]))]),
    );
  }
  return pairs;
}

/** " sequence=1 t_us=2 ...", behind the name of the packet. */
export function packetText(packet: Health | Ack | Info, name: 'health' | 'ack' | 'info'): string {
  const values = packet as unknown as Record<string, number | bigint>;
  return [whole('sequence'), whole('t_us'), ...PACKET_KEYS[name]]
    .map(({ key, field }) => ` ${key}=${values[field]}`)
    .join('');
}
