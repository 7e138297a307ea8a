#!/usr/bin/env node
/** usage: cycles.mjs fit_cycles.bin: cycles of the fit, and of the tangential estimate after it: median, median and most of 100 presses. */
import { readFileSync } from 'node:fs';
import { Bench, pressMaker } from '../fit/on_chip/fit_on_chip.mjs';

const PRESSES = 100;
const bench = new Bench(readFileSync(process.argv[2]));
const press = pressMaker(3, true);
const counts = { fit: [], tangential: [] };
for (let i = 0; i < PRESSES; i++) {
  const readings = press();
  for (const kernel of Object.keys(counts)) counts[kernel].push(bench.usual(kernel, readings));
}
const median = (values) => [...values].sort((a, b) => a - b)[values.length >> 1];
process.stdout.write(`${median(counts.fit)} ${median(counts.tangential)} ${Math.max(...counts.tangential)}\n`);
