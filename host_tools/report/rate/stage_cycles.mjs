#!/usr/bin/env node
/**
 * usage: stage_cycles.mjs --image BASE --board NAME --scenario FILE --host-script FILE --window NAME:FROM_S:TO_S...
 *
 * Runs BASE.bin on the emulated board and counts the cycles of each stage in the windows of emulated time, in order of time, with the
 * symbols of BASE.elf. A stage is a function that the main loop calls, or an interrupt, with all that it calls; what the main loop does
 * besides is "other". Interrupts are counted as their own stages, wherever they strike.
 *
 * Prints {window: {frames, frames_per_s, cycles_per_frame: {stage: cycles}, total_cycles_per_frame, busy_percent}}.
 */
import { execFileSync } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { parseArgs } from 'node:util';
import { findBoard } from '../../simulation/emulator/board/boards.mjs';
import { Machine } from '../../simulation/emulator/machine.mjs';
import { readHostScript, scheduleHostScript } from '../../simulation/emulator/port/host_script.mjs';
import { readScenario } from '../../simulation/emulator/scenario.mjs';

/** Function that begins a stage in the main loop, and the stage. */
const STAGES = {
  scan_take: 'take',
  condition_frame: 'condition',
  condition_follow: 'condition',
  fit_gaussian_update: 'fit',
  fit_gaussian_grid_update: 'fit',
  fit_gaussian_grid_plain: 'fit',
  fit_gaussian_grid_small: 'fit',
  contact_update: 'contact',
  contact_set_flags: 'contact',
  wire_encode: 'encode',
  cdc_write: 'queue',
  cdc_read: 'commands',
  wire_receive: 'commands',
};
/** Interrupt number and its stage. */
const INTERRUPTS = { 0: 'bus', 5: 'usb', 7: 'bus', 11: 'bus', 23: 'bus', 26: 'usb' };
/** Called once a frame, in every scene. */
const FRAME = 'condition_frame';
const RAM = 0x20000000;

class StageMeter {
  constructor(functions) {
    this.stages = [...new Set([...Object.values(STAGES), ...Object.values(INTERRUPTS), 'other'])];
    this.entry = new Uint8Array(1 << 18);
    this.frameEntry = 0;
    for (const { name, start } of functions) {
      const known = name.split('=').find((n) => STAGES[n]);
      if (known) this.entry[start - RAM] = 1 + this.stages.indexOf(STAGES[known]);
      if (name.split('=').includes(FRAME)) this.frameEntry = start;
    }
    if (!this.frameEntry) throw new Error(`the image has no function ${FRAME}`);
    this.reset();
  }

  reset() {
    this.cycles = new Float64Array(this.stages.length);
    this.frames = 0;
  }

  /** Replaces the core's loop by one that steps and counts. */
  attach(chip) {
    const meter = this;
    const { core } = chip;
    const registers = core.registers;
    const other = this.stages.indexOf('other');
    const calls = []; // {stage, back: return address, sp, depth: of exceptions}
    let stage = other;
    let depth = 0;
    const enter = core.exceptionEntry.bind(core);
    core.exceptionEntry = (number) => {
      const before = core.cycles;
      calls.push({ stage, back: -1, sp: 0 });
      depth += 1;
      stage = meter.stages.indexOf(INTERRUPTS[number - 16] ?? 'other');
      enter(number);
      meter.cycles[stage] += core.cycles - before;
      meter.charged += core.cycles - before;
    };
    const leave = core.exceptionReturn.bind(core);
    core.exceptionReturn = (value) => {
      leave(value);
      meter.left = true;
    };
    const executeOriginal = Object.getPrototypeOf(core).execute;
    core.execute = function execute(stop, time) {
      while (core.cycles < stop && !core.waiting && !time.earliestChanged) {
        if (core.interruptsUpdated) {
          const waited = core.checkForInterrupts();
          if (waited) core.waiting = false;
        }
        const pc = registers[15];
        const at = pc - RAM;
        if (at >= 0 && at < 1 << 18) {
          const top = calls.at(-1);
          if (top && top.back === pc && registers[13] >= top.sp) {
            do stage = calls.pop().stage;
            while (calls.length && calls.at(-1).back === pc && registers[13] >= calls.at(-1).sp);
          }
          const entered = meter.entry[at];
          if (entered && depth === 0) {
            calls.push({ stage, back: registers[14] & ~1, sp: registers[13] });
            stage = entered - 1;
            if (pc === meter.frameEntry) meter.frames += 1;
          }
        }
        const before = core.cycles;
        meter.charged = 0;
        meter.left = false;
        executeOriginal.call(core, before + 1, NEVER);
        const spent = core.cycles - before - meter.charged;
        meter.cycles[stage] += spent;
        if (meter.left) {
          stage = calls.pop()?.stage ?? other; // none: the counting began within this exception
          depth = Math.max(0, depth - 1);
        }
      }
    };
  }
}
const NEVER = Object.freeze({ earliestChanged: false });

/** The functions of an image: [{name, start}], aliases joined with "=". */
function readFunctions(path) {
  const byStart = new Map();
  for (const line of execFileSync('arm-none-eabi-nm', ['-p', '-f', 'sysv', path], { encoding: 'utf8' }).split('\n')) {
    const [name, value, , type] = line.split('|').map((cell) => cell.trim());
    if (type !== 'FUNC') continue;
    const start = Number.parseInt(value, 16) & ~1;
    const known = byStart.get(start);
    if (known) known.name += `=${name}`;
    else byStart.set(start, { name, start });
  }
  return [...byStart.values()];
}

process.on('uncaughtException', (error) => {
  process.stderr.write(`stage_cycles.mjs: ${error.message}\n`);
  process.exit(1);
});
const text = { type: 'string' };
const options = { image: text, board: text, scenario: text, 'host-script': text, window: { ...text, multiple: true } };
const { values } = parseArgs({ options });
const windows = values.window.map((one) => one.split(':')).map(([name, from, to]) => ({ name, from_s: Number(from), to_s: Number(to) }));
const meter = new StageMeter(readFunctions(`${values.image}.elf`));
const machine = new Machine({
  image: readFileSync(`${values.image}.bin`),
  Board: findBoard(values.board),
  scenario: readScenario(values.scenario),
  fastEnumeration: true,
});
scheduleHostScript(readHostScript(values['host-script']), machine.scope, machine.client);
const run = (to_s) => {
  if (!machine.run(to_s * 1e9))
    throw new Error(`the image stopped at ${machine.time.nanos / 1e9} s: ${machine.result.warnings.join('; ') || machine.endReason}`);
};
run(windows[0].from_s);
meter.attach(machine.chip);
const result = {};
for (const { name, from_s, to_s } of windows) {
  run(from_s);
  meter.reset();
  run(to_s);
  if (!meter.frames) throw new Error(`no frame in window ${name}`);
  const busy = meter.cycles.reduce((sum, value) => sum + value, 0);
  result[name] = {
    frames: meter.frames,
    frames_per_s: meter.frames / (to_s - from_s),
    cycles_per_frame: Object.fromEntries(meter.stages.map((stage, i) => [stage, Math.round(meter.cycles[i] / meter.frames)])),
    total_cycles_per_frame: Math.round(busy / meter.frames),
    busy_percent: (100 * busy) / ((to_s - from_s) * machine.Board.clkSys_Hz),
  };
}
if (machine.result.warnings.length) throw new Error(machine.result.warnings.join('; '));
process.stdout.write(`${JSON.stringify(result)}\n`);
