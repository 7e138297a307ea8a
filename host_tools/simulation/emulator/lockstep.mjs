#!/usr/bin/env node
/** Emulated boards in lock step with a program that simulates the world around them: see USAGE. */
import { spawn } from 'node:child_process';
import { BOARDS, findBoard } from './board/boards.mjs';
import { isPositive, isWhole, main, numberOf } from './command_line.mjs';
import { InputError } from './errors.mjs';
import { readImage } from './image.mjs';
import { DEFAULT_SERIAL, Machine } from './machine.mjs';
import { restOf } from './scenario.mjs';

const USAGE = `usage: lockstep.mjs --image FILE.bin --board NAME [options] -- PROGRAM [ARGUMENT...]

Runs emulated boards with the same firmware image and a program in slices of 500 us of emulated time, each waiting for the other:
the same bit for bit each time, whatever the wall clock. The ports of the boards are open from the start.

  --image FILE       raw flash image (.bin), loaded at flash offset 0
  --board NAME       ${BOARDS.join(' or ')}
  --boards N         number of boards, 1 to 8; default 2
  --clock-ppm LIST   how fast the clock of each is, split by commas; default 0
  --seconds N        the program must be done by then, emulated; default 10
  --seed N           noise, sensor tolerances, SRAM content at power-on of the first board, one more for each further; default 1

At the end of each slice, the first of which has no length, PROGRAM reads from its standard input, little-endian,
  u64 time in ns, u32 chunks, and of each: u32 board, u64 time in ns, u32 length, bytes that the board sent over USB
and answers on its standard output: u32 0, then of each board f64 pressure at the end of the next slice on every sensor,
above ambient in Pa, at most 1e7 to either side; u32 length, bytes to send to it. Or u32 1: it is over; all that it
writes from there on is a JSON object, which goes to the standard output with what became of the boards added.

Exit: 0 clean; 1 a warning or failure of firmware or emulation; 2 wrong usage or input, or a program that failed.`;

const DEFAULTS = { boards: '2', 'clock-ppm': '0', seconds: '10', seed: '1' };
const SLICE_NS = 500_000;
const PRESSURE_LIMIT_Pa = 1e7;
/** No client sends more within a slice. */
const SENT_LIMIT = 65536;

function parseOptions(values, program) {
  if (!program.length) throw new InputError('no program is named; see --help');
  const whole = (name, low, high) => numberOf(name, values[name], isWhole(low, high), `a whole number from ${low} to ${high}`);
  const boards = whole('boards', 1, 8);
  const listed = values['clock-ppm']
    .split(',')
    .map((text) => numberOf('clock-ppm', text, (v) => Math.abs(v) <= 1000, 'a list of numbers from -1000 to 1000'));
  if (listed.length > boards) throw new InputError(`--clock-ppm has ${listed.length} numbers for ${boards} boards`);
  return {
    image: values.image,
    board: values.board,
    boards,
    program,
    seed: whole('seed', 0, 2 ** 32 - 16),
    end_ns: 1e9 * numberOf('seconds', values.seconds, isPositive, 'a positive number of seconds'),
    clocks_ppm: Array.from({ length: boards }, (_, i) => listed[i] ?? 0),
  };
}

/** The program that simulates the world. */
class World {
  constructor([program, ...rest]) {
    this.name = program;
    this.child = spawn(program, rest, { stdio: ['pipe', 'pipe', 'inherit'] });
    this.ended = new Promise((resolve) => {
      this.child.on('error', (error) => resolve(`cannot be run (${error.code})`));
      this.child.on('close', (code, signal) => resolve(code === 0 ? null : `ended with ${signal ?? code}`));
    });
    this.child.stdin.on('error', () => {}); // what it did not read shows in what it did not answer
    this.chunks = this.child.stdout[Symbol.asyncIterator]();
    this.buffer = Buffer.alloc(0);
  }

  async #more() {
    const { value, done } = await this.chunks.next();
    if (!done) this.buffer = this.buffer.length ? Buffer.concat([this.buffer, value]) : value;
    return !done;
  }

  async read(length) {
    while (this.buffer.length < length) {
      if (!(await this.#more())) throw new InputError(`${this.name} ${(await this.ended) ?? 'ended before it was over'}`);
    }
    const bytes = this.buffer.subarray(0, length);
    this.buffer = this.buffer.subarray(length);
    return bytes;
  }

  async u32() {
    return (await this.read(4)).readUInt32LE(0);
  }

  send(t_ns, chunks) {
    const parts = [Buffer.alloc(12)];
    parts[0].writeBigUInt64LE(BigInt(Math.round(t_ns)), 0);
    parts[0].writeUInt32LE(chunks.length, 8);
    for (const { board, at_ns, bytes } of chunks) {
      const head = Buffer.alloc(16);
      head.writeUInt32LE(board, 0);
      head.writeBigUInt64LE(BigInt(Math.round(at_ns)), 4);
      head.writeUInt32LE(bytes.length, 12);
      parts.push(head, Buffer.from(bytes));
    }
    this.child.stdin.write(Buffer.concat(parts));
  }

  /** For each board { pressures_Pa, bytes }; null: it is over. */
  async answer(boards, sensors) {
    const over = await this.u32();
    if (over > 1) throw new InputError(`${this.name}: begins an answer with ${over}`);
    if (over) return null;
    const answers = [];
    for (let board = 0; board < boards; board++) {
      const values = await this.read(8 * sensors);
      const pressures_Pa = Array.from({ length: sensors }, (_, k) => values.readDoubleLE(8 * k));
      const wrong = pressures_Pa.find((p_Pa) => !(Math.abs(p_Pa) <= PRESSURE_LIMIT_Pa));
      if (wrong !== undefined) throw new InputError(`${this.name}: gives a pressure of ${wrong} Pa`);
      const length = await this.u32();
      if (length > SENT_LIMIT) throw new InputError(`${this.name}: sends ${length} bytes at once`);
      answers.push({ pressures_Pa, bytes: Uint8Array.from(await this.read(length)) });
    }
    return answers;
  }

  async result() {
    this.child.stdin.end();
    while (await this.#more());
    const failure = await this.ended;
    if (failure) throw new InputError(`${this.name} ${failure}`);
    try {
      return JSON.parse(this.buffer.toString());
    } catch (error) {
      throw new InputError(`${this.name}: its result is no JSON (${error.message})`);
    }
  }
}

async function run({ image: imagePath, board, boards, program, seed, end_ns, clocks_ppm }) {
  const Board = findBoard(board);
  const image = readImage(imagePath);
  let chunks = [];
  const live = Array.from({ length: boards }, () => restOf(Board.sensors));
  const machines = live.map((scenario, i) => {
    const serial = DEFAULT_SERIAL.slice(0, -2) + (i + 1).toString(16).padStart(2, '0');
    const machine = new Machine({
      image,
      Board,
      scenario,
      seed: seed + i,
      serial,
      clock_ppm: clocks_ppm[i],
      onData: (bytes) => chunks.push({ board: i, at_ns: machine.time.nanos, bytes: Uint8Array.from(bytes) }),
    });
    machine.client.setDtr(true);
    return machine;
  });
  const world = new World(program);
  const started_ms = performance.now();
  let result;
  try {
    for (let slice = 0; ; slice++) {
      world.send(slice * SLICE_NS, chunks);
      chunks = [];
      const answers = await world.answer(boards, Board.sensors);
      if (!answers) break;
      if (slice * SLICE_NS >= end_ns) throw new InputError(`${world.name}: is not over after ${end_ns / 1e9} s`);
      answers.forEach(({ pressures_Pa, bytes }, i) => {
        live[i].add(((slice + 1) * SLICE_NS) / 1e9, pressures_Pa);
        if (bytes.length) machines[i].client.write(bytes);
      });
      const stopped = machines.findIndex((machine) => !machine.run((slice + 1) * SLICE_NS));
      if (stopped >= 0)
        throw new InputError(`board ${stopped} ended after ${machines[stopped].result.emulated_s} s: ${machines[stopped].endReason}`);
    }
    result = await world.result();
  } finally {
    world.child.kill();
  }
  const ran = machines.map((machine) => machine.result);
  const summary = ran.map(({ emulated_s, busy_fraction, clock_ppm, warnings, image_sha256 }) => ({
    emulated_s,
    busy_fraction,
    clock_ppm,
    warnings,
    image_sha256,
  }));
  process.stdout.write(
    `${JSON.stringify({ ...result, slice_us: SLICE_NS / 1e3, boards: summary, wall_s: (performance.now() - started_ms) / 1e3 }, null, 1)}\n`,
  );
  for (const [i, { warnings }] of ran.entries()) for (const line of warnings) process.stderr.write(`board ${i}: ${line}\n`);
  return ran.every(({ warnings }) => warnings.length === 0) ? 0 : 1;
}

await main(USAGE, { defaults: DEFAULTS, needed: ['image', 'board'], allowPositionals: true }, (values, program) =>
  run(parseOptions(values, program)),
);
