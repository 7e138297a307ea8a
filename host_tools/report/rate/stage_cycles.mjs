#!/usr/bin/env node
/** Counts where the cycles of an image go, by stage of the frame and by function: see USAGE. */
import { readFileSync, writeFileSync } from 'node:fs';
import { parseArgs } from 'node:util';
import { findBoard } from '../../simulation/emulator/board/boards.mjs';
import { InputError, inWords } from '../../simulation/emulator/errors.mjs';
import { Machine } from '../../simulation/emulator/machine.mjs';
import { readHostScript, scheduleHostScript } from '../../simulation/emulator/port/host_script.mjs';
import { readScenario } from '../../simulation/emulator/scenario.mjs';
import { readFunctions } from './elf_symbols.mjs';

const USAGE = `usage: stage_cycles.mjs --image BASE --board NAME --scenario FILE --host-script FILE --window NAME:FROM_S:TO_S...

Runs BASE.bin on the emulated board and counts the cycles of each stage in the windows of emulated time, with the
symbols of BASE.elf. A stage is a function that the main loop calls, or an interrupt, with all that it calls; what the
main loop does besides is "other". Interrupts are counted as their own stages, wherever they strike.

  --json FILE      {window: {frames, cycles_per_frame: {stage: cycles}, frames_per_s, busy_percent, functions}}
  --functions      print the functions with the most cycles, too

Exit: 0 done; 1 the image failed or warned; 2 wrong usage or input.`;

/** Function that begins a stage in the main loop, and the stage. */
const STAGES = {
  scan_take: 'take',
  condition_frame: 'condition',
  condition_follow: 'condition',
  fit_gaussian_follow: 'fit',
  fit_gaussian_grid_follow: 'fit',
  fit_gaussian_grid_plain: 'fit',
  fit_gaussian_grid_small: 'fit',
  contact_update: 'contact',
  contact_judge: 'contact',
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

export class StageMeter {
  constructor(functions) {
    this.functions = functions;
    this.stages = [...new Set([...Object.values(STAGES), ...Object.values(INTERRUPTS), 'other'])];
    this.entry = new Uint8Array(1 << 18);
    this.frameEntry = 0;
    for (const { name, start } of functions) {
      const known = name.split('=').find((n) => STAGES[n]);
      if (known) this.entry[start - RAM] = 1 + this.stages.indexOf(STAGES[known]);
      if (name.split('=').includes(FRAME)) this.frameEntry = start;
    }
    if (!this.frameEntry) throw new InputError(`the image has no function ${FRAME}`);
    this.reset();
  }

  reset() {
    this.cycles = new Float64Array(this.stages.length);
    this.byPlace = new Float64Array(1 << 17);
    this.elsewhere = 0;
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
        if (at >= 0 && at < 1 << 18) meter.byPlace[at >> 1] += spent;
        else meter.elsewhere += spent;
        if (meter.left) {
          stage = calls.pop()?.stage ?? other; // none: the counting began within this exception
          depth = Math.max(0, depth - 1);
        }
      }
    };
  }

  /** [{name, cycles}] by cycles, of one frame. */
  functionsOfFrame() {
    return this.functions
      .map(({ name, start, end }) => {
        let cycles = 0;
        for (let at = Math.max(0, start - RAM); start >= RAM && at < end - RAM; at += 2) cycles += this.byPlace[at >> 1];
        return { name, cycles: cycles / this.frames };
      })
      .filter((f) => f.cycles > 0)
      .sort((a, b) => b.cycles - a.cycles);
  }
}
const NEVER = Object.freeze({ earliestChanged: false });

function parseOptions(argv) {
  let values;
  try {
    const text = { type: 'string' };
    ({ values } = parseArgs({
      args: argv,
      strict: true,
      options: {
        image: text,
        board: text,
        scenario: text,
        'host-script': text,
        window: { type: 'string', multiple: true, default: [] },
        json: text,
        functions: { type: 'boolean', default: false },
        help: { type: 'boolean', short: 'h', default: false },
      },
    }));
  } catch (error) {
    throw new InputError(`${error.message.split('\n')[0]}; see --help`);
  }
  if (values.help) return values;
  for (const name of ['image', 'board', 'scenario', 'host-script'])
    if (!values[name]) throw new InputError(`--${name} is missing; see --help`);
  values.windows = values.window.map((text) => {
    const [name, from, to] = text.split(':');
    const window = { name, from_s: Number(from), to_s: Number(to) };
    if (!name || !(window.from_s >= 0) || !(window.to_s > window.from_s))
      throw new InputError(`--window "${text}" is not NAME:FROM_S:TO_S`);
    return window;
  });
  if (!values.windows.length) throw new InputError('--window is missing; see --help');
  values.windows.reduce((before, next) => {
    if (next.from_s < before.to_s)
      throw new InputError(`--window ${next.name} begins before ${before.name} ends; give them in order of time`);
    return next;
  });
  return values;
}

function readImage(path) {
  try {
    return readFileSync(path);
  } catch (error) {
    throw new InputError(`${path}: cannot read the image (${inWords(error)}); build it first`);
  }
}

function main(argv) {
  const options = parseOptions(argv);
  if (options.help) {
    process.stdout.write(`${USAGE}\n`);
    return 0;
  }
  const meter = new StageMeter(readFunctions(`${options.image}.elf`));
  const machine = new Machine({
    image: readImage(`${options.image}.bin`),
    Board: findBoard(options.board),
    scenario: readScenario(options.scenario),
    fastEnumeration: true,
  });
  scheduleHostScript(readHostScript(options['host-script']), machine.scope, machine.client);
  const run = (to_s) => {
    if (!machine.run(to_s * 1e9))
      throw new Error(`the image stopped at ${machine.time.nanos / 1e9} s: ${machine.result.warnings.join('; ') || machine.endReason}`);
  };
  run(options.windows[0].from_s);
  meter.attach(machine.chip);
  const result = {};
  for (const { name, from_s, to_s } of options.windows) {
    run(from_s);
    meter.reset();
    run(to_s);
    if (!meter.frames) throw new Error(`no frame in window ${name}`);
    const clock_Hz = machine.Board.clkSys_Hz;
    const busy = meter.cycles.reduce((sum, value) => sum + value, 0);
    const cycles_per_frame = Object.fromEntries(meter.stages.map((stage, i) => [stage, Math.round(meter.cycles[i] / meter.frames)]));
    const functions = meter.functionsOfFrame();
    result[name] = {
      frames: meter.frames,
      frames_per_s: meter.frames / (to_s - from_s),
      cycles_per_frame,
      total_cycles_per_frame: Math.round(busy / meter.frames),
      busy_percent: (100 * busy) / ((to_s - from_s) * clock_Hz),
      functions: Object.fromEntries(functions.map((f) => [f.name, Math.round(f.cycles)])),
    };
    const stages = Object.entries(cycles_per_frame)
      .map(([stage, cycles]) => `${stage} ${cycles}`)
      .join(', ');
    process.stdout.write(
      `${name}: ${result[name].frames_per_s.toFixed(1)} frames/s, ${result[name].total_cycles_per_frame} cycles a frame, busy ${result[name].busy_percent.toFixed(1)} %: ${stages}\n`,
    );
    if (options.functions)
      for (const f of functions.slice(0, 45)) process.stdout.write(`  ${f.cycles.toFixed(0).padStart(8)}  ${f.name}\n`);
  }
  if (options.json) {
    try {
      writeFileSync(options.json, `${JSON.stringify(result, null, 2)}\n`);
    } catch (error) {
      throw new InputError(`${options.json}: cannot write (${inWords(error)}); check the folder`);
    }
  }
  for (const line of machine.result.warnings) process.stderr.write(`${line}\n`);
  return machine.result.warnings.length ? 1 : 0;
}

try {
  process.exitCode = main(process.argv.slice(2));
} catch (error) {
  process.stderr.write(`stage_cycles.mjs: ${error.message}\n`);
  process.exitCode = error instanceof InputError ? 2 : 1;
}
