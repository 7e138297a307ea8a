/** Runs fits on the emulated chip one at a time and counts their cycles: the other half of main.c. */
import { Chip, Stopped } from '../../../simulation/emulator/chip/chip.mjs';
import { SimulatedTime } from '../../../simulation/emulator/clock.mjs';
import { Prng } from '../../../simulation/emulator/prng.mjs';
import { Report } from '../../../simulation/emulator/report.mjs';

/** In the order of `kernels` in main.c. */
export const KERNELS =
  'nothing fit grid masked general naive_float naive_double lm_float lm_double tangential step_bias gains_of_touch shapes'.split(' ');
/** Words of `job` in main.c. */
const FIELDS = { kernel: 0, iterations: 1, noise_Pa_q10: 2, usable: 3, own: 4, readings: 5, x_mm: 37, y_mm: 38 };
const [PITCH_mm, SENSORS, SEED] = [9, 15, 20221015];
const [NEXT_JOB, START, STOP] = [1, 2, 3];
const RAM = 0x20000000;

/** One chip that runs fit_cycles.bin. */
export class Bench {
  constructor(image) {
    this.time = new SimulatedTime();
    this.report = new Report(() => this.time.nanos);
    this.chip = new Chip(this.time, this.report, { serial: new Uint8Array(8) });
    this.chip.load(image);
    this.chip.boot();
    const { chip } = this;
    const breakpoint = chip.onBreak;
    let started;
    chip.onBreak = (code) => {
      if (code === START) started = chip.core.cycles;
      else if (code === STOP) this.calls.push(chip.core.cycles - started);
      else if (code === NEXT_JOB) throw new Stopped('next job');
      else breakpoint(code);
    };
    this.runJob();
    this.overhead = 0;
    this.overhead = this.run({ kernel: 'nothing' }).cycles;
  }

  /** `job` of the image. */
  get job() {
    const { sram, core } = this.chip;
    return new DataView(sram.buffer, sram.byteOffset + core.registers[0] - RAM);
  }

  runJob() {
    this.calls = [];
    try {
      this.chip.runUntil(this.time.nanos + 60e9);
    } catch (error) {
      if (!(error instanceof Stopped)) throw error;
      if (error.reason === 'next job') return;
      throw new Error(`the image stopped: ${error.reason}; ${this.report.list.map((e) => Report.line(e)).join('; ')}`);
    }
    throw new Error('a job takes longer than a minute');
  }

  /** @returns {{calls, cycles, x_mm, y_mm}} of one fit: the cycles of each of its calls, and of the last */
  run({ kernel, iterations = 0, noise_Pa_q10 = 1, usable = 0, own = false, readings = [] }) {
    const { job } = this;
    const values = { kernel: KERNELS.indexOf(kernel), iterations, noise_Pa_q10, usable, own: own ? 1 : 0 };
    for (const [field, value] of Object.entries(values)) job.setInt32(4 * FIELDS[field], value, true);
    readings.forEach((value, k) => job.setInt32(4 * (FIELDS.readings + k), value, true));
    this.runJob();
    const calls = this.calls.map((cycles) => cycles - this.overhead);
    return {
      calls,
      cycles: calls.at(-1),
      x_mm: job.getFloat32(4 * FIELDS.x_mm, true),
      y_mm: job.getFloat32(4 * FIELDS.y_mm, true),
    };
  }

  /** As `run`, of a kernel as the firmware uses it, of a press on every sensor. */
  usual(kernel, readings) {
    return this.run({ kernel, iterations: 4, noise_Pa_q10: 4096, usable: 2 ** SENSORS - 1, own: true, readings });
  }
}

/**
 * Makes readings of round contacts, of 10^decade Pa to 50 kPa. pulled: with a field as of a pull, which need not be a layer's: the cost does not
 * depend on it.
 */
export function pressMaker(decade, pulled = false) {
  const random = new Prng(SEED);
  const between = (low, high) => random.range(low, high);
  return () => {
    const [x_mm, y_mm, sigma_mm, p0_Pa] = [between(-9, 9), between(-18, 18), between(5.5, 7), 10 ** between(decade, 4.7)];
    const tilt = pulled ? between(-0.4, 0.4) : 0;
    return Array.from({ length: SENSORS }, (_, k) => {
      const dx = PITCH_mm * (Math.floor(k / 5) - 1) - x_mm;
      const dy = PITCH_mm * ((k % 5) - 2) - y_mm;
      const share = Math.exp(-(dx * dx + dy * dy) / (2 * sigma_mm * sigma_mm)) * (1 + (tilt * dx) / 12);
      return Math.round(1024 * (p0_Pa * share + 4 * between(-1, 1)));
    });
  };
}
