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
const most = { tangential: 0, shapes_first_0: 0, shapes_first_1: 0, shapes_0: 0, shapes_1: 0, shapes_2: 0 };
for (let i = 0; i < PRESSES; i++) {
  const other = press();
  const readings = press().map((value, k) => value + (i % 2 ? other[k] : 0));
  for (const kernel of Object.keys(most)) {
    most[kernel] = Math.max(most[kernel], bench.usual(kernel, readings, true));
  }
}
const { tangential, ...parts } = most;
const cycles_part_max = Math.max(...Object.values(parts));
process.stdout.write(
  JSON.stringify({
    cycles_load_max: tangential,
    cycles_part_max,
    cycles_all_parts_max: parts.shapes_0 + parts.shapes_1 + parts.shapes_2,
    cycles_core1_max: tangential + cycles_part_max,
  }) + '\n',
);
