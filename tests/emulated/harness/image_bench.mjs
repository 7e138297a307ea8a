/** A release image on its board, with a host that opens its port, for tests that look at the chip. Times are emulated, in ms. */
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { findBoard } from '../../../host_tools/simulation/emulator/board/boards.mjs';
import { parseFaults } from '../../../host_tools/simulation/emulator/faults.mjs';
import { Machine } from '../../../host_tools/simulation/emulator/machine.mjs';
import { steady } from './bench.mjs';

const commands = new Map();
const HELD = 1 << 6; // contact_flags.h

/** images: the folder with those of all boards; folder: that of this one; tools: { fingertip, command_frame }, the tool and the program of tests/support. */
export class ImageBench {
  constructor(images, tools, name, { faults = [], folder = join(images, name), ...options } = {}) {
    const Board = findBoard(name);
    this.tools = tools;
    this.elf = join(folder, `fingertip-${name}.elf`);
    this.received = [];
    this.bytes = 0;
    this.machine = new Machine({
      image: readFileSync(join(folder, `fingertip-${name}.bin`)),
      Board,
      scenario: steady(),
      fastEnumeration: true,
      allowWatchdog: true,
      faults: parseFaults(JSON.stringify(faults), 'faults', Board),
      onData: (bytes) => {
        this.received.push(Buffer.from(bytes));
        this.bytes += bytes.length;
      },
      ...options,
    });
    this.machine.client.setDtr(true);
  }

  /** The bytes of a command. */
  encoded(...command) {
    const words = command.join(' ');
    if (!commands.has(words))
      commands.set(words, Buffer.from(execFileSync(this.tools.command_frame, command, { encoding: 'utf8' }).trim(), 'hex'));
    return commands.get(words);
  }

  get now_ms() {
    return this.machine.time.nanos / 1e6;
  }

  run(ms) {
    const { machine } = this;
    if (!machine.run(machine.time.nanos + ms * 1e6)) assert.fail(`${machine.endReason} ${machine.result.warnings}`);
  }

  /** Runs until `what()`; the time. */
  until(what, limit_ms, name) {
    const end_ms = this.now_ms + limit_ms;
    while (!what()) {
      assert.ok(this.now_ms < end_ms, `no ${name} within ${limit_ms} ms`);
      this.run(1);
    }
    return this.now_ms;
  }

  /** Asks for the streams of a port that was just opened; the time at which they come. */
  stream(limit_ms = 200) {
    const { machine } = this;
    this.until(() => machine.host.configured, limit_ms, 'enumeration');
    this.run(10);
    const before = this.bytes;
    machine.client.write(this.encoded('stream', 'contact,raw,health'));
    return this.until(() => this.bytes > before + 100, 100, 'stream');
  }

  assertStreams(ms) {
    const before = this.bytes;
    this.run(ms);
    assert.ok(this.bytes - before > 20 * ms, `${this.bytes - before} bytes in ${ms} ms`);
  }

  /** The recording of what was received. */
  recording() {
    const folder = mkdtempSync(join(tmpdir(), 'silicon-'));
    try {
      const [stream, table] = [join(folder, 'stream.ftr'), join(folder, 'stream.csv')];
      writeFileSync(stream, Buffer.concat(this.received));
      execFileSync(this.tools.fingertip, ['convert', stream, table], { stdio: 'pipe' });
      return readFileSync(table, 'utf8').trim().split('\n');
    } finally {
      rmSync(folder, { recursive: true });
    }
  }

  /** What the device says of itself. */
  health() {
    this.machine.client.write(this.encoded('health'));
    this.run(20);
    const line = this.recording().findLast((l) => l.startsWith('# packet: health'));
    return Object.fromEntries([...line.matchAll(/(\w+)=(\S+)/g)].map(([, key, value]) => [key, Number(value)]));
  }

  /** Frames of the recording, by column; NaN where there is nothing. */
  rows() {
    const lines = this.recording().filter((l) => !l.startsWith('#'));
    const [head, ...rows] = lines.map((l) => l.split(','));
    return rows.map((cells) => Object.fromEntries(head.map((name, i) => [name, cells[i] === '' ? NaN : Number(cells[i])])));
  }

  /** The last one that was measured, and came with both packets. */
  lastRow() {
    return this.rows().findLast(({ raw_flags }) => !Number.isNaN(raw_flags) && !(raw_flags & HELD));
  }

  /** Flags of that frame. */
  flags() {
    return this.lastRow().flags;
  }

  end() {
    assert.deepEqual(this.machine.result.warnings, []);
    return this.machine.result;
  }
}
