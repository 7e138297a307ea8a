#!/usr/bin/env node
/** Counts the cycles of fits on the emulated chip: see USAGE. */
import { readFileSync, writeFileSync } from 'node:fs';
import { parseArgs } from 'node:util';
import { Chip, Stopped } from '../../emulator/chip/chip.mjs';
import { SimulatedTime } from '../../emulator/clock.mjs';
import { InputError } from '../../emulator/errors.mjs';
import { Report } from '../../emulator/report.mjs';

const USAGE = `usage: bench.mjs --image fit_cycles.bin --jobs fit_jobs.json --out fit_cycles.csv [options]

Fits the presses of fit_jobs.json (written by fit_report --jobs) on the emulated chip with every kernel and variant
that the image knows and counts processor cycles, from the call to its return, corrected as the emulator's core
describes. No interrupt runs meanwhile.

  --budget N   million cycles to spend on one row, at least 2 presses; default 25
  --kernel K   this kernel only

Columns: kernel, variant, presses, cycles (min, median, max), and as a check that they were spent on fits the median
distance of the location from the reference optimum over the observable presses of the row, in um.
Exit: 0 done; 1 the image failed; 2 wrong usage or input.`;

/** In the order of `kernels` in main.c. */
const KERNELS = ['nothing', 'fit', 'grid', 'general', 'naive_float', 'naive_double', 'lm_float', 'lm_double'];
const [NEXT_JOB, START, STOP] = [1, 2, 3];
/** Words of `job` in main.c. */
const FIELDS = { kernel: 0, iterations: 1, n_largest: 2, guess: 3, noise_Pa_q10: 4, prior_sigma_mm: 5, prior_width_mm: 6, usable: 7, readings: 8, x_mm: 40, y_mm: 41 };
const GUESSES = ['log_linear', 'maximum', 'centroid'];

class Bench {
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
      if (error.reason !== 'next job') throw new Error(`the image stopped: ${error.reason}; ${this.report.list.map((e) => Report.line(e)).join('; ')}`);
      return;
    }
    throw new Error('a fit takes longer than a minute');
  }

  /** @returns {{cycles, x_mm, y_mm}} of one fit */
  run({ kernel, iterations = 0, n_largest = 0, guess = 'log_linear', noise_Pa_q10 = 1, prior_sigma_mm = 0, prior_width_mm = 0, usable = 0, readings = [] }) {
    const { chip } = this;
    const at = chip.core.registers[0] - 0x20000000;
    const view = new DataView(chip.sram.buffer, chip.sram.byteOffset + at);
    const put = (field, value) => view.setInt32(4 * field, value, true);
    put(FIELDS.kernel, KERNELS.indexOf(kernel));
    put(FIELDS.iterations, iterations);
    put(FIELDS.n_largest, n_largest);
    put(FIELDS.guess, GUESSES.indexOf(guess));
    put(FIELDS.noise_Pa_q10, noise_Pa_q10);
    view.setFloat32(4 * FIELDS.prior_sigma_mm, prior_sigma_mm, true);
    view.setFloat32(4 * FIELDS.prior_width_mm, prior_width_mm, true);
    put(FIELDS.usable, usable);
    readings.forEach((value, k) => put(FIELDS.readings + k, value));
    this.#untilNextJob();
    return { cycles: this.cycles - (this.overhead ?? 0), x_mm: view.getFloat32(4 * FIELDS.x_mm, true), y_mm: view.getFloat32(4 * FIELDS.y_mm, true) };
  }
}

const median = (values) => (values.length ? [...values].sort((a, b) => a - b)[values.length >> 1] : NaN);

/** @returns {{cycles, error_um}} lists over as many of the presses as the budget allows, spread evenly */
function measure(bench, variant, presses, budget) {
  const cycles = [];
  const error_um = [];
  const fit = (press) => {
    const result = bench.run({ ...variant, ...press });
    cycles.push(result.cycles);
    if (press.observable) error_um.push(1e3 * Math.hypot(result.x_mm - press.best_x_mm, result.y_mm - press.best_y_mm));
  };
  fit(presses[0]);
  const count = Math.min(presses.length, Math.max(2, Math.floor(budget / cycles[0])));
  for (let i = 1; i < count; i++) fit(presses[Math.floor((i * presses.length) / count)]);
  return { cycles, error_um };
}

function main(argv) {
  let options;
  try {
    const text = (other) => ({ type: 'string', default: other });
    ({ values: options } = parseArgs({ args: argv, options: { image: text(), jobs: text(), out: text(), budget: text('25'), kernel: text(), help: { type: 'boolean' } }, strict: true }));
  } catch (error) {
    throw new InputError(`${error.message.split('\n')[0]}; see --help`);
  }
  if (options.help) return void process.stdout.write(`${USAGE}\n`);
  for (const name of ['image', 'jobs', 'out']) if (!options[name]) throw new InputError(`--${name} is missing; see --help`);
  const budget = 1e6 * Number(options.budget);
  if (!(budget > 0)) throw new InputError(`--budget "${options.budget}" is not a positive number`);
  const read = (file, how) => {
    try {
      return readFileSync(file, how);
    } catch (error) {
      throw new InputError(`${file}: cannot read (${error.code}); build the image, and run fit_report --jobs first`);
    }
  };
  const { variants, presses } = JSON.parse(read(options.jobs, 'utf8'));
  const bench = new Bench(read(options.image));
  const rows = ['kernel,variant,presses,cycles_min,cycles_median,cycles_max,p50_um'];
  for (const variant of variants) {
    if (!KERNELS.includes(variant.kernel) || (options.kernel && variant.kernel !== options.kernel)) continue;
    const { cycles, error_um } = measure(bench, variant, presses[variant.mask], budget);
    const row = [variant.kernel, variant.variant, cycles.length, Math.min(...cycles), median(cycles), Math.max(...cycles), median(error_um).toPrecision(3)];
    rows.push(row.join(','));
    process.stdout.write(`${row[0].padEnd(13)} ${row[1].padEnd(18)} ${String(row[2]).padStart(4)} fits, cycles ${row[3]} ${row[4]} ${row[5]}, ${row[6]} um\n`);
  }
  try {
    writeFileSync(options.out, `${rows.join('\n')}\n`);
  } catch (error) {
    throw new InputError(`${options.out}: cannot write (${error.code}); check the folder`);
  }
}

try {
  main(process.argv.slice(2));
} catch (error) {
  process.stderr.write(`bench.mjs: ${error.message}\n`);
  process.exitCode = error instanceof InputError ? 2 : 1;
}
