#!/usr/bin/env node
/** usage: cycles.mjs fit_cycles.bin: cycles of the fit, and of the tangential estimate after it: median, median and most of 100 presses. */
import { readFileSync } from 'node:fs';
import { Prng } from '../../simulation/emulator/prng.mjs';
import { Bench } from '../fit/on_chip/fit_on_chip.mjs';

const PRESSES = 100;
const [PITCH_mm, SENSORS, SEED] = [9, 15, 20221015];
const bench = new Bench(readFileSync(process.argv[2]));
const random = new Prng(SEED);
const between = (low, high) => random.range(low, high);

/** Round, with a field as of a pull, which need not be a layer's: the cost does not depend on it. */
function press() {
  const [x_mm, y_mm, sigma_mm, p0_Pa, tilt] = [
    between(-9, 9),
    between(-18, 18),
    between(5.5, 7),
    10 ** between(3, 4.7),
    between(-0.4, 0.4),
  ];
  return Array.from({ length: SENSORS }, (_, k) => {
    const dx = PITCH_mm * (Math.floor(k / 5) - 1) - x_mm;
    const dy = PITCH_mm * ((k % 5) - 2) - y_mm;
    return Math.round(
      1024 * (p0_Pa * Math.exp(-(dx * dx + dy * dy) / (2 * sigma_mm * sigma_mm)) * (1 + (tilt * dx) / 12) + 4 * between(-1, 1)),
    );
  });
}

const counts = { fit: [], tangential: [] };
for (let i = 0; i < PRESSES; i++) {
  const readings = press();
  for (const kernel of Object.keys(counts)) {
    counts[kernel].push(bench.run({ kernel, iterations: 4, noise_Pa_q10: 4096, usable: 2 ** SENSORS - 1, readings }).cycles);
  }
}
const median = (values) => [...values].sort((a, b) => a - b)[values.length >> 1];
process.stdout.write(`${median(counts.fit)} ${median(counts.tangential)} ${Math.max(...counts.tangential)}\n`);
