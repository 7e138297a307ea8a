/** DMA controller: pacing by the PIO's requests, rings, chains, interrupts, and what it refuses. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { ChipBench, CYCLE_NS } from './chip_bench.mjs';

const DMA = 0x50000000;
const CH = (channel, offset) => DMA + 0x40 * channel + offset;
const [READ, WRITE, COUNT, CTRL_TRIG, AL1_CTRL] = [0, 4, 8, 0xc, 0x10];
const [INTE0, INTS0] = [0x404, 0x40c].map((o) => DMA + o);
const PIO0 = 0x50200000;
const [PIO_CTRL, TXF0, RXF0] = [0, 0x10, 0x20].map((o) => PIO0 + o);
const [TX0, RX0, UNPACED] = [0, 4, 0x3f];

const [EN, HALVES, WORDS, INCR_READ, INCR_WRITE, QUIET, BSWAP, BUSY] = [1, 4, 8, 16, 32, 1 << 21, 1 << 22, 1 << 24];
/** Memory to memory, in words. */
const COPY = WORDS | INCR_READ | INCR_WRITE | (0x3f << 15);
const ring = (size) => (size << 6) | (1 << 10);
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
    return (this.read(CH(channel, CTRL_TRIG)) & BUSY) !== 0;
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
    this.write(PIO0 + 0xdc, 16 << 20);
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
  b.write(CH(3, CTRL_TRIG), b.read(CH(3, CTRL_TRIG)));
  b.run(200);
  assert.equal(b.read(CH(3, WRITE)), B + 800);
});

test('transmit requests: as many words as the FIFO has room for, then one for each that the machine takes', () => {
  const b = new Bench();
  for (let i = 0; i < 64; i++) b.ram.setUint32(A - 0x20000000 + 4 * i, 1000 + i, true);
  b.setUp(0, { to: TXF0, count: 20, ctrl: WORDS | INCR_READ | paced(TX0) });
  b.run(200);
  assert.equal(b.chip.pio[0].tx.length, 4);
  assert.equal(b.read(CH(0, COUNT)), 16);
  // out pindirs, 32 [9]: a word every ten cycles.
  b.pio([0x6080 | (9 << 8)]);
  const levels = new Set();
  const words = new Set();
  for (let i = 0; i < 210; i++) {
    b.run(1);
    levels.add(b.chip.pio[0].tx.length);
    words.add(b.chip.pio[0].pinDirections);
  }
  const sent = Array.from({ length: 20 }, (_, i) => 1000 + i);
  assert.deepEqual([...words].slice(-20), sent);
  assert.ok(!b.busy(0));
  assert.deepEqual(b.warnings, [], 'no FIFO overflow');
  assert.deepEqual([...levels].sort(), [0, 1, 2, 3, 4]);
});

test('receive requests: each word is fetched as it comes, none is read from an empty FIFO; both at once keep the pace', () => {
  const b = new Bench();
  // What is driven low comes back: pull-ups, and the inputs are two cycles late.
  b.pinFunction([...Array(16).keys()], 6);
  for (let pin = 0; pin < 16; pin++) b.write(0x4001c004 + 4 * pin, 0x4a);
  for (let i = 0; i < 300; i++) b.ram.setUint32(A - 0x20000000 + 4 * i, i * 3, true);
  b.setUp(1, { from: RXF0, count: 300, ctrl: WORDS | INCR_WRITE | paced(RX0) });
  b.setUp(0, { to: TXF0, count: 300, ctrl: WORDS | INCR_READ | QUIET | paced(TX0) });
  b.write(INTE0, 3);
  b.run(20);
  assert.ok(b.busy(1));
  // out pindirs, 32 [3]; in pins, 32: a word every five cycles.
  b.pio([0x6380, 0x4000]);
  b.run(1520);
  assert.ok(!b.busy(1));
  for (let i = 0; i < 300; i++) assert.equal(~b.ram.getUint32(B - 0x20000000 + 4 * i, true) & 0xffff, i * 3);
  assert.deepEqual(b.warnings, []);
  assert.equal(b.read(INTS0), 2, 'the quiet channel raises nothing');
  assert.equal((b.chip.core.pendingInterrupts >>> 11) & 1, 1);
  b.write(INTS0, 2);
  assert.equal((b.chip.core.pendingInterrupts >>> 11) & 1, 0);
  assert.equal(b.read(INTS0), 0);
});

test('a channel that only receives starts with each word', () => {
  const b = new Bench();
  b.setUp(1, { from: RXF0, count: 3, ctrl: WORDS | INCR_WRITE | paced(RX0) });
  b.pio([0x5f00]); // in pins, 32 [31]
  b.run(80);
  assert.ok(!b.busy(1));
});

test('a ring keeps the address written within its region', () => {
  const b = new Bench();
  b.fill(A, 24);
  b.setUp(1, { count: 6, ctrl: COPY | ring(4) });
  b.run(40);
  assert.deepEqual(b.bytes(B, 16), [...b.bytes(A + 16, 8), ...b.bytes(A + 8, 8)]);
  assert.equal(b.read(CH(1, WRITE)), B + 8);
});

test('a chain: the next channel starts when the last write ends, with the number that it had', () => {
  const b = new Bench();
  b.fill(A, 8);
  [READ, WRITE, COUNT].forEach((register, i) => b.write(CH(5, register), [A, B + 16, 2][i]));
  b.write(CH(5, AL1_CTRL), EN | COPY | chain(5));
  b.run(20);
  assert.ok(!b.busy(5), 'AL1_CTRL does not trigger');
  b.setUp(2, { count: 2, ctrl: COPY | chain(5) });
  b.run(6);
  assert.deepEqual([b.busy(2), b.busy(5)], [false, true]);
  b.run(20);
  assert.deepEqual(b.bytes(B + 16, 8), b.bytes(A, 8));
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
refuses('halfwords', /only words are modelled/, (b) => b.setUp(0, { count: 1, ctrl: HALVES | paced(UNPACED) }));
refuses('an abort', /Unimplemented/, (b) => b.write(DMA + 0x444, 1));
refuses('swapped bytes', /BSWAP, SNIFF_EN .* are not modelled/, (b) => b.setUp(0, { count: 1, ctrl: WORDS | BSWAP | paced(UNPACED) }));
refuses('two channels on one request', /as busy channel 0 is/, (b) =>
  [0, 1].forEach((c) => b.setUp(c, { to: TXF0, count: 9, ctrl: WORDS | paced(TX0) })),
);
refuses('address written while busy', /readAddress written while the channel is busy/, (b) =>
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
