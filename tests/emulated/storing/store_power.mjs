#!/usr/bin/env node
/**
 * Cuts the power of the emulated chip while it stores.
 *
 *     store_power.mjs STORE_POWER.bin UPDATES SEED
 *
 * The image keeps one thing after another in its flash, with the firmware's store and driver. The power is cut once in each
 * update, at each of its steps in turn: while bytes go to the flash, and early, late and in the middle of each erase and page
 * program. In every fourth update it is cut once more while start-up mends what the first cut has left. After each start the
 * flash must hold what it held before the update or what the update was to bring, and what it holds when start-up has ended
 * must stay.
 *
 * Prints one JSON object: updates, cuts, cuts_in_mending, restarts, brought (updates that the cut did not keep), lost.
 */
import { readFileSync } from 'node:fs';
import { Chip, Stopped } from '../../../host_tools/simulation/emulator/chip/chip.mjs';
import { FlashMemory } from '../../../host_tools/simulation/emulator/chip/flash_memory.mjs';
import { SimulatedTime } from '../../../host_tools/simulation/emulator/clock.mjs';
import { Prng } from '../../../host_tools/simulation/emulator/prng.mjs';
import { Report } from '../../../host_tools/simulation/emulator/report.mjs';

const RAM = 0x20000000;
const NEXT_JOB = 1;
const [FINISH, CALIBRATE, ERASE, KEEP, FORGET] = [0, 1, 2, 3, 4];
const KINDS = [CALIBRATE, CALIBRATE, CALIBRATE, KEEP, KEEP, KEEP, ERASE, FORGET];
const LIMIT_NS = 20e9;
/**
 * Which flash operation of an update is hit, in turn: begin, record, seal and final are in each; where a sector is full
 * two come before them, the seal of what remains and the erase.
 */
const OPERATIONS = [0, 1, 2, 3, 0, 1, 2, 3, 4, 5];
/** Parts of an operation's time, and before it, in this order. */
const POINTS = ['before', 0.001, 0.5, 0.999];
/** Between the end of one operation and the beginning of the next bytes go back and forth. */
const BEFORE_NS = 3e6;

class Device {
  constructor(image, seed) {
    this.time = new SimulatedTime();
    this.report = new Report(() => this.time.nanos);
    this.memory = new FlashMemory({ time: this.time, serial: new Uint8Array(8), seed });
    this.scope = this.time.scope();
    this.cutAlarm = this.scope.createAlarm(() => {
      throw new Stopped('cut');
    });
    this.image = image;
    this.restarts = 0;
    this.#start();
  }

  #start() {
    const { chip: old } = this;
    old?.dispose();
    this.restarts += 1;
    const kept = old && { sram: old.sram, watchdog: { reason: 0, scratch: old.watchdog.scratch.map(() => 0) } };
    this.chip = new Chip(this.time, this.report, { serial: new Uint8Array(8), memory: this.memory, kept });
    if (!old) this.chip.load(this.image);
    const breakpoint = this.chip.onBreak;
    this.chip.onBreak = (code) => {
      if (code === NEXT_JOB) throw new Stopped('next job');
      breakpoint(code);
    };
    this.chip.boot();
    this.#untilNextJob();
  }

  /** True: the power was cut before. */
  #untilNextJob() {
    try {
      this.chip.runUntil(this.time.nanos + LIMIT_NS);
    } catch (error) {
      if (!(error instanceof Stopped)) throw error;
      if (error.reason === 'next job') return false;
      if (error.reason === 'cut') return true;
      throw new Error(`the image stopped: ${error.reason}; ${this.report.list.map((e) => Report.line(e)).join('; ')}`);
    }
    throw new Error('a job takes longer than twenty seconds');
  }

  /** Power goes and comes back. */
  restart() {
    this.memory.cutPower();
    this.#start();
  }

  get #words() {
    return new Uint32Array(this.chip.sram.buffer, this.chip.sram.byteOffset + this.chip.core.registers[0] - RAM, 8);
  }

  /** What the image reports. */
  get state() {
    const [, , calibration, settings, mixed, damaged, writing, failures] = this.#words;
    if (failures) throw new Error('the flash does not keep what is written');
    return { calibration, settings, mixed, damaged, writing };
  }

  /** arm(): sets what is to cut it. True: the power was cut before it was done. */
  do(kind, number, arm = () => {}) {
    this.#words.set([kind, number]);
    arm();
    const cut = this.#untilNextJob();
    this.cutAlarm.cancel();
    this.memory.onStep = () => {};
    return cut;
  }

  /** Cuts at a point of the operation with this number, from now on. */
  cutAt(operation, point) {
    let begun = 0;
    const before = (number) => {
      if (number === operation && point === 'before') this.cutAlarm.schedule(BEFORE_NS * this.prng.uniform());
    };
    before(0);
    this.memory.onStep = ({ kind }, what) => {
      if (what === 'begins') {
        if (begun === operation && point !== 'before') this.cutAlarm.schedule(this.memory.busy_ns[kind] * point);
        begun += 1;
      } else before(begun);
    };
  }
}

function run(image, updates, seed) {
  const prng = new Prng(seed);
  const device = new Device(image, seed);
  device.prng = prng;
  const found = { updates: 0, cuts: 0, cuts_in_mending: 0, restarts: 0, brought: 0, lost: 0 };
  let before = { calibration: 0, settings: 0 };
  const is = (state, expected) =>
    !state.mixed && !state.damaged && state.calibration === expected.calibration && state.settings === expected.settings;
  for (let number = 1; found.updates < updates; number++) {
    const kind = KINDS[prng.uint32() % KINDS.length];
    const after = { ...before };
    if (kind === CALIBRATE || kind === ERASE) after.calibration = kind === CALIBRATE ? number : 0;
    else after.settings = kind === KEEP ? number : 0;
    if (after.calibration === before.calibration && after.settings === before.settings) continue;
    const operation = OPERATIONS[Math.floor(found.updates / POINTS.length) % OPERATIONS.length];
    const point = POINTS[found.updates % POINTS.length];
    found.updates += 1;
    const cut = device.do(kind, number, () => device.cutAt(operation, point));
    let good = true;
    if (cut) {
      found.cuts += 1;
      device.restart();
      good = is(device.state, before) || is(device.state, after);
      if (found.cuts % 4 === 0 && device.state.writing) {
        if (device.do(FINISH, 0, () => device.cutAt(prng.uint32() % 4, POINTS[prng.uint32() % POINTS.length]))) {
          found.cuts_in_mending += 1;
          device.restart();
          good = good && (is(device.state, before) || is(device.state, after));
        }
      }
      device.do(FINISH, 0);
    } else good = is(device.state, after);
    const decided = is(device.state, after) ? after : before;
    if (number % 4 === 0) device.restart();
    good = good && is(device.state, decided);
    if (device.state.writing) device.do(FINISH, 0);
    if (!good) found.lost += 1;
    found.brought += cut && decided === after ? 1 : 0;
    before = { calibration: device.state.calibration, settings: device.state.settings };
  }
  found.restarts = device.restarts;
  return { ...found, erases: device.memory.erases, programs: device.memory.programs, device_s: device.time.nanos / 1e9 };
}

const [image, updates, seed] = process.argv.slice(2);
process.stdout.write(`${JSON.stringify(run(readFileSync(image), Number(updates), Number(seed)))}\n`);
