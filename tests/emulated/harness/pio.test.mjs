/** PIO against the RP2040 datasheet, chapter 3: in every cycle like a plain model of it, and case by case. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Prng } from '../../../host_tools/simulation/emulator/prng.mjs';
import { ChipBench } from './chip_bench.mjs';
import { ReferencePio } from './pio_reference.mjs';

const PIO0 = 0x50200000;
const [CTRL, FSTAT, FDEBUG, FLEVEL, TXF0, RXF0, IRQ, BYPASS, INSTR_MEM0, INTR, IRQ0_INTE] = [
  0, 4, 8, 0xc, 0x10, 0x20, 0x30, 0x38, 0x48, 0x128, 0x12c,
].map((o) => PIO0 + o);
const SM = (m, offset) => PIO0 + 0xc8 + 0x18 * m + offset;
const [CLKDIV, EXECCTRL, SHIFTCTRL, ADDR, INSTR, PINCTRL] = [0, 4, 8, 0xc, 0x10, 0x14];

const op = (kind, arg, low, field = 0) => (kind << 13) | (field << 8) | (arg << 5) | (low & 31);
const jmp = (to, condition = 0, field) => op(0, condition, to, field);
const wait = (polarity, source, index, field) => op(1, (polarity << 2) | source, index, field);
const inn = (source, bits, field) => op(2, source, bits, field);
const out = (destination, bits, field) => op(3, destination, bits, field);
const push = (flags = 1, field) => op(4, flags, 0, field);
const pull = (flags = 1, field) => op(4, 4 | flags, 0, field);
const mov = (destination, source, how = 0, field) => op(5, destination, (how << 3) | source, field);
const irq = (flags, index, field) => op(6, flags, index, field);
const set = (destination, value, field) => op(7, destination, value, field);
const [PINS, X, PINDIRS, ISR, EXEC] = [0, 1, 4, 6, 7];
const [AUTOPULL, IN_RIGHT, OUT_RIGHT] = [1 << 17, 1 << 18, 1 << 19];

/** A bench with `program` at 0 in SM0: wrap around it, all pin groups from GPIO0, pins 0 to 15 with PIO0. */
function bench(program, { shift = IN_RIGHT | OUT_RIGHT, clkdiv = 1 << 16, exec = 0, pin = (16 << 20) | (5 << 26), start = true } = {}) {
  const b = new ChipBench();
  b.pinFunction([...Array(16).keys()], 6);
  program.forEach((instruction, i) => b.write(INSTR_MEM0 + 4 * i, instruction));
  b.write(SM(0, CLKDIV), clkdiv);
  b.write(SM(0, EXECCTRL), ((program.length - 1) << 12) | exec);
  b.write(SM(0, SHIFTCTRL), shift);
  b.write(SM(0, PINCTRL), pin);
  b.pio = b.chip.pio[0];
  b.sm = b.pio.machines[0];
  /** [cycle, pin values] of each change from now on; cycle 1 is the first. */
  const zero = b.chip.sysClock.edge;
  b.trace = [];
  let last = 0;
  const drive = b.chip.pins.drive.bind(b.chip.pins);
  b.chip.pins.drive = () => {
    drive();
    const now = b.pio.pinValues & 0xffff;
    if (now !== last) b.trace.push([b.chip.sysClock.edge - zero, now]);
    last = now;
  };
  if (start) b.write(CTRL, 1);
  return b;
}

test('agrees in every cycle with a plain model of the datasheet: random programs, dividers, FIFO traffic, pins, flags', () => {
  const random = new Prng(2040);
  const below = (n) => random.uint32() % n;
  const pick = (list) => list[below(list.length)];
  const instruction = () => {
    const field = random.uniform() < 0.5 ? 0 : below(32);
    const kinds = [
      () => jmp(below(32), below(8), field),
      () => wait(below(2), pick([0, 1, 2]), below(2) ? below(8) | (below(2) << 4) : 16 + below(8), field) & (0x3fff & ~8),
      () => inn(pick([0, 1, 2, 3, 6, 7]), below(32), field),
      () => out(pick([0, 1, 2, 3, 4, 5, 6]), below(32), field),
      () => push(below(4), field),
      () => pull(below(4), field),
      () => mov(pick([0, 1, 2, 5, 6, 7]), pick([0, 1, 2, 3, 5, 6, 7]), below(3), field),
      () => irq(below(4), below(8) | (below(2) << 4), field),
      () => set(pick([0, 1, 2, 4]), below(32), field),
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
    const configurations = [0, 1, 2, 3].map((m) => {
      const sideEnable = below(2);
      const sideCount = below(3) ? 0 : sideEnable + below(6 - sideEnable);
      const drawn = (of, ...names) => Object.fromEntries(names.map((name) => [name, below(of)]));
      const c = {
        ...{ divisor: pick([256, 256, 512, 640, 257, 1280, 1000]), sideEnable, sideCount, rxDepth: 4 },
        ...drawn(2, 'sideToDirections', 'autopush', 'autopull', 'inRight', 'outRight', 'statusReceive'),
        ...drawn(32, 'wrapTop', 'wrapBottom', 'sideBase', 'inBase', 'outBase', 'setBase'),
        ...{ jumpPin: below(30), pushThreshold: 1 + below(32), pullThreshold: 1 + below(32) },
        ...{ outCount: below(33), setCount: below(6), statusN: below(10) },
      };
      b.write(SM(m, CLKDIV), c.divisor << 8);
      const placed = (fields) => Object.entries(fields).reduce((word, [at, value]) => word | (value << at), 0);
      const { statusN, statusReceive, wrapBottom, wrapTop, jumpPin, sideToDirections } = c;
      b.write(
        SM(m, EXECCTRL),
        placed({ 0: statusN, 4: statusReceive, 7: wrapBottom, 12: wrapTop, 24: jumpPin, 29: sideToDirections, 30: sideEnable }),
      );
      const { autopush, autopull, inRight, outRight, pushThreshold, pullThreshold } = c;
      b.write(
        SM(m, SHIFTCTRL),
        placed({ 16: autopush, 17: autopull, 18: inRight, 19: outRight, 20: pushThreshold & 31, 25: pullThreshold & 31 }),
      );
      const { outBase, setBase, sideBase, inBase, outCount, setCount } = c;
      b.write(SM(m, PINCTRL), placed({ 0: outBase, 5: setBase, 10: sideBase, 15: inBase, 20: outCount, 26: setCount, 29: sideCount }));
      return c;
    });
    const reference = new ReferencePio(memory, configurations);
    reference.history = [outside, outside, outside];
    const pio = b.chip.pio[0];
    b.write(CTRL, 0xf0f);
    const levels = (r) => outside | (r.values & r.directions & 0xffff);
    for (let cycle = 0; cycle < 250; cycle++) {
      b.run(1);
      reference.cycle(levels);
      for (const r of reference.machines) executed.add(memory[r.pc] >> 13);
      const state = (m) => [m.pc, m.x, m.y, m.isr | 0, m.osr | 0, m.isrCount, m.osrCount, [...m.tx], m.rx.map((v) => v | 0)];
      assert.deepEqual(
        [pio.pinValues | 0, pio.pinDirections | 0, pio.flags, ...pio.machines.map(state)],
        [reference.values | 0, reference.directions | 0, reference.flags, ...reference.machines.map(state)],
        `round ${round}, cycle ${cycle}`,
      );
      // The bus in this cycle: what it changes is seen from the next on.
      const m = below(4);
      if (below(4) === 0 && reference.machines[m].tx.length < 4) {
        const word = random.uint32() | 0;
        b.write(TXF0 + 4 * m, word);
        reference.machines[m].tx.push(word);
      }
      if (below(4) === 0 && reference.machines[m].rx.length) assert.equal(b.read(RXF0 + 4 * m) | 0, reference.machines[m].rx.shift() | 0);
      if (below(8) === 0) {
        const bits = below(256);
        b.write(IRQ, bits);
        reference.flags &= ~bits;
      }
      if (below(6) === 0) {
        outside = (outside ^ (1 << (16 + below(14)))) & 0x3fff0000;
        b.chip.pins.setLevels(0x3fff0000, outside);
        reference.history[2] = levels(reference);
      }
    }
  }
  assert.equal(executed.size, 8);
});

test('inputs are two cycles late, unless bypassed', () => {
  for (const bypass of [0, 1 << 20]) {
    const b = bench([wait(1, 0, 20), set(PINS, 1), jmp(2)]);
    b.chip.pins.setLevels(1 << 20, 0);
    b.write(BYPASS, bypass);
    b.run(10);
    b.chip.pins.setLevels(1 << 20, -1);
    b.run(10);
    assert.deepEqual(b.trace, [[10 + (bypass ? 1 : 3) + 1, 1]]);
  }
});

test('a stalled machine and a disabled one leave no event behind', () => {
  const b = bench([out(X, 32), jmp(0)], { shift: AUTOPULL });
  b.run(5);
  assert.equal(b.pio.alarm.scheduled, false);
  b.write(TXF0, 5);
  assert.equal(b.pio.alarm.scheduled, true);
  b.run(5);
  assert.equal(b.pio.alarm.scheduled, false);
  assert.equal(b.sm.x, 5);
});

test('INSTR: executes in the next cycle, without the divider, enabled or not, and leaves pc where it was', () => {
  const b = bench([set(X, 1, 31), set(X, 2, 31)], { clkdiv: 100 << 16, start: false });
  b.write(SM(0, INSTR), set(PINS, 5));
  b.run(1);
  assert.deepEqual(b.trace, [[1, 5]]);
  assert.equal(b.read(SM(0, ADDR)), 0);
  b.write(SM(0, INSTR), jmp(1));
  b.run(1);
  assert.equal(b.read(SM(0, ADDR)), 1);
  b.write(SM(0, INSTR), pull());
  b.run(1);
  assert.equal(b.read(SM(0, EXECCTRL)) >>> 31, 1, 'stalled');
  b.write(TXF0, 77);
  b.run(1);
  assert.equal(b.read(SM(0, EXECCTRL)) >>> 31, 0);
  assert.equal(b.sm.osr, 77);
  assert.equal(b.read(SM(0, ADDR)), 1);
});

test('OUT EXEC: the instruction follows in the next cycle and keeps its delay, that of the OUT is ignored', () => {
  const b = bench([out(EXEC, 16, 7), set(PINS, 2), jmp(2)], { shift: OUT_RIGHT | AUTOPULL });
  b.write(TXF0, set(PINS, 1, 3));
  b.run(20);
  // Cycle 1 pulls, 2 is the OUT, 3 the executee with three cycles of delay.
  assert.deepEqual(b.trace, [
    [3, 1],
    [7, 2],
  ]);
});

test('joined FIFOs: eight deep on one side, none on the other; changing it empties them', () => {
  const b = bench([jmp(0)], { start: false });
  b.write(TXF0, 1);
  b.write(SM(0, SHIFTCTRL), 1 << 30);
  assert.equal(b.read(FLEVEL) & 0xff, 0);
  for (let i = 0; i < 8; i++) b.write(TXF0, i);
  assert.equal(b.read(FLEVEL) & 0xff, 8);
  assert.equal(b.read(FSTAT) & 0x01010101, 0x00010101, 'TX full; RX both full and empty');
  assert.deepEqual(b.warnings, []);
  b.write(TXF0, 9);
  assert.match(b.warnings.join(), /TXF0 written while full/);
  assert.equal((b.read(FDEBUG) >>> 16) & 15, 1);
  b.write(FDEBUG, 1 << 16);
  assert.equal(b.read(FDEBUG), 0);
});

test('reading an empty receive FIFO is noted', () => {
  const b = bench([jmp(0)], { start: false });
  assert.equal(b.read(RXF0), 0);
  assert.equal((b.read(FDEBUG) >>> 8) & 15, 1);
  assert.match(b.warnings.join(), /RXF0 read while empty/);
});

test('interrupts: FIFO levels and flags 0 to 3 reach the processor', () => {
  const b = bench([pull(), irq(1, 2), mov(ISR, 7), push()]);
  b.write(0xe000e100, 1 << 7);
  b.write(IRQ0_INTE, (1 << 10) | 1);
  const pending = () => (b.chip.core.pendingInterrupts >>> 7) & 1;
  b.run(5);
  assert.equal(pending(), 0);
  b.write(TXF0, 9);
  b.run(5);
  assert.equal(pending(), 1);
  assert.equal(b.read(INTR) & 0xf00, 0x400);
  b.write(IRQ, 4);
  assert.equal(pending(), 0);
  b.run(5);
  assert.equal(pending(), 1, 'received');
  assert.equal(b.read(RXF0), 9);
  assert.equal(pending(), 0);
});

test('SM_RESTART clears counters, stall and delay, not pc, x, osr; disabling holds a delay', () => {
  const b = bench([set(X, 3), inn(X, 5, 20), jmp(2)]);
  b.run(4);
  assert.deepEqual([b.sm.pc, b.sm.x, b.sm.isrCount], [2, 3, 5]);
  b.write(CTRL, 0);
  b.run(100);
  b.write(SM(0, EXECCTRL), 31 << 12);
  b.write(INSTR_MEM0 + 8, set(PINS, 1));
  b.write(CTRL, 1);
  b.run(18);
  assert.deepEqual(b.trace, [], 'two cycles of the delay had passed');
  b.run(1);
  assert.deepEqual([b.trace.length, b.trace[0][1]], [1, 1]);
  b.write(CTRL, 0x10);
  assert.deepEqual([b.sm.pc, b.sm.x, b.sm.isrCount, b.sm.osrCount], [3, 3, 0, 32]);
});

test('a change of clk_sys moves the edges, not the count', () => {
  const b = bench([set(PINS, 1, 9), set(PINS, 0, 9)]);
  b.run(5);
  const { edge } = b.chip.sysClock;
  b.chip.sysClock.retune(12.5e6);
  for (const block of [b.chip.dma, ...b.chip.pio]) block.clockChanged();
  assert.equal(b.chip.sysClock.edge, edge);
  const before_ns = b.time.nanos;
  b.runTo(before_ns + 5 * 80);
  assert.equal(b.trace.length, 1);
  b.runTo(before_ns + 6 * 80);
  assert.equal(b.trace.length, 2);
});

for (const [name, instruction] of [
  ['MOV to destination 3', mov(3, 0)],
  ['MOV operation 3', mov(1, 1, 3)],
  ['SET to destination 3', set(3, 0)],
  ['WAIT on source 3', wait(0, 3, 0)],
  ['IN from source 4', inn(4, 1)],
  ['PUSH with a low bit', push() | 1],
]) {
  test(`fails: ${name} is reserved`, () => {
    const b = bench([instruction]);
    assert.throws(() => b.run(2), /failure/);
    assert.match(b.warnings[0], /PIO0|reserved/);
  });
}

for (const [name, offset, value] of [
  ['OUT_STICKY', EXECCTRL, 1 << 17],
  ['INLINE_OUT_EN', EXECCTRL, 1 << 18],
  ['both joins', SHIFTCTRL, 3 << 30],
  ['FRAC without INT', CLKDIV, 1 << 8],
  ['33 OUT pins', PINCTRL, 33 << 20],
]) {
  test(`fails: ${name}`, () => {
    const b = bench([jmp(0)], { start: false });
    assert.throws(() => b.write(SM(0, offset), value), /failure/);
  });
}

test('fails: PIO held in reset', () => {
  const b = new ChipBench({ held: 1 << 10 });
  assert.throws(() => b.write(CTRL, 1), /failure/);
  assert.match(b.warnings[0], /while PIO0 is held in reset/);
});

test('RESETS stops a running machine and lets its pins go', () => {
  const b = bench([set(PINDIRS, 31), jmp(1)]);
  b.run(3);
  assert.equal(b.chip.pins.low, 31);
  b.write(0x4000e000, 1 << 10);
  assert.equal(b.chip.pins.low, 0);
  b.write(0x4000f000, 1 << 10);
  assert.equal(b.read(CTRL), 0);
  b.run(3);
  assert.equal(b.chip.pins.low, 0);
});
