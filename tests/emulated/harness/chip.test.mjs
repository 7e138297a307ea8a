/** The chip: small images that behave, and small images with one mistake each, which must fail the run. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Chip } from '../../../host_tools/simulation/emulator/chip/chip.mjs';
import { RP2040 } from '../../../host_tools/simulation/emulator/chip/core.mjs';
import { SimulatedTime } from '../../../host_tools/simulation/emulator/clock.mjs';
import { Prng } from '../../../host_tools/simulation/emulator/prng.mjs';
import { Report } from '../../../host_tools/simulation/emulator/report.mjs';
import { makeMachine, run } from './bench.mjs';

const main = (body) => `void main(void) { ${body} done(); }`;

function failsWith(name, source, pattern, options) {
  test(`fails: ${name}`, () => {
    const { result, finished } = run(source, options);
    assert.ok(!finished, 'the image must not reach its end');
    assert.equal(result.end_reason, 'failure', result.end_reason);
    assert.match(result.warnings.join('\n'), pattern);
  });
}

test('starts: second stage, clocks, timer; the boot loader entry is reported with its arguments', () => {
  const { result, results, machine } = run(`void main(void) {
    start_clocks(); RESULT(0) = now_us(); wait_us(1000); RESULT(1) = now_us();
    const uint32_t table = REG(0x14) & 0xffff;
    uint32_t (*find)(uint32_t, uint32_t) = (void *)(REG(0x18) & 0xffff);
    void (*enter)(uint32_t, uint32_t) = (void *)find(table, 'U' | 'B' << 8);
    RESULT(2) = find(table, 'X');
    enter(12, 34); }`);
  assert.deepEqual(result.warnings, []);
  assert.equal(results[1] - results[0], 1000);
  assert.equal(results[2], 0);
  assert.equal(machine.chip.clkSys, 125e6);
  assert.equal(machine.chip.clkUsbHz, 48e6);
  assert.deepEqual([result.end_reason, result.end_detail], ['entered the USB boot loader', { r0: 12, r1: 34 }]);
});

test('a timer alarm wakes WFI at its microsecond, not before', () => {
  const { results, result } = run(`
    void isr(void) { REG(0x40054034) = 1; RESULT(0) = now_us(); }
    void main(void) { start_clocks(); REG(0x40054038) = 1; REG(0xe000e100) = 1;
      const uint32_t target = now_us() + 500; RESULT(1) = target; REG(0x40054010) = target;
      __asm volatile("wfi"); done(); }`);
  assert.deepEqual(result.warnings, []);
  assert.equal(results[0], results[1]);
  assert.ok(result.busy_fraction < 1);
});

test('WFI with PRIMASK set wakes before the handler runs', () => {
  const { results } = run(`
    void isr(void) { REG(0x40054034) = 1; RESULT(0) = RESULT(0) + 1; }
    void main(void) { start_clocks(); RESULT(0) = 0; REG(0x40054038) = 1; REG(0xe000e100) = 1;
      __asm volatile("cpsid i"); REG(0x40054010) = now_us() + 50;
      __asm volatile("wfi"); RESULT(1) = RESULT(0); __asm volatile("cpsie i\\n isb"); RESULT(2) = RESULT(0); done(); }`);
  assert.deepEqual(results.slice(0, 3), [1, 0, 1]);
});

const DENY = (base, log2) => `REG(0xe000ed9c) = ${base} | 16; REG(0xe000eda0) = 1 << 28 | ${log2 - 1} << 1 | 1; REG(0xe000ed94) = 5;`;

test('a region of the MPU without access faults, and nothing beside it', () => {
  const { results } = run(`
    void isr(void) { RESULT(1) = REG(0x20020000); done(); }
    void main(void) { RESULT(0) = 0; ${DENY('0x20020000', 12)} REG(0x2001fffc) = 1; REG(0x20021000) = 2;
      RESULT(0) = REG(0x2001fffc) + REG(0x20021000); REG(0x20020ffc) = 3; RESULT(0) = 99; done(); }`);
  assert.equal(results[0], 3);
});

for (const [what, region, act] of [
  ['the null page, for loads too', DENY('0', 8), 'RESULT(0) = REG(0x10);'],
  ['a jump there, in SRAM', DENY('0x20020000', 12), '((void (*)(void))0x20020101)();'],
  ['a jump there, at 0', DENY('0', 8), '((void (*)(void))0x11)();'],
]) {
  test(`so does ${what}`, () => {
    const { results } = run(`void isr(void) { RESULT(0) = 7; done(); }
      void main(void) { RESULT(0) = REG(0x10); ${region} ${act} done(); }`);
    assert.equal(results[0], 7);
  });
}

/** Of SRAM: 256 KiB but its last six eighths, and of the eighth that follows the first. */
const READ_ONLY = `REG(0xe000ed9c) = 0x20000000 | 16 | 0; REG(0xe000eda0) = 6 << 24 | 1 << 17 | 0xfc00 | 17 << 1 | 1;
  REG(0xe000ed9c) = 0x20010000 | 16 | 1; REG(0xe000eda0) = 6 << 24 | 1 << 17 | 0xfe00 | 14 << 1 | 1; REG(0xe000ed94) = 5;`;

for (const [at, last] of Object.entries({ '0x20010ffc': 1, '0x20008000': 1, '0x20011000': 2 })) {
  test(`a write to ${at}, where memory is read-only up to 0x20011000, ${last === 1 ? 'faults' : 'does not'}; reading does not`, () => {
    const { results } = run(`void isr(void) { RESULT(1) = REG(${at}); done(); }
      void main(void) { REG(${at}) = 7; RESULT(1) = 1; ${READ_ONLY} RESULT(0) = REG(${at}); REG(${at}) = 8; RESULT(1) = 2; done(); }`);
    assert.deepEqual(results.slice(0, 2), [7, last === 1 ? 7 : 2]);
  });
}

const region = (attributes) => main(`REG(0xe000ed9c) = 0x20020010; REG(0xe000eda0) = ${attributes} | 11 << 1 | 1; REG(0xe000ed94) = 5;`);
failsWith('MPU with parts of a region without access', region('1 << 28 | 0xff00'), /whole without any access/);
failsWith('MPU with read-only memory elsewhere', region('6 << 24 | 1 << 17'), /from the start of SRAM/);
failsWith('MPU with code in strongly ordered memory', region('6 << 24'), /nothing executes/);

test('before its clocks the watchdog counts ticks of the ring oscillator', () => {
  const { machine } = run(
    `void main(void) { SET(0x4000c000) = 1 << 21; REG(0x40010008) = 0x1fffc; REG(0x4005802c) = 0x200 | 12;
    REG(0x40058004) = 20000; SET(0x40058000) = 1 << 30; for (;;) { } }`,
    { seconds: 0.03, allowWatchdog: true },
  );
  assert.equal(machine.reboots, 1); // after 10000 ticks of 12 / 6.5 MHz
});

failsWith('timer with a tick of another rate', main('REG(0x4005802c) = 0x200 | 12;'), /must be 1 MHz for the timer/);

test('cycles: PUSH with lr and POP with pc cost what the hardware takes', () => {
  const machine = makeMachine(`__attribute__((naked, noinline)) void leaf(void) { __asm volatile("push {r4, lr}\\n pop {r4, pc}"); }
      void main(void) { leaf(); done(); }`);
  const at = Buffer.from(machine.image).indexOf('10b510bd', 0, 'hex'); // unique in this image
  assert.ok(at > 0);
  const stamps = [];
  machine.chip.onCall(0x10000000 + at, ({ core }) => {
    stamps.push(core.cycles);
    machine.chip.onCall(core.LR, () => stamps.push(core.cycles));
  });
  machine.run(1e6);
  assert.equal(stamps[1] - stamps[0], 3 + 5);
});

test('a chip whose clocks are fast does everything sooner, by as much, and does not know', () => {
  const loops = `void main(void) { start_clocks(); for (unsigned i = 0; i < 2000000; i++) __asm volatile(""); done(); }`;
  const [exact, fast] = [0, 500].map((clock_ppm) => makeMachine(loops, { clock_ppm }));
  for (const machine of [exact, fast]) machine.run(1e9);
  assert.ok(Math.abs(fast.result.cycles - exact.result.cycles) < 100);
  assert.deepEqual([exact.result.clock_ppm, fast.result.clock_ppm], [0, 500]);
  const rates = [exact, fast].map(({ time, chip: { timer, clock } }) => [1 / time.nanos, timer.count_us / (clock.nanos - timer.zero_ns)]);
  for (const k of [0, 1]) assert.ok(Math.abs(rates[1][k] / rates[0][k] - 1 - 500e-6) < 50e-6, `${rates}`);
});

const CODE = 0x20001000;
const STACK = 0x20004000;
const EDGES = [0, 1, 2, 31, 32, 33, 0x7fffffff, 0x80000000, 0x80000001, 0xfffffffe, 0xffffffff];
const random = new Prng(99);
const bits = (mask) => random.uint32() & mask;
const someWord = () =>
  random.uniform() < 0.3 ? EDGES[random.uint32() % EDGES.length] : random.uniform() < 0.5 ? random.uint32() : bits(0xff);

/** A core with an instruction at CODE; `state` of two of them is comparable after each executed it. */
class Bench {
  constructor(owner) {
    this.owner = owner;
    this.core = owner.core;
    this.memory = new DataView(owner.sram.buffer, owner.sram.byteOffset);
    this.compared = Buffer.from(owner.sram.buffer, owner.sram.byteOffset + 0x1000, 0x4000);
  }

  execute(halfwords, registers, flags) {
    halfwords.forEach((halfword, i) => this.memory.setUint16(CODE - 0x20000000 + 2 * i, halfword, true));
    this.core.registers.set(registers);
    this.core.registers[15] = CODE;
    [this.core.N, this.core.Z, this.core.C, this.core.V] = flags;
    return this.core.executeInstruction();
  }

  get state() {
    const { core } = this;
    return [...core.registers, core.N, core.Z, core.C, core.V];
  }
}

function fastBench() {
  return new Bench(new Chip(new SimulatedTime(), new Report(), { serial: new Uint8Array(8) }));
}

const someFlags = () => [1, 2, 4, 8].map((bit) => (random.uint32() & bit) !== 0);

/**
 * Per instruction class: its encodings, and what its registers must be for the access to be a legal one. Left to
 * the test below, because rp2040js differs from the manual: ADCS, SBCS, shifts by a register.
 */
const DATA = (registers) => registers.forEach((_, k) => k < 8 && (registers[k] = 0x20002000 + 4 * bits(0xff)));
const CLASSES = {
  'shift by a constant': [() => random.uint32() % 0x1800],
  'ADDS, SUBS of three': [() => 0x1800 | bits(0x7ff)],
  'MOVS, CMP, ADDS, SUBS with a byte': [() => 0x2000 | bits(0x1fff)],
  'data processing': [() => 0x4000 | ([0, 1, 8, 9, 10, 11, 12, 13, 14, 15][random.uint32() % 10] << 6) | bits(0x3f)],
  'ADD, CMP, MOV of high registers, pc': [() => 0x4400 + (random.uint32() % 0x300)],
  'BX, BLX': [
    () => 0x4700 | bits(0x80) | ((random.uint32() % 13) << 3),
    (registers) => registers.forEach((_, k) => k < 13 && (registers[k] = CODE + 1 + 2 * bits(0x1ff))),
  ],
  'LDR literal': [() => 0x4800 | bits(0x7ff)],
  'load, store, register offset': [
    () => {
      const [base, offset] = [bits(7), bits(7)];
      return 0x5000 | bits(0xe07) | (base << 3) | ((offset === base ? base ^ 1 : offset) << 6);
    },
    (registers, op) => {
      DATA(registers);
      registers[(op >>> 6) & 7] = 4 * bits(0xff);
    },
  ],
  'load, store of words and bytes': [() => 0x6000 | bits(0x1fff), DATA],
  'load, store of halfwords': [() => 0x8000 | bits(0xfff), DATA],
  'load, store on the stack': [() => 0x9000 | bits(0xfff)],
  'ADR, ADD from sp': [() => 0xa000 | bits(0xfff)],
  'ADD, SUB sp': [() => 0xb000 | bits(0xff)],
  extend: [() => 0xb200 | bits(0xff)],
  PUSH: [() => 0xb400 | (bits(0x1ff) || 1)],
  POP: [() => 0xbc00 | (bits(0xff) || 1)],
  'POP with pc': [() => 0xbd00 | bits(0xff)],
  reverse: [() => 0xba00 | ([0, 1, 3][random.uint32() % 3] << 6) | bits(0x3f)],
  'STM, LDM': [
    () => {
      const base = bits(7);
      const op = 0xc000 | bits(0x800) | (base << 8) | bits(0xff);
      return (op & 0x800 ? op : op & ~(1 << base)) | (1 << (base ^ 1)); // STM with its base in the list: rp2040js differs
    },
    DATA,
  ],
  'B conditional': [() => 0xd000 | (random.uint32() % 0xe00)],
  B: [() => 0xe000 | bits(0x7ff)],
  BL: [() => 0xf000 | bits(0x7ff), null, () => 0xd000 | bits(0x2fff)],
};

test('the fast decoder agrees with rp2040js: every class, random operands and flags, memory and cycles', () => {
  const fast = fastBench();
  const stock = new Bench(new RP2040());
  stock.owner.logger = { debug() {}, info() {}, warn() {}, error() {} };
  for (const [name, [encode, prepare, second]] of Object.entries(CLASSES)) {
    for (const bench of [fast, stock]) {
      // Odd, and not 0xf0000000 or above: what POP loads into pc must be a Thumb address.
      for (let at = 0x1000; at < 0x5000; at += 4) bench.memory.setUint32(at, (Math.imul(at, 2654435761) >>> 4) | 1, true);
    }
    for (let i = 0; i < 3000; i++) {
      const op = encode();
      const registers = [...Array.from({ length: 13 }, someWord), STACK, random.uint32() | 1];
      prepare?.(registers, op);
      const [halfwords, flags] = [[op, second?.() ?? 0xbf00], someFlags()];
      const cycles = fast.execute(halfwords, registers, flags);
      const expected = stock.execute(halfwords, registers, flags) + ((op & 0xf700) === 0xb500 ? 1 : 0);
      const which = `${name}: ${halfwords.map((h) => h.toString(16))} on ${registers.map((v) => (v >>> 0).toString(16))}, ${flags}`;
      assert.deepEqual(fast.state, stock.state, which);
      assert.equal(cycles, expected, which);
      assert.equal(fast.compared.compare(stock.compared), 0, which);
    }
  }
});

/** Results of the ARMv6-M Architecture Reference Manual, A2.2.1: AddWithCarry() and a shift bit by bit. */
function addWithCarry(x, y, carry) {
  const sum = BigInt(x >>> 0) + BigInt(y >>> 0) + BigInt(carry);
  const signed = BigInt(x | 0) + BigInt(y | 0) + BigInt(carry);
  return { result: Number(sum & 0xffffffffn), C: sum > 0xffffffffn, V: signed !== BigInt.asIntN(32, sum) };
}

function shiftBits(kind, value, count, C) {
  let bitsLeft = (value >>> 0).toString(2).padStart(32, '0');
  let carry = C;
  for (let i = 0; i < count; i++) {
    carry = bitsLeft[kind === 'LSL' ? 0 : 31] === '1';
    if (kind === 'LSL') bitsLeft = `${bitsLeft.slice(1)}0`;
    else bitsLeft = { LSR: '0', ASR: bitsLeft[0], ROR: bitsLeft[31] }[kind] + bitsLeft.slice(0, 31);
  }
  return { result: parseInt(bitsLeft, 2), C: carry };
}

test('the fast decoder follows the manual where rp2040js does not: ADCS, SBCS, shifts by a register, STM', () => {
  const fast = fastBench();
  const KINDS = { 2: 'LSL', 3: 'LSR', 4: 'ASR', 7: 'ROR' };
  for (let i = 0; i < 20000; i++) {
    const kind = [2, 3, 4, 5, 6, 7][i % 6];
    const [d, m] = [bits(7), bits(7)];
    const registers = [...Array.from({ length: 13 }, someWord), STACK, 1];
    const flags = someFlags();
    const [a, b] = [registers[d], registers[m]];
    const shifted = KINDS[kind] && { ...shiftBits(KINDS[kind], a, b & 0xff, flags[2]), V: flags[3] };
    const expected = shifted ?? addWithCarry(a, kind === 5 ? b : ~b, flags[2] ? 1 : 0);
    const op = 0x4000 | (kind << 6) | (m << 3) | d;
    const which = `${op.toString(16)} on ${a.toString(16)}, ${b.toString(16)}, ${flags}`;
    assert.equal(fast.execute([op], registers, flags), 1, which);
    registers[d] = expected.result;
    const after = [...registers.map((v) => v >>> 0), CODE + 2, expected.result >>> 31 === 1, expected.result === 0, expected.C, expected.V];
    assert.deepEqual(fast.state, after, which);
  }
  // STM r1!, {r1, r2}: the base is the lowest in the list, so its old value is stored.
  const registers = [0, 0x20002000, 7, ...new Array(10).fill(0), STACK, 1];
  assert.equal(fast.execute([0xc106], registers, someFlags()), 3);
  const stored = [0x2000, 0x2004].map((at) => fast.memory.getUint32(at, true));
  assert.deepEqual([...stored, fast.core.registers[1]], [0x20002000, 7, 0x20002008]);
});

failsWith('read of an unmapped address', main('(void)REG(0x30000000);'), /read of 0x30000000, where nothing is/);
failsWith('unaligned load', main('volatile uint32_t at = 0x20000002; (void)REG(at);'), /unaligned 32-bit read/);
failsWith('unaligned store', main('volatile uint32_t at = 0x20000001; *(volatile uint16_t *)at = 1;'), /unaligned 16-bit write/);
failsWith('store through a null pointer', main('REG(0) = 1;'), /write to 0x0 in the boot ROM/);
failsWith('store to flash', main('REG(0x10000200) = 1;'), /in flash/);
failsWith('undefined instruction', main('__asm volatile("udf #7");'), /undefined instruction/);
failsWith('peripheral held in reset', main('REG(0x40044000) = 0x65;'), /while I2C0 is held in reset/);
failsWith('USB memory held in reset', main('REG(0x50100000) = 0;'), /while USBCTRL is held in reset/);
failsWith('timer read without a tick', main('(void)now_us();'), /no tick runs/);
const tooSoon = main('unreset(1 << 12); REG(0x40028008) = 125; CLR(0x40028004) = 33;');
failsWith('PLL before the crystal is stable', tooSoon, /before the crystal oscillator was stable/);
const restartPll = (reset) =>
  main(`start_clocks(); REG(0x4000803c) = 0; SET(0x40028004) = 45; ${reset} REG(0x40028008) = 125; REG(0x4002800c) = 6 << 16 | 2 << 12;
  CLR(0x40028004) = 33; while (!(REG(0x40028000) & 0x80000000)) { } CLR(0x40028004) = 8; done();`);
failsWith('PLL started again that still says it is locked', restartPll(''), /before the PLL locked/);
test('a reset of its block takes the lock of a PLL', () => {
  assert.ok(run(restartPll('SET(0x4000c000) = 1 << 12; unreset(1 << 12);')).finished);
});
failsWith('clk_sys from a dead PLL', main('REG(0x4000803c) = 1;'), /clk_sys switched to a source that does not run/);
failsWith('WFI with no interrupt enabled', main('__asm volatile("wfi");'), /firmware hung/);
failsWith('asleep for ever', main('REG(0xe000e100) = 1; __asm volatile("wfi");'), /asleep for 2 s/, { seconds: 3 });
const early = main('REG(0xd0000060) = 100; REG(0xd0000064) = 7; RESULT(0) = REG(0xd0000070);');
failsWith('divider result read too early', early, /before its 8 cycles/);

test('a corrupt second stage is not started', () => {
  const machine = makeMachine(main(''));
  const image = Uint8Array.from(machine.image);
  image[10] ^= 1;
  machine.chip.load(image);
  assert.throws(() => machine.chip.boot(), /failure/);
  assert.match(machine.result.warnings[0], /second stage CRC/);
});

test('watchdog: unfed reboots the chip and is reported; scratch and reason survive', () => {
  const source = main(`if (REG(0x40058008)) { RESULT(0) = REG(0x40058008); RESULT(1) = REG(0x4005800c); done(); }
    start_clocks(); REG(0x4005800c) = 77; REG(0x40010008) = 0x1fffc; REG(0x40058004) = 2 * 10000; SET(0x40058000) = 1 << 30;
    for (int i = 0; i < 5; i++) { wait_us(5000); REG(0x40058004) = 2 * 10000; }
    RESULT(2) = now_us(); for (;;) { }`);
  const { result, results, finished } = run(source);
  assert.ok(finished);
  assert.deepEqual(results.slice(0, 2), [1, 77]);
  assert.ok(results[2] >= 25000, 'feeding kept it alive');
  assert.equal(result.reboots, 1);
  assert.match(result.warnings[0], /watchdog: was not fed/);
  assert.deepEqual(run(source, { allowWatchdog: true }).result.warnings, []);
});

const unfed = main('start_clocks(); REG(0x40058004) = 2000; SET(0x40058000) = 1 << 30; for (;;) { }');
failsWith('watchdog without PSM_WDSEL', unfed, /PSM_WDSEL/);

const READ_ID = (fill) => `
  __attribute__((noinline, section(".ramcode"))) static void read_id(void) {
    REG(0x18000008) = 0; REG(0x18000014) = 6; REG(0x18000000) = 7 << 16; REG(0x18000008) = 1;
    int sent = 0, got = 0;
    while (got < 13) {
      ${fill}
      if (REG(0x18000024)) { const uint32_t b = REG(0x18000060); if (got >= 5) ((volatile uint8_t *)0x20030000)[got - 5] = (uint8_t)b; got++; }
    }
    REG(0x18000008) = 0; REG(0x18000000) = 31 << 16 | 3 << 8; REG(0x18000008) = 1;
  }
  void main(void) {
    const volatile uint32_t *from = (const volatile uint32_t *)((uint32_t)read_id & ~3u);
    for (int i = 0; i < 64; i++) REG(0x20008000 + 4 * i) = from[i];
    ((void (*)(void))(0x20008001 + ((uint32_t)read_id & 2)))(); done(); }`;

test('the flash unique id is read over the SSI from SRAM and execute-in-place comes back', () => {
  const { finished, result, machine } = run(READ_ID('if (sent < 13 && sent - got < 14) { REG(0x18000060) = sent ? 0 : 0x4b; sent++; }'), {
    serial: '0123456789abcdef',
  });
  assert.deepEqual(result.warnings, []);
  assert.ok(finished);
  assert.equal(Buffer.from(machine.chip.sram.subarray(0x30000, 0x30008)).toString('hex'), '0123456789abcdef');
});

const cut = main('REG(0x18000008) = 0; RESULT(0) = 1;');
failsWith('flash code while the SSI is reconfigured', cut, /read of flash at .* while the SSI is disabled/);
