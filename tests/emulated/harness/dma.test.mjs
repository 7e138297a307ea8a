/** DMA controller: pacing by the PIO's requests, sizes, rings, chains, interrupts, abort, and what it refuses. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { ChipBench, CYCLE_NS } from './chip_bench.mjs';

const DMA = 0x50000000;
const CH = (channel, offset) => DMA + 0x40 * channel + offset;
const [READ, WRITE, COUNT, CTRL_TRIG, AL1_CTRL, AL1_COUNT_TRIG, AL2_WRITE_TRIG, AL3_READ_TRIG] = [0, 4, 8, 0xc, 0x10, 0x1c, 0x2c, 0x3c];
const [INTR, INTE0, INTS0, INTE1, INTS1, MULTI, ABORT] = [0x400, 0x404, 0x40c, 0x414, 0x41c, 0x430, 0x444].map((o) => DMA + o);
const PIO0 = 0x50200000;
const [PIO_CTRL, FLEVEL, TXF0, RXF0] = [0, 0xc, 0x10, 0x20].map((o) => PIO0 + o);
const [TX0, RX0, UNPACED] = [0, 4, 0x3f];

const [EN, BYTES, HALVES, WORDS, INCR_READ, INCR_WRITE, QUIET, BSWAP, BUSY] = [1, 0, 4, 8, 16, 32, 1 << 21, 1 << 22, 1 << 24];
/** Memory to memory, in words. */
const COPY = WORDS | INCR_READ | INCR_WRITE | (0x3f << 15);
const ring = (size, write) => (size << 6) | (write ? 1 << 10 : 0);
const chain = (to) => to << 11;
const paced = (treq) => treq << 15;

const [A, B] = [0x20010000, 0x20020000];

class Bench extends ChipBench {
  /** Accesses from here fall in the middle of a cycle. */
  constructor(options) {
    super(options);
    this.runTo(CYCLE_NS / 2);
  }

  setUp(channel, { from = A, to = B, count, ctrl }) {
    this.write(CH(channel, READ), from);
    this.write(CH(channel, WRITE), to);
    this.write(CH(channel, COUNT), count);
    this.write(CH(channel, CTRL_TRIG), EN | ctrl | (ctrl & (15 << 11) ? 0 : chain(channel)));
  }

  busy(channel) {
    return (this.read(CH(channel, AL1_CTRL)) & BUSY) !== 0;
  }

  fill(address, bytes) {
    for (let i = 0; i < bytes; i++) this.ram.setUint8(address - 0x20000000 + i, (i * 37 + 11) & 0xff);
  }

  bytes(address, count) {
    return [...new Uint8Array(this.ram.buffer, address - 0x20000000, count)];
  }

  /** SM0 of PIO0 runs `program`, autopull and autopush of whole words. */
  pio(program, clkdiv = 1) {
    program.forEach((instruction, i) => this.write(PIO0 + 0x48 + 4 * i, instruction));
    this.write(PIO0 + 0xc8, clkdiv << 16);
    this.write(PIO0 + 0xcc, (program.length - 1) << 12);
    this.write(PIO0 + 0xd0, 15 << 16);
    this.write(PIO_CTRL, 1);
  }
}

test('memory to memory: one word a cycle after the first; TRANS_COUNT counts down and reloads', () => {
  const b = new Bench();
  b.fill(A, 400);
  b.setUp(3, { count: 100, ctrl: COPY });
  b.run(50);
  assert.ok(b.busy(3));
  assert.equal(b.read(CH(3, COUNT)), 100 - 46, 'issued in cycle 1, written four later');
  b.run(53);
  assert.ok(b.busy(3));
  b.run(1);
  assert.ok(!b.busy(3));
  assert.deepEqual(b.bytes(B, 400), b.bytes(A, 400));
  assert.deepEqual([b.read(CH(3, READ)), b.read(CH(3, WRITE))], [A + 400, B + 400]);
  b.write(CH(3, AL3_READ_TRIG), A);
  b.run(200);
  assert.equal(b.read(CH(3, WRITE)), B + 800);
});

test('bytes and halfwords', () => {
  for (const size of [BYTES, HALVES]) {
    const b = new Bench();
    b.fill(A, 12);
    b.setUp(0, { count: size === BYTES ? 12 : 6, ctrl: size | INCR_READ | INCR_WRITE | paced(UNPACED) });
    b.run(40);
    assert.deepEqual(b.bytes(B, 12), b.bytes(A, 12));
  }
});

test('narrow writes to a peripheral are replicated over the lanes; narrow reads take their lane', () => {
  const b = new Bench();
  b.fill(A, 2);
  b.setUp(0, { to: TXF0, count: 1, ctrl: BYTES | paced(TX0) });
  b.setUp(1, { to: TXF0 + 4, count: 1, ctrl: HALVES | paced(TX0 + 1) });
  b.run(10);
  const [low, high] = b.bytes(A, 2);
  assert.equal(b.chip.pio[0].machines[0].tx[0] >>> 0, (low * 0x01010101) >>> 0);
  assert.equal(b.chip.pio[0].machines[1].tx[0] >>> 0, (((high << 8) | low) * 0x10001) >>> 0);
  b.chip.pio[0].machines[2].rx.push(0x44332211);
  b.setUp(2, { from: RXF0 + 8 + 2, count: 1, ctrl: HALVES | paced(RX0 + 2) });
  b.run(10);
  assert.deepEqual(b.bytes(B, 2), [0x33, 0x44]);
});

test('transmit requests: as many words as the FIFO has room for, then one for each that the machine takes', () => {
  const b = new Bench();
  for (let i = 0; i < 64; i++) b.ram.setUint32(A - 0x20000000 + 4 * i, 1000 + i, true);
  b.setUp(0, { to: TXF0, count: 20, ctrl: WORDS | INCR_READ | paced(TX0) });
  b.run(200);
  assert.equal(b.read(FLEVEL) & 15, 4);
  assert.equal(b.read(CH(0, COUNT)), 16);
  // out x, 32 [9]: a word every ten cycles.
  b.pio([0x6020 | (9 << 8)]);
  const levels = new Set();
  const words = new Set();
  for (let i = 0; i < 210; i++) {
    b.run(1);
    levels.add(b.chip.pio[0].machines[0].tx.length);
    words.add(b.chip.pio[0].machines[0].x);
  }
  const sent = Array.from({ length: 20 }, (_, i) => 1000 + i);
  assert.deepEqual([...words].slice(-20), sent);
  assert.ok(!b.busy(0));
  assert.deepEqual(b.warnings, [], 'no FIFO overflow');
  assert.deepEqual([...levels].sort(), [0, 1, 2, 3, 4]);
});

test('receive requests: each word is fetched as it comes, none is read from an empty FIFO; both at once keep the pace', () => {
  const b = new Bench();
  for (let i = 0; i < 300; i++) b.ram.setUint32(A - 0x20000000 + 4 * i, i * 3, true);
  b.setUp(1, { from: RXF0, count: 300, ctrl: WORDS | INCR_WRITE | paced(RX0) });
  b.setUp(0, { to: TXF0, count: 300, ctrl: WORDS | INCR_READ | QUIET | paced(TX0) });
  b.write(INTE0, 3);
  b.run(20);
  assert.ok(b.busy(1));
  // out x, 32; in x, 32: a word every two cycles.
  b.pio([0x6020, 0x4020]);
  b.run(615);
  assert.ok(!b.busy(1));
  for (let i = 0; i < 300; i++) assert.equal(b.ram.getUint32(B - 0x20000000 + 4 * i, true), i * 3);
  assert.deepEqual(b.warnings, []);
  assert.equal(b.read(INTS0), 2, 'the quiet channel raises nothing');
  assert.equal((b.chip.core.pendingInterrupts >>> 11) & 1, 1);
  b.write(INTS0, 2);
  assert.equal((b.chip.core.pendingInterrupts >>> 11) & 1, 0);
  assert.equal(b.read(INTR), 0);
});

test('a ring keeps an address within its region, on the side that it is for', () => {
  const b = new Bench();
  b.fill(A, 16);
  b.setUp(0, { from: A + 4, count: 8, ctrl: WORDS | INCR_READ | INCR_WRITE | ring(4, false) | paced(UNPACED) });
  b.run(40);
  assert.deepEqual(b.bytes(B, 32), [...b.bytes(A + 4, 12), ...b.bytes(A, 16), ...b.bytes(A, 4)]);
  assert.equal(b.read(CH(0, READ)), A + 4);
  b.setUp(1, { from: A, to: B, count: 6, ctrl: HALVES | INCR_READ | INCR_WRITE | ring(2, true) | paced(UNPACED) });
  b.run(40);
  assert.deepEqual(b.bytes(B, 4), b.bytes(A + 8, 4));
});

test('a chain: the next channel starts when the last write ends; a control block of another channel reloads this one', () => {
  const b = new Bench();
  b.fill(A, 8);
  [READ, WRITE, COUNT].forEach((register, i) => b.write(CH(5, register), [A, B + 16, 2][i]));
  b.write(CH(5, AL1_CTRL), EN | WORDS | INCR_READ | INCR_WRITE | chain(5) | paced(UNPACED));
  b.run(20);
  assert.ok(!b.busy(5), 'AL1_CTRL does not trigger');
  b.setUp(2, { count: 2, ctrl: WORDS | INCR_READ | INCR_WRITE | chain(5) | paced(UNPACED) });
  b.run(6);
  assert.deepEqual([b.busy(2), b.busy(5)], [false, true]);
  b.run(20);
  assert.deepEqual(b.bytes(B + 16, 8), b.bytes(A, 8));
  // Channel 7 writes the write address of channel 5 through its trigger.
  b.ram.setUint32(0x100, B + 64, true);
  b.write(CH(5, READ), A);
  b.setUp(7, { from: 0x20000100, to: CH(5, AL2_WRITE_TRIG), count: 1, ctrl: WORDS | paced(UNPACED) });
  b.run(30);
  assert.deepEqual(b.bytes(B + 64, 8), b.bytes(A, 8));
});

test('interrupts: at the end, or, quiet, at a null trigger; two lines; several channels at once', () => {
  const b = new Bench();
  b.write(INTE1, 0b110);
  for (const channel of [1, 2]) {
    [READ, WRITE, COUNT].forEach((register, i) => b.write(CH(channel, register), [A, B, 4][i]));
    b.write(CH(channel, AL1_CTRL), EN | WORDS | chain(channel) | paced(UNPACED) | (channel === 2 ? QUIET : 0));
  }
  b.write(MULTI, 0b110);
  b.run(30);
  assert.equal(b.read(INTS1), 0b010);
  assert.equal(b.read(INTS0), 0);
  assert.equal((b.chip.core.pendingInterrupts >>> 12) & 1, 1);
  b.write(INTR, 0b010);
  b.write(CH(2, AL1_COUNT_TRIG), 0);
  assert.equal(b.read(INTS1), 0b100);
});

test('clearing EN pauses a channel, setting it resumes', () => {
  const b = new Bench();
  b.setUp(0, { count: 100, ctrl: COPY });
  b.run(20);
  b.write(CH(0, AL1_CTRL), b.read(CH(0, AL1_CTRL)) & ~1);
  b.run(20);
  const left = b.read(CH(0, COUNT));
  b.run(50);
  assert.deepEqual([b.busy(0), b.read(CH(0, COUNT))], [true, left]);
  b.write(CH(0, AL1_CTRL), b.read(CH(0, AL1_CTRL)) | 1);
  b.run(left + 10);
  assert.ok(!b.busy(0));
});

test('abort: a channel without transfers under way stops silently; others end theirs and then interrupt (E13)', () => {
  const b = new Bench();
  b.setUp(0, { to: TXF0, count: 20, ctrl: WORDS | paced(TX0) });
  b.run(50);
  b.write(ABORT, 1);
  assert.equal(b.read(ABORT), 0);
  assert.deepEqual([b.busy(0), b.read(INTR), b.read(CH(0, COUNT))], [false, 0, 0]);
  b.setUp(1, { count: 20, ctrl: WORDS | paced(UNPACED) });
  b.run(3);
  b.write(ABORT, 2);
  assert.deepEqual([b.read(ABORT), b.busy(1)], [0, true]);
  b.run(5);
  assert.deepEqual([b.busy(1), b.read(INTR)], [false, 2]);
});

function refuses(name, pattern, action, options) {
  test(`fails: ${name}`, () => {
    const b = new Bench(options);
    assert.throws(() => action(b), /failure/);
    assert.match(b.warnings.at(-1), pattern);
  });
}
refuses('held in reset', /while DMA is held in reset/, (b) => b.write(INTE0, 1), { held: 1 << 2 });
refuses('request that is not modelled', /request 20 is not modelled/, (b) => b.setUp(0, { count: 1, ctrl: WORDS | paced(20) }));
refuses('misaligned address', /not aligned to 4 bytes/, (b) => b.setUp(0, { from: A + 2, count: 1, ctrl: WORDS | paced(UNPACED) }));
refuses('data size 3', /DATA_SIZE 3/, (b) => b.setUp(0, { count: 1, ctrl: 3 << 2 }));
refuses('swapped bytes', /BSWAP and SNIFF_EN are not modelled/, (b) => b.setUp(0, { count: 1, ctrl: WORDS | BSWAP | paced(UNPACED) }));
refuses('two channels on one request', /as busy channel 0 is/, (b) =>
  [0, 1].forEach((c) => b.setUp(c, { to: TXF0, count: 9, ctrl: WORDS | paced(TX0) })),
);
refuses('address written while busy', /READ_ADDR written while the channel is busy/, (b) =>
  [0, 1].forEach(() => b.setUp(0, { to: TXF0, count: 9, ctrl: WORDS | paced(TX0) })),
);
refuses('SIO as a target', /which DMA cannot reach/, (b) => {
  b.setUp(0, { to: 0xd0000010, count: 1, ctrl: WORDS | paced(UNPACED) });
  b.run(10);
});
refuses('PIO in reset as a target', /while PIO0 is held in reset/, (b) => {
  b.chip.resets.held = 1 << 10;
  b.setUp(0, { to: TXF0, count: 1, ctrl: WORDS | paced(UNPACED) });
  b.run(10);
});
