#!/usr/bin/env node
/** A release image in the emulator, as the bench of fingertip_soak: see USAGE. */
import { spawn } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { createInterface } from 'node:readline';
import { parseArgs } from 'node:util';
import { findBoard } from '../../host_tools/simulation/emulator/board/boards.mjs';
import { InputError } from '../../host_tools/simulation/emulator/errors.mjs';
import { parseFaults } from '../../host_tools/simulation/emulator/faults.mjs';
import { Machine } from '../../host_tools/simulation/emulator/machine.mjs';

const USAGE = `usage: emulated.mjs --image FILE.bin --board NAME --soak PROGRAM [--seed N] [--seconds S] [--show FROM_s TO_s] [--steady]

One episode of a soak: runs the image on the emulated board while PROGRAM, fingertip_soak, says what is felt, what goes
wrong and what the host sends (emulated_plant.hpp). The same bit for bit each time. Prints PROGRAM's JSON object.
--steady: nothing goes wrong, and the clock crosses 2^32 us in the middle.

Exit: as PROGRAM; 2 wrong usage.`;

/** After a start by these the clocks come late: the watchdog may help, which is no failure. */
const LATE = { start_crystal_weak: 'crystal_weak', start_crystal_dead: 'crystal_dead', start_pll_late: 'pll_late' };
const OFF_NS = 5e6;

class Bench {
  constructor({ image, board, seed, uptime_us }) {
    this.Board = findBoard(board);
    this.rows = [];
    this.events = [];
    this.mayRestart_ns = -1;
    this.unasked = 0;
    this.open = false;
    this.closed = 0;
    this.asleep = 0;
    const stimulus = { at_ns: (sensor, t_ns) => this.#felt(sensor, t_ns) };
    const machine = new Machine({
      image: readFileSync(image),
      Board: this.Board,
      scenario: stimulus,
      seed,
      uptime_us,
      fastEnumeration: true,
      allowWatchdog: true,
      onData: (bytes) => {
        this.#look();
        this.events.push(['bytes', this.#now_us(), Buffer.from(bytes).toString('hex')]);
      },
    });
    this.machine = machine;
    machine.onPowerUp = () => {
      const { reason } = machine.chip.watchdog;
      if (reason && machine.time.nanos > this.mayRestart_ns) this.unasked += 1;
      this.#look();
      this.events.push(['start', this.#now_us()]);
    };
    this.ofTheHost = {
      port_closed: (active) => {
        this.closed += active ? 1 : -1;
        machine.client.setDtr(this.closed === 0);
      },
      suspend: (active) => this.#sleep(active),
    };
    machine.client.setDtr(true);
  }

  #now_us() {
    return Math.round(this.machine.time.nanos / 1000);
  }

  /** A host sleeps as long as anything wants it to; a device that it lost meanwhile it finds when it wakes up. */
  #sleep(active) {
    const { host } = this.machine;
    this.asleep += active ? 1 : -1;
    if (active && host.state === 'active' && host.device) host.suspend();
    if (!active && this.asleep === 0 && host.state === 'suspended') host.resume();
    this.#look();
  }

  #felt(sensor, t_ns) {
    const [first] = this.rows;
    const step_ns = 1e4 * 1000;
    const at = Math.min(Math.max((t_ns - first.t_us * 1000) / step_ns, 0), this.rows.length - 1);
    const before = Math.floor(at);
    const [a, b] = [this.rows[before], this.rows[Math.min(before + 1, this.rows.length - 1)]];
    const mix = (x, y) => x + (y - x) * (at - before);
    return { pressure_Pa: mix(a.Pa[sensor], b.Pa[sensor]), temperature_degC: mix(a.degC, b.degC) };
  }

  /** Tells when the port opens and closes, and where the device's clock began. */
  #look() {
    const { host, client, chip } = this.machine;
    const open = this.machine.hasPower && host.configured && host.state === 'active' && client.dtr;
    const life = `${host.statistics.enumerations} ${this.closed}`;
    if (this.open && (!open || life !== this.life)) {
      this.open = false;
      this.events.push(['close', this.#now_us()]);
    }
    if (open && !this.open) {
      this.open = true;
      this.events.push(['open', this.#now_us()]);
    }
    this.life = life;
    const { zero_ns } = chip.timer;
    if (zero_ns !== null && zero_ns !== this.zero_ns) {
      this.zero_ns = zero_ns;
      this.events.push(['zero', this.#now_us(), zero_ns / 1000]);
    }
  }

  #add(fault) {
    const { faults } = this.machine;
    const { type, from_s } = fault;
    if (LATE[type]) {
      const [off] = parseFaults(JSON.stringify([{ type: 'power_cut', from_s, to_s: from_s + OFF_NS / 1e9 }]), 'soak', this.Board);
      const [late] = parseFaults(JSON.stringify([{ ...fault, type: LATE[type] }]), 'soak', this.Board);
      faults.add(late);
      faults.add(off);
      this.mayRestart_ns = late.to_ns + 1e9;
    } else if (this.ofTheHost[type]) {
      for (const [active, t_s] of [
        [true, from_s],
        [false, fault.to_s],
      ])
        this.machine.scope.createAlarm(() => this.ofTheHost[type](active)).scheduleAt(t_s * 1e9);
    } else {
      faults.add(parseFaults(JSON.stringify([fault]), 'soak', this.Board)[0]);
    }
  }

  /** But one: a sensor that does not hear the reset at the start hears what is meant for the others when it comes back. */
  get warnings() {
    return this.machine.result.warnings.filter((line) => !line.includes('conversion before the reset command that loads its PROM'));
  }

  /** One line to the next. */
  step({ to_us, rows, faults, write }) {
    const { machine } = this;
    this.rows.push(...rows);
    while (this.rows.length > 100) this.rows.shift();
    faults.forEach((fault) => this.#add(fault));
    if (write) machine.client.write(Buffer.from(write, 'hex'));
    machine.run(to_us * 1000);
    this.#look();
    const answer = {
      events: this.events,
      unasked: this.unasked,
      ended: machine.endReason ? `${machine.endReason} ${this.warnings.join('; ')}` : '',
    };
    this.events = [];
    return answer;
  }
}

async function main(argv) {
  let values, positionals;
  try {
    ({ values, positionals } = parseArgs({
      args: argv,
      strict: true,
      allowPositionals: true,
      options: {
        image: { type: 'string' },
        board: { type: 'string' },
        soak: { type: 'string' },
        seed: { type: 'string', default: '1' },
        seconds: { type: 'string', default: '60' },
        show: { type: 'string' },
        steady: { type: 'boolean' },
        help: { type: 'boolean' },
      },
    }));
  } catch (error) {
    throw new InputError(`${error.message.split('\n')[0]}; see --help`);
  }
  if (values.help) return void process.stdout.write(`${USAGE}\n`);
  for (const name of ['image', 'board', 'soak']) if (!values[name]) throw new InputError(`--${name} is missing; see --help`);
  const seed = Number(values.seed);
  if (!Number.isInteger(seed) || seed < 1 || seed > 1e9)
    throw new InputError(`--seed "${values.seed}" is not a whole number from 1 to 1000000000`);
  const more = [...(values.show === undefined ? [] : ['--show', values.show, ...positionals]), ...(values.steady ? ['--steady'] : [])];
  const child = spawn(values.soak, ['--emulated', values.board, '--seed', `${seed}`, '--seconds', values.seconds, ...more], {
    stdio: ['pipe', 'pipe', 'inherit'],
  });
  const ended = new Promise((resolve, reject) => {
    child.on('error', (error) => reject(new InputError(`${values.soak}: cannot be run (${error.code})`)));
    child.on('close', (code, signal) => resolve(signal ? 1 : code));
  });
  child.stdin.on('error', () => {}); // what it did not read shows in how it ended
  const bench = new Bench({
    image: values.image,
    board: values.board,
    seed,
    uptime_us: values.steady ? 2 ** 32 - 5e5 * Number(values.seconds) : undefined,
  });
  for await (const line of createInterface({ input: child.stdout })) {
    const said = JSON.parse(line);
    if (said.to_us === undefined) {
      process.stdout.write(`${JSON.stringify({ ...said, warnings: bench.warnings })}\n`);
      break;
    }
    child.stdin.write(`${JSON.stringify(bench.step(said))}\n`);
  }
  process.exitCode = await ended;
}

main(process.argv.slice(2)).catch((error) => {
  process.stderr.write(`emulated.mjs: ${error.stack}\n`);
  process.exitCode = error instanceof InputError ? 2 : 1;
});
