/** PIO against the RP2040 datasheet, chapter 3, instruction by instruction and case by case. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { ChipBench } from './chip_bench.mjs';

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
function bench(program, { shift = IN_RIGHT | OUT_RIGHT, clkdiv = 1 << 16, exec = 0, pin = 16 << 20, start = true } = {}) {
  const b = new ChipBench();
  b.pinFunction([...Array(16).keys()], 6);
  program.forEach((instruction, i) => b.write(INSTR_MEM0 + 4 * i, instruction));
  b.write(CLKDIV, clkdiv);
  b.write(EXECCTRL, ((program.length - 1) << 12) | exec);
  b.write(SHIFTCTRL, shift);
  b.write(PINCTRL, pin);
  b.pio = b.chip.pio[0];
  if (start) b.write(CTRL, 1);
  return b;
}

const [ALL, HIGH] = [-1, 1 << 21];
const [BLOCKED, FULL] = [{ pc: 0 }, [1, 2, 3, 4]];
const PUSHES = { shift: AUTOPUSH | IN_RIGHT };
const PULLS = { shift: AUTOPULL | OUT_RIGHT };
/** One instruction at 0 in one cycle: the machine before and after; pins: levels of GPIO16 and up; options: as bench. */
const STEPS = [
  ['JMP', jmp(5), {}, { pc: 5 }],
  ['JMP X--', jmp(5, 2), { x: 3 }, { pc: 5, x: 2 }],
  ['JMP X--, at 0', jmp(5, 2), { x: 0 }, { pc: 1, x: -1 }],
  ['JMP Y--', jmp(5, 4), { y: (1 << 31) + 1 }, { pc: 5, y: 1 << 31 }],
  ['JMP Y--, at 0', jmp(5, 4), { y: 0 }, { pc: 1, y: -1 }],
  ['JMP PIN', jmp(5, 6), { pins: HIGH }, { pc: 5 }, { exec: 21 << 24 }],
  ['JMP PIN, low', jmp(5, 6), { pins: ~HIGH }, { pc: 1 }, { exec: 21 << 24 }],
  ['WAIT high', wait(1, 3), { pins: HIGH }, { pc: 1 }, { pin: 18 << 15 }],
  ['WAIT high, low', wait(1, 3), { pins: ~HIGH }, BLOCKED, { pin: 18 << 15 }],
  ['WAIT low', wait(0, 3), { pins: ~HIGH }, { pc: 1 }, { pin: 18 << 15 }],
  ['WAIT, round', wait(1, 25), { pins: HIGH }, { pc: 1 }, { pin: 28 << 15 }],
  ['IN', inn(8), { pins: 0x50000, isr: 0x80000001 | 0 }, { isr: 0x50800000, isrCount: 8 }, { pin: 12 << 15 }],
  ['IN of all', inn(32), { pins: 0x28000000, isr: 5, isrCount: 9 }, { isr: (0x28000000 << 4) | 2, isrCount: 32 }, { pin: 28 << 15 }],
  ['autopush', inn(31), { isrCount: 1 }, { rx: [0], isrCount: 0 }, PUSHES],
  ['autopush, not yet', inn(31), {}, { rx: [], isrCount: 31 }, PUSHES],
  ['autopush, full', inn(32), { rx: FULL, isr: 7 }, { ...BLOCKED, isr: 7, rx: FULL }, PUSHES],
  ['OUT', out(8), { osr: 0xabcd12a5 | 0 }, { directions: 0xa50, osr: 0xabcd12, osrCount: 8 }, { pin: (8 << 20) | 4 }],
  ['OUT of all', out(32), { osr: ALL, osrCount: 30 }, { directions: 0xffff, osr: 0, osrCount: 32 }],
  ['OUT of nothing', out(32), {}, { directions: 0 }],
  ['OUT, round', out(32), { osr: 0xb, directions: ALL }, { directions: 0xfffffffe | 0 }, { pin: (4 << 20) | 30 }],
  ['autopull, behind the OUT', out(8), { osr: 3, osrCount: 24, tx: [7] }, { directions: 3, osr: 7, osrCount: 0, tx: [] }, PULLS],
  ['autopull, before the OUT', out(8), { osrCount: 32 }, { ...BLOCKED, directions: 0 }, PULLS],
  ['autopull, for the OUT', out(8), { osrCount: 32, tx: [7] }, { ...BLOCKED, osr: 7, osrCount: 0 }, PULLS],
  ['autopull, beside another', set(X, 1), { osrCount: 32, tx: [7] }, { x: 1, osr: 7, osrCount: 0, tx: [] }, PULLS],
  ['PUSH', push(), { isr: 9, isrCount: 3 }, { rx: [9], isr: 0, isrCount: 0 }],
  ['PUSH of nothing', push(), {}, { rx: [0] }],
  ['PUSH, full', push(), { isr: 9, rx: FULL }, { pc: 1, rx: FULL, isr: 0 }],
  ['MOV PINS, NULL', lower(), { values: 0xff }, { values: 0xc3 }, { pin: (4 << 20) | 2 }],
  ['MOV ISR, !Y', notY(), { y: 0xf, isrCount: 9 }, { isr: ~0xf, isrCount: 0 }],
  ['SET X', set(X, 31), {}, { x: 31 }],
  ['SET Y', set(Y, 17), {}, { y: 17 }],
  ['wrap', set(X, 1), { pc: 20 }, { pc: 6 }, { exec: 6 << 7, wrap: 20 }],
  ['round', set(X, 1), { pc: 31 }, { pc: 0, x: 1 }],
];

for (const [name, instruction, before, after, { wrap = 7, exec = 0, ...options } = {}] of STEPS) {
  test(`${name}: one cycle`, () => {
    const { pins = 0, values = 0, directions = 0, pc = 0, ...state } = before;
    const b = bench([instruction], { ...options, start: false });
    b.write(EXECCTRL, (wrap << 12) | exec);
    b.write(INSTR_MEM0 + 4 * pc, instruction);
    b.chip.pins.setLevels(0x3fff0000, pins);
    b.run(4);
    Object.assign(b.pio, { osrCount: 0, pc, pinValues: values, pinDirections: directions, ...structuredClone(state) });
    b.write(CTRL, 1);
    b.run(1);
    const is = { ...b.pio, values: b.pio.pinValues, directions: b.pio.pinDirections };
    for (const [key, value] of Object.entries(after)) assert.deepEqual(is[key], value, key);
  });
}

test('delays are cycles of the divider, which begin when it is written; behind a jump it goes on', () => {
  const b = bench([set(X, 1), jmp(3, 0, 1), set(X, 2), set(X, 3, 2)], { start: false });
  b.run(5);
  b.write(CLKDIV, 3 << 16);
  b.write(CTRL, 1);
  const seen = Array.from({ length: 36 }, () => (b.run(1), b.pio.x)).join('');
  assert.equal(seen, '111111111333333333111111111333333333');
});

test('inputs are two cycles late', () => {
  const b = bench([wait(1, 20), set(X, 1), jmp(2)]);
  b.run(10);
  b.chip.pins.setLevels(1 << 20, -1);
  b.run(3);
  assert.deepEqual([b.pio.pc, b.pio.x], [1, 0]);
  b.run(1);
  assert.equal(b.pio.x, 1);
});

test('each side of a full FIFO waits for the other: no word is lost', () => {
  const b = bench([out(32, 3), inn(32)], { shift: AUTOPULL | AUTOPUSH | IN_RIGHT | OUT_RIGHT, clkdiv: 2 << 16 });
  for (let pin = 0; pin < 16; pin++) b.write(0x4001c004 + 4 * pin, 0x4a);
  const got = [];
  for (let i = 0, sent = 0; i < 400; i++) {
    if (b.pio.tx.length < 4) b.write(TXF0, 1000 + sent++);
    b.run(1);
    if (i % (i < 200 ? 5 : 25) === 0 && b.pio.rx.length) got.push(~b.read(RXF0) & 0xffff);
  }
  assert.deepEqual(
    got,
    got.map((_, i) => 1000 + i),
  );
  assert.ok(got.length > 20, `${got.length}`);
  assert.deepEqual(b.warnings, []);
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
