/**
 * Board pico_mux: I2C0 on GPIO4 (SDA) and GPIO5 (SCL); TCA9548A at 0x70, 0x71, 0x72 with active-low RESET on
 * GPIO6, 7, 8 (pulled up on the board); five MS5840 on channels 0..4 of each. Sensor k sits on channel k % 5 of
 * multiplexer floor(k / 5).
 */
import { GPIOPinState } from 'rp2040js';
import { Prng } from '../prng.mjs';
import { I2cBus } from './i2c_bus.mjs';
import { I2cWaveform, WAVEFORM_SCL, WAVEFORM_SDA } from './i2c_waveform.mjs';
import { Ms5840 } from './ms5840.mjs';
import { Tca9548a } from './tca9548a.mjs';

const SDA = 4;
const SCL = 5;
const RESETS = [6, 7, 8];
const FIRST_ADDRESS = 0x70;
const SENSORS_PER_MUX = 5;
const FUNCTION_I2C = 3;
/** SCL rise time assumed for 400 kHz with the board's pull-ups; not a measurement. */
const RISE_NS = 100;

export class PicoMux {
  static sensors = 15;
  static muxes = 3;
  static lines = false;
  static clkSys_Hz = 125e6;

  static probes = [['SDA', WAVEFORM_SDA], ['SCL', WAVEFORM_SCL]];

  /**
   * @param options scope, report, seed, stimulus(index, t_ns), faults() -> Faults, onTransfer; sensor: see findSensor; rise_ns: of SCL;
   *   onLevels(levels, t_ns): the lines changed, bits as in `probes`
   */
  constructor({ scope, report, seed, stimulus, faults, onTransfer, onLevels, sensor, rise_ns = RISE_NS }) {
    const now_ns = () => scope.nanos;
    this.report = report;
    this.bus = new I2cBus({ now_ns, rise_ns, report, onTransfer });
    if (onLevels) this.bus.waveform = new I2cWaveform(onLevels);
    this.sensors = [];
    this.muxes = RESETS.map((_, m) => {
      const mux = new Tca9548a(FIRST_ADDRESS + m, m);
      for (let channel = 0; channel < SENSORS_PER_MUX; channel++) {
        const index = m * SENSORS_PER_MUX + channel;
        const prng = new Prng(Math.imul(seed, 1000003) + index);
        const part = new Ms5840({ index, prng, now_ns, report, stimulus, sensor, faults: (i) => faults().sensor(i) });
        part.onFast = () => {
          this.bus.wasFast = true;
        };
        this.sensors.push(part);
        mux.connect(channel, part);
      }
      mux.onReset = () => {
        mux.stuck = false;
        for (const s of mux.channels.flat()) s.release();
        this.bus.linesChanged();
      };
      return mux;
    });
    this.bus.targets = this.muxes;
    this.bus.muxState = () => this.muxes.map((m) => m.control.toString(16).padStart(2, '0')).join(':');
  }

  get statistics() {
    return this.bus.statistics;
  }

  /** Actions for `Faults`. */
  get faultActions() {
    return {
      sda_stuck_low: (sensor, active) => {
        if (active) this.sensors[sensor].hold();
        else this.sensors[sensor].release();
        this.bus.linesChanged();
      },
      line_stuck_low: (sensor, active) => {
        this.sensors[sensor].tied = active;
        this.bus.linesChanged();
      },
      mux_stuck: (mux, active) => {
        this.muxes[mux].stuck = active;
      },
      mux_dead: (mux, active) => {
        this.muxes[mux].dead = active;
        this.bus.linesChanged();
      },
    };
  }

  attachChip(chip) {
    const { bus } = this;
    chip.i2c[0].bus = bus;
    const [sda, scl] = [chip.gpio[SDA], chip.gpio[SCL]];
    bus.gpio = { sda: false, scl: false };
    bus.onReleased = null;
    bus.problem = () => {
      for (const [pin, name] of [[sda, `GPIO${SDA} (SDA)`], [scl, `GPIO${SCL} (SCL)`]]) {
        if (pin.functionSelect !== FUNCTION_I2C) return `${name} has function ${pin.functionSelect}, not I2C (3)`;
        if (!pin.inputEnable) return `${name} has its input disabled`;
        if (pin.outputDisable) return `${name} has its output disabled`;
        if (!pin.pullupEnabled || pin.pulldownEnabled) return `${name} has no pull-up, or a pull-down; set PUE and clear PDE`;
      }
      return null;
    };
    bus.onLines = () => {
      const [sdaHigh, sclHigh] = [!bus.sdaLow, !bus.sclLow];
      if (sda.rawInputValue !== sdaHigh) sda.setInputValue(sdaHigh);
      if (scl.rawInputValue !== sclHigh) scl.setInputValue(sclHigh);
    };
    const onPin = () => {
      for (const pin of [sda, scl]) {
        if (pin.value === GPIOPinState.High) chip.fail('i2c', `GPIO${pin.index} drives the bus high; a bus line may only be pulled low or released`);
      }
      bus.drive(sda.value === GPIOPinState.Low, scl.value === GPIOPinState.Low);
    };
    sda.addListener(onPin);
    scl.addListener(onPin);
    RESETS.forEach((gpio, m) => {
      const pin = chip.gpio[gpio];
      const apply = () => {
        const low = pin.value === GPIOPinState.Low;
        this.muxes[m].setReset(low);
        pin.setInputValue(!low);
      };
      pin.addListener(apply);
      apply();
    });
    bus.drive(false, false);
  }
}
