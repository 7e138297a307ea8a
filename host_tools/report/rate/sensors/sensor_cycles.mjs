#!/usr/bin/env node
/** Counts the cycles of a frame against the number of sensors: see USAGE. */
import { readFileSync } from 'node:fs';
import { InputError, inWords } from '../../../simulation/emulator/errors.mjs';
import { JobBench } from '../../shared/jobs_on_chip.mjs';

const USAGE = `usage: sensor_cycles.mjs FOLDER

Takes presses on arrays of 5 to 32 sensors through compensation, conditioning and fit, on the emulated chip, with the
images FOLDER/sensor_cycles_CxR.bin. Prints one JSON array: {sensors, layout, kernel, take, condition, fit, error_um}:
cycles of the slowest of the presses, and the largest distance of a location from the truth.

Exit: 0 done; 1 an image failed; 2 wrong usage or input.`;

/** Rectangles by their image. */
const GRIDS = [
  [3, 3],
  [3, 4],
  [3, 5],
  [4, 5],
  [5, 5],
  [5, 6],
];
/** Free layouts, all with the image of the first rectangle: a rectangle that the kernel is not compiled for, or the five of a die. */
const FREE = [null, [3, 4], [3, 5], [4, 5], [5, 5], [5, 6], [4, 8]];
const PITCH_MM = 9;
const SIGMA_MM = 5.7;
const P0_PA = 25000;
/** Places of the presses, in parts of the array. */
const PLACES = [
  [0.1, -0.2],
  [-0.35, 0.3],
  [0.45, 0.45],
];

const STAGES = ['take', 'condition', 'fit'];
/** Words of \`job\` in main.c. */
const AT = { sensor_count: 0, pitch_mm: 1, x_mm: 2, y_mm: 34, pressure: 66, fit_x_mm: 98, fit_y_mm: 99 };

function readImage(file) {
  try {
    return readFileSync(file);
  } catch (error) {
    throw new InputError(`${file}: cannot read (${inWords(error)}); build the images first`);
  }
}

function cyclesOf(bench, { x_mm, y_mm }, press) {
  const { job } = bench;
  job.setUint32(4 * AT.sensor_count, x_mm.length, true);
  job.setFloat32(4 * AT.pitch_mm, PITCH_MM, true);
  x_mm.forEach((x, k) => {
    const distance2 = (x - press.x_mm) ** 2 + (y_mm[k] - press.y_mm) ** 2;
    job.setFloat32(4 * (AT.x_mm + k), x, true);
    job.setFloat32(4 * (AT.y_mm + k), y_mm[k], true);
    job.setInt32(4 * (AT.pressure + k), Math.round(1024 * P0_PA * Math.exp(-distance2 / (2 * SIGMA_MM ** 2))), true);
  });
  const cycles = bench.runJob();
  const error_um = 1e3 * Math.hypot(job.getFloat32(4 * AT.fit_x_mm, true) - press.x_mm, job.getFloat32(4 * AT.fit_y_mm, true) - press.y_mm);
  return { cycles, error_um };
}

function layoutOf(grid) {
  if (grid === null) return { x_mm: [-1, 1, 0, -1, 1].map((x) => x * PITCH_MM), y_mm: [-1, -1, 0, 1, 1].map((y) => y * PITCH_MM) };
  const [columns, rows] = grid;
  const x_mm = [];
  const y_mm = [];
  for (let i = 0; i < columns; i++) {
    for (let j = 0; j < rows; j++) {
      x_mm.push((i - (columns - 1) / 2) * PITCH_MM);
      y_mm.push((j - (rows - 1) / 2) * PITCH_MM);
    }
  }
  return { x_mm, y_mm };
}

function measure(bench, grid, kernel) {
  const layout = layoutOf(grid);
  const span = (values) => Math.max(...values) - Math.min(...values);
  const row = { sensors: layout.x_mm.length, layout: grid ? grid.join('x') : 'die', kernel, take: 0, condition: 0, fit: 0, error_um: 0 };
  for (const [x, y] of PLACES) {
    const { cycles, error_um } = cyclesOf(bench, layout, { x_mm: x * span(layout.x_mm), y_mm: y * span(layout.y_mm) });
    STAGES.forEach((stage, i) => {
      row[stage] = Math.max(row[stage], cycles[i]);
    });
    row.error_um = Math.max(row.error_um, error_um);
  }
  return row;
}

function main([folder, ...others]) {
  if (folder === '--help') return void process.stdout.write(`${USAGE}\n`);
  if (folder === undefined || others.length) throw new InputError('give one folder; see --help');
  const bench = (grid) => new JobBench(readImage(`${folder}/sensor_cycles_${grid.join('x')}.bin`));
  const rows = GRIDS.map((grid) => measure(bench(grid), grid, 'fixed point'));
  const free = bench(GRIDS[0]);
  for (const grid of FREE) rows.push(measure(free, grid, 'float'));
  process.stdout.write(`${JSON.stringify(rows)}\n`);
}

try {
  main(process.argv.slice(2));
} catch (error) {
  process.stderr.write(`sensor_cycles: ${error.message}\n`);
  process.exitCode = error instanceof InputError ? 2 : 1;
}
