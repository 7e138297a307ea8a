/**
 * A board with a data line for each sensor: the SDA of sensor k is GPIO k, SCL is common; a pull-up on every line.
 * Lines are wired-AND; in bitmaps bit k is GPIO k.
 *
 * A line falls at once, and is high when it has risen to 0.7 VDD, which takes 1.42 times its rise time from 0.3 to
 * 0.7 VDD. A sensor changes SDA a while after the fall of SCL. Every line is checked against the times of UM10204's
 * fast mode. Of changes at one moment, SCL comes first where it falls and last where it rises.
 */
import { I2cTarget } from './i2c_bus.mjs';
import { HIGH, I2cLine, LOW, PERIOD, TimingCheck } from './i2c_line.mjs';
import { makeSensors } from './ms5840.mjs';

/** Time from release to 0.7 VDD over the time from 0.3 to 0.7 VDD, of a line that charges through a resistor. */
const RELEASE_TO_HIGH = Math.log(0.3) / Math.log(0.3 / 0.7);
/** From the fall of SCL to a sensor's change of SDA: assumed; UM10204 asks for 300 ns internal hold, 900 ns to valid. */
const SENSOR_SDA_NS = 350;
/** A clock that was high for this time begins again after a fault of SCL. */
const QUIET_NS = 3000;
/** Where in a clock's high time a glitch falls. */
const GLITCH_AT_NS = 200;

export class ParallelBoard {
  static facts({ wiring }) {
    return {
      sensors: wiring.sensor_count,
      muxes: 0,
      lines: true,
      probes: [...Array.from({ length: wiring.sensor_count }, (_, k) => [`SDA${k}`, 1 << k]), ['SCL', 1 << wiring.pin_scl]],
    };
  }

  /**
   * @param descriptor board.json
   * @param options scope, report, seed, stimulus(index, t_ns), faults() -> Faults, onTransfer; rise_ns: of every line;
   *   onLevels(levels, t_ns): lines changed, bits as in `probes`
   */
  constructor({ wiring, rise_ns: usual }, options) {
    const { scope, report, onTransfer, onLevels = () => {}, rise_ns: rise } = options;
    const rise_ns = rise === undefined ? usual : { sda: rise, scl: rise };
    /** Bitmaps of lines. */
    this.scl = 1 << wiring.pin_scl;
    this.sda = (1 << wiring.sensor_count) - 1;
    this.all = this.scl | this.sda;
    this.scope = scope;
    this.onLevels = onLevels;
    this.statistics = { transactions: 0, nacks: 0 };
    this.sclCheck = new TimingCheck(report, 'SCL');
    this.sensors = makeSensors(wiring.sensor_count, options);
    this.lines = this.sensors.map(
      (target, k) => new I2cLine({ name: `SDA${k}`, target, rise_ns, report, statistics: this.statistics, onTransfer }),
    );
    this.absent = new I2cTarget(-1);
    this.rise_ns = rise_ns;
    /** Who pulls down; what a fault ties to VDD wins. */
    this.low = { chip: 0, sensors: 0, fault: 0 };
    this.tied = 0;
    this.levels = this.all;
    /** Released lines that are not high yet, and since when. */
    this.rising = 0;
    this.released_ns = new Float64Array(32);
    this.riseAlarms = [
      [this.sda, rise_ns.sda],
      [this.scl, rise_ns.scl],
    ].map(([mask, rise]) => this.#riser(mask, rise * RELEASE_TO_HIGH));
    this.sensorsAlarm = scope.createAlarm(() => this.#sensorsPull());
    this.glitches = 0;
    this.glitchAlarm = scope.createAlarm(() => this.#glitch());
    this.sclFaults = 0;
    this.sclFell_ns = -Infinity;
    this.sclRose_ns = -Infinity;
  }

  /** The shortest times (tVD_DAT: longest) of all lines, by name as in TimingCheck. */
  get times_ns() {
    const times = { ...this.sclCheck.extremes };
    for (const { check } of this.lines) {
      for (const [name, value] of Object.entries(check.extremes)) {
        const other = times[name] ?? value;
        times[name] = name === 'tVD_DAT' ? Math.max(other, value) : Math.min(other, value);
      }
    }
    return times;
  }

  /** Actions for `Faults`. */
  get faultActions() {
    const onLine = (action) => (k, active) => {
      if (active) this.lines[k].fault(true);
      action(1 << k, active, k);
      this.#resolve();
      if (!active) this.lines[k].fault(false); // where the line falls only now, that is no START of the controller's
    };
    const onScl = (action) => (_, active) => {
      this.sclFaults += active ? 1 : -1;
      if (active) this.sclCheck.excused = true;
      else this.sclRose_ns = this.scope.nanos; // it may end within a clock: only a pause from here on is one
      for (const line of this.lines) line.fault(active);
      action(this.scl, active);
      this.#resolve();
    };
    const tieLow = (mask, active) => {
      this.low.fault = active ? this.low.fault | mask : this.low.fault & ~mask;
    };
    const tieHigh = (mask, active) => {
      this.tied = active ? this.tied | mask : this.tied & ~mask;
    };
    return {
      sda_stuck_low: onLine((_, active, k) => {
        this.sensors[k].hold(active);
        this.#sensorsPull();
      }),
      line_stuck_low: onLine(tieLow),
      line_stuck_high: onLine(tieHigh),
      scl_stuck_low: onScl(tieLow),
      scl_stuck_high: onScl(tieHigh),
      sensor_missing: onLine((_, active, k) => {
        if (!active) this.sensors[k].powerUp();
        this.lines[k].connect(active ? this.absent : this.sensors[k]);
        this.#sensorsPull();
      }),
      clock_glitch: (k, active) => {
        this.glitches = active ? this.glitches | (1 << k) : this.glitches & ~(1 << k);
      },
    };
  }

  attachChip(chip) {
    const drive = (low, high) => {
      const pins = high & this.all;
      if (pins)
        chip.fail('i2c', `GPIO${31 - Math.clz32(pins & -pins)} drives a bus line high; a bus line may only be pulled low or released`);
      this.low.chip = low & this.all;
      this.#resolve();
    };
    if (this.chip) this.#letGo();
    this.chip = chip;
    chip.pins.onDriven = drive;
    chip.pins.setLevels(this.all, this.levels);
    drive(chip.pins.low, chip.pins.high);
  }

  /** The chip was reset, in the middle of a byte perhaps. */
  #letGo() {
    this.sclCheck.excused = true;
    for (const line of this.lines) {
      line.fault(true);
      line.fault(false);
    }
  }

  #riser(mask, delay_ns) {
    const alarm = this.scope.createAlarm(() => {
      const now = this.scope.nanos;
      let risen = 0;
      let next = Infinity;
      for (let rest = this.rising & mask; rest; rest &= rest - 1) {
        const bit = rest & -rest;
        const due = this.released_ns[31 - Math.clz32(bit)] + delay_ns;
        if (due <= now) risen |= bit;
        else if (due < next) next = due;
      }
      if (next !== Infinity) alarm.scheduleAt(next);
      this.rising &= ~risen;
      if (risen) this.#become(this.levels | risen);
    });
    return { mask, delay_ns, alarm };
  }

  /** Somebody pulls, or lets go. */
  #resolve() {
    const low = (this.low.chip | this.low.sensors | this.low.fault) & ~this.tied;
    const released = ~low & ~this.levels & ~this.rising & this.all;
    this.rising = (this.rising & ~low) | released;
    if (released) {
      const now = this.scope.nanos;
      for (let rest = released; rest; rest &= rest - 1) this.released_ns[31 - Math.clz32(rest & -rest)] = now;
      for (const { mask, delay_ns, alarm } of this.riseAlarms) if (released & mask && !alarm.scheduled) alarm.scheduleAt(now + delay_ns);
    }
    if (this.levels & low) this.#become(this.levels & ~low);
  }

  #become(levels) {
    const now = this.scope.nanos;
    const was = this.levels;
    this.levels = levels;
    this.chip?.pins.setLevels(this.all, levels);
    this.onLevels(levels, now);
    const sclFalls = (was & ~levels & this.scl) !== 0;
    const sclRises = (~was & levels & this.scl) !== 0;
    if (sclFalls) this.#sclFell(now);
    for (let rest = (was ^ levels) & this.sda; rest; rest &= rest - 1) {
      const bit = rest & -rest;
      const line = this.lines[31 - Math.clz32(bit)];
      if (levels & bit) line.sdaRose(now);
      else line.sdaFell(now, (this.low.chip & bit) !== 0);
    }
    if (sclRises) this.#sclRose(now);
    else if (levels & this.scl && (was ^ levels) & this.sda) this.#sensorsWill(now);
  }

  #sclFell(now) {
    if (!this.sclFaults && now - this.sclRose_ns > QUIET_NS) this.sclCheck.excused = false;
    this.sclCheck.atLeast(HIGH, now - this.sclRose_ns);
    this.sclCheck.atLeast(PERIOD, now - this.sclFell_ns);
    this.sclFell_ns = now;
    for (const line of this.lines) line.sclFell(now);
    this.#sensorsWill(now);
  }

  #sclRose(now) {
    this.sclCheck.atLeast(LOW, now - this.rise_ns.scl - this.sclFell_ns);
    this.sclRose_ns = now;
    const { chip } = this.low;
    for (let k = 0; k < this.lines.length; k++) this.lines[k].sclRose(now, ((chip >>> k) & 1) === 1);
    if (this.glitches) this.glitchAlarm.scheduleAt(now + GLITCH_AT_NS);
  }

  get #wanted() {
    let pulled = 0;
    for (let k = 0; k < this.lines.length; k++) if (this.lines[k].pulls || this.lines[k].target.holdsSda) pulled |= 1 << k;
    return pulled;
  }

  #sensorsWill(now) {
    if (this.#wanted !== this.low.sensors) this.sensorsAlarm.scheduleAt(now + SENSOR_SDA_NS);
  }

  #sensorsPull() {
    this.low.sensors = this.#wanted;
    this.#resolve();
  }

  /** Sensors that are being talked to see one clock more than there is. */
  #glitch() {
    if (!(this.levels & this.scl)) return;
    const now = this.scope.nanos;
    for (let k = 0; k < this.lines.length; k++) {
      const line = this.lines[k];
      if (!((this.glitches >>> k) & 1) || line.phase === 'idle') continue;
      this.glitches &= ~(1 << k);
      line.fault(true);
      line.sclFell(now);
      line.sclRose(now, ((this.low.chip >>> k) & 1) === 1);
      line.fault(false);
    }
    this.#sensorsWill(now);
  }
}
