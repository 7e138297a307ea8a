#!/usr/bin/env node
/** Counts the cycles of fits on the emulated chip: see USAGE. */
import { readFileSync, writeFileSync } from 'node:fs';
import { parseArgs } from 'node:util';
import { InputError } from '../../../simulation/emulator/errors.mjs';
import { Bench, KERNELS } from './fit_on_chip.mjs';

const USAGE = `usage: bench.mjs --image fit_cycles.bin --jobs fit_jobs.json --out fit_cycles.csv [options]

Fits the presses of fit_jobs.json (written by fit.py) on the emulated chip with every kernel and variant
that the image knows and counts processor cycles, from the call to its return, corrected as the emulator's core
describes. No interrupt runs meanwhile.

  --budget N   million cycles to spend on one row, at least 2 presses; default 25
  --kernel K   this kernel only

Columns: kernel, variant, presses, cycles (min, median, max), and as a check that they were spent on fits the median
distance of the location from the reference optimum over the observable presses of the row, in um.
Exit: 0 done; 1 the image failed; 2 wrong usage or input.`;

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
    ({ values: options } = parseArgs({
      args: argv,
      options: { image: text(), jobs: text(), out: text(), budget: text('25'), kernel: text(), help: { type: 'boolean' } },
      strict: true,
    }));
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
      throw new InputError(`${file}: cannot read (${error.code}); build the image, and run fit.py first`);
    }
  };
  const { variants, presses } = JSON.parse(read(options.jobs, 'utf8'));
  const bench = new Bench(read(options.image));
  const rows = ['kernel,variant,presses,cycles_min,cycles_median,cycles_max,p50_um'];
  for (const variant of variants) {
    if (!KERNELS.includes(variant.kernel) || (options.kernel && variant.kernel !== options.kernel)) continue;
    const { cycles, error_um } = measure(bench, variant, presses[variant.mask], budget);
    const row = [
      variant.kernel,
      variant.variant,
      cycles.length,
      Math.min(...cycles),
      median(cycles),
      Math.max(...cycles),
      median(error_um).toPrecision(3),
    ];
    rows.push(row.join(','));
    process.stdout.write(
      `${row[0].padEnd(13)} ${row[1].padEnd(18)} ${String(row[2]).padStart(4)} fits, cycles ${row[3]} ${row[4]} ${row[5]}, ${row[6]} um\n`,
    );
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
