/** The chip: small images that behave, and small images with one mistake each, which must fail the run. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Chip } from '../../../host_tools/emulator/chip/chip.mjs';
import { RP2040 } from '../../../host_tools/emulator/chip/core.mjs';
import { SimulatedTime } from '../../../host_tools/emulator/clock.mjs';
import { Prng } from '../../../host_tools/emulator/prng.mjs';
import { Report } from '../../../host_tools/emulator/report.mjs';
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

test('cycles: push/pop, exception entry and exit are charged as the hardware does', () => {
  const { machine } = (() => {
    const m = makeMachine(`__attribute__((naked, noinline)) void leaf(void) { __asm volatile("push {r4, lr}\\n pop {r4, pc}"); }
      void main(void) { leaf(); done(); }`);
    return { machine: m };
  })();
  const { chip } = machine;
  // push {r4, lr} (0xb510) is unique in this image.
  let at = 0;
  for (let i = 0; i < machine.image.length; i += 2) if (machine.image[i] === 0x10 && machine.image[i + 1] === 0xb5 && machine.image[i + 2] === 0x10 && machine.image[i + 3] === 0xbd) at = 0x10000000 + i;
  assert.ok(at);
  const stamps = [];
  chip.onCall(at, (c) => stamps.push([c.core.cycles, c.core.LR & ~1]));
  machine.run(1e6);
  const back = [];
  assert.equal(stamps.length, 1);
  const again = makeMachine(`__attribute__((naked, noinline)) void leaf(void) { __asm volatile("push {r4, lr}\\n pop {r4, pc}"); }
      void main(void) { leaf(); done(); }`);
  again.chip.onCall(at, (c) => back.push(c.core.cycles));
  again.chip.onCall(stamps[0][1], (c) => back.push(c.core.cycles));
  again.run(1e6);
  assert.equal(back[1] - back[0], 3 + 5);
});

test('the fast decoder agrees with rp2040js on random instructions', () => {
  const time = new SimulatedTime();
  const chip = new Chip(time, new Report(), { serial: new Uint8Array(8) });
  const reference = new RP2040();
  reference.sram.set(chip.sram);
  reference.logger = { debug() {}, info() {}, warn() {}, error() {} };
  const random = new Prng(99);
  const FORMS = [
    () => random.uint32() & 0x3fff, // shifts, adds, moves, compares, below
    () => 0x2000 | (random.uint32() & 0x1fff), () => 0x4000 | (random.uint32() & 0x3ff),
    () => 0x6000 | (random.uint32() & 0x1fff), () => 0x8000 | (random.uint32() & 0xfff), () => 0x5000 | (random.uint32() & 0xfff),
    () => 0x9000 | (random.uint32() & 0xfff), () => 0xa000 | (random.uint32() & 0xfff), () => 0xb000 | (random.uint32() & 0xff),
    () => 0xb200 | (random.uint32() & 0xff), () => 0xb400 | (random.uint32() & 0x1ff), () => 0xbc00 | (random.uint32() & 0xff),
    () => 0xc000 | (random.uint32() & 0xfff), () => 0xd000 | (random.uint32() % 0xe00), () => 0xe000 | (random.uint32() & 0x7ff),
    () => 0x4400 | (random.uint32() & 0x2ff), () => 0x4600 | (random.uint32() & 0xff),
  ];
  const pc = 0x20001000;
  let compared = 0;
  for (let i = 0; i < 60000; i++) {
    const op = FORMS[i % FORMS.length]();
    const [top, kind] = [op >>> 11, (op >>> 6) & 15];
    if (top === 24 && (op >>> ((op >>> 8) & 7)) & 1) continue; // STM with its base in the list: rp2040js differs from hardware
    if (op >>> 10 === 16) {
      if (kind === 5 || kind === 6) continue; // carry into 0x7fffffff: V of rp2040js is wrong
      if (kind === 2 || kind === 3 || kind === 4 || kind === 7) continue; // shift counts above 31: C of rp2040js is wrong
    }
    const registers = Array.from({ length: 13 }, () => (random.uniform() < 0.5 ? random.uint32() : random.uint32() & 0xff));
    if ((top >= 10 && top <= 17) || top === 24 || top === 25) {
      for (let k = 0; k < 8; k++) registers[k] = 0x20002000 + 4 * (random.uint32() & 0xff);
      if (top === 10 || top === 11) registers[(op >>> 6) & 7] = 4 * (random.uint32() & 0xff);
      if ((top === 10 || top === 11) && ((op >>> 6) & 7) === ((op >>> 3) & 7)) continue;
    }
    const flags = random.uint32();
    for (const c of [chip.core, reference.core]) {
      c.registers.set(registers);
      c.registers[13] = 0x20004000;
      c.registers[14] = 0x20000101;
      c.registers[15] = pc;
      [c.N, c.Z, c.C, c.V] = [flags & 1, flags & 2, flags & 4, flags & 8].map(Boolean);
    }
    for (const target of [chip, reference]) {
      target.sramView.setUint16(0x1000, op, true);
      for (let k = 0; k < 64; k++) target.sramView.setUint32(0x2000 + 4 * ((i + k) & 0x7f), Math.imul(i + k, 2654435761) >>> 0, true);
    }
    const before = chip.core.cycles;
    chip.core.executeInstruction();
    const cycles = chip.core.cycles - before;
    const expected = reference.core.executeInstruction() + ((op & 0xff00) === 0xb500 ? 1 : 0);
    const name = `op 0x${op.toString(16)}`;
    assert.deepEqual([...chip.core.registers], [...reference.core.registers], name);
    assert.deepEqual([chip.core.N, chip.core.Z, chip.core.C, chip.core.V], [reference.core.N, reference.core.Z, reference.core.C, reference.core.V], name);
    assert.equal(cycles, expected, name);
    assert.equal(Buffer.compare(Buffer.from(chip.sram.subarray(0x2000, 0x2800)), Buffer.from(reference.sram.subarray(0x2000, 0x2800))), 0, name);
    reference.sram.set(chip.sram.subarray(0x3000, 0x5000), 0x3000);
    compared += 1;
  }
  assert.ok(compared > 40000);
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
failsWith('PLL before the crystal is stable', main('unreset(1 << 12); REG(0x40028008) = 125; CLR(0x40028004) = 33;'), /before the crystal oscillator was stable/);
failsWith('clk_sys from a dead PLL', main('REG(0x4000803c) = 1;'), /clk_sys switched to a source that does not run/);
failsWith('wrong tick divider', main('start_clocks(); REG(0x4005802c) = 0x200 | 10;'), /must be 1 MHz/);
failsWith('WFI with no interrupt enabled', main('__asm volatile("wfi");'), /firmware hung/);
failsWith('asleep for ever', main('REG(0xe000e100) = 1; __asm volatile("wfi");'), /asleep for 2 s/, { seconds: 3 });
failsWith('divider result read too early', main('REG(0xd0000060) = 100; REG(0xd0000064) = 7; RESULT(0) = REG(0xd0000070);'), /before its 8 cycles/);

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

failsWith('watchdog without PSM_WDSEL', main('start_clocks(); REG(0x40058004) = 2000; SET(0x40058000) = 1 << 30; for (;;) { }'), /PSM_WDSEL/);

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
  const { finished, result, machine } = run(READ_ID('if (sent < 13 && sent - got < 14) { REG(0x18000060) = sent ? 0 : 0x4b; sent++; }'), { serial: '0123456789abcdef' });
  assert.deepEqual(result.warnings, []);
  assert.ok(finished);
  assert.equal(Buffer.from(machine.chip.sram.subarray(0x30000, 0x30008)).toString('hex'), '0123456789abcdef');
});

failsWith('flash code while the SSI is reconfigured', main('REG(0x18000008) = 0; RESULT(0) = 1;'), /read of flash at .* while the SSI is disabled/);
