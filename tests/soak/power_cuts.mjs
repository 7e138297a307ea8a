#!/usr/bin/env node
/** Cuts the power of a release image in the emulator, all through its start and all through what it writes: see USAGE. */
import { execFileSync } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { parseArgs } from 'node:util';
import { findBoard } from '../../host_tools/simulation/emulator/board/boards.mjs';
import { InputError } from '../../host_tools/simulation/emulator/errors.mjs';
import { parseFaults } from '../../host_tools/simulation/emulator/faults.mjs';
import { Machine } from '../../host_tools/simulation/emulator/machine.mjs';

const USAGE = `usage: power_cuts.mjs --image FILE.bin --board NAME --soak PROGRAM --command-frame PROGRAM [--step-us N] [--kinds LIST]

Cuts the power every N microseconds (100), every two milliseconds while what was written is read back, of
  write   an update of what is kept, into a free slot
  erase   one that needs a sector erased first
  mend    a start that finds an update cut short, and writes what it decides for once more
  start   a start that finds what it stored in order
  reset   a start of the chip alone: a reset instead, sensors and flash go on
With a cut the flash keeps of the bits that were to change some, and some read as they like from then on (flash_memory.mjs).
After each it must start, with all sensors, and hold the old settings or the new ones; and after one more cut of the
power, when all is written, the same ones. PROGRAM is fingertip_soak, which reads the packets.

Prints one JSON object: of each kind cuts, not_started, wrong_values, brought (the new ones are there), slowest_ms (from
power to streams, with the emulator's fast enumeration), and "what" went wrong, at most ten lines.

Exit: 0 done, whatever was found; 2 wrong usage.`;

const [OLD, NEW] = [512, 2048];
const SETTINGS = 2,
  WRITING = 4,
  DAMAGED = 8;
const ALL_SENSORS = 0x7fff;
const OFF_MS = 3;
/** Before the first step of a write and behind its last. */
const MARGIN_NS = 0.3e6;
const PAUSE_NS = 2e6;
const SETTLED_MS = 200;
const START_LIMIT_MS = 1000;
/** More than the answers. */
const STREAMS_BYTES = 600;
const KINDS = ['write', 'erase', 'mend', 'start', 'reset'];

class Cutter {
  constructor(options) {
    this.options = options;
    this.Board = findBoard(options.board);
    this.image = readFileSync(options.image);
    this.encoded = (...command) => Buffer.from(execFileSync(options['command-frame'], command, { encoding: 'utf8' }).trim(), 'hex');
    this.ask = Buffer.concat([this.encoded('stream', 'raw'), this.encoded('info')]);
    this.again = Buffer.concat([this.encoded('info'), this.encoded('health')]);
    this.update = Object.fromEntries(
      [OLD, NEW].map((osr) => [osr, Buffer.concat([this.encoded('osr', `${osr}`), this.encoded('rate', '20'), this.encoded('keep')])]),
    );
  }

  /** A life of the board with this flash; `kept`: { bytes, unstable, resolvesAtPowerUp }. */
  machine(kept, seed, faults = []) {
    const felt = { pressure_Pa: 101325, temperature_degC: 25 };
    const machine = new Machine({
      image: this.image,
      Board: this.Board,
      scenario: { at_ns: () => felt },
      seed,
      fastEnumeration: true,
      allowWatchdog: true,
      flash: kept?.bytes ?? null,
      faults: parseFaults(JSON.stringify(faults), 'cuts', this.Board),
      onData: (bytes) => machine.heard.push(Buffer.from(bytes)),
    });
    machine.heard = [];
    if (kept) machine.memory.unstable = new Map(kept.unstable);
    machine.memory.resolvesAtPowerUp = kept?.resolvesAtPowerUp ?? false;
    machine.client.setDtr(true);
    return machine;
  }

  keep({ memory }) {
    return { bytes: memory.bytes.slice(), unstable: [...memory.unstable], resolvesAtPowerUp: memory.resolvesAtPowerUp };
  }

  run(machine, ms) {
    return machine.run(machine.time.nanos + ms * 1e6);
  }

  /** Opens the port and asks; the time from `from_ns` until it streams, or null. */
  opens(machine, from_ns) {
    const end_ns = from_ns + START_LIMIT_MS * 1e6;
    while (!machine.host.configured) if (machine.time.nanos > end_ns || !this.run(machine, 1)) return null;
    this.run(machine, 5);
    machine.heard.length = 0;
    machine.client.write(this.ask);
    const size = () => machine.heard.reduce((n, bytes) => n + bytes.length, 0);
    while (size() < STREAMS_BYTES) if (machine.time.nanos > end_ns || !this.run(machine, 1)) return null;
    return (machine.time.nanos - from_ns) / 1e6;
  }

  /** What it says now, as hexadecimal bytes. */
  says(machine, ms) {
    this.run(machine, ms);
    machine.client.write(this.again);
    this.run(machine, 15);
    const said = Buffer.concat(machine.heard).toString('hex');
    machine.heard.length = 0;
    return said;
  }

  /** Stores once more; the times of its steps: beginnings and ends of operations. */
  store(machine, osr) {
    const steps_ns = [];
    machine.memory.onStep = () => steps_ns.push(machine.time.nanos);
    machine.client.write(this.update[osr]);
    this.run(machine, SETTLED_MS);
    machine.memory.onStep = () => {};
    return steps_ns;
  }

  /** When to cut: each step while bits change and shortly before and after, each PAUSE_NS in between, where it is read back. */
  moments(steps_ns, step_ns) {
    const moments = [];
    for (let at_ns = steps_ns[0] - MARGIN_NS; at_ns <= steps_ns.at(-1) + MARGIN_NS; ) {
      moments.push(at_ns);
      const changes = steps_ns.some((begin_ns, i) => i % 2 === 0 && at_ns >= begin_ns - MARGIN_NS && at_ns <= steps_ns[i + 1] + MARGIN_NS);
      const next_ns = Math.min(
        ...steps_ns.filter((begin_ns, i) => i % 2 === 0 && begin_ns - MARGIN_NS > at_ns).map((begin_ns) => begin_ns - MARGIN_NS),
      );
      at_ns += changes ? step_ns : Math.max(step_ns, Math.min(PAUSE_NS, next_ns - at_ns));
    }
    return moments;
  }

  /** Flashes that hold the old settings: before a free slot, and before a sector that is full. */
  prepare() {
    const machine = this.machine(null, 1);
    this.opens(machine, 0);
    const kept = {};
    for (let n = 0; !(kept.write && kept.erase); n++) {
      if (n > 20) throw new Error('no update needs an erase');
      this.store(machine, OLD);
      const before = this.keep(machine);
      const { erases } = machine.memory;
      this.store(machine, NEW);
      const kind = machine.memory.erases > erases ? 'erase' : 'write';
      kept[kind] ??= before;
      if (n === 9) {
        // an odd number of records, or the erases would always come before the old ones
        machine.client.write(this.encoded('forget'));
        this.run(machine, SETTLED_MS);
      }
    }
    return kept;
  }

  /** The flash that an update leaves whose power was cut while it was sealed, so that either may be there. */
  torn(kept) {
    for (let seed = 1; seed < 60; seed++) {
      const machine = this.machine(kept, seed);
      this.opens(machine, 0);
      let begun = 0;
      machine.memory.onStep = (_, what) => {
        begun += what === 'begins' ? 1 : 0;
      };
      machine.client.write(this.update[NEW]);
      const end_ns = machine.time.nanos + START_LIMIT_MS * 1e6;
      while (begun < 4) {
        if (machine.time.nanos > end_ns) throw new Error('the update is not written');
        this.run(machine, 0.1);
      }
      this.run(machine, 0.3);
      machine.memory.cutPower();
      const torn = this.keep(machine);
      const next = this.machine(torn, seed);
      this.opens(next, 0);
      this.run(next, SETTLED_MS);
      if (next.memory.programs > 0) return torn; // it has something to mend
    }
    throw new Error('no cut leaves anything to mend');
  }

  /** One cut at `at_ns`; what became of it. */
  cut(kept, seed, at_ns, { type = 'power_cut', writes = false } = {}) {
    const to_ns = at_ns + OFF_MS * 1e6;
    const machine = this.machine(kept, seed, [{ type, from_s: at_ns / 1e9, to_s: to_ns / 1e9 }]);
    if (writes) {
      this.opens(machine, 0);
      machine.client.write(this.update[NEW]);
    }
    machine.run(to_ns);
    const start_ms = this.opens(machine, to_ns);
    if (start_ms === null) return { start_ms, lives: [] };
    const lives = [this.says(machine, SETTLED_MS)];
    machine.memory.cutPower();
    const next = this.machine(this.keep(machine), seed + 1);
    if (this.opens(next, 0) === null) return { start_ms: null, lives: [] };
    lives.push(this.says(next, 1));
    return { start_ms, lives, warnings: machine.result.warnings };
  }

  sweep(kind, kept, step_ns) {
    const writes = kind === 'write' || kind === 'erase';
    const first = this.machine(kept, 1);
    const open_ms = this.opens(first, 0);
    const steps = Math.ceil((open_ms * 1e6 + 5e6) / step_ns);
    const moments = writes ? this.moments(this.store(first, NEW), step_ns) : Array.from({ length: steps }, (_, i) => (i + 1) * step_ns);
    const found = { cuts: 0, not_started: 0, wrong_values: 0, brought: 0, slowest_ms: 0, what: [] };
    const cuts = [];
    for (const at_ns of moments) {
      cuts.push({ at_ns, ...this.cut(kept, 1 + cuts.length, at_ns, { type: kind === 'reset' ? 'chip_reset' : 'power_cut', writes }) });
    }
    const lines = execFileSync(this.options.soak, ['--packets'], {
      input: `${cuts.flatMap((c) => c.lives).join('\n')}\n`,
      encoding: 'utf8',
      maxBuffer: 1 << 28,
    });
    const told = lines
      .trim()
      .split('\n')
      .map((line) => JSON.parse(line));
    const problem = (cut, name, what) => {
      found[name] += 1;
      if (found.what.length < 10) found.what.push(`${kind} cut at ${(cut.at_ns / 1e6).toFixed(3)} ms: ${what}`);
    };
    for (const cut of cuts) {
      found.cuts += 1;
      const [now, later] = cut.lives.length ? [told.shift(), told.shift()] : [];
      if (!now) {
        problem(cut, 'not_started', 'it did not stream again');
        continue;
      }
      found.slowest_ms = Math.max(found.slowest_ms, cut.start_ms);
      if (cut.warnings.length || [now, later].some((life) => life.present !== ALL_SENSORS || life.prom_bad !== 0 || life.complete < 1)) {
        problem(cut, 'not_started', `${JSON.stringify([now, later])} ${cut.warnings.join('; ')}`);
      } else if (
        ![OLD, NEW].includes(now.osr) ||
        later.osr !== now.osr ||
        now.stored !== SETTINGS ||
        (later.stored & ~WRITING) !== SETTINGS
      ) {
        problem(cut, 'wrong_values', `holds ${JSON.stringify([now, later])}${now.stored & DAMAGED ? ', damaged' : ''}`);
      } else if (now.osr === NEW) found.brought += 1;
    }
    return { ...found, slowest_ms: Math.round(found.slowest_ms) };
  }
}

function main(argv) {
  let values;
  try {
    ({ values } = parseArgs({
      args: argv,
      strict: true,
      options: {
        image: { type: 'string' },
        board: { type: 'string' },
        soak: { type: 'string' },
        'command-frame': { type: 'string' },
        'step-us': { type: 'string', default: '100' },
        kinds: { type: 'string', default: KINDS.join(',') },
        help: { type: 'boolean' },
      },
    }));
  } catch (error) {
    throw new InputError(`${error.message.split('\n')[0]}; see --help`);
  }
  if (values.help) return void process.stdout.write(`${USAGE}\n`);
  for (const name of ['image', 'board', 'soak', 'command-frame'])
    if (!values[name]) throw new InputError(`--${name} is missing; see --help`);
  const step_us = Number(values['step-us']);
  if (!(step_us >= 1 && step_us <= 1e6)) throw new InputError(`--step-us "${values['step-us']}" is not a number from 1 to 1000000`);
  const kinds = values.kinds.split(',');
  const unknown = kinds.find((kind) => !KINDS.includes(kind));
  if (unknown !== undefined) throw new InputError(`--kinds: "${unknown}" is none of ${KINDS.join(', ')}`);
  const cutter = new Cutter(values);
  const kept = cutter.prepare();
  if (kinds.includes('mend')) kept.mend = cutter.torn(kept.write);
  kept.start = kept.reset = kept.write;
  process.stdout.write(
    `${JSON.stringify(Object.fromEntries(kinds.map((kind) => [kind, cutter.sweep(kind, kept[kind], step_us * 1000)])))}\n`,
  );
}

try {
  main(process.argv.slice(2));
} catch (error) {
  process.stderr.write(`power_cuts.mjs: ${error instanceof InputError ? error.message : error.stack}\n`);
  process.exitCode = error instanceof InputError ? 2 : 1;
}
