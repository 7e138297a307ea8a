/** The second core, by small images that start it: what the datasheet and the boot ROM promise, and one mistake each, which must fail the run. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { run } from './bench.mjs';

const PRELUDE = `
  enum { CPUID = 0xd0000000, FIFO_ST = 0xd0000050, FIFO_WR = 0xd0000054, FIFO_RD = 0xd0000058, SPINLOCK0 = 0xd0000100, FRCE_OFF = 0x40010004, PROC1 = 1 << 16 };
  static inline void sev(void) { __asm volatile("sev" ::: "memory"); }
  static inline void wfe(void) { __asm volatile("wfe" ::: "memory"); }
  static inline uint32_t pop(void) { while (!(REG(FIFO_ST) & 1)) wfe(); return REG(FIFO_RD); }
  static inline void push(uint32_t word) { while (!(REG(FIFO_ST) & 2)) { } REG(FIFO_WR) = word; sev(); }
  static inline void drain(void) { while (REG(FIFO_ST) & 1) (void)REG(FIFO_RD); }
  static inline uint32_t ask(uint32_t word) { push(word); return pop(); }
  static inline void reset_core1(void) { SET(FRCE_OFF) = PROC1; while (!(REG(FRCE_OFF) & PROC1)) { } CLR(FRCE_OFF) = PROC1; }
  static inline void launch(void (*entry)(void), uint32_t sp) {
    const uint32_t words[] = {0, 0, 1, 0x10000100, sp, (uint32_t)entry};
    for (unsigned i = 0; i < 6;) {
      if (words[i] == 0) { drain(); sev(); }
      i = ask(words[i]) == words[i] ? i + 1 : 0;
    }
  }
  static inline void halt(void) { for (;;) __asm volatile("wfi"); }`;
const STACK = '0x20040800';

const image = (core1, main, helpers = '') =>
  `${PRELUDE}\n${helpers}\nstatic void core1(void) { ${core1} }\nvoid main(void) { start_clocks(); ${main} done(); }`;
/** The results of an image whose core 1 is launched first. */
const launched = (core1, main, helpers) => results(image(core1, `launch(core1, ${STACK}); ${main}`, helpers)).found;

/** @returns the results of an image without faults */
function results(source, options) {
  const { result, finished, results: found, machine } = run(source, options);
  assert.deepEqual(result.warnings, []);
  assert.ok(finished, result.end_reason);
  return { found, result, machine };
}

function failsWith(name, source, pattern) {
  test(`fails: ${name}`, () => {
    const { result, finished } = run(source);
    assert.ok(!finished, 'the image must not reach its end');
    assert.match(result.warnings.join('\n'), pattern);
  });
}

test('the boot ROM sends a 0 after a reset, answers each word with itself, and begins again at a 0 and at what is no 1', () => {
  const words = `RESULT(0) = pop(); drain();
    RESULT(1) = ask(0); RESULT(2) = ask(1); RESULT(3) = ask(0x10000100); RESULT(4) = ask(0);
    RESULT(5) = ask(7); RESULT(6) = ask(1); RESULT(7) = ask(0x10000100); RESULT(8) = ask(${STACK}); RESULT(9) = ask((uint32_t)core1);`;
  const { found } = results(image('halt();', words));
  assert.deepEqual(found.slice(0, 9), [0, 0, 1, 0x10000100, 0, 0, 1, 0x10000100, Number(STACK)]);
  assert.equal(found[9] & 1, 1);
});

test('a core that was launched has its number, its stack and its vector table; the end of its function parks it', () => {
  const core1 = `uint32_t sp; __asm volatile("mov %0, sp" : "=r"(sp)); RESULT(0) = REG(CPUID); RESULT(1) = sp; RESULT(2) = REG(0xe000ed08);
    RESULT(3) = REG(FIFO_ST) & 8; REG(FIFO_ST) = 8; RESULT(4) = REG(FIFO_ST) & 8; push(5);`;
  const main = `launch(core1, ${STACK}); RESULT(5) = pop(); RESULT(6) = REG(CPUID); wait_us(10);`;
  const { found, result, machine } = results(image(core1, main));
  assert.deepEqual([found[0], found[2], ...found.slice(3, 7)], [1, 0x10000100, 8, 0, 5, 0]);
  assert.ok(found[1] <= Number(STACK) && found[1] > Number(STACK) - 64);
  assert.ok(machine.chip.second.core.waiting, 'parked in the boot ROM');
  assert.ok(result.cycles_core1 > 0);
});

test('a FIFO holds eight words; more are lost and noted, as is a read of an empty one', () => {
  const main = `RESULT(0) = REG(FIFO_ST) & 15; for (uint32_t i = 0; i < 8; i++) REG(FIFO_WR) = i;
    RESULT(1) = REG(FIFO_ST) & 15; REG(FIFO_WR) = 8; RESULT(2) = REG(FIFO_ST) & 15; REG(FIFO_ST) = 4; RESULT(3) = REG(FIFO_ST) & 15;
    (void)REG(FIFO_RD); RESULT(4) = REG(FIFO_ST) & 15;`;
  const found = launched('halt();', main);
  assert.deepEqual(found.slice(0, 5), [2, 0, 4, 0, 8]);
});

test('the interrupt of a FIFO comes to the core that reads it', () => {
  const { found } = results(`${PRELUDE}
    void isr(void) { const uint32_t id = REG(CPUID); RESULT(id) = pop(); RESULT(2 + id) = __builtin_return_address(0) != 0; REG(FIFO_ST) = 12; }
    static void core1(void) { drain(); REG(FIFO_ST) = 12; REG(0xe000e100) = 1 << 16; push(1); for (;;) __asm volatile("wfi"); }
    void main(void) { start_clocks(); launch(core1, ${STACK}); RESULT(0) = RESULT(1) = 0; (void)pop();
      push(77); wait_us(5); RESULT(4) = RESULT(0); RESULT(5) = RESULT(1); done(); }`);
  assert.deepEqual(found.slice(4, 6), [0, 77]);
});

test('SEV ends the WFE of the other and is kept if it comes before', () => {
  // The boot ROM's last SEV is kept for the first WFE of core 1.
  const found = launched(
    `wfe(); wfe(); RESULT(0) = now_us(); wait_us(20); sev(); RESULT(1) = now_us(); halt();`,
    `wait_us(30); RESULT(2) = now_us(); sev(); wfe(); wfe(); RESULT(3) = now_us(); sev(); wfe(); RESULT(4) = now_us();`,
  );
  assert.ok(found[0] - found[2] <= 1, 'core 1 wakes at once');
  assert.ok(found[3] - found[1] <= 1 && found[1] - found[2] >= 20, 'core 0 sleeps until core 1 has done');
  assert.ok(found[4] - found[3] <= 1, 'an event of its own is kept');
});

test('each core has a divider of its own', () => {
  const divide = (a, b) => `REG(0xd0000060) = ${a}; REG(0xd0000064) = ${b}; for (volatile int i = 0; i < 4; i++) { }`;
  const main = `RESULT(0) = RESULT(1) = RESULT(2) = 0; launch(core1, ${STACK});
    for (int k = 0; k < 500; k++) { ${divide(999999, 10)} if (REG(0xd0000074) != 9 || REG(0xd0000070) != 99999) RESULT(2)++; }`;
  const { found } = results(image(`for (;;) { ${divide(1000, 7)} if (REG(0xd0000070) != 142) RESULT(0)++; RESULT(1)++; }`, main));
  assert.deepEqual([found[0], found[2]], [0, 0]);
  assert.ok(found[1] > 100);
});

test("a spin lock is one core's at a time, and who comes first depends on the seed", () => {
  const source = image(
    `for (int k = 0; k < 300; k++) add(1); RESULT(1) = 1; halt();`,
    `RESULT(0) = RESULT(1) = 0; launch(core1, ${STACK}); for (int k = 0; k < 300; k++) add(2); while (!RESULT(1)) { } RESULT(3) = RESULT(2);`,
    `static void add(uint32_t who) { while (!REG(SPINLOCK0)) { }
      const uint32_t had = RESULT(0); RESULT(2) = RESULT(2) * 3 + who; RESULT(0) = had + 1; REG(SPINLOCK0) = 1; }`,
  );
  const orders = new Set();
  for (const seed of [1, 2, 3, 4]) {
    const { found } = results(source, { seed });
    assert.equal(found[0], 600, 'no sum is lost');
    orders.add(found[3]);
    assert.equal(results(source, { seed }).found[3], found[3], 'the same seed, the same order');
  }
  assert.ok(orders.size > 1, 'the order varies');
});

test('without a lock sums of two cores get lost', () => {
  const many = 'for (int k = 0; k < 2000; k++) RESULT(0)++;';
  const main = `RESULT(0) = RESULT(1) = 0; launch(core1, ${STACK}); ${many} while (!RESULT(1)) { }`;
  const { found } = results(image(`${many} RESULT(1) = 1; halt();`, main));
  assert.ok(found[0] < 4000 && found[0] >= 2000, `${found[0]}`);
});

test('a core is reset in the middle of its work, whatever it does, and launched again', () => {
  const main = `RESULT(0) = RESULT(1) = 0; for (int k = 0; k < 5; k++) { launch(core1, ${STACK}); wait_us(3 + k); reset_core1();
    RESULT(2) = RESULT(1); wait_us(5); RESULT(3 + k) = RESULT(1) - RESULT(2); }`;
  const { found } = results(image('RESULT(0)++; for (;;) RESULT(1)++;', main));
  assert.equal(found[0], 5);
  assert.ok(found[1] > 10);
  assert.deepEqual(found.slice(3, 8), [0, 0, 0, 0, 0]);
});

test('each core has an MPU of its own: what faults one does not fault the other', () => {
  const { found } = results(`${PRELUDE}
    void isr(void) { RESULT(REG(CPUID)) = 1; halt(); }
    static void core1(void) { REG(0xe000ed9c) = 0x20020000 | 16; REG(0xe000eda0) = 1 << 28 | 7 << 1 | 1; REG(0xe000ed94) = 5; __asm volatile("dsb\\n isb"); REG(0x20020010) = 9; RESULT(2) = 1; halt(); }
    void main(void) { start_clocks(); RESULT(0) = RESULT(1) = RESULT(2) = 0; launch(core1, ${STACK}); wait_us(10); REG(0x20020010) = 5; RESULT(3) = REG(0x20020010); done(); }`);
  assert.deepEqual(found.slice(0, 4), [0, 1, 0, 5]);
});

test('two cores keep the time: core 1 counts as many cycles as pass while it works', () => {
  const main = `launch(core1, ${STACK}); RESULT(0) = now_us(); wait_us(1000); RESULT(1) = now_us();`;
  const { found, result } = results(image('for (;;) { }', main));
  const more = result.cycles_core1 - (found[1] - found[0]) * 125; // now_us() counts whole microseconds
  assert.ok(more > -125 && more < 500, `${more}`);
});

test('core 1 works while core 0 sleeps', () => {
  const main = `RESULT(0) = now_us(); launch(core1, ${STACK}); sev(); wfe(); wfe(); RESULT(1) = now_us();`;
  const { found } = results(image('wait_us(100); sev(); halt();', main));
  const took = found[1] - found[0];
  assert.ok(took >= 100 && took < 110, `${took}`);
});

const asks = (first, table, entry) => `${first} ask(0); ask(1); ask(${table}); ask(${STACK}); ask((uint32_t)core1${entry}); wait_us(5);`;
const entered = image('halt();', asks('ask(0);', '0x10000100', ' & ~1u'));
failsWith('an entry that is no Thumb address', entered, /without the Thumb bit/);
failsWith('a vector table that is not aligned', image('halt();', asks('drain();', '0x10000180', '')), /not aligned to 256/);
const working = (core1, main) => image(core1, `launch(core1, ${STACK}); ${main} wait_us(5);`);
failsWith('an interrupt of core 1 that is not modelled', working('REG(0xe000e100) = 1; halt();', ''), /only that of its FIFO/);
failsWith('the reset of something else', image('halt();', '(void)core1; REG(FRCE_OFF) = 1 << 3;'), /only the reset of core 1/);
failsWith('code of core 1 in a flash that is not readable', working('for (;;) { }', 'REG(0x18000008) = 0;'), /while/);
failsWith(
  'a fault of core 1 in its fault handler',
  image(
    '__asm volatile("udf #0");',
    `launch(core1, ${STACK}); wait_us(5);`,
    'void isr(void) { (void)REG(0x20020000); REG(0xe000ed94) = 5; __asm volatile("udf #0"); halt(); }',
  ),
  /undefined instruction/,
);
