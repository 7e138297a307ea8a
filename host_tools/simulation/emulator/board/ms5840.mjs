/**
 * TE MS5840-02BA and MS5837-30BA pressure sensors, written from its family's datasheets and independent of the firmware.
 *
 * Commands: reset 1Eh (no acknowledge for 2.8 ms), PROM A0h..ACh, convert 40h/50h | osr, ADC read 00h. The
 * early-read trap is modelled: an ADC read during a conversion returns 0 and spoils that conversion, so does a
 * convert command; without a finished conversion, or a second time, an ADC read returns 0.
 *
 * The 24-bit codes are found by inverting the datasheet's compensation, second order included, for the absolute
 * pressure and temperature in the middle of the conversion, plus Gaussian noise of the datasheet's rms.
 */
import { InputError } from '../errors.mjs';
import { Prng } from '../prng.mjs';
import { I2cTarget } from './i2c_bus.mjs';

export const ADDRESS = 0x76;
const RESET_NS = 2.8e6;
/** Typical conversion time as a fraction of the datasheet's maximum, before the oscillator's own tolerance. */
const CONVERSION_FRACTION = 0.96;
const OSCILLATOR_TOLERANCE = 0.04;
const CODE_MAX = 0xffffff;

/** MS5840, by osr field / 2: maximum conversion time, pressure noise rms, temperature noise rms. */
export const OSR = [
  { name: 256, max_ns: 0.56e6, noise_Pa: 11, noise_degC: 0.012 },
  { name: 512, max_ns: 1.1e6, noise_Pa: 6.2, noise_degC: 0.009 },
  { name: 1024, max_ns: 2.17e6, noise_Pa: 3.9, noise_degC: 0.006 },
  { name: 2048, max_ns: 4.32e6, noise_Pa: 2.8, noise_degC: 0.004 },
  { name: 4096, max_ns: 8.61e6, noise_Pa: 2.1, noise_degC: 0.003 },
  { name: 8192, max_ns: 17.2e6, noise_Pa: 1.6, noise_degC: 0.002 },
];

/** First-order temperature and the second-order terms for it, in the datasheet's units, not rounded. */
function secondOrderOfMs5840(dT, temperature) {
  const below = temperature - 2000;
  if (temperature >= 2000) return { t: 0, off: 0, sens: 0 };
  if (temperature >= 1000) return { t: (12 * dT * dT) / 2 ** 35, off: (30 * below * below) / 2 ** 8, sens: 0 };
  return { t: (14 * dT * dT) / 2 ** 35, off: (35 * below * below) / 2 ** 3, sens: (63 * below * below) / 2 ** 5 };
}

function secondOrderOfMs5837(dT, temperature) {
  const below = temperature - 2000;
  if (temperature >= 2000) return { t: (2 * dT * dT) / 2 ** 37, off: below ** 2 / 2 ** 4, sens: 0 };
  const beyond = Math.min(0, temperature + 1500);
  return { t: (3 * dT * dT) / 2 ** 33, off: (3 * below ** 2) / 2 + 7 * beyond ** 2, sens: (5 * below ** 2) / 2 ** 3 + 4 * beyond ** 2 };
}

const MS5840 = {
  osr: OSR,
  /** A public dump of a part (C1..C6), around which the simulated parts spread. */
  typical: [41335, 41466, 26840, 27317, 31225, 28780],
  /** Product type and factory bits of the same dump. */
  word0: 0x8a1,
  /** Powers of 2 with C1..C4 and in the pressure; what one count of that is. */
  sens: [16, 7],
  off: [17, 6],
  divisor: 15,
  count_Pa: 1,
  secondOrder: secondOrderOfMs5840,
};

/** The datasheet's pages 7 and 9 of 10/2015; noise below OSR 8192 recalled; times as of the MS5611, the same converter. */
const MS5837_30BA = {
  osr: [
    [256, 0.6, 157, 0.012],
    [512, 1.17, 84, 0.009],
    [1024, 2.28, 54, 0.006],
    [2048, 4.54, 38, 0.004],
    [4096, 9.04, 28, 0.003],
    [8192, 18.08, 20, 0.002],
  ].map(([name, max_ms, noise_Pa, noise_degC]) => ({ name, max_ns: max_ms * 1e6, noise_Pa, noise_degC })),
  typical: [34982, 36352, 20328, 22354, 26646, 26146],
  word0: 0x1a << 5,
  sens: [15, 8],
  off: [16, 7],
  divisor: 13,
  count_Pa: 10,
  secondOrder: secondOrderOfMs5837,
};

const SENSORS = { ms5840: MS5840, ms5837_30ba: MS5837_30BA };

export function findSensor(name) {
  if (!Object.hasOwn(SENSORS, name)) throw new InputError(`unknown sensor "${name}"; known: ${Object.keys(SENSORS).join(', ')}`);
  return SENSORS[name];
}

const SPREAD = 0.03;

/** CRC-4 over seven PROM words, the first one's top nibble and the eighth word taken as 0. */
export function crc4(words) {
  let remainder = 0;
  const all = [words[0] & 0x0fff, ...words.slice(1, 7), 0];
  for (const word of all) {
    for (const byte of [word >> 8, word & 0xff]) {
      remainder ^= byte;
      for (let i = 0; i < 8; i++) remainder = remainder & 0x8000 ? ((remainder << 1) ^ 0x3000) & 0xffff : (remainder << 1) & 0xffff;
    }
  }
  return remainder >> 12;
}

export function makeProm(prng, kind = MS5840) {
  const words = [kind.word0, ...kind.typical.map((c) => Math.min(65535, Math.round(c * prng.range(1 - SPREAD, 1 + SPREAD))))];
  words[0] |= crc4(words) << 12;
  return words;
}

/** The same but for two to four bits of C1 to C6, with a CRC-4 that is right by chance. */
export function collide(prng, words) {
  for (;;) {
    const others = [...words];
    const flips = 2 + Math.floor(prng.range(0, 3));
    for (let i = 0; i < flips; i++) others[1 + Math.floor(prng.range(0, 6))] ^= 1 << Math.floor(prng.range(0, 16));
    if (others.some((word, i) => word !== words[i]) && crc4(others) === others[0] >> 12) return others;
  }
}

/** OFF and SENS at a difference from the reference temperature. */
function lineOf(words, dT, { sens, off, secondOrder }) {
  const second = secondOrder(dT, 2000 + (dT * words[6]) / 2 ** 23);
  return {
    off: words[2] * 2 ** off[0] + (words[4] * dT) / 2 ** off[1] - second.off,
    sens: words[1] * 2 ** sens[0] + (words[3] * dT) / 2 ** sens[1] - second.sens,
  };
}

function temperatureOf(words, dT, { secondOrder }) {
  const first = 2000 + (dT * words[6]) / 2 ** 23;
  return first - secondOrder(dT, first).t;
}

/** Pressure (Pa) and temperature (0.01 degC) of a pair of codes: the datasheet's formula in real numbers. */
export function compensate(words, d1, d2, kind = MS5840) {
  const dT = d2 - words[5] * 2 ** 8;
  const { off, sens } = lineOf(words, dT, kind);
  return {
    pressure_Pa: (((d1 * sens) / 2 ** 21 - off) / 2 ** kind.divisor) * kind.count_Pa,
    temperature_cdegC: temperatureOf(words, dT, kind),
  };
}

/** Codes (real numbers) that a part with this PROM gives for a pressure and temperature. */
export function codesFor(words, pressure_Pa, temperature_degC, kind = MS5840) {
  const wanted = temperature_degC * 100;
  let low = -(2 ** 24);
  let high = 2 ** 24;
  for (let i = 0; i < 60; i++) {
    const middle = (low + high) / 2;
    if (temperatureOf(words, middle, kind) < wanted) low = middle;
    else high = middle;
  }
  const dT = (low + high) / 2;
  const { off, sens } = lineOf(words, dT, kind);
  return { d1: (((pressure_Pa / kind.count_Pa) * 2 ** kind.divisor + off) * 2 ** 21) / sens, d2: dT + words[5] * 2 ** 8 };
}

export class Ms5840 extends I2cTarget {
  /**
   * @param options index; prng: this sensor's own; now_ns: () => time; report: Report;
   *   stimulus: (index, t_ns) => { pressure_Pa, temperature_degC }, absolute;
   *   sensor: see findSensor; faults: (index) => { dead, promCorrupt, promCollision, promBit, adcZero, d2Corrupt, fast } of this moment, { nacks, brownOuts } so far
   */
  constructor({ index, prng, now_ns, report, stimulus, sensor = 'ms5840', faults = () => ({}) }) {
    super(ADDRESS);
    this.kind = findSensor(sensor);
    this.index = index;
    this.prng = prng;
    this.now_ns = now_ns;
    this.report = report;
    this.stimulus = stimulus;
    this.faults = faults;
    this.prom = makeProm(prng, this.kind);
    /** The PROM's content under the fault sensor_prom_collision. */
    this.collidingProm = collide(new Prng(this.prom.reduce((sum, word) => Math.imul(sum, 31) + word, 7)), this.prom);
    this.timeFactor = CONVERSION_FRACTION * (1 + prng.range(-OSCILLATOR_TOLERANCE, OSCILLATOR_TOLERANCE));
    this.heldClocks = 0;
    this.holding = false;
    /** Fault: its SDA is tied to ground, which no reset ends. */
    this.tied = false;
    this.nacks = 0;
    this.brownOuts = 0;
    this.wrongBit = 0;
    /** It pulled SDA as soon as SCL fell. */
    this.onFast = () => {};
    this.powerUp();
  }

  /** The supply comes, or comes back: then the PROM reads as 0 until a reset command (assumed; drivers all reset first). */
  powerUp() {
    this.returned = this.wasReset !== undefined;
    this.busyUntil_ns = 0;
    this.wasReset = false;
    this.untrimmed = false;
    this.conversion = null;
    this.output = [];
    this.phase = 'idle';
  }

  /** Faults that strike once. */
  #struck(faults) {
    const nack = (faults.nacks ?? 0) > this.nacks;
    if (nack) this.nacks += 1;
    if ((faults.brownOuts ?? 0) > this.brownOuts) {
      this.brownOuts += 1;
      // The supply dips, not as far as at power-up: the part goes on converting, with another gain until it is reset (assumed).
      const { phase } = this;
      this.powerUp();
      Object.assign(this, { phase, untrimmed: true });
    }
    return nack;
  }

  get holdsSda() {
    return this.holding || this.tied;
  }

  hold(active) {
    this.holding = active;
    this.heldClocks = 0;
  }

  clock() {
    if (this.holding && ++this.heldClocks >= 9) this.holding = false;
  }

  acknowledgesAddress() {
    const faults = this.faults(this.index);
    if (this.#struck(faults)) return false;
    return this.now_ns() >= this.busyUntil_ns && !faults.dead && !this.holdsSda;
  }

  write(byte) {
    const acknowledged = super.write(byte);
    if (acknowledged && this.faults(this.index).fast) this.onFast();
    return acknowledged;
  }

  receive(command) {
    const now = this.now_ns();
    if (command === 0x1e) {
      this.busyUntil_ns = now + RESET_NS;
      this.wasReset = true;
      this.untrimmed = false;
      this.conversion = null;
      this.output = [];
      return true;
    }
    if (command === 0x00) {
      this.output = this.#adcRead(now);
      return true;
    }
    const osr = command & 0x0f;
    if ((command & 0xf0) === 0x40 || (command & 0xf0) === 0x50) {
      if (osr & 1 || osr > 10) return false;
      this.#convert(now, (command & 0xf0) === 0x40, this.kind.osr[osr >> 1]);
      return true;
    }
    if (command >= 0xa0 && command <= 0xac && !(command & 1)) {
      const prom = this.faults(this.index).promCollision ? this.collidingProm : this.prom;
      let word = prom[(command - 0xa0) >> 1];
      if (this.returned && !this.wasReset) word = 0;
      if (this.faults(this.index).promBit && command === 0xa2) word ^= 0x0400;
      if (this.faults(this.index).promCorrupt) word ^= 0x0140 << ((command >> 1) & 3);
      this.output = [(word >> 8) & 0xff, word & 0xff];
      return true;
    }
    return false;
  }

  transmit() {
    return this.output.length ? this.output.shift() : 0xff;
  }

  #convert(now, isPressure, osr) {
    // A sensor that came back hears what is meant for the others.
    if (!this.wasReset && !this.returned)
      this.report.warn('ms5840', `sensor ${this.index}: conversion before the reset command that loads its PROM`);
    const interrupted = this.conversion !== null && now < this.conversion.end_ns;
    const duration_ns = osr.max_ns * this.timeFactor;
    const corrupt = !isPressure && this.faults(this.index).d2Corrupt;
    this.conversion = {
      isPressure,
      osr,
      start_ns: now,
      end_ns: now + duration_ns,
      spoiled: interrupted,
      wrong: corrupt ? 1 << this.#otherBit() : 0,
    };
  }

  /** The wrong bit of a corrupt temperature: never the same twice running, or two would agree. */
  #otherBit() {
    this.wrongBit = (this.wrongBit + 1 + Math.floor(this.prng.range(0, 23))) % 24;
    return this.wrongBit;
  }

  #adcRead(now) {
    const conversion = this.conversion;
    if (!conversion || this.faults(this.index).adcZero) return [0, 0, 0];
    if (now < conversion.end_ns) {
      conversion.spoiled = true;
      return [0, 0, 0];
    }
    this.conversion = null;
    const code = this.#code(conversion);
    return [code >> 16, (code >> 8) & 0xff, code & 0xff];
  }

  #code({ isPressure, osr, start_ns, end_ns, spoiled, wrong }) {
    const { pressure_Pa, temperature_degC } = this.stimulus(this.index, (start_ns + end_ns) / 2);
    const noise = this.prng.normal();
    const codes = isPressure
      ? codesFor(this.prom, pressure_Pa + noise * osr.noise_Pa, temperature_degC, this.kind).d1
      : codesFor(this.prom, pressure_Pa, temperature_degC + noise * osr.noise_degC, this.kind).d2;
    const spoil = spoiled ? this.prng.range(-0.5, 0.5) * 2 ** 22 : 0;
    const gain = this.untrimmed ? 15 / 16 : 1;
    return Math.max(0, Math.min(CODE_MAX, Math.round(codes * gain + spoil))) ^ wrong;
  }
}

/** Those of a board, each with random numbers of its own. */
export const makeSensors = (count, { scope, report, seed, stimulus, faults, sensor }) =>
  Array.from(
    { length: count },
    (_, index) =>
      new Ms5840({
        index,
        prng: new Prng(Math.imul(seed, 1000003) + index),
        now_ns: () => scope.nanos,
        report,
        stimulus,
        sensor,
        faults: (i) => faults().sensor(i),
      }),
  );
