#!/usr/bin/env node
/**
 * usage: bench.mjs fit_cycles.bin fit_jobs.json fit_cycles.csv MILLIONS: counts the cycles of fits on the emulated chip, of every kernel and
 * variant of fit_jobs.json (errors.py) that the image knows, from the call to its return; no interrupt runs meanwhile. Of each as many presses
 * as MILLIONS of cycles allow, at least two, spread evenly. As a check that they were spent on fits, p50_um is the median distance of the location
 * from the reference optimum over the observable ones.
 */
import { readFileSync, writeFileSync } from 'node:fs';
import { Bench, KERNELS } from './fit_on_chip.mjs';

const median = (values) => (values.length ? [...values].sort((a, b) => a - b)[values.length >> 1] : NaN);

const [image, jobs, out, millions] = process.argv.slice(2);
const { variants, presses } = JSON.parse(readFileSync(jobs, 'utf8'));
const bench = new Bench(readFileSync(image));
const rows = ['kernel,variant,presses,cycles_min,cycles_median,cycles_max,p50_um'];
for (const variant of variants.filter(({ kernel }) => KERNELS.includes(kernel))) {
  const list = presses[variant.mask];
  const fit = (press) => {
    const { cycles, x_mm, y_mm } = bench.run({ ...variant, ...press });
    return { cycles, um: press.observable ? 1e3 * Math.hypot(x_mm - press.best_x_mm, y_mm - press.best_y_mm) : NaN };
  };
  const fits = [fit(list[0])];
  const count = Math.min(list.length, Math.max(2, Math.floor((1e6 * Number(millions)) / fits[0].cycles)));
  for (let i = 1; i < count; i++) fits.push(fit(list[Math.floor((i * list.length) / count)]));
  const cycles = fits.map((one) => one.cycles);
  const um = median(fits.map((one) => one.um).filter((value) => !Number.isNaN(value)));
  rows.push([variant.kernel, variant.variant, count, Math.min(...cycles), median(cycles), Math.max(...cycles), um.toPrecision(3)].join());
}
writeFileSync(out, `${rows.join('\n')}\n`);
