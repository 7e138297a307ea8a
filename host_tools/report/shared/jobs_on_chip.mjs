/** Images that take jobs from a debugger, on the emulated chip: the other half of fit/on_chip/main.c and rate/sensors/main.c. */
import { Chip, Stopped } from '../../simulation/emulator/chip/chip.mjs';
import { SimulatedTime } from '../../simulation/emulator/clock.mjs';
import { Report } from '../../simulation/emulator/report.mjs';

const [NEXT_JOB, START, STOP] = [1, 2, 3];
const RAM = 0x20000000;

export class JobBench {
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
      else if (code === STOP) this.cycles.push(chip.core.cycles - started);
      else if (code === NEXT_JOB) throw new Stopped('next job');
      else breakpoint(code);
    };
    this.runJob();
  }

  /** `job` of the image. */
  get job() {
    const { sram, core } = this.chip;
    return new DataView(sram.buffer, sram.byteOffset + core.registers[0] - RAM);
  }

  /** @returns the cycles of each part that the job counts */
  runJob() {
    this.cycles = [];
    try {
      this.chip.runUntil(this.time.nanos + 60e9);
    } catch (error) {
      if (!(error instanceof Stopped)) throw error;
      if (error.reason === 'next job') return this.cycles;
      throw new Error(`the image stopped: ${error.reason}; ${this.report.list.map((e) => Report.line(e)).join('; ')}`);
    }
    throw new Error('a job takes longer than a minute');
  }
}
