/** written by firmware/wire/line.py from line.toml; change it there. */

export const WIRE_VERSION = 5;
export const MAX_SENSORS = 32;
export const MAX_FRAME_BYTES = 836;
export const LOADER_MAGIC = 0x746f6f42;

export const PacketType = {
  CONTACT: 0x01,
  RAW: 0x02,
  INFO: 0x03,
  HEALTH: 0x04,
  ACK: 0x05,
  CRASH: 0x06,
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
} as const;
/** What a fingertip keeps without power. */
export const Stored = {
  CALIBRATION: 1 << 0,
  SETTINGS: 1 << 1,
  WRITING: 1 << 2,
  DAMAGED: 1 << 3,
  PAD: 1 << 4,
} as const;
/** What a frame says about itself. */
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
} as const;
/** What an acknowledgement says. */
export const Result = {
  DONE: 0,
  UNKNOWN_COMMAND: 1,
  OUT_OF_RANGE: 2,
  NOT_NOW: 3,
} as const;

export const CAPABILITY_WORDS: readonly (readonly [number, string])[] = [
  [Capability.FIT, 'fit'],
  [Capability.SLIP, 'slip'],
  [Capability.RAW_STREAM, 'raw'],
  [Capability.TANGENTIAL, 'tangential'],
];
export const STORED_WORDS: readonly (readonly [number, string])[] = [
  [Stored.CALIBRATION, 'calibration'],
  [Stored.SETTINGS, 'settings'],
  [Stored.WRITING, 'writing'],
  [Stored.DAMAGED, 'damaged'],
  [Stored.PAD, 'pad'],
];
export const RESULT_WORDS: readonly (readonly [number, string])[] = [
  [Result.DONE, 'done'],
  [Result.UNKNOWN_COMMAND, 'its firmware does not know this command'],
  [Result.OUT_OF_RANGE, 'the value is out of range for this firmware'],
  [Result.NOT_NOW, 'not possible now'],
];
export const COMMAND_WORDS: readonly (readonly [number, string])[] = [
  [PacketType.CMD_STREAM, 'stream'],
  [PacketType.CMD_TARE, 'tare'],
  [PacketType.CMD_RATE, 'rate'],
  [PacketType.CMD_OSR, 'osr'],
  [PacketType.CMD_SLIP, 'slip'],
  [PacketType.CMD_INFO, 'info'],
  [PacketType.CMD_HEALTH, 'health'],
  [PacketType.CMD_CRASH, 'crash'],
  [PacketType.CMD_LOADER, 'loader'],
  [PacketType.CMD_CALIBRATE, 'calibrate'],
  [PacketType.CMD_ERASE_CALIBRATION, 'erase calibration'],
  [PacketType.CMD_KEEP, 'keep'],
  [PacketType.CMD_PRIOR, 'prior'],
  [PacketType.CMD_LOCATION_LIMIT, 'limit'],
  [PacketType.CMD_PAD, 'pad'],
  [PacketType.CMD_ERASE_PAD, 'erase pad'],
];

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
  { bit: Flag.CALIBRATED, name: 'CALIBRATED', warning: false, meaning: 'gains and force scale of a calibration act' },
  { bit: Flag.TANGENTIAL_VALID, name: 'TANGENTIAL_VALID', warning: false, meaning: 'the force along the rubber has values' },
  { bit: Flag.TANGENTIAL_FROM_TOUCH, name: 'TANGENTIAL_FROM_TOUCH', warning: false, meaning: 'the tangential load is the change since the first touch' },
  { bit: Flag.VELOCITY_VALID, name: 'VELOCITY_VALID', warning: false, meaning: 'the velocity of the contact has values' },
  { bit: Flag.MOVING, name: 'MOVING', warning: false, meaning: 'the contact moves' },
  { bit: Flag.SLIDING, name: 'SLIDING', warning: false, meaning: 'the contact slides, however slowly' },
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
} as const;
/** So many of them come before the stages; the others are not in recordings of before. */
export const FIRST_FIELDS_COUNT = 12;

export const STAGES = [
  'convert_us',
  'read_us',
  'queue_us',
  'condition_us',
  'fit_us',
  'contact_us',
  'total_us',
] as const;
export const HEALTH_WORDS = [
  'capabilities',
  'uptime_s',
  'frames',
  'frames_incomplete',
  'frames_skipped',
  'packets_sent',
  'packets_dropped',
  'commands_done',
  'commands_rejected',
  'bus_nacks',
  'bus_timeouts',
  'bus_recoveries',
  'zero_readings',
  'implausible_readings',
  'sensors_present',
  'sensors_prom_bad',
  'watchdog_resets',
] as const;
export const HEALTH_KEYS = [
  'capabilities',
  'uptime_s',
  'frames',
  'frames_incomplete',
  'frames_skipped',
  'packets_sent',
  'packets_dropped',
  'commands_done',
  'commands_rejected',
  'bus_nacks',
  'bus_timeouts',
  'bus_recoveries',
  'zero_readings',
  'implausible_readings',
  'fit_failures',
  'sensors_present',
  'sensors_prom_bad',
  'watchdog_resets',
  'cpu_busy_permille',
  'stack_free_bytes',
] as const;

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
      { field: 'rate_mHz', info: 'rate_mHz', say: 'Frame rate', per: 1000, whole: true, span: [0.1, 2000], choices: null, unlessGiven: null },
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
      { field: 'osr', info: 'osr', say: 'Oversampling', per: 1, whole: true, span: null, choices: [256, 512, 1024, 2048, 4096, 8192], unlessGiven: null },
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
      { field: 'threshold_mm', info: 'slip_threshold_mm', say: 'Slip threshold', per: 1, whole: false, span: [0.01, 50], choices: null, unlessGiven: null },
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
      { field: 'window_ms', info: 'slip_window_ms', say: 'Slip window', per: 1, whole: true, span: [5, 1000], choices: null, unlessGiven: null },
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
      { field: 'sigma_mm', info: 'prior_sigma_mm', say: 'Prior', per: 1, whole: false, span: [0.5, 100], choices: null, unlessGiven: null },
      { field: 'width_mm', info: 'prior_width_mm', say: "The prior's width", per: 1, whole: false, span: [0.01, 100], choices: null, unlessGiven: 0.5 },
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
      { field: 'limit_mm', info: 'location_limit_mm', say: 'Location limit', per: 1, whole: false, span: [0.01, 100], choices: null, unlessGiven: null },
    ],
  },
] as const;
