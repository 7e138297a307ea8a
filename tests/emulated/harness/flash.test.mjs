/** The flash chip: what it takes, how long, what it refuses, and what is left when its power goes. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { BUSY_NS, FLASH_BYTES, FlashMemory } from '../../../host_tools/simulation/emulator/chip/flash_memory.mjs';
import { SimulatedTime } from '../../../host_tools/simulation/emulator/clock.mjs';
import { makeMachine } from './bench.mjs';
import { ChipBench, CYCLE_NS } from './chip_bench.mjs';

const AT = 0x1fe000;
const address = (at) => [(at >> 16) & 0xff, (at >> 8) & 0xff, at & 0xff];
const READ = (at) => [0x03, ...address(at)];
const PROGRAM = (at, ...data) => [0x02, ...address(at), ...data];
const ERASE = (at) => [0x20, ...address(at)];

/** Commands through the SSI as a driver gives them: forced chip select, eight-bit frames. */
class Driver extends ChipBench {
  constructor() {
    super();
    this.write(0x18000008, 0);
    this.write(0x18000000, 7 << 16);
    this.write(0x18000008, 1);
    this.memory = this.chip.memory;
  }

  command(bytes) {
    this.write(0x4001800c, 2 << 8);
    const answer = [];
    for (const byte of bytes) {
      this.write(0x18000060, byte);
      while (!this.read(0x18000024)) this.run(8);
      answer.push(this.read(0x18000060));
    }
    this.write(0x4001800c, 0);
    return answer;
  }

  get status() {
    return this.command([0x05, 0])[1];
  }

  /** Gives a changing command and waits for its end; returns how long that took. */
  change(bytes) {
    this.command([0x06]);
    this.command(bytes);
    const began_ns = this.time.nanos;
    while (this.status & 1) this.run(1000);
    return this.time.nanos - began_ns;
  }

  bytes(at, count) {
    return this.command([...READ(at), ...new Array(count).fill(0)]).slice(4);
  }
}

/** Of these commands, one after the other, or what else is done with the driver, the last fails. */
function fails(name, pattern, ...acts) {
  test(`fails: ${name}`, () => {
    const driver = new Driver();
    const act = (what) => (typeof what === 'function' ? what(driver) : driver.command(what));
    acts.slice(0, -1).forEach(act);
    assert.throws(() => act(acts.at(-1)), { reason: 'failure' });
    assert.match(driver.warnings.join('\n'), pattern);
  });
}

test('programming clears bits, erasing sets them, each takes its time and ends write enable', () => {
  const driver = new Driver();
  assert.deepEqual(driver.bytes(AT, 3), [0xff, 0xff, 0xff]);
  const page_ns = driver.change(PROGRAM(AT + 1, 0xf0, 0x3c));
  assert.ok(Math.abs(page_ns - 0.7e6) < 20e3, `${page_ns}`);
  assert.equal(driver.status, 0);
  driver.change(PROGRAM(AT + 1, 0x1f));
  assert.deepEqual(driver.bytes(AT, 4), [0xff, 0x10, 0x3c, 0xff]);
  driver.memory.bytes.fill(0, AT - 1, AT + 4097);
  const sector_ns = driver.change(ERASE(AT + 77));
  assert.ok(Math.abs(sector_ns - 45e6) < 100e3, `${sector_ns}`);
  const edges = [AT - 1, AT, AT + 4095, AT + 4096].map((at) => driver.memory.bytes[at]);
  assert.deepEqual(edges, [0, 0xff, 0xff, 0]);
});

test('bytes take bus time', () => {
  const driver = new Driver();
  driver.command(READ(AT));
  const began_ns = driver.time.nanos;
  driver.command([...READ(AT), ...new Array(12).fill(0)]);
  assert.ok(driver.time.nanos - began_ns >= 16 * 8 * 4 * CYCLE_NS);
});

test('write enable shows in the status and is needed again each time', () => {
  const driver = new Driver();
  driver.command([0x06]);
  assert.equal(driver.status, 2);
  driver.command(PROGRAM(AT, 0));
  assert.equal(driver.status, 3);
});

const WRITE_ENABLE = [0x06];
fails('page program without write enable', /page programmed without write enable/, PROGRAM(AT, 0));
fails('sector erase without write enable', /sector erased without write enable/, ERASE(AT));
fails('reading while busy', /0x3 while the flash is busy/, WRITE_ENABLE, ERASE(AT), READ(AT));
fails('beyond the end of a page', /passes the end of the page/, WRITE_ENABLE, PROGRAM(AT + 250, ...new Array(7).fill(0)));
fails('page program without data', /without data/, WRITE_ENABLE, PROGRAM(AT));
fails('an unknown command', /0xd8 is not modelled/, [0xd8]);
fails('a second program without write enable', /without write enable/, (d) => d.change(PROGRAM(AT, 0)), PROGRAM(AT, 0));
fails('execution in place while busy', /read of flash at .* while the flash is busy/, WRITE_ENABLE, ERASE(AT), (d) => {
  d.write(0x18000008, 0);
  d.write(0x18000000, (31 << 16) | (3 << 8));
  d.write(0x18000008, 1);
  d.read(0x10000000);
});

fails('continuous-read mode', /read of flash at .* the SSI sends no command/, (d) => {
  d.write(0x18000008, 0);
  d.write(0x18000000, (31 << 16) | (3 << 8));
  d.write(0x180000f4, 0xa0 << 24);
  d.write(0x18000008, 1);
  d.read(0x10000000);
});

/** Erases or programs on a memory without a chip, cut after part of the time. */
function cut(seed, command, share, prepare = () => {}) {
  const time = new SimulatedTime();
  const memory = new FlashMemory({ time, serial: new Uint8Array(8), seed });
  prepare(memory);
  const before = memory.bytes.slice();
  const give = (bytes) => {
    memory.select();
    const answer = bytes.map((b) => memory.exchange(b));
    memory.deselect();
    return answer;
  };
  give([0x06]);
  give(command);
  time.advanceTo(share * (command[0] === 0x20 ? BUSY_NS.typical.erase : BUSY_NS.typical.program));
  time.fireDue();
  memory.cutPower();
  return { memory, before, give };
}

const DATA = Array.from({ length: 100 }, (_, i) => (i * 37) & 0xff);

test('a page program that is cut short changes only bits that it was to clear', () => {
  let [torn, differing] = [0, 0];
  const outcomes = new Set();
  for (let seed = 1; seed <= 60; seed++) {
    const { memory, before, give } = cut(seed, PROGRAM(AT + 8, ...DATA), 0.5);
    for (let i = 0; i < FLASH_BYTES; i += i < AT || i >= AT + 256 ? 997 : 1) {
      const to = i >= AT + 8 && i < AT + 108 ? DATA[i - AT - 8] : 0xff;
      assert.equal(memory.bytes[i] & to, to & before[i], `byte ${i}`);
    }
    const reading = () => give([...READ(AT + 8), ...new Array(100).fill(0)]).slice(4);
    const readings = [1, 2, 3].map(() => reading().join());
    torn += memory.unstable.size > 0 ? 1 : 0;
    differing += new Set(readings).size > 1 ? 1 : 0;
    outcomes.add(readings[0]);
    // Programmed once more it is whole.
    give([0x06]);
    give(PROGRAM(AT + 8, ...DATA));
    memory.time.advanceTo(memory.busyUntil_ns);
    memory.time.fireDue();
    assert.deepEqual(reading(), DATA);
    assert.equal(memory.unstable.size, 0);
  }
  assert.ok(torn > 30 && differing > 10 && outcomes.size > 30, `${torn} ${differing} ${outcomes.size}`);
});

test('an erase that is cut short stays in its sector', () => {
  const old = (memory) => memory.bytes.fill(0x5a, AT - 4096, AT + 8192);
  let [whole, gone] = [0, 0];
  for (let seed = 1; seed <= 40; seed++) {
    const { memory } = cut(seed, ERASE(AT), 0.3, old);
    assert.ok(memory.bytes.subarray(AT - 4096, AT).every((b) => b === 0x5a));
    assert.ok(memory.bytes.subarray(AT + 4096, AT + 8192).every((b) => b === 0x5a));
    const left = memory.bytes.subarray(AT, AT + 4096);
    whole += left.filter((b) => b === 0x5a).length > 4000 ? 1 : 0;
    gone += left.filter((b) => b === 0xff).length > 4000 ? 1 : 0;
  }
  assert.ok(whole > 2 && gone > 2, `${whole} ${gone}`);
});

test('what was done before the power went stays done', () => {
  const { memory } = cut(5, PROGRAM(AT, ...DATA), 1.01);
  assert.deepEqual([...memory.bytes.subarray(AT, AT + 100)], DATA);
  assert.equal(memory.programs, 1);
});

test('a reset does not reach the flash: the boot ROM waits for it, for so many cycles', () => {
  for (const flashSpeed of ['typical', 'slowest']) {
    const machine = makeMachine('void main(void) { for (;;) { } }', { flashSpeed });
    machine.run(2e6);
    const { memory } = machine;
    for (const command of [WRITE_ENABLE, ERASE(AT)]) {
      memory.select();
      command.forEach((b) => memory.exchange(b));
      memory.deselect();
    }
    const busyUntil_ns = memory.busyUntil_ns;
    const cycles = machine.chip.core.cycles;
    machine.chip.boot();
    machine.run(busyUntil_ns - 1e3);
    assert.equal(machine.chip.core.cycles, cycles);
    machine.run(busyUntil_ns + 1e6);
    assert.ok(machine.chip.core.cycles > cycles);
  }
});

test('at its fast corner the ring oscillator makes the boot ROM give up before the slowest erase ends', () => {
  for (const [rosc_hz, most_ms] of Object.entries({ 6.5e6: 471, 12e6: 255 })) {
    const machine = makeMachine('void main(void) { for (;;) { } }', { rosc_hz: Number(rosc_hz) });
    machine.run(2e6);
    machine.memory.operation = { kind: 'erase', at: AT };
    const bootWith = (busy_ms) => {
      machine.memory.busyUntil_ns = machine.time.nanos + busy_ms * 1e6;
      machine.chip.boot();
    };
    bootWith(most_ms - 5);
    assert.throws(() => bootWith(most_ms + 5), { reason: 'failure' });
    assert.match(machine.result.warnings.join(), new RegExp(`busy for longer than ${most_ms} ms`));
  }
});

test('a power cut starts everything again but the flash', () => {
  const source = `void main(void) { start_clocks(); RESULT(0) = RESULT(0) == 0x12345678 ? 1 : 0x12345678; for (;;) { } }`;
  const machine = makeMachine(source, { faults: [{ type: 'power_cut', from_s: 0.1, to_s: 0.15 }] });
  machine.run(0.09e9);
  const first = machine.chip;
  machine.memory.bytes[AT] = 0x42;
  const result = () => new Uint32Array(machine.chip.sram.buffer)[0x30000 / 4];
  assert.equal(result(), 0x12345678);
  machine.run(0.12e9);
  const cycles = first.core.cycles;
  machine.run(0.149e9);
  assert.equal(first.core.cycles, cycles, 'nothing runs without power');
  machine.run(0.2e9);
  assert.notEqual(machine.chip, first);
  assert.equal(result(), 0x12345678, 'SRAM has forgotten');
  assert.equal(machine.memory.bytes[AT], 0x42);
  assert.deepEqual(machine.result.flash, { erases: 0, programs: 0, power_cuts: 1 });
  assert.equal(machine.result.reboots, 0);
});
