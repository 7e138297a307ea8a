/**
 * What the release images leave when they end in a fault, a panic or by the watchdog, and what the next life tells of it.
 *
 * usage: test_crash.mjs BUILD_OF_IMAGES FINGERTIP COMMAND_FRAME
 */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { CrashBench } from './harness/crash_bench.mjs';

const [images, fingertip, command_frame] = process.argv.slice(2);
// crash.h
const [FAULT, PANIC, WATCHDOG, EXCEPTION, OVERFLOW, START] = [1, 2, 3, 4, 5, 6];
const [MAIN, SCAN, USB, INTERRUPTS] = [1, 2, 4, 8];
const AT = { rest: 1, commands: 2, readings: 3, fit: 5 };
const EVENT = { start: 1, command: 2, closed: 3 };
// Instructions: b . ; bx lr ; movs r0, #FT_PENDING and bx lr; ldr r1, =0x7fffffff and movs r0, #0 and bx lr
const [STAND_STILL, RETURN, RETURN_PENDING, RETURN_FAR] = ['fee7', '7047', '01207047', '0149002070470000ffffff7f'];
const LAST_WORDS_ms = 20;
const PERIOD_ms = 500;
const LIMIT_ms = 400;

class Bench extends CrashBench {
  constructor(name, options) {
    super(images, { fingertip, command_frame }, name, options);
  }

  /** And that no more is left of it. */
  end() {
    this.stream();
    this.assertStreams(50);
    return super.end();
  }
}

/** A bench whose streams have come for some time. */
function streaming(name, ms = 0, options = {}) {
  const bench = new Bench(name, options);
  bench.stream();
  bench.run(ms);
  return bench;
}

/** Something that was in no crash does not read as one. */
test('a first start tells of no crash, whatever is in SRAM', () => {
  for (let seed = 1; seed < 4; seed++) {
    const bench = streaming('pico_mux', 0, { seed });
    assert.equal(bench.crash().kind, 0);
    assert.equal(bench.resets(), 0);
    bench.end();
  }
});

{
  const name = 'pico_parallel';
  test(`${name}: a jump into the guarded page is a hard fault with its registers`, () => {
    const bench = streaming(name, 300);
    const { core } = bench.machine.chip;
    bench.until(() => core.waiting && core.IPSR === 0, 10, 'sleep');
    const sp = core.registers[13];
    [0x11, 0x22, 0x33, 0x44].forEach((value, i) => (core.registers[i] = value));
    core.registers[12] = 0x55;
    core.registers[14] = 0x20001235;
    core.registers[15] = 0x20040100;
    core.waiting = false;
    const at_us = bench.machine.chip.timer.count_us;
    assert.ok(bench.untilReset() < 3);
    const crash = bench.crash();
    assert.deepEqual([crash.kind, crash.exception, crash.vector, crash.activity], [FAULT, 0, 3, AT.rest]);
    assert.deepEqual([crash.pc, crash.lr, crash.sp], [0x20040100, 0x20001235, sp >>> 0]);
    assert.deepEqual([crash.r0, crash.r1, crash.r2, crash.r3, crash.r12], [0x11, 0x22, 0x33, 0x44, 0x55]);
    assert.ok(Math.abs(crash.t_us - at_us) < 100, `${crash.t_us} ${at_us}`);
    const codes = crash.events.map(([code]) => code);
    assert.equal(codes.at(-1), EVENT.start);
    assert.ok(codes.includes(EVENT.command), `${codes}`);
    assert.ok(Math.abs(crash.events.at(-1)[2] - at_us / 1000) < 5, 'the start was as long ago as the firmware ran');
    assert.equal(bench.resets(), 1);
    bench.end();
  });

  test(`${name}: a call through a null pointer, in an interrupt, is told with both`, () => {
    const bench = streaming(name);
    const { chip } = bench.machine;
    let fell = false;
    chip.onCall(bench.address('app_on_event'), () => {
      if (fell || bench.now_ms < 100) return;
      fell = true;
      chip.core.registers[15] = 0;
    });
    bench.until(() => bench.now_ms > 100, 200, 'time');
    bench.untilReset(100);
    const crash = bench.crash();
    assert.deepEqual([crash.kind, crash.pc], [FAULT, 0]);
    assert.ok(crash.exception >= 16, `${crash.exception}`);
    assert.ok(['on_event', 'rp2040_event'].includes(bench.place(crash.lr & ~1)), bench.place(crash.lr & ~1));
    bench.end();
  });

  test(`${name}: a stack that grows out of its bank`, () => {
    const bench = streaming(name);
    const { core } = bench.machine.chip;
    bench.until(() => core.waiting, 10, 'sleep');
    core.registers[13] = 0x20041008;
    assert.ok(bench.untilReset() <= 10);
    const crash = bench.crash();
    assert.equal(crash.kind, OVERFLOW);
    assert.ok(crash.sp < 0x20041028 && crash.sp > 0x20040f00, crash.sp.toString(16));
    assert.ok(bench.place(crash.pc), crash.pc.toString(16));
    bench.end();
  });

  test(`${name}: a panic tells who called it`, () => {
    const bench = streaming(name);
    const { chip } = bench.machine;
    const [caller, panic] = [bench.address('scan_take'), bench.address('port_panic')];
    // bl port_panic
    const offset = panic - (caller + 4);
    const [s, imm10, imm11] = [(offset >>> 24) & 1, (offset >>> 12) & 0x3ff, (offset >>> 1) & 0x7ff];
    const [j1, j2] = [23, 22].map((bit) => ((offset >>> bit) & 1) ^ s ^ 1);
    const code = Buffer.alloc(4);
    code.writeUInt16LE(0xf000 | (s << 10) | imm10, 0);
    code.writeUInt16LE(0xd000 | (j1 << 13) | (j2 << 11) | imm11, 2);
    chip.sram.set(code, caller - 0x20000000);
    assert.ok(bench.untilReset() <= 100);
    const crash = bench.crash();
    assert.deepEqual([crash.kind, crash.vector, crash.exception, crash.pc, crash.activity], [PANIC, 0, 0, caller, AT.readings]);
    bench.end();
  });

  test(`${name}: an interrupt without a handler`, () => {
    const bench = streaming(name);
    bench.machine.chip.busWrite(0xe000e100, 1 << 20, 4); // UART0
    bench.machine.chip.busWrite(0xe000e200, 1 << 20, 4);
    bench.untilReset(10);
    const crash = bench.crash();
    assert.deepEqual([crash.kind, crash.vector], [EXCEPTION, 16 + 20]);
    bench.end();
  });

  test(`${name}: interrupts that are off for good: the next start tells what it knows`, () => {
    const bench = streaming(name, 100);
    const { chip } = bench.machine;
    bench.patch('scan_take', '72b6' + STAND_STILL); // cpsid i
    const at_us = chip.timer.count_us;
    const took_ms = bench.untilReset();
    assert.ok(took_ms > PERIOD_ms && took_ms < PERIOD_ms + LAST_WORDS_ms + 20, `${took_ms}`);
    const crash = bench.crash();
    assert.deepEqual([crash.kind, crash.stuck, crash.activity, crash.pc, crash.sp], [WATCHDOG, INTERRUPTS, AT.readings, 0, 0]);
    assert.ok(Math.abs(crash.t_us - at_us - 1000 * PERIOD_ms) < 20e3, `${crash.t_us} ${at_us}`);
    assert.ok(crash.events.length >= 2);
    bench.end();
  });

  /** While no host hears it, or none comes, nothing is stuck. */
  test(`${name}: a bus that sleeps, a cable that is out, a host that is silent or does not read are no reason`, () => {
    const bench = streaming(name, 0, {
      faults: [
        { type: 'usb_unplug', from_s: 2.5, to_s: 5 },
        { type: 'host_stall', from_s: 5.5, to_s: 7 },
      ],
    });
    bench.machine.host.suspend();
    bench.run(1500);
    bench.machine.host.resume();
    bench.run(8000 - bench.now_ms);
    assert.equal(bench.machine.reboots, 0);
    bench.end();
  });
}

for (const name of ['pico_mux', 'pico_parallel']) {
  test(`${name}: a main loop that stands still`, (t) => {
    // The last words mostly come amid an interrupt of the bus on pico_mux, and tell that: other instants, until they do not.
    let told = 0;
    for (let from_ms = 100; told === 0 && from_ms < 150; from_ms += 1.37) {
      const bench = streaming(name, from_ms);
      bench.patch('scan_take', STAND_STILL);
      const took_ms = bench.untilReset();
      t.diagnostic(`${took_ms.toFixed(0)} ms`);
      assert.ok(took_ms > PERIOD_ms && took_ms < PERIOD_ms + LAST_WORDS_ms + 20, `${took_ms}`);
      assert.equal(bench.machine.chip.watchdog.reason, 1, 'by its timer');
      const crash = bench.crash();
      assert.deepEqual([crash.kind, crash.stuck, crash.activity], [WATCHDOG, MAIN, AT.readings]);
      if (crash.exception === 0) {
        assert.equal(crash.pc, bench.address('scan_take'));
        told += 1;
      }
      assert.equal(bench.resets(), 1);
      bench.end();
    }
    assert.ok(told > 0);
  });

  const patched = (where, code) => (bench) => bench.patch(where, code);
  for (const [what, act, stuck, least_ms] of [
    ['a scan that does not go on, whose alarm is lost', patched('rp2040_event', RETURN), SCAN, 0],
    ['a scan that never wants to be called again, while its events go on', patched('scan_step', RETURN_FAR), SCAN, LIMIT_ms],
    ['a bus operation that never ends, while its events go on', patched('poll', RETURN_PENDING), SCAN, LIMIT_ms],
    // the service interrupt is disabled
    ['USB that is not served', (bench) => bench.machine.chip.busWrite(0xe000e180, 1 << 26, 4), USB, LIMIT_ms],
  ]) {
    test(`${name}: ${what}`, (t) => {
      const bench = streaming(name, 100);
      act(bench);
      const took_ms = bench.untilReset();
      t.diagnostic(`${took_ms.toFixed(0)} ms`);
      assert.ok(took_ms >= least_ms && took_ms < LIMIT_ms + PERIOD_ms + LAST_WORDS_ms + 100, `${took_ms}`);
      const crash = bench.crash();
      assert.deepEqual([crash.kind, crash.stuck], [WATCHDOG, stuck]);
      bench.end();
    });
  }
}

test('the slowest rate, and sensors that are all dead, are no reason', () => {
  const bench = streaming('pico_mux', 0, {
    faults: Array.from({ length: 15 }, (_, sensor) => ({ type: 'sensor_dead', sensor, from_s: 1, to_s: 3 })),
  });
  bench.machine.client.write(bench.encoded('rate', '0.1'));
  bench.run(5000);
  assert.equal(bench.machine.reboots, 0);
});

test('two crashes: the last is told, both are counted, and power-off forgets them', () => {
  const bench = streaming('pico_mux', 0, { faults: [{ type: 'power_cut', from_s: 3, to_s: 3.1 }] });
  bench.patch('scan_take', STAND_STILL);
  bench.untilReset();
  assert.equal(bench.crash().kind, WATCHDOG);
  bench.stream();
  bench.machine.chip.core.registers[15] = 0x20040000;
  bench.machine.chip.core.waiting = false;
  bench.untilReset();
  assert.equal(bench.crash().kind, FAULT);
  assert.equal(bench.resets(), 2);
  bench.run(3200 - bench.now_ms);
  assert.equal(bench.crash().kind, 0);
  assert.equal(bench.resets(), 0);
  bench.end();
});

test('a record that was damaged is none', () => {
  const bench = streaming('pico_mux');
  const { chip } = bench.machine;
  chip.core.registers[15] = 0x20040000;
  chip.core.waiting = false;
  const kept = bench.address('kept') - 0x20000000;
  chip.onWatchdog = () => {
    chip.sram[kept + 20] ^= 1;
  };
  bench.untilReset();
  const crash = bench.crash();
  assert.deepEqual([crash.kind, crash.pc], [START, 0], 'only that the chip reset itself');
  bench.end();
});
