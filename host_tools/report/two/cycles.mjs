#!/usr/bin/env node
/**
 * usage: cycles.mjs fit_cycles.bin: the most cycles that fit_shapes takes, of presses and pairs, as JSON. In a frame the second core
 * estimates the load and does one part of fit_shapes, or begins it.
 */
import { readFileSync } from 'node:fs';
import { Prng } from '../../simulation/emulator/prng.mjs';
import { Bench } from '../fit/on_chip/fit_on_chip.mjs';

const PRESSES = 60;
const [PITCH_mm, SENSORS, SEED] = [9, 15, 20221015];
const bench = new Bench(readFileSync(process.argv[2]));
const random = new Prng(SEED);
const between = (low, high) => random.range(low, high);

function press() {
  const [x_mm, y_mm, sigma_mm, p0_Pa] = [between(-9, 9), between(-18, 18), between(5.5, 7), 10 ** between(3.5, 4.7)];
  return Array.from({ length: SENSORS }, (_, k) => {
    const dx = PITCH_mm * (Math.floor(k / 5) - 1) - x_mm;
    const dy = PITCH_mm * ((k % 5) - 2) - y_mm;
    return Math.round(1024 * (p0_Pa * Math.exp(-(dx * dx + dy * dy) / (2 * sigma_mm * sigma_mm)) + 4 * between(-1, 1)));
  });
}

const most = { tangential: 0, shapes_first_0: 0, shapes_first_1: 0, shapes_0: 0, shapes_1: 0, shapes_2: 0 };
for (let i = 0; i < PRESSES; i++) {
  const other = press();
  const readings = press().map((value, k) => value + (i % 2 ? other[k] : 0));
  for (const kernel of Object.keys(most)) {
    const { cycles } = bench.run({ kernel, iterations: 4, noise_Pa_q10: 4096, usable: 2 ** SENSORS - 1, own: true, readings });
    most[kernel] = Math.max(most[kernel], cycles);
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
