/**
 * The release images after days: their timer begins shortly before it crosses 2^32 us, 2^32 ms and 60 days, and nothing steps back or
 * stands still, awake or asleep.
 *
 * usage: test_times.mjs BUILD_OF_IMAGES FINGERTIP COMMAND_FRAME
 */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { ImageBench } from './harness/image_bench.mjs';

const [images, fingertip, command_frame] = process.argv.slice(2);
const CROSSINGS = Object.entries({ '2^32 us': 2 ** 32, '2^32 ms': 2 ** 32 * 1000, '60 days': 60 * 86400e6 });
const BEFORE_us = 400e3;

function bench(name, crossing_us) {
  const made = new ImageBench(images, { fingertip, command_frame }, name, { uptime_us: crossing_us - BEFORE_us });
  made.stream();
  return made;
}

for (const name of ['pico_mux', 'pico_parallel']) {
  for (const [what, crossing_us] of CROSSINGS) {
    test(`${name}: frames across ${what}`, (t) => {
      const device = bench(name, crossing_us);
      device.run(700);
      const told = device.rows().map(({ t_us, frame }) => [t_us, frame]);
      assert.ok(told[0][0] < crossing_us && told.at(-1)[0] > crossing_us + 100e3, `${told[0]} ${told.at(-1)}`);
      const steps_us = told.slice(1).map(([t_us], i) => t_us - told[i][0]);
      const [least, most] = [Math.min(...steps_us), Math.max(...steps_us)];
      t.diagnostic(`${told.length} frames, ${least} to ${most} us apart`);
      assert.ok(least > 0.5 * most, `${least} to ${most} us apart`);
      const isNext = told.slice(1).every(([, frame], i) => frame === told[i][1] + 1);
      assert.ok(isNext, 'each frame has the next number');
      const { reboots, usb } = device.end();
      assert.deepEqual([reboots, usb.enumerations], [0, 1]);
    });
  }
}

test('a bus that sleeps across 2^32 us, and wakes up', () => {
  const device = bench('pico_parallel', 2 ** 32);
  device.machine.host.suspend();
  device.run(1500);
  assert.ok(device.machine.chip.timer.count_us > 2 ** 32 + 1e6);
  device.machine.host.resume();
  device.run(40);
  device.stream();
  device.assertStreams(300);
  const { reboots, usb } = device.end();
  assert.deepEqual([reboots, usb.enumerations], [0, 1]);
});

test('at the slowest rate the alarm is set again across 2^32 us', () => {
  const device = bench('pico_parallel', 2 ** 32);
  device.machine.client.write(device.encoded('rate', '0.1'));
  device.run(3000);
  device.machine.client.write(device.encoded('rate', 'max'));
  device.run(50);
  device.assertStreams(100);
  assert.equal(device.end().reboots, 0);
});
