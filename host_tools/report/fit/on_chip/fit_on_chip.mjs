/** Runs fits on the emulated chip one at a time and counts their cycles: the other half of main.c. */
import { Chip, Stopped } from '../../../simulation/emulator/chip/chip.mjs';
import { SimulatedTime } from '../../../simulation/emulator/clock.mjs';
import { Report } from '../../../simulation/emulator/report.mjs';

/** In the order of `kernels` in main.c. */
export const KERNELS = (
  'nothing fit grid masked general naive_float naive_double lm_float lm_double tangential ' +
  'doubt_0 doubt_1 doubt_2 doubt_3 doubt_4 doubt_5 gains_of_touch shapes_first_0 shapes_first_1 shapes_0 shapes_1 shapes_2'
).split(' ');
const [NEXT_JOB, START, STOP] = [1, 2, 3];
/** Words of `job` in main.c. */
const FIELDS = { kernel: 0, iterations: 1, noise_Pa_q10: 2, usable: 3, own: 4, readings: 5, x_mm: 37, y_mm: 38 };

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
    this.started = null;
    this.cycles = null;
    this.next = null;
    chip.onBreak = (code) => {
      if (code === START) this.started = chip.core.cycles;
      else if (code === STOP) this.cycles = chip.core.cycles - this.started;
      else if (code === NEXT_JOB) throw new Stopped('next job');
      else breakpoint(code);
    };
    this.#untilNextJob();
    this.overhead = this.run({ kernel: 'nothing' }).cycles;
  }

  #untilNextJob() {
    try {
      this.chip.runUntil(this.time.nanos + 60e9);
    } catch (error) {
      if (!(error instanceof Stopped)) throw error;
      if (error.reason !== 'next job')
        throw new Error(`the image stopped: ${error.reason}; ${this.report.list.map((e) => Report.line(e)).join('; ')}`);
      return;
    }
    throw new Error('a fit takes longer than a minute');
  }

  /** @returns {{cycles, x_mm, y_mm}} of one fit */
  run({ kernel, iterations = 0, noise_Pa_q10 = 1, usable = 0, own = false, readings = [] }) {
    const { chip } = this;
    const at = chip.core.registers[0] - 0x20000000;
    const view = new DataView(chip.sram.buffer, chip.sram.byteOffset + at);
    const values = { kernel: KERNELS.indexOf(kernel), iterations, noise_Pa_q10, usable, own: own ? 1 : 0 };
    for (const [field, value] of Object.entries(values)) view.setInt32(4 * FIELDS[field], value, true);
    readings.forEach((value, k) => view.setInt32(4 * (FIELDS.readings + k), value, true));
    this.#untilNextJob();
    return {
      cycles: this.cycles - (this.overhead ?? 0),
      x_mm: view.getFloat32(4 * FIELDS.x_mm, true),
      y_mm: view.getFloat32(4 * FIELDS.y_mm, true),
    };
  }
}
