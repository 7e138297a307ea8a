/**
 * The release images on a chip that behaves as silicon does at its worst: each fault is overcome without help, in a
 * time that is the same in every run.
 *
 * usage: test_silicon.mjs BUILD_OF_IMAGES FINGERTIP COMMAND_FRAME [STEP_us]
 *
 * STEP_us: from one interrupted start to the next; 100 takes some minutes. Default: 4000.
 */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { parseScenario } from '../../host_tools/simulation/emulator/scenario.mjs';
import { HEADER } from './harness/bench.mjs';
import { ImageBench } from './harness/image_bench.mjs';

const [images, fingertip, command_frame, step_us = '4000'] = process.argv.slice(2);
const BOARDS = ['pico_mux', 'pico_parallel'];
// Flags of a contact (contact_flags.h)
const [CONTACT, TARED] = [1 << 0, 1 << 5];

const benchOf = (name, options) => new ImageBench(images, { fingertip, command_frame }, name, options);

/** A bench whose streams have come. */
function streaming(name, options) {
  const bench = benchOf(name, options);
  bench.stream();
  return bench;
}

test('a change of the suspend state that is told late does not close the port', () => {
  const bench = streaming('pico_parallel', { faults: [{ type: 'usb_late_resume', from_s: 0 }] });
  const { host } = bench.machine;
  host.suspend();
  bench.run(20);
  host.resume();
  bench.run(31);
  const before = bench.bytes;
  bench.machine.client.write(bench.encoded('stream', 'contact,raw,health'));
  bench.until(() => bench.bytes > before, 20, 'stream after the resume');
  bench.assertStreams(100);
  bench.end();
});

test('an abort of the I2C controller, whose FIFO stays flushed until it is told, costs no recovery of the bus', () => {
  const faults = Array.from({ length: 20 }, (_, i) => ({ type: 'sensor_nack', sensor: (4 * i) % 15, from_s: 0.1 + 0.0103 * i }));
  const bench = streaming('pico_mux', { faults });
  bench.run(320);
  const { bus_recoveries, bus_timeouts, bus_nacks } = bench.health();
  assert.ok(bus_nacks > 5, `${bus_nacks}`);
  assert.deepEqual([bus_recoveries, bus_timeouts], [0, 0]);
  bench.end();
});

for (const name of BOARDS) {
  for (const [type, limit_ms] of Object.entries({ usb_deaf: 1000, usb_dead: 1500 })) {
    test(`${name}: a USB controller hung as by erratum E15 (${type}) is reset and comes back`, (t) => {
      const from_s = 0.2;
      const bench = streaming(name, { faults: [{ type, from_s }] });
      bench.assertStreams(1000 * from_s - bench.now_ms);
      bench.until(() => !bench.machine.host.configured, 10, 'loss of the device');
      const back_ms = bench.stream(limit_ms) - 1000 * from_s;
      t.diagnostic(`streams again after ${back_ms} ms`);
      assert.ok(back_ms < limit_ms, `${back_ms}`);
      bench.assertStreams(100);
      const { reboots, usb } = bench.end();
      assert.deepEqual([reboots, usb.enumerations], [0, 2]);
    });
  }
}

/** A start with this fault from power-on to `to_ms`: how often the watchdog must help, and by when the streams come. */
function starts(what, faults, reboots, limit_ms) {
  for (const name of BOARDS) {
    test(`${name}: ${what}`, (t) => {
      const bench = benchOf(name, { faults });
      const back_ms = bench.stream(limit_ms);
      t.diagnostic(`streams after ${back_ms.toFixed(0)} ms`);
      assert.ok(back_ms < limit_ms, `${back_ms}`);
      bench.assertStreams(50);
      assert.equal(bench.end().reboots, reboots);
    });
  }
}
const until = (type, to_ms) => [{ type, from_s: 0, to_s: to_ms / 1000 }];

starts('a crystal that swings in full after 5 ms', until('crystal_weak', 5), 0, 60);
starts('a crystal that swings in full after 40 ms, past what is waited for: the watchdog helps', until('crystal_weak', 40), 1, 700);
starts('a crystal that begins to swing after 70 ms', until('crystal_dead', 70), 0, 130);
starts('a crystal that begins to swing after 400 ms', until('crystal_dead', 400), 2, 700);
starts('PLLs that lock after 60 ms', until('pll_late', 60), 0, 130);
starts('PLLs that lock after 400 ms', until('pll_late', 400), 2, 700);

test('what a debugger left in the clock generators does not stay', () => {
  const bench = benchOf('pico_mux');
  const { clocks, core } = bench.machine.chip;
  bench.until(() => clocks.sysHz === 125e6, 20, 'clock');
  for (const generator of [clocks.ref, clocks.sys, clocks.usb]) generator.div = 0x200;
  for (const generator of [clocks.sys, clocks.peri, clocks.usb]) generator.ctrl |= 1 << 5;
  core.registers[15] = bench.machine.chip.flashView.getUint32(0x104, true) & ~1; // as `load` and `run` do
  core.registers[13] = bench.machine.chip.flashView.getUint32(0x100, true);
  bench.stream();
  assert.deepEqual([clocks.refHz, clocks.sysHz, clocks.periHz, clocks.usbHz], [12e6, 125e6, 125e6, 48e6]);
  assert.equal(bench.end().reboots, 0);
});

test('a reset of the first core alone ends the second before its code is copied over', () => {
  const bench = benchOf('pico_mux');
  const { chip } = bench.machine;
  bench.until(() => chip.second.state === 'runs', 50, 'second core');
  chip.sram.set(chip.flash.subarray(0, 256), 0x41f00); // as the boot ROM does
  chip.core.registers.fill(0);
  chip.core.registers[13] = chip.core.registers[15] = 0x20041f00;
  chip.core.waiting = false;
  bench.run(0.03);
  assert.equal(chip.second.state, 'pen');
});

for (const name of BOARDS) {
  test(`${name}: the start of a frame is seen at once, whatever the sensors need`, (t) => {
    const faults = [{ type: 'sensor_dead', sensor: 3, from_s: 0.2, to_s: 0.25 }];
    const bench = streaming(name, { faults });
    bench.run(1500); // all PROMs are read and judged again
    const slowest_us = bench.machine.chip.usbCtrl.slowestSof_ns / 1000;
    t.diagnostic(`${slowest_us.toFixed(1)} us`);
    assert.ok(slowest_us < 20, `${slowest_us} us`);
    bench.end();
  });
}

test('sensors that acknowledge as soon as SCL falls cost no arbitration', () => {
  const bench = streaming('pico_mux', { faults: [3, 7, 14].map((sensor) => ({ type: 'sensor_fast', sensor, from_s: 0 })) });
  bench.run(200);
  const { frames_incomplete, bus_recoveries, bus_timeouts } = bench.health();
  assert.deepEqual([frames_incomplete, bus_recoveries, bus_timeouts], [0, 0, 0]);
  bench.end();
});

for (const name of BOARDS) {
  test(`${name}: the Pico's regulator is held in its quiet mode`, () => {
    const bench = streaming(name);
    assert.equal((bench.machine.chip.pins.high >>> 23) & 1, 1);
    bench.end();
  });
}

for (const [name, revision, faults] of [
  ['pico_mux', 1, [{ type: 'usb_busy_hub', from_s: 0 }]],
  ['pico_mux', 0, []],
  ['pico_parallel', 1, []],
  ['pico_parallel', 2, [{ type: 'usb_busy_hub', from_s: 0 }]],
]) {
  test(`${name}: a chip of revision B${revision} enumerates${faults.length ? ' behind a busy hub' : ''}`, (t) => {
    const bench = benchOf(name, { revision, faults, fastEnumeration: false });
    t.diagnostic(`streams after ${bench.stream(500).toFixed(0)} ms`);
    bench.assertStreams(100);
    assert.equal(bench.end().usb.enumerations, 1);
  });
}

for (const name of BOARDS) {
  for (const type of ['power_cut', 'chip_reset']) {
    test(`${name}: a start that is interrupted (${type}) at any time is followed by one that succeeds, whatever is in SRAM`, (t) => {
      const whole_ms = benchOf(name).stream();
      let [starts, slowest_ms] = [0, 0];
      for (let at_ms = Number(step_us) / 1000; at_ms < whole_ms + 5; at_ms += Number(step_us) / 1000) {
        starts += 1;
        const to_ms = at_ms + 3;
        const bench = benchOf(name, { seed: starts, faults: [{ type, from_s: at_ms / 1000, to_s: to_ms / 1000 }] });
        bench.run(to_ms);
        slowest_ms = Math.max(slowest_ms, bench.stream() - to_ms);
        bench.run(20);
        const { frames_incomplete, sensors_present, sensors_prom_bad, bus_nacks } = bench.health();
        assert.deepEqual([frames_incomplete, sensors_present, sensors_prom_bad], [0, 0x7fff, 0], `interrupted at ${at_ms} ms`);
        if (name === 'pico_parallel') assert.equal(bus_nacks, 0, `interrupted at ${at_ms} ms`); // sensors in mid-byte got their clocks first
        assert.equal(bench.end().reboots, 0, `interrupted at ${at_ms} ms`);
      }
      t.diagnostic(`${starts} starts, the slowest took ${slowest_ms.toFixed(0)} ms`);
      assert.ok(slowest_ms < whole_ms + 20, `${slowest_ms}`);
    });
  }
}

for (const name of BOARDS) {
  test(`${name}: while the bus sleeps sensors and clocks do too, and wake up in time`, (t) => {
    const bench = benchOf(name);
    const { host } = bench.machine;
    const { chip, board } = bench.machine;
    const steady = () => (chip.pins.high >>> 23) & 1;
    bench.stream();
    bench.assertStreams(50);
    for (const wake of ['resume', 'reset']) {
      assert.deepEqual([chip.clkSys, steady()], [125e6, 1]);
      host.suspend();
      bench.run(13); // 3 ms until the bus counts as idle, and 7 ms to follow (USB 2.0, 7.1.7.6)
      assert.deepEqual([chip.clkSys, chip.pllSys.outputHz, steady()], [12e6, 0, 0]);
      const [transactions, cycles, gated_ns] = [board.statistics.transactions, chip.core.cycles, chip.deepSleep_ns];
      bench.run(1000);
      assert.equal(board.statistics.transactions, transactions, 'no sensor is asked for anything');
      const awake = (chip.core.cycles - cycles) / 12e6;
      t.diagnostic(`awake for ${(100 * awake).toFixed(2)} % of the time, at 12 MHz`);
      assert.ok(awake < 0.02, `${awake}`);
      assert.ok(chip.deepSleep_ns - gated_ns > 0.98e9, 'the clocks of what cannot wake it stand');
      const from_ms = bench.now_ms;
      if (wake === 'resume') host.resume();
      else host.resetDevice(() => {});
      bench.until(() => chip.clkSys === 125e6, 5, 'fast clock'); // before the signalling ends, 20 or 10 ms
      t.diagnostic(`fast ${(bench.now_ms - from_ms).toFixed(0)} ms after the ${wake} began`);
      bench.run(45);
      if (wake === 'resume') bench.stream();
      bench.until(() => board.statistics.transactions > transactions + 30, 50, 'transactions');
    }
    bench.end();
  });
}

/** As the weather does. */
test('what changed while the bus slept for long is no contact', () => {
  const row = (t_s, Pa) => `${t_s},0,0,0,0,0,0,0,${new Array(15).fill(Pa).join(',')}\n`;
  const scenario = parseScenario(`# fingertip-scenario 1\n${HEADER}\n${row(0, 0)}${row(1, 0)}${row(60, 800)}`, 'weather.csv');
  const bench = streaming('pico_parallel', { scenario });
  bench.run(200);
  assert.equal(bench.flags() & (CONTACT | TARED), TARED);
  bench.machine.host.suspend();
  bench.run(64e3);
  bench.machine.host.resume();
  bench.run(35);
  bench.stream();
  bench.run(300);
  assert.equal(bench.flags() & (CONTACT | TARED), TARED);
  assert.equal(bench.end().usb.enumerations, 1, 'a bus that sleeps for long is no reason to attach again');
});
