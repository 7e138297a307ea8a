#!/usr/bin/env node
/**
 * usage: cycles.mjs fit_cycles.bin: the most cycles that fit_shapes takes, of presses and pairs, as JSON. In a frame the second core
 * estimates the load and does one part of fit_shapes, or begins it.
 */
import { readFileSync } from 'node:fs';
import { Bench, pressMaker } from '../fit/on_chip/fit_on_chip.mjs';

const PRESSES = 60;
const bench = new Bench(readFileSync(process.argv[2]));
const press = pressMaker(3.5);
let load = 0;
let parts = [0, 0, 0, 0, 0]; // two of a contact's first frame, and three of a frame that answers
for (let i = 0; i < PRESSES; i++) {
  const other = press();
  const readings = press().map((value, k) => value + (i % 2 ? other[k] : 0));
  load = Math.max(load, bench.usual('tangential', readings).cycles);
  const { calls } = bench.usual('shapes', readings);
  parts = [...calls.slice(0, 2), ...calls.slice(-3)].map((cycles, part) => Math.max(cycles, parts[part]));
}
const cycles_part_max = Math.max(...parts);
process.stdout.write(
  JSON.stringify({
    cycles_load_max: load,
    cycles_part_max,
    cycles_all_parts_max: parts[2] + parts[3] + parts[4],
    cycles_core1_max: load + cycles_part_max,
  }) + '\n',
);
