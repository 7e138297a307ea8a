/**
 * A board of multiplexers: SDA and SCL of I2C0; for each strip of sensors a TCA9548A with active-low RESET (pulled up
 * on the board), its sensors on channels from 0 on.
 */
import { GPIOPinState } from 'rp2040js';
import { I2cBus } from './i2c_bus.mjs';
import { I2cWaveform, WAVEFORM_SCL, WAVEFORM_SDA } from './i2c_waveform.mjs';
import { makeSensors } from './ms5840.mjs';
import { Tca9548a } from './tca9548a.mjs';

const FUNCTION_I2C = 3;

export class MultiplexedBoard {
  static facts({ wiring }) {
    return {
      sensors: wiring.sensor_count,
      muxes: wiring.sensor_count / wiring.sensors_of_strip,
      lines: false,
      probes: [
        ['SDA', WAVEFORM_SDA],
        ['SCL', WAVEFORM_SCL],
      ],
    };
  }

  /**
   * @param descriptor board.json
   * @param options scope, report, seed, stimulus(index, t_ns), faults() -> Faults, onTransfer; sensor: see findSensor; rise_ns: of SCL;
   *   onLevels(levels, t_ns): the lines changed, bits as in `probes`
   */
  constructor(descriptor, options) {
    const { scope, report, onTransfer, onLevels, rise_ns = descriptor.rise_ns.scl } = options;
    this.wiring = descriptor.wiring;
    const { sensor_count, sensors_of_strip, mux_address_0 } = this.wiring;
    const now_ns = () => scope.nanos;
    this.report = report;
    this.bus = new I2cBus({ now_ns, rise_ns, report, onTransfer });
    if (onLevels) this.bus.waveform = new I2cWaveform(onLevels);
    this.sensors = makeSensors(sensor_count, options);
    for (const sensor of this.sensors) {
      sensor.onFast = () => {
        this.bus.wasFast = true;
      };
    }
    this.muxes = Array.from({ length: sensor_count / sensors_of_strip }, (_, m) => {
      const mux = new Tca9548a(Number(mux_address_0) + m, m);
      for (let channel = 0; channel < sensors_of_strip; channel++) mux.connect(channel, this.sensors[m * sensors_of_strip + channel]);
      mux.onReset = () => {
        mux.stuck = false;
        for (const s of mux.channels.flat()) s.hold(false);
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
        this.sensors[sensor].hold(active);
        this.bus.linesChanged();
      },
      line_stuck_low: (sensor, active) => {
        this.sensors[sensor].tied = active;
        this.bus.linesChanged();
      },
      mux_stuck: (mux, active) => {
        this.muxes[mux].stuck = active;
      },
    };
  }

  attachChip(chip) {
    const {
      bus,
      wiring: { pin_sda, pin_scl, pin_mux_reset_0 },
    } = this;
    chip.i2c[0].bus = bus;
    const [sda, scl] = [chip.gpio[pin_sda], chip.gpio[pin_scl]];
    bus.gpio = { sda: false, scl: false };
    bus.onReleased = null;
    bus.problem = () => {
      for (const [pin, name] of [
        [sda, `GPIO${pin_sda} (SDA)`],
        [scl, `GPIO${pin_scl} (SCL)`],
      ]) {
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
        if (pin.value === GPIOPinState.High)
          chip.fail('i2c', `GPIO${pin.index} drives the bus high; a bus line may only be pulled low or released`);
      }
      bus.drive(sda.value === GPIOPinState.Low, scl.value === GPIOPinState.Low);
    };
    sda.addListener(onPin);
    scl.addListener(onPin);
    this.muxes.forEach((mux, m) => {
      const pin = chip.gpio[pin_mux_reset_0 + m];
      const apply = () => {
        const low = pin.value === GPIOPinState.Low;
        mux.setReset(low);
        pin.setInputValue(!low);
      };
      pin.addListener(apply);
      apply();
    });
    bus.drive(false, false);
  }
}
