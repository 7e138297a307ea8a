#!/usr/bin/env node
/** Counts the cycles of a frame against the number of sensors: see USAGE. */
import { readFileSync } from 'node:fs';
import { Chip, Stopped } from '../../../simulation/emulator/chip/chip.mjs';
import { SimulatedTime } from '../../../simulation/emulator/clock.mjs';
import { InputError, inWords } from '../../../simulation/emulator/errors.mjs';
import { Report } from '../../../simulation/emulator/report.mjs';

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
const [NEXT_JOB, START, STOP] = [1, 2, 3];
const RAM = 0x20000000;
/** Words of \`job\` in main.c. */
const AT = { sensor_count: 0, pitch_mm: 1, x_mm: 2, y_mm: 34, pressure: 66, fit_x_mm: 98, fit_y_mm: 99 };

class Bench {
  constructor(file) {
    let image;
    try {
      image = readFileSync(file);
    } catch (error) {
      throw new InputError(`${file}: cannot read (${inWords(error)}); build the images first`);
    }
    this.time = new SimulatedTime();
    this.report = new Report(() => this.time.nanos);
    this.chip = new Chip(this.time, this.report, { serial: new Uint8Array(8) });
    this.chip.load(image);
    this.chip.boot();
    const { chip } = this;
    const breakpoint = chip.onBreak;
    chip.onBreak = (code) => {
      if (code === START) this.started = chip.core.cycles;
      else if (code === STOP) this.cycles.push(chip.core.cycles - this.started);
      else if (code === NEXT_JOB) throw new Stopped('next job');
      else breakpoint(code);
    };
    this.#untilNextJob();
  }

  #untilNextJob() {
    this.cycles = [];
    try {
      this.chip.runUntil(this.time.nanos + 10e9);
    } catch (error) {
      if (!(error instanceof Stopped)) throw error;
      if (error.reason === 'next job') return;
      throw new Error(`the image stopped: ${error.reason}; ${this.report.list.map((e) => Report.line(e)).join('; ')}`);
    }
    throw new Error('a job takes longer than ten seconds');
  }

  run({ x_mm, y_mm }, press) {
    const { chip } = this;
    const view = new DataView(chip.sram.buffer, chip.sram.byteOffset + chip.core.registers[0] - RAM);
    view.setUint32(4 * AT.sensor_count, x_mm.length, true);
    view.setFloat32(4 * AT.pitch_mm, PITCH_MM, true);
    x_mm.forEach((x, k) => {
      const distance2 = (x - press.x_mm) ** 2 + (y_mm[k] - press.y_mm) ** 2;
      view.setFloat32(4 * (AT.x_mm + k), x, true);
      view.setFloat32(4 * (AT.y_mm + k), y_mm[k], true);
      view.setInt32(4 * (AT.pressure + k), Math.round(1024 * P0_PA * Math.exp(-distance2 / (2 * SIGMA_MM ** 2))), true);
    });
    this.#untilNextJob();
    const error_um =
      1e3 * Math.hypot(view.getFloat32(4 * AT.fit_x_mm, true) - press.x_mm, view.getFloat32(4 * AT.fit_y_mm, true) - press.y_mm);
    return { cycles: this.cycles, error_um };
  }
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
    const { cycles, error_um } = bench.run(layout, { x_mm: x * span(layout.x_mm), y_mm: y * span(layout.y_mm) });
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
  const image = (grid) => `${folder}/sensor_cycles_${grid.join('x')}.bin`;
  const rows = GRIDS.map((grid) => measure(new Bench(image(grid)), grid, 'fixed point'));
  const free = new Bench(image(GRIDS[0]));
  for (const grid of FREE) rows.push(measure(free, grid, 'float'));
  process.stdout.write(`${JSON.stringify(rows)}\n`);
}

try {
  main(process.argv.slice(2));
} catch (error) {
  process.stderr.write(`sensor_cycles: ${error.message}\n`);
  process.exitCode = error instanceof InputError ? 2 : 1;
}
