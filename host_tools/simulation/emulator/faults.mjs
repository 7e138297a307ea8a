/**
 * Faults of the world around the chip, from a JSON file: a list of
 *
 *     { "type": TYPE, "sensor": 0..14 | "mux": 0..2, "from_s": seconds, "to_s": seconds }
 *
 * `to_s` may be left out: the fault then stays. Times are seconds since power-on.
 */
import { RAM_BASE, RAM_BYTES } from './chip/core.mjs';
import { InputError, readText } from './errors.mjs';

/** Of one sensor: its name in Ms5840's `faults`. */
const OF_SENSOR = {
  sensor_dead: 'dead', // acknowledges nothing
  sensor_prom_corrupt: 'promCorrupt', // PROM words read back with flipped bits
  sensor_prom_collision: 'promCollision', // two to four bits of C1 to C6 read back inverted, always the same, such that the CRC-4 is right
  sensor_prom_bit: 'promBit', // bit 10 of C1 reads back inverted: some 7 kPa
  sensor_adc_zero: 'adcZero', // every ADC read gives 0
  sensor_d2_corrupt: 'd2Corrupt', // every temperature has one bit inverted, another one each time
  sensor_fast: 'fast', // acknowledges so soon that an I2C controller without a receive hold takes it for lost arbitration
};

/** The same, which strike once at from_s: how many have struck. */
const ONCE_OF_SENSOR = {
  sensor_nack: 'nacks', // does not acknowledge its address, the first time from then on
  sensor_brown_out: 'brownOuts', // its supply dips: a conversion is lost, and until a reset its codes are 1/16 too small
};

/** Of a board: what it strikes. */
const OF_BOARD = {
  sda_stuck_low: 'sensor', // pulls SDA from from_s until nine clocks reached it or its multiplexer was reset
  mux_stuck: 'mux', // acknowledges nothing until its RESET line was pulsed
  line_stuck_low: 'sensor', // its SDA is tied to ground; behind a multiplexer only while its channel is on
};

/** Of a board with a data line for each sensor. */
const OF_LINES = {
  sensor_missing: 'sensor', // is not there; when it comes back it has just been powered
  line_stuck_high: 'sensor', // its SDA is tied to VDD
  scl_stuck_low: null, // SCL is tied to ground
  scl_stuck_high: null, // SCL is tied to VDD
  clock_glitch: 'sensor', // sees one clock too many, once, in the first transfer from from_s on
};

/** Not of the board. */
const OF_WORLD = {
  host_stall: null, // the USB host stops reading the CDC port
  usb_unplug: null, // the cable is out; it comes back at to_s
  crystal_dead: null, // the crystal does not swing before to_s
  crystal_weak: null, // it swings, but what it drives before to_s stops the chip until a reset
  pll_late: null, // no PLL locks before to_s
  usb_busy_hub: null, // other devices talk on the bus: after a reset of it it is never idle for 800 us
  usb_deaf: null, // erratum E15 strikes in the first IN transfer from from_s on: the controller answers nothing until its block is reset
  usb_dead: null, // the same, and it does not hear the bus either
  usb_late_resume: null, // the controller reports the end of a suspend 45 ms late
  power_cut: null, // chip, flash and sensors are without power until to_s; what the flash was doing is cut short
  chip_reset: null, // the chip alone is held in reset until to_s, as when its brown-out detector trips; its SRAM is lost
  sram_upset: null, // at from_s the "bytes", as hexadecimal digits, get into the chip's SRAM at this "address"
};

const eachSensor = Object.fromEntries(Object.keys({ ...OF_SENSOR, ...ONCE_OF_SENSOR }).map((type) => [type, 'sensor']));
const TARGET = { ...eachSensor, ...OF_BOARD, ...OF_LINES, ...OF_WORLD };

export function parseFaults(text, file, { sensors, muxes, lines }) {
  const fail = (message) => {
    throw new InputError(`${file}: ${message}`);
  };
  let list;
  try {
    list = JSON.parse(text);
  } catch (error) {
    fail(`not JSON (${error.message})`);
  }
  if (!Array.isArray(list)) fail('must be a list of faults, e.g. [{"type":"sensor_dead","sensor":3,"from_s":1}]');
  return list.map((fault, i) => {
    const at = `fault ${i + 1}`;
    const known = `known: ${Object.keys(TARGET).join(', ')}`;
    if (!fault || typeof fault !== 'object' || Array.isArray(fault))
      fail(`${at}: must be an object, e.g. {"type":"sensor_dead","sensor":3,"from_s":1}`);
    if (fault.type === undefined) fail(`${at}: "type" is missing; ${known}`);
    if (!Object.hasOwn(TARGET, fault.type)) fail(`${at}: unknown type "${fault.type}"; ${known}`);
    const target = TARGET[fault.type];
    if (Object.hasOwn(OF_LINES, fault.type) && !lines) fail(`${at}: ${fault.type} needs a board with a data line for each sensor`);
    if (target === 'mux' && !muxes) fail(`${at}: ${fault.type} needs a board with multiplexers`);
    const own = fault.type === 'sram_upset' ? ['address', 'bytes'] : ['to_s', target];
    const extra = Object.keys(fault).find((key) => !['type', 'from_s', ...own].includes(key));
    if (extra) fail(`${at}: key "${extra}" does not belong to ${fault.type}`);
    if (target) {
      const count = target === 'sensor' ? sensors : muxes;
      if (!Number.isInteger(fault[target]) || fault[target] < 0 || fault[target] >= count)
        fail(`${at}: "${target}" must be 0..${count - 1}`);
    }
    if (fault.type === 'sram_upset' && !(typeof fault.bytes === 'string' && /^([0-9a-f]{2})+$/i.test(fault.bytes)))
      fail(`${at}: "bytes" must be pairs of hexadecimal digits`);
    const upset = fault.type === 'sram_upset' ? { address: fault.address, bytes: Buffer.from(fault.bytes, 'hex') } : null;
    if (
      upset &&
      !(Number.isInteger(upset.address) && upset.address >= RAM_BASE && upset.address + upset.bytes.length <= RAM_BASE + RAM_BYTES)
    )
      fail(`${at}: "address" must be one of SRAM, and so must be where the bytes end`);
    const { from_s, to_s = Infinity } = fault;
    if (typeof from_s !== 'number' || !(from_s >= 0)) fail(`${at}: "from_s" must be a time >= 0`);
    if (typeof to_s !== 'number' || !(to_s > from_s)) fail(`${at}: "to_s" must be later than "from_s"`);
    return { type: fault.type, target: upset ?? (target ? fault[target] : null), from_ns: from_s * 1e9, to_ns: to_s * 1e9 };
  });
}

export const readFaults = (file, limits) => parseFaults(readText(file, 'faults'), file, limits);

const NONE = Object.freeze({});

/** The faults in force. `on[type](target, active)` is called when one that has its own effect begins or ends. */
export class Faults {
  constructor(list, scope, on = {}) {
    this.sensors = new Map();
    this.scope = scope;
    this.on = on;
    /** Those in force that act by themselves. */
    this.active = new Set();
    for (const fault of list) this.add(fault);
  }

  /** One more, that begins now or later. */
  add(fault) {
    const { scope, on } = this;
    const [key, times] = [OF_SENSOR[fault.type], ONCE_OF_SENSOR[fault.type]];
    const set = (name, value) => this.sensors.set(fault.target, { ...this.sensor(fault.target), [name]: value });
    const change = (active) => {
      if (key) set(key, active);
      else if (times) set(times, (this.sensor(fault.target)[times] ?? 0) + (active ? 1 : 0));
      else {
        if (active) this.active.add(fault);
        else this.active.delete(fault);
        on[fault.type]?.(fault.target, active);
      }
    };
    scope.createAlarm(() => change(true)).scheduleAt(fault.from_ns);
    if (fault.to_ns !== Infinity) scope.createAlarm(() => change(false)).scheduleAt(fault.to_ns);
  }

  /** On a board that has just been powered. */
  actAnew() {
    for (const fault of this.active) if (!Object.hasOwn(OF_WORLD, fault.type)) this.on[fault.type]?.(fault.target, true);
  }

  sensor(index) {
    return this.sensors.get(index) ?? NONE;
  }
}
