/** PIO against the RP2040 datasheet, chapter 3: in every cycle like a plain model of it, and case by case. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Prng } from '../../../host_tools/simulation/emulator/prng.mjs';
import { ChipBench } from './chip_bench.mjs';
import { ReferencePio } from './pio_reference.mjs';

const PIO0 = 0x50200000;
const [CTRL, TXF0, RXF0, INSTR_MEM0] = [0, 0x10, 0x20, 0x48].map((o) => PIO0 + o);
const [CLKDIV, EXECCTRL, SHIFTCTRL, ADDR, INSTR, PINCTRL] = [0xc8, 0xcc, 0xd0, 0xd4, 0xd8, 0xdc].map((o) => PIO0 + o);

const op = (kind, arg, low, delay = 0) => (kind << 13) | (delay << 8) | (arg << 5) | (low & 31);
const jmp = (to, condition = 0, delay) => op(0, condition, to, delay);
const wait = (polarity, index, delay) => op(1, (polarity << 2) | 1, index, delay);
const inn = (bits, delay) => op(2, 0, bits, delay);
const out = (bits, delay) => op(3, 4, bits, delay);
const push = (delay) => op(4, 0, 0, delay);
const lower = (delay) => op(5, 0, 3, delay);
const notY = (delay) => op(5, 6, 10, delay);
const set = (destination, value, delay) => op(7, destination, value, delay);
const [X, Y] = [1, 2];
const [AUTOPUSH, AUTOPULL, IN_RIGHT, OUT_RIGHT, JOIN_RX] = [1 << 16, 1 << 17, 1 << 18, 1 << 19, 2 ** 31];

/** A bench with `program` at 0: wrap around it, pin groups from GPIO0, pins 0 to 15 with PIO0. */
function bench(program, { shift = IN_RIGHT | OUT_RIGHT, clkdiv = 1 << 16, start = true } = {}) {
  const b = new ChipBench();
  b.pinFunction([...Array(16).keys()], 6);
  program.forEach((instruction, i) => b.write(INSTR_MEM0 + 4 * i, instruction));
  b.write(CLKDIV, clkdiv);
  b.write(EXECCTRL, (program.length - 1) << 12);
  b.write(SHIFTCTRL, shift);
  b.write(PINCTRL, 16 << 20);
  b.pio = b.chip.pio[0];
  if (start) b.write(CTRL, 1);
  return b;
}

test('agrees in every cycle with a plain model of the datasheet: random programs, dividers, FIFO traffic, pins', () => {
  const random = new Prng(2040);
  const below = (n) => random.uint32() % n;
  const pick = (list) => list[below(list.length)];
  const instruction = () => {
    const delay = random.uniform() < 0.5 ? 0 : below(32);
    const kinds = [
      () => jmp(below(32), pick([0, 2, 4, 6]), delay),
      () => wait(below(2), below(32), delay),
      () => inn(below(32), delay),
      () => out(below(32), delay),
      () => push(delay),
      () => pick([lower, notY])(delay),
      () => set(pick([X, Y]), below(32), delay),
    ];
    return pick(kinds)();
  };
  const executed = new Set();
  for (let round = 0; round < 150; round++) {
    const b = new ChipBench();
    b.pinFunction([...Array(16).keys()], 6);
    let outside = random.uint32() & 0x3fff0000;
    b.chip.pins.setLevels(0x3fff0000, outside);
    b.run(8);
    const memory = Array.from({ length: 32 }, instruction);
    memory.forEach((m, i) => b.write(INSTR_MEM0 + 4 * i, m));
    const drawn = (of, ...names) => Object.fromEntries(names.map((name) => [name, below(of)]));
    const c = {
      ...{ divisor: pick([1, 1, 2, 5, 7]), jumpPin: below(30), outCount: below(32) },
      ...drawn(2, 'autopush', 'autopull', 'join'),
      ...drawn(32, 'wrapTop', 'wrapBottom', 'inBase', 'outBase'),
    };
    c.rxDepth = c.join ? 8 : 4;
    b.write(CLKDIV, c.divisor << 16);
    b.write(EXECCTRL, (c.wrapBottom << 7) | (c.wrapTop << 12) | (c.jumpPin << 24));
    b.write(SHIFTCTRL, (c.autopush ? AUTOPUSH : 0) | (c.autopull ? AUTOPULL : 0) | IN_RIGHT | OUT_RIGHT | (c.join ? JOIN_RX : 0));
    b.write(PINCTRL, c.outBase | (c.inBase << 15) | (c.outCount << 20));
    const reference = new ReferencePio(memory, c);
    reference.history = [outside, outside, outside];
    const pio = b.chip.pio[0];
    b.write(CTRL, 0x11);
    const levels = (r) => outside | (r.values & r.directions & 0xffff);
    for (let cycle = 0; cycle < 250; cycle++) {
      b.run(1);
      reference.cycle(levels);
      executed.add(memory[reference.pc] >> 13);
      const { values, directions } = reference;
      const state = (m) => [m.pc, m.x, m.y, m.isr | 0, m.osr | 0, m.isrCount, m.osrCount, [...m.tx], m.rx.map((v) => v | 0)];
      assert.deepEqual(
        [pio.pinValues | 0, pio.pinDirections | 0, ...state(pio)],
        [values | 0, directions | 0, ...state(reference)],
        `round ${round}, cycle ${cycle}`,
      );
      // The bus in this cycle: what it changes is seen from the next on.
      if (below(2) === 0 && reference.tx.length < (c.join ? 0 : 4)) {
        const word = random.uint32() | 0;
        b.write(TXF0, word);
        reference.tx.push(word);
      }
      if (below(4) === 0 && reference.rx.length) assert.equal(b.read(RXF0) | 0, reference.rx.shift() | 0);
      if (below(6) === 0) {
        outside = (outside ^ (1 << (16 + below(14)))) & 0x3fff0000;
        b.chip.pins.setLevels(0x3fff0000, outside);
        reference.history[2] = levels(reference);
      }
    }
  }
  assert.deepEqual([...executed].sort(), [0, 1, 2, 3, 4, 5, 7]);
});

test('a stalled machine and a disabled one leave no event behind', () => {
  const b = bench([out(32), jmp(0)], { shift: AUTOPULL | OUT_RIGHT });
  b.run(5);
  assert.equal(b.pio.alarm.scheduled, false);
  b.write(TXF0, 5);
  assert.equal(b.pio.alarm.scheduled, true);
  b.run(5);
  assert.equal(b.pio.alarm.scheduled, false);
  assert.equal(b.pio.pinDirections, 5);
});

test('INSTR: executes in the next cycle, without the divider, and leaves pc where it was unless it is a jump', () => {
  const b = bench([set(X, 1, 31), set(X, 2, 31)], { clkdiv: 100 << 16, start: false });
  b.write(INSTR, set(Y, 5));
  b.run(1);
  assert.equal(b.pio.y, 5);
  assert.equal(b.read(ADDR), 0);
  b.write(INSTR, jmp(1));
  b.run(1);
  assert.equal(b.read(ADDR), 1);
});

test('a joined receive FIFO: eight deep, none to transmit; changing it empties both', () => {
  const b = bench([push(), jmp(0)], { start: false });
  b.write(TXF0, 1);
  b.write(SHIFTCTRL, JOIN_RX);
  assert.deepEqual(b.pio.tx, []);
  b.write(CTRL, 1);
  b.run(30);
  assert.equal(b.pio.rx.length, 8);
  b.write(SHIFTCTRL, 0);
  assert.deepEqual(b.pio.rx, []);
  assert.deepEqual(b.warnings, []);
});

test('a full transmit FIFO and an empty receive FIFO are noted', () => {
  const b = bench([jmp(0)], { start: false });
  for (let i = 0; i < 5; i++) b.write(TXF0, i);
  assert.deepEqual(b.pio.tx, [0, 1, 2, 3]);
  assert.equal(b.read(RXF0), 0);
  assert.match(b.warnings.join(), /TXF0 written while full.*RXF0 read while empty/);
});

test('a full receive FIFO: PUSH NOBLOCK loses the word, IN waits until one is read', () => {
  const b = bench([notY(), push(), jmp(2)], { start: false });
  b.pio.rx = [1, 2, 3, 4];
  b.write(CTRL, 1);
  b.run(3);
  assert.deepEqual([b.pio.rx.length, b.pio.isr], [4, 0]);
  const waiting = bench([inn(32)], { shift: AUTOPUSH | IN_RIGHT });
  for (let i = 0; i < 2; i++) {
    waiting.run(9);
    assert.equal(waiting.pio.rx.length, 4);
    waiting.read(RXF0);
  }
});

test('SM_RESTART clears counters, stall and delay, not pc, x, osr; disabling holds a delay', () => {
  const b = bench([set(X, 3), inn(5, 20), set(Y, 7), jmp(3)]);
  b.run(4);
  assert.deepEqual([b.pio.pc, b.pio.x, b.pio.isrCount], [2, 3, 5]);
  b.write(CTRL, 0);
  b.run(100);
  b.write(CTRL, 1);
  b.run(18);
  assert.equal(b.pio.y, 0, 'two cycles of the delay had passed');
  b.run(1);
  assert.equal(b.pio.y, 7);
  b.write(CTRL, 0x10);
  assert.deepEqual([b.pio.pc, b.pio.x, b.pio.isrCount, b.pio.osrCount], [3, 3, 0, 32]);
});

test('a change of clk_sys moves the edges, not the count', () => {
  const b = bench([set(X, 1, 9), set(X, 0, 9)]);
  b.run(5);
  const { edge } = b.chip.sysClock;
  b.chip.sysClock.retune(12.5e6);
  for (const block of [b.chip.dma, ...b.chip.pio]) block.clockChanged();
  assert.equal(b.chip.sysClock.edge, edge);
  const before_ns = b.time.nanos;
  b.runTo(before_ns + 5 * 80);
  assert.equal(b.pio.x, 1);
  b.runTo(before_ns + 6 * 80);
  assert.equal(b.pio.x, 0);
});

for (const [name, instruction] of [
  ['JMP on an empty shift register', jmp(0, 7)],
  ['WAIT on a GPIO', wait(1, 0) & ~(1 << 5)],
  ['IN from X', inn(1) | (1 << 5)],
  ['OUT to pins', out(1) & ~(4 << 5)],
  ['PULL', push() | (4 << 5)],
  ['MOV X, NULL', lower() | (1 << 5)],
  ['IRQ', op(6, 0, 0)],
  ['SET pins', set(0, 0)],
]) {
  test(`fails: ${name} is not modelled`, () => {
    const b = bench([instruction]);
    assert.throws(() => b.run(2), /failure/);
    assert.match(b.warnings[0], /instruction 0x[0-9a-f]{4} at 0 is not modelled/);
  });
}

for (const [name, address, value] of [
  ['another machine', CTRL, 2],
  ['side-set', EXECCTRL, 1 << 30],
  ['a threshold', SHIFTCTRL, 8 << 20],
  ['a joined transmit FIFO', SHIFTCTRL, 1 << 30],
  ['a divider with a fraction', CLKDIV, (1 << 16) | (1 << 8)],
  ['SET pins in PINCTRL', PINCTRL, 5 << 26],
  ['a waiting instruction in INSTR', INSTR, wait(1, 0)],
  ['an interrupt', PIO0 + 0x12c, 1],
]) {
  test(`fails: ${name}`, () => {
    const b = bench([jmp(0)], { start: false });
    assert.throws(() => b.write(address, value), /failure/);
    assert.match(b.warnings[0], /not modelled|Unimplemented/);
  });
}

test('fails: PIO held in reset', () => {
  const b = new ChipBench({ held: 1 << 10 });
  assert.throws(() => b.write(CTRL, 1), /failure/);
  assert.match(b.warnings[0], /while PIO0 is held in reset/);
});

test('RESETS stops a running machine and lets its pins go', () => {
  const b = bench([out(32), jmp(1)], { shift: AUTOPULL | OUT_RIGHT });
  b.write(TXF0, 31);
  b.run(5);
  assert.equal(b.chip.pins.low, 31);
  b.write(0x4000e000, 1 << 10);
  assert.equal(b.chip.pins.low, 0);
  b.write(0x4000f000, 1 << 10);
  assert.equal(b.read(CTRL), 0);
  b.run(3);
  assert.equal(b.chip.pins.low, 0);
});
