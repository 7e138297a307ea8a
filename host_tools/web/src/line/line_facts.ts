/** written by firmware/wire/line.py from line.toml; change it there. */

export const WIRE_VERSION = 9;
export const LOADER_MAGIC = 0x746f6f42;

export const PacketType = {
  CONTACT: 0x01,
  RAW: 0x02,
  INFO: 0x03,
  HEALTH: 0x04,
  ACK: 0x05,
  CRASH: 0x06,
  SYNC: 0x07,
  CMD_STREAM: 0x80,
  CMD_TARE: 0x81,
  CMD_RATE: 0x82,
  CMD_OSR: 0x83,
  CMD_SLIP: 0x84,
  CMD_INFO: 0x85,
  CMD_HEALTH: 0x86,
  CMD_CRASH: 0x8f,
  CMD_LOADER: 0x87,
  CMD_CALIBRATE: 0x88,
  CMD_ERASE_CALIBRATION: 0x89,
  CMD_KEEP: 0x8a,
  CMD_PRIOR: 0x8b,
  CMD_LOCATION_LIMIT: 0x8c,
  CMD_PAD: 0x8d,
  CMD_ERASE_PAD: 0x8e,
  CMD_SYNC: 0x90,
} as const;

/** Bits of the stream mask. */
export const Stream = {
  CONTACT: 1 << 0,
  RAW: 1 << 1,
  HEALTH: 1 << 2,
} as const;
/** What a firmware can do. */
export const Capability = {
  FIT: 1 << 0,
  SLIP: 1 << 1,
  RAW_STREAM: 1 << 2,
  TANGENTIAL: 1 << 3,
  SYNC: 1 << 4,
  SECOND: 1 << 5,
} as const;
/** What a fingertip keeps without power. */
export const Stored = {
  CALIBRATION: 1 << 0,
  SETTINGS: 1 << 1,
  WRITING: 1 << 2,
  DAMAGED: 1 << 3,
  PAD: 1 << 4,
} as const;
/** What a frame reports about itself. */
export const Flag = {
  CONTACT: 1 << 0,
  FIT_VALID: 1 << 1,
  UNCERTAINTY_VALID: 1 << 2,
  SLIP_VALID: 1 << 3,
  SLIP: 1 << 4,
  TARED: 1 << 5,
  HELD: 1 << 6,
  WIDTHS_VALID: 1 << 7,
  LOW_SIGNAL: 1 << 8,
  FLAT: 1 << 9,
  UNCERTAIN: 1 << 10,
  MODEL: 1 << 11,
  SATURATED: 1 << 12,
  FORCE_LOWER_BOUND: 1 << 13,
  SENSOR_MASKED: 1 << 14,
  AT_BOUND: 1 << 15,
  ELONGATED: 1 << 16,
  ZERO_DOUBTFUL: 1 << 17,
  SENSOR_DOUBTFUL: 1 << 18,
  CALIBRATED: 1 << 19,
  TANGENTIAL_VALID: 1 << 20,
  TANGENTIAL_FROM_TOUCH: 1 << 21,
  VELOCITY_VALID: 1 << 22,
  MOVING: 1 << 23,
  SLIDING: 1 << 24,
  TANGENTIAL_LATE: 1 << 25,
  SHAPE_VALID: 1 << 26,
  TWO_CONTACTS: 1 << 27,
  EDGE: 1 << 28,
  SHAPE_UNKNOWN: 1 << 29,
} as const;
/** What an acknowledgement reports. */
export const Result = {
  DONE: 0,
  UNKNOWN_COMMAND: 1,
  OUT_OF_RANGE: 2,
  NOT_NOW: 3,
} as const;

/** Those of state, then the warnings. warning: the numbers deserve less trust. */
export const FLAGS: readonly { bit: number; name: keyof typeof Flag; warning: boolean; meaning: string }[] = [
  { bit: Flag.CONTACT, name: 'CONTACT', warning: false, meaning: 'something presses' },
  { bit: Flag.FIT_VALID, name: 'FIT_VALID', warning: false, meaning: 'place and force have values' },
  { bit: Flag.UNCERTAINTY_VALID, name: 'UNCERTAINTY_VALID', warning: false, meaning: 'their possible errors have values' },
  { bit: Flag.SLIP_VALID, name: 'SLIP_VALID', warning: false, meaning: 'the slip distance spans its whole window' },
  { bit: Flag.SLIP, name: 'SLIP', warning: false, meaning: 'it slips: the slip distance is above the threshold' },
  { bit: Flag.TARED, name: 'TARED', warning: false, meaning: 'readings are relative to a measured zero' },
  { bit: Flag.HELD, name: 'HELD', warning: false, meaning: 'all values are those of the frame before: the sensors measured their temperature' },
  { bit: Flag.WIDTHS_VALID, name: 'WIDTHS_VALID', warning: false, meaning: 'the widths along the axes have values' },
  { bit: Flag.CALIBRATED, name: 'CALIBRATED', warning: false, meaning: 'gains and force scale of a calibration are applied' },
  { bit: Flag.TANGENTIAL_VALID, name: 'TANGENTIAL_VALID', warning: false, meaning: 'the force along the rubber has values' },
  { bit: Flag.TANGENTIAL_FROM_TOUCH, name: 'TANGENTIAL_FROM_TOUCH', warning: false, meaning: 'the tangential force is the change since the first touch' },
  { bit: Flag.VELOCITY_VALID, name: 'VELOCITY_VALID', warning: false, meaning: 'the velocity of the contact has values' },
  { bit: Flag.MOVING, name: 'MOVING', warning: false, meaning: 'the contact moves' },
  { bit: Flag.SLIDING, name: 'SLIDING', warning: false, meaning: 'the contact slides, however slowly' },
  { bit: Flag.SHAPE_VALID, name: 'SHAPE_VALID', warning: false, meaning: 'the contact shape is known' },
  { bit: Flag.EDGE, name: 'EDGE', warning: false, meaning: 'one long contact presses' },
  { bit: Flag.LOW_SIGNAL, name: 'LOW_SIGNAL', warning: true, meaning: 'the press is so light that noise matters' },
  { bit: Flag.FLAT, name: 'FLAT', warning: true, meaning: 'pressure without a peak: there is no place' },
  { bit: Flag.UNCERTAIN, name: 'UNCERTAIN', warning: true, meaning: 'the place may be further off than the limit that is set' },
  { bit: Flag.MODEL, name: 'MODEL', warning: true, meaning: 'the pressures are not those of one contact' },
  { bit: Flag.SATURATED, name: 'SATURATED', warning: true, meaning: 'a sensor is beyond its range and was left out' },
  { bit: Flag.FORCE_LOWER_BOUND, name: 'FORCE_LOWER_BOUND', warning: true, meaning: 'too few sensors are in their range: the force is at least this' },
  { bit: Flag.SENSOR_MASKED, name: 'SENSOR_MASKED', warning: true, meaning: 'a sensor is missing or was left out' },
  { bit: Flag.AT_BOUND, name: 'AT_BOUND', warning: true, meaning: 'the fit stopped at a limit' },
  { bit: Flag.ELONGATED, name: 'ELONGATED', warning: true, meaning: 'the contact is not round' },
  { bit: Flag.ZERO_DOUBTFUL, name: 'ZERO_DOUBTFUL', warning: true, meaning: 'the pressure may be a zero that has moved, or rubber that has not let go yet' },
  { bit: Flag.SENSOR_DOUBTFUL, name: 'SENSOR_DOUBTFUL', warning: true, meaning: 'a sensor in use gives reason to doubt it' },
  { bit: Flag.TANGENTIAL_LATE, name: 'TANGENTIAL_LATE', warning: true, meaning: 'the force along the rubber was not computed in time' },
  { bit: Flag.TWO_CONTACTS, name: 'TWO_CONTACTS', warning: true, meaning: 'two contacts press' },
  { bit: Flag.SHAPE_UNKNOWN, name: 'SHAPE_UNKNOWN', warning: true, meaning: 'the contact shape is neither one contact nor a long one nor two' },
];

/** The quantities of a contact that hold under a flag, in the order of a recording's columns, and that flag. */
export const CONTACT_FLAG = {
  x_mm: Flag.FIT_VALID,
  y_mm: Flag.FIT_VALID,
  p0_Pa: Flag.FIT_VALID,
  sigma_mm: Flag.FIT_VALID,
  force_N: Flag.FIT_VALID,
  slip_mm: Flag.SLIP_VALID,
  residual_rms_Pa: Flag.FIT_VALID,
  location_sd_mm: Flag.UNCERTAINTY_VALID,
  force_sd_N: Flag.UNCERTAINTY_VALID,
  sigma_x_mm: Flag.WIDTHS_VALID,
  sigma_y_mm: Flag.WIDTHS_VALID,
  width_correlation: Flag.WIDTHS_VALID,
  qx_N: Flag.TANGENTIAL_VALID,
  qy_N: Flag.TANGENTIAL_VALID,
  q_sd_N: Flag.TANGENTIAL_VALID,
  tangential_ratio: Flag.TANGENTIAL_VALID,
  vx_mm_s: Flag.VELOCITY_VALID,
  vy_mm_s: Flag.VELOCITY_VALID,
  shape_age_ms: Flag.SHAPE_VALID,
  x1_mm: Flag.TWO_CONTACTS,
  y1_mm: Flag.TWO_CONTACTS,
  location1_sd_mm: Flag.TWO_CONTACTS,
  force1_N: Flag.TWO_CONTACTS,
  force1_sd_N: Flag.TWO_CONTACTS,
  x2_mm: Flag.TWO_CONTACTS,
  y2_mm: Flag.TWO_CONTACTS,
  location2_sd_mm: Flag.TWO_CONTACTS,
  force2_N: Flag.TWO_CONTACTS,
  force2_sd_N: Flag.TWO_CONTACTS,
  edge_angle_deg: Flag.EDGE,
  edge_angle_sd_deg: Flag.EDGE,
  edge_length_mm: Flag.EDGE,
} as const;
export type ContactField = keyof typeof CONTACT_FLAG;
export const CONTACT_FIELDS = Object.keys(CONTACT_FLAG) as ContactField[];

interface Header {
  sequence: number;
  /** Device time since start; in commands the host's own clock. */
  t_us: number;
}
/** One judged frame. The header's time is the middle of the sensors' conversion. A quantity travels only under its VALID flag. Without it the encoder leaves it out and the decoder gives 0 (NaN in Python and in messages). */
export interface Contact extends Header {
  type: 0x01;
  /** counts every frame since start, fitted or not */
  frame: number;
  /** flags of the frame, see below */
  flags: number;
  /** broadcast of the conversion command, and the sensors' conversion */
  convert_us: number;
  /** reading every sensor */
  read_us: number;
  /** the complete frame waits for the processor */
  queue_us: number;
  /** compensation, tare, gate */
  condition_us: number;
  /** the fit */
  fit_us: number;
  /** slip, and the flags of the result */
  contact_us: number;
  /** the sum of the six stages: from the first bus activity of the frame to the encoding of this packet */
  total_us: number;
  /** bitmap of the sensors that entered the fit */
  sensors_used: number;
  /** location across the strips, from the centre of the pad */
  x_mm: number;
  /** location along the strips */
  y_mm: number;
  /** peak of the fitted Gaussian */
  p0_Pa: number;
  /** standard deviation of the fitted Gaussian */
  sigma_mm: number;
  /** force scale times 2 pi p0 sigma^2, paper eq. (4), where AT_BOUND with at most the largest reading for p0; positive: pressing */
  force_N: number;
  /** root mean square of the residuals of the fit */
  residual_rms_Pa: number;
  /** predicted radial standard deviation of the location */
  location_sd_mm: number;
  /** predicted standard deviation of the force, with that of the force scale: 0.8 of the force on a pad that was never calibrated with a weight */
  force_sd_N: number;
  /** slip distance, paper eq. (7): from the mean location over the slip window */
  slip_mm: number;
  /** standard deviation of an elliptic Gaussian along x */
  sigma_x_mm: number;
  /** standard deviation of that along y */
  sigma_y_mm: number;
  /** of that Gaussian, -1 to 1; 0 unless it lies aslant */
  width_correlation: number;
  /** tangential force of the object on the rubber, along x */
  qx_N: number;
  /** tangential force along y */
  qy_N: number;
  /** predicted standard deviation of either where force_N is right, with that of the tangential scale */
  q_sd_N: number;
  /** size of the tangential force over force_N */
  tangential_ratio: number;
  /** velocity of the contact along x */
  vx_mm_s: number;
  /** velocity of the contact along y */
  vy_mm_s: number;
  /** age of the frame that the following values are of */
  shape_age_ms: number;
  /** location of the stronger of two contacts, as x_mm */
  x1_mm: number;
  /** as y_mm */
  y1_mm: number;
  /** predicted radial standard deviation of this location */
  location1_sd_mm: number;
  /** force of the stronger of two contacts */
  force1_N: number;
  /** its predicted standard deviation, with that of the force scale */
  force1_sd_N: number;
  /** location of the weaker of two contacts, as x_mm */
  x2_mm: number;
  /** as y_mm */
  y2_mm: number;
  /** predicted radial standard deviation of this location */
  location2_sd_mm: number;
  /** force of the weaker of two contacts */
  force2_N: number;
  /** its predicted standard deviation, with that of the force scale */
  force2_sd_N: number;
  /** direction of a long contact, from x towards y, -90 to 90 */
  edge_angle_deg: number;
  /** its predicted standard deviation */
  edge_angle_sd_deg: number;
  /** length of the line that presses evenly */
  edge_length_mm: number;
}
/** The readings of one frame, without the gains of a calibration. The header's time is that of the contact packet of the same frame number. */
export interface Raw extends Header {
  type: 0x02;
  /** the same number as in the contact packet of this frame */
  frame: number;
  /** as in the contact packet; firmware without capability fit sets only CONTACT, TARED, HELD, SATURATED, SENSOR_MASKED, ZERO_DOUBTFUL and SENSOR_DOUBTFUL */
  flags: number;
  /** bitmap: the reading is a measurement; 0 in a held frame, whose readings are those of the frame before */
  valid: number;
  /** bitmap: the reading is above 1980 mbar, where the sensor's range ends, and does not enter the fit */
  saturated: number;
  /** bitmap: a measurement with a reason to doubt it; 0 in a held frame */
  doubtful: number;
  /** mean of the sensors, 0.01 degC; 0 until measured */
  temperature_cC: number;
  /** number of sensors, 1 to 36 */
  sensor_count: number;
  /** of each sensor: absolute pressure, and the zero, of which the fit subtracts what has not faded in this contact; both in 1/1024 Pa */
  pressure_Pa_q10: Float64Array;
  /** of each sensor: absolute pressure, and the zero, of which the fit subtracts what has not faded in this contact; both in 1/1024 Pa */
  baseline_Pa_q10: Float64Array;
}
/** Identity, settings and stored data of a fingertip. Without its capability a field is 0 (None or NaN in Python). */
export interface Info extends Header {
  type: 0x03;
  /** major, minor, patch */
  firmware_version: Float64Array;
  /** number of sensors, 1 to 36 */
  sensor_count: number;
  /** what the firmware can do, see below */
  capabilities: number;
  /** commit of the firmware; a final + means uncommitted changes */
  git_hash: string;
  /** name of the board */
  board: string;
  /** name of the scene */
  scene: string;
  /** 16 hexadecimal digits, the flash chip's unique id */
  serial: string;
  /** requested frame rate; 0: as fast as the sensors allow */
  rate_mHz: number;
  /** frame rate over the last second; 0 before */
  measured_rate_mHz: number;
  /** oversampling ratio, 256 to 8192 */
  osr: number;
  /** time between temperature conversions while the temperature changes; up to four times as long while it is constant */
  temperature_interval_ms: number;
  /** streams that are on */
  streams: number;
  /** iterations of the fit */
  fit_iterations: number;
  /** slip window */
  slip_window_ms: number;
  /** slip threshold */
  slip_threshold_mm: number;
  /** of a rectangular layout; 0 for a free one */
  pitch_mm: number;
  /** of each sensor: x and y, from the centre of the pad */
  x_mm: Float64Array;
  /** of each sensor: x and y, from the centre of the pad */
  y_mm: Float64Array;
  /** prior on sigma that is set */
  prior_sigma_mm: number;
  /** its standard deviation; 0: none is set, and the sigma of a calibration is applied */
  prior_width_mm: number;
  /** UNCERTAIN is set where location_sd_mm is above it */
  location_limit_mm: number;
  /** sync pin: 0 off, 1 in, 2 frame, 3 second */
  sync: number;
  /** what the fingertip keeps without power, see below */
  stored: number;
  /** date of the calibration, Unix time */
  calibration_date_s: number;
  /** placements that entered it */
  calibration_placements: number;
  /** force is this times 2 pi p0 sigma^2 */
  force_scale: number;
  /** its standard deviation */
  force_scale_sd: number;
  /** sigma of a usual contact on this pad, um; 0: not known */
  calibration_sigma_um: number;
  /** its standard deviation from contact to contact */
  calibration_sigma_sd_um: number;
  /** depth of the dip around a contact, of its peak, 1/65536; 0: none */
  calibration_dip_share_q16: number;
  /** standard deviation of the dip's Gaussian */
  calibration_dip_sd_um: number;
  /** air in which the force scale was found; 0: not known */
  calibration_ambient_kPa: number;
  /** of each sensor: gain, and its relative standard deviation */
  gain: Float64Array;
  /** of each sensor: gain, and its relative standard deviation */
  gain_sd: Float64Array;
  /** of each sensor: how far it lies from its place in the layout, um, and the log of the width in which it measures a contact over that of the others, 1/32768; zeros: not known */
  off_x_um: Float64Array;
  /** of each sensor: how far it lies from its place in the layout, um, and the log of the width in which it measures a contact over that of the others, 1/32768; zeros: not known */
  off_y_um: Float64Array;
  /** of each sensor: how far it lies from its place in the layout, um, and the log of the width in which it measures a contact over that of the others, 1/32768; zeros: not known */
  wider_q15: Float64Array;
  /** of the rubber */
  pad_thickness_mm: number;
  /** of the rubber beyond the outer sensors; 0: not set */
  pad_overhang_mm: number;
  /** two normal terms: share and sd_mm of each */
  pad_normal: Float64Array;
  /** three tangential terms: moment_mm and sd_mm of each */
  pad_tangential: Float64Array;
  /** expected value of a contact's own spread */
  pad_spread_mm2: number;
  /** its standard deviation */
  pad_spread_sd_mm2: number;
  /** 2 pi p0 sigma^2 of a usual contact over its force */
  pad_force_ratio: number;
  /** tangential force is this times the profile's */
  pad_tangential_scale: number;
  /** its standard deviation */
  pad_tangential_scale_sd: number;
  /** effect of the pad's ends, three coefficients each: on the ratio along x */
  pad_edge_ratio_x: Float64Array;
  /** on the ratio along y */
  pad_edge_ratio_y: Float64Array;
  /** on the gain along x */
  pad_edge_gain_x: Float64Array;
  /** on the gain along y */
  pad_edge_gain_y: Float64Array;
  /** on the place, x */
  pad_edge_place_x_mm: Float64Array;
  /** on the place, y */
  pad_edge_place_y_mm: Float64Array;
  /** on the place by a tangential force along x */
  pad_edge_pull_x_mm: Float64Array;
  /** on the place by a tangential force along y */
  pad_edge_pull_y_mm: Float64Array;
  /** on the force */
  pad_edge_force: Float64Array;
  /** 1: the fingertip reports the tangential force from the first touch on; 0: from zero */
  pad_from_touch: number;
}
/** Counters since start, modulo 2^32, and present state. */
export interface Health extends Header {
  type: 0x04;
  /** as in info */
  capabilities: number;
  /** since start */
  uptime_s: number;
  /** frames that were read from the array */
  frames: number;
  /** of these, with at least one sensor missing */
  frames_incomplete: number;
  /** of these, never fitted: the processor was behind */
  frames_skipped: number;
  /** handed to the USB queue */
  packets_sent: number;
  /** the queue was full: whole packets, and each leaves a gap in the sequence */
  packets_dropped: number;
  /** commands carried out */
  commands_done: number;
  /** commands that were unknown, out of range, damaged, or not possible at that time */
  commands_rejected: number;
  /** reads that a sensor did not acknowledge, or that broke off */
  bus_nacks: number;
  /** operations on the bus that did not end in time */
  bus_timeouts: number;
  /** nine clocks, and resets of multiplexers */
  bus_recoveries: number;
  /** conversions that had not finished, and those that are void after one of these or after a missed reading */
  zero_readings: number;
  /** readings left out: below zero, or a step that no other sensor shared */
  implausible_readings: number;
  /** bitmap: the sensor answered at the last attempt */
  sensors_present: number;
  /** bitmap: the PROM's CRC is wrong, and the sensor still streams; or the PROM is blank, and it does not */
  sensors_prom_bad: number;
  /** since power-on. Faults and panics end in one too. The command crash asks for the last */
  watchdog_resets: number;
  /** main loop without interrupts, over the last second */
  cpu_busy_permille: number;
  /** never touched since start */
  stack_free_bytes: number;
  /** frames in contact whose fit could not be solved */
  fit_failures: number;
}
/** The answer to a command. */
export interface Ack extends Header {
  type: 0x05;
  /** type of the command */
  command: number;
  /** result, see below */
  result: number;
  /** the command's own */
  command_sequence: number;
  /** time in the command's header, so that the host can relate the clocks */
  host_time_us: number;
}
/** How the firmware last ended since power-on. If kind and all else is 0, it did not (firmware/common/crash.h explains the codes). */
export interface Crash extends Header {
  type: 0x06;
  /** 0 none, 1 hard fault, 2 panic, 3 watchdog, 4 an unhandled exception, 5 stack overflow, 6 start-up gave up */
  kind: number;
  /** exception in which the code at pc ran: 0 main loop, 16 + n interrupt n */
  exception: number;
  /** exception that made the record; 0 for a panic */
  vector: number;
  /** activity of the main loop: 0 start, 1 rest, 2 commands, 3 readings, 4 condition, 5 fit, 6 contact, 7 packet, 8 health, 9 store */
  activity: number;
  /** parts without progress, for kind 3: bit 0 main loop, 1 scan, 2 USB, 3 interrupts */
  stuck: number;
  /** the last events, newest first: 0 none, 1 start, 2 command, 3 port closed, 4 bus asleep, 5 awake, 6 stored, 7 other sensors answer, 8 timeouts on the sensor bus, 9 frames skipped, 10 the second processor did not answer, and was started again */
  event_codes: Float64Array;
  /** of these: type of the command; 1 if storing failed; 1 if the second processor does not start; number of timeouts or frames in a second */
  event_details: Float64Array;
  /** registers; all 0 if they could not be recorded */
  r0: number;
  r1: number;
  r2: number;
  r3: number;
  r12: number;
  lr: number;
  pc: number;
  xpsr: number;
  sp: number;
  /** ages of the events at the end, in 1024 us; they saturate */
  event_ages_1024us: Float64Array;
  /** time of the end, since the start before it */
  end_us: number;
}
/** An edge at the sync pin. The header's time is that of the edge. */
export interface Sync extends Header {
  type: 0x07;
  /** counts the edges since the pin was set, from 1, modulo 2^32; a gap is edges that came too fast. An odd one rises */
  number: number;
  /** of the pin after it: 1 high, 0 low */
  level: number;
}
export type DevicePacket = Contact | Raw | Info | Health | Ack | Crash | Sync;
/** What a command carries. */
export type Command =
  | { type: 0x80; streams: number; }
  | { type: 0x81; force: number; }
  | { type: 0x82; rate_mHz: number; }
  | { type: 0x83; osr: number; }
  | { type: 0x84; threshold_mm: number; window_ms: number; }
  | { type: 0x85; }
  | { type: 0x86; }
  | { type: 0x8f; }
  | { type: 0x87; magic: number; }
  | { type: 0x88; sensor_count: number; calibration_date_s: number; calibration_placements: number; force_scale: number; force_scale_sd: number; calibration_sigma_um: number; calibration_sigma_sd_um: number; calibration_dip_share_q16: number; calibration_dip_sd_um: number; calibration_ambient_kPa: number; gain: ArrayLike<number>; gain_sd: ArrayLike<number>; off_x_um: ArrayLike<number>; off_y_um: ArrayLike<number>; wider_q15: ArrayLike<number>; }
  | { type: 0x89; }
  | { type: 0x8a; keep: number; }
  | { type: 0x8b; sigma_mm: number; width_mm: number; }
  | { type: 0x8c; limit_mm: number; }
  | { type: 0x8d; pad_thickness_mm: number; pad_overhang_mm: number; pad_normal: ArrayLike<number>; pad_tangential: ArrayLike<number>; pad_spread_mm2: number; pad_spread_sd_mm2: number; pad_force_ratio: number; pad_tangential_scale: number; pad_tangential_scale_sd: number; pad_edge_ratio_x: ArrayLike<number>; pad_edge_ratio_y: ArrayLike<number>; pad_edge_gain_x: ArrayLike<number>; pad_edge_gain_y: ArrayLike<number>; pad_edge_place_x_mm: ArrayLike<number>; pad_edge_place_y_mm: ArrayLike<number>; pad_edge_pull_x_mm: ArrayLike<number>; pad_edge_pull_y_mm: ArrayLike<number>; pad_edge_force: ArrayLike<number>; pad_from_touch: number; }
  | { type: 0x8e; }
  | { type: 0x90; mode: number; };

/** What people set, as they type it; in a packet a value is `per` times as much. */
export const SETTINGS = [
  {
    name: 'rate',
    label: 'Frame rate, Hz',
    hint: '0.1 to 2000, or max: as fast as the sensors allow',
    zeros: 'max',
    command: PacketType.CMD_RATE,
    capability: 0,
    values: [
      { field: 'rate_mHz', info: 'rate_mHz', title: 'Frame rate', per: 1000, whole: true, span: [0.1, 2000], choices: null, words: null, unlessGiven: null },
    ],
  },
  {
    name: 'osr',
    label: 'Oversampling (osr)',
    hint: 'more is quieter and slower',
    zeros: null,
    command: PacketType.CMD_OSR,
    capability: 0,
    values: [
      { field: 'osr', info: 'osr', title: 'Oversampling', per: 1, whole: true, span: null, choices: [256, 512, 1024, 2048, 4096, 8192], words: null, unlessGiven: null },
    ],
  },
  {
    name: 'slip_threshold',
    label: 'Slip threshold, mm',
    hint: '0.01 to 50',
    zeros: null,
    command: PacketType.CMD_SLIP,
    capability: Capability.SLIP,
    values: [
      { field: 'threshold_mm', info: 'slip_threshold_mm', title: 'Slip threshold', per: 1, whole: false, span: [0.01, 50], choices: null, words: null, unlessGiven: null },
    ],
  },
  {
    name: 'slip_window',
    label: 'Slip window, ms',
    hint: '5 to 1000, and 160 frames at most',
    zeros: null,
    command: PacketType.CMD_SLIP,
    capability: Capability.SLIP,
    values: [
      { field: 'window_ms', info: 'slip_window_ms', title: 'Slip window', per: 1, whole: true, span: [5, 1000], choices: null, words: null, unlessGiven: null },
    ],
  },
  {
    name: 'prior',
    label: 'Prior on the width, mm',
    hint: 'SIGMA, SIGMA:WIDTH or none; 0.5 to 100, width 0.01 to 100, 0.5 unless given; for thin pads',
    zeros: 'none',
    command: PacketType.CMD_PRIOR,
    capability: Capability.FIT,
    values: [
      { field: 'sigma_mm', info: 'prior_sigma_mm', title: 'Prior', per: 1, whole: false, span: [0.5, 100], choices: null, words: null, unlessGiven: null },
      { field: 'width_mm', info: 'prior_width_mm', title: "The prior's width", per: 1, whole: false, span: [0.01, 100], choices: null, words: null, unlessGiven: 0.5 },
    ],
  },
  {
    name: 'limit',
    label: 'Location limit, mm',
    hint: '0.01 to 100; UNCERTAIN where location_sd_mm is above it',
    zeros: null,
    command: PacketType.CMD_LOCATION_LIMIT,
    capability: Capability.FIT,
    values: [
      { field: 'limit_mm', info: 'location_limit_mm', title: 'Location limit', per: 1, whole: false, span: [0.01, 100], choices: null, words: null, unlessGiven: null },
    ],
  },
  {
    name: 'sync',
    label: 'Sync pin',
    hint: 'in: stamp its edges; frame, second: pulse at each frame or second',
    zeros: 'off',
    command: PacketType.CMD_SYNC,
    capability: Capability.SYNC,
    values: [
      { field: 'mode', info: 'sync', title: 'Sync pin', per: 1, whole: true, span: null, choices: [1, 2, 3], words: ['in', 'frame', 'second'], unlessGiven: null },
    ],
  },
] as const;
