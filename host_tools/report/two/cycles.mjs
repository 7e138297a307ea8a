#!/usr/bin/env node
/** usage: cycles.mjs fit_cycles.bin: the most cycles that a frame of fit_shapes takes, of presses and pairs, as JSON. */
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

const most = { shapes_first: 0, shapes: 0 };
for (let i = 0; i < PRESSES; i++) {
  const other = press();
  const readings = press().map((value, k) => value + (i % 2 ? other[k] : 0));
  for (const kernel of Object.keys(most)) {
    const { cycles } = bench.run({ kernel, iterations: 4, noise_Pa_q10: 4096, usable: 2 ** SENSORS - 1, readings });
    most[kernel] = Math.max(most[kernel], cycles);
  }
}
process.stdout.write(JSON.stringify({ cycles_first_frame_max: most.shapes_first, cycles_core1_max: Math.max(...Object.values(most)) }) + '\n');
