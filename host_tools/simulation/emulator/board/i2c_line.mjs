/**
 * One data line of a bit-parallel I2C bus: the target on it, bit by bit from the levels, the timing checks of
 * UM10204, and a log of its transfers.
 *
 * The board calls, in the order of time, `sclFell`, `sclRose`, `sdaFell`, `sdaRose`; `pulls` is whether the
 * target wants SDA low, and changes only in `sclFell` and where the target loses its place (START, STOP).
 */
import { Transfer } from './i2c_bus.mjs';

/** UM10204 table 10, fast mode, ns. tVD;DAT may be longer by what SCL stays low beyond tLOW. */
const FAST_MODE = {
  tHD_STA: 600,
  tLOW: 1300,
  tHIGH: 600,
  tSU_STA: 600,
  tSU_DAT: 100,
  tSU_STO: 600,
  tBUF: 1300,
  tVD_DAT: 900,
  period: 2500,
};
const NAMES = Object.keys(FAST_MODE);
const LIMITS_NS = Float64Array.from(Object.values(FAST_MODE));
/** Numbers, since they are checked at every clock of every line. */
export const [HD_STA, LOW, HIGH, SU_STA, SU_DAT, SU_STO, BUF, VD_DAT, PERIOD] = NAMES.keys();

/** Tolerance of emulated time, which is in floating point. */
const SLACK_NS = 1e-3;

/** Warns of each time that is too short (or long), once per line and name with its first value, and counts the rest. */
export class TimingCheck {
  constructor(report, name) {
    this.report = report;
    this.name = name;
    this.messages = new Map();
    this.seen_ns = new Float64Array(NAMES.length).fill(NaN);
    /** Something is wrong on purpose: what happens is not the controller's fault. */
    this.excused = false;
  }

  /** The shortest times that were seen, by name; of tVD_DAT the longest. */
  get extremes() {
    return Object.fromEntries(NAMES.map((name, what) => [name, this.seen_ns[what]]).filter(([, value_ns]) => !Number.isNaN(value_ns)));
  }

  atLeast(what, value_ns) {
    if (this.excused) return;
    if (!(value_ns >= this.seen_ns[what])) this.seen_ns[what] = value_ns;
    if (value_ns < LIMITS_NS[what] - SLACK_NS) this.#warn(what, value_ns, 'at least');
  }

  atMost(what, value_ns) {
    if (this.excused) return;
    if (!(value_ns <= this.seen_ns[what])) this.seen_ns[what] = value_ns;
    if (value_ns > LIMITS_NS[what] + SLACK_NS) this.#warn(what, value_ns, 'at most');
  }

  #warn(what, value_ns, bound) {
    if (!this.messages.has(what))
      this.messages.set(what, `${this.name}: ${NAMES[what]} is ${value_ns.toFixed(0)} ns; fast mode allows ${bound} ${LIMITS_NS[what]} ns`);
    this.report.warn('i2c', this.messages.get(what));
  }
}

export class I2cLine {
  /**
   * @param options name; target: I2cTarget; rise_ns: { sda, scl } from 0.3 to 0.7 VDD; report; statistics;
   *   onTransfer(transfer), see I2cBus
   */
  constructor({ name, target, rise_ns, report, statistics, onTransfer }) {
    this.name = name;
    this.target = target;
    this.rise_ns = rise_ns;
    this.report = report;
    this.statistics = statistics;
    this.onTransfer = onTransfer;
    this.check = new TimingCheck(report, name);
    this.faults = 0;
    this.pulls = false;
    this.phase = 'idle';
    this.bits = 0;
    this.byte = 0;
    this.answer = null;
    this.current = null;
    this.sclHigh = true;
    this.sdaHigh = true;
    this.sclFell_ns = -Infinity;
    this.sclRose_ns = -Infinity;
    this.sdaChanged_ns = -Infinity;
    this.started_ns = -Infinity;
    this.stopped_ns = -Infinity;
  }

  /** A fault begins or ends. Its consequences last until the controller's next START. */
  fault(active) {
    this.faults += active ? 1 : -1;
    if (active) this.check.excused = true;
  }

  /** Another target takes the line, or none. */
  connect(target) {
    this.target = target;
    this.phase = 'idle';
    this.pulls = false;
  }

  sclFell(t_ns) {
    this.sclHigh = false;
    this.sclFell_ns = t_ns;
    if (this.started_ns > this.sclRose_ns) this.check.atLeast(HD_STA, t_ns - this.started_ns);
    this.target.clock();
    this.#shift(t_ns);
  }

  /** The clock pulse that began with the last rise is over. */
  #shift(t_ns) {
    if (this.phase === 'start') this.#expect('receive');
    else if (this.phase === 'receive' && this.bits === 8) {
      this.pulls = this.target.write(this.byte);
      this.phase = 'acknowledge';
    } else if (this.phase === 'acknowledge' && this.bits === 9) {
      this.pulls = false;
      this.#received();
    } else if (this.phase === 'transmit' && this.bits === 8) {
      this.pulls = false;
      this.phase = 'acknowledged?';
    } else if (this.phase === 'acknowledged?' && this.bits === 9) {
      this.current.bytes.push(this.byte >> 1);
      const acknowledged = (this.byte & 1) === 0;
      this.target.readAcknowledged(acknowledged);
      this.#expect('transmit');
    }
    if (this.phase === 'transmit') this.pulls = this.answer !== null && !((this.answer >> (7 - this.bits)) & 1);
    if (this.current) this.current.end_ns = t_ns;
  }

  #expect(phase) {
    this.phase = phase;
    this.bits = 0;
    this.byte = 0;
    if (phase === 'transmit') this.answer = this.target.read();
  }

  #received() {
    const { current } = this;
    current.sent(this.byte >> 1, (this.byte & 1) === 0, this.statistics);
    this.#expect(current.read ? 'transmit' : 'receive');
  }

  /** `controllerPulls`: the controller wants SDA low. */
  sclRose(t_ns, controllerPulls) {
    this.sclHigh = true;
    this.sclRose_ns = t_ns;
    if (this.phase === 'idle') return;
    this.check.atLeast(SU_DAT, t_ns - this.rise_ns.scl - this.sdaChanged_ns);
    if (this.sdaChanged_ns > this.sclFell_ns) {
      const stretched_ns = Math.max(0, t_ns - this.rise_ns.scl - this.sclFell_ns - LIMITS_NS[LOW]);
      this.check.atMost(VD_DAT, this.sdaChanged_ns - this.sclFell_ns - stretched_ns);
    }
    this.byte = (this.byte << 1) | (this.sdaHigh ? 1 : 0);
    this.bits += 1;
    const targets = this.phase === 'acknowledge' || (this.phase === 'transmit' && this.answer !== null);
    if (targets && controllerPulls && !this.check.excused)
      this.report.warn('i2c', `${this.name}: the controller pulls SDA in a bit that is the sensor's`);
  }

  sdaFell(t_ns, controllerPulls) {
    this.sdaHigh = false;
    this.sdaChanged_ns = t_ns;
    if (!this.sclHigh) return;
    if (this.phase === 'idle') {
      this.check.atLeast(BUF, t_ns - this.stopped_ns); // still excused where a fault's end made the STOP
      if (controllerPulls && !this.faults) this.check.excused = false;
    } else {
      this.#mustBeBetweenBytes('START');
      this.check.atLeast(SU_STA, t_ns - this.sclRose_ns);
    }
    this.#finish(t_ns);
    this.started_ns = t_ns;
    this.phase = 'start';
    this.pulls = false;
    this.current = new Transfer(t_ns, this.name);
    this.target.start();
  }

  sdaRose(t_ns) {
    this.sdaHigh = true;
    this.sdaChanged_ns = t_ns;
    if (!this.sclHigh) return;
    this.check.atLeast(SU_STO, t_ns - this.rise_ns.sda - this.sclRose_ns);
    if (this.phase !== 'idle') this.#mustBeBetweenBytes('STOP');
    this.#finish(t_ns);
    this.stopped_ns = t_ns;
    this.phase = 'idle';
    this.pulls = false;
    this.target.stop();
  }

  #mustBeBetweenBytes(what) {
    const between = (this.phase === 'receive' || this.phase === 'transmit') && this.bits === 1;
    if (!between && !this.check.excused)
      this.report.warn('i2c', `${this.name}: ${what} in the middle of a byte (SDA changed while SCL was high)`);
  }

  #finish(t_ns) {
    const { current } = this;
    this.current = null;
    if (!current || current.address < 0) return;
    this.statistics.transactions += 1;
    current.end_ns = t_ns;
    this.onTransfer(current);
  }
}
