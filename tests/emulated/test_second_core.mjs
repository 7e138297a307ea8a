/**
 * The image of scene grasp with its second core: it estimates the load; killed, faulted or run into its stack's guard it costs
 * no frame, the frames say so, and it is started again. It sleeps while the USB bus does.
 *
 * usage: test_second_core.mjs FOLDER_OF_IMAGE FINGERTIP COMMAND_FRAME
 */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import {
  EVENT_WORKER,
  has,
  killedAt,
  SecondCoreBench,
  SHAPE_VALID,
  TANGENTIAL_LATE,
  TANGENTIAL_VALID,
  withoutCore1,
} from './harness/second_core.mjs';

const [folder, fingertip, command_frame] = process.argv.slice(2);
const tools = { fingertip, command_frame };
const KILLS = 10; // a nightly test has 1000

const newBench = () => new SecondCoreBench(folder, tools);

test('core 1 estimates the load of every frame and says what presses, while core 0 sleeps', () => {
  const bench = newBench();
  const [second, first] = [bench.second.cycles, bench.machine.chip.core0.cycles];
  bench.run(100);
  const frames = bench.frames();
  assert.ok(frames.length > 125, `${frames.length}`);
  assert.equal(has(frames, TANGENTIAL_VALID), frames.length);
  assert.equal(has(frames, SHAPE_VALID), frames.length);
  const share = (cycles) => cycles / (0.1 * 125e6);
  assert.ok(share(bench.second.cycles - second) > 0.3, 'it is busy');
  assert.ok(share(bench.machine.chip.core0.cycles - first) < 0.8, 'core 0 sleeps a fifth of the time');
  assert.ok(bench.second.core.readOnlyBytes > bench.machine.chip.core0.readOnlyBytes + 20000, 'it may not write to what is of core 0');
});

/** Kills core 1 so long after the press, and judges what comes. */
function kill(bench, kill) {
  kill(bench.second);
  bench.run(20);
  const frames = bench.frames();
  const late = has(frames, TANGENTIAL_LATE);
  assert.ok(late >= 1 && late <= 2, `${late} frames say that it was late`);
  assert.ok(frames.every(([, flags]) => !(flags & TANGENTIAL_LATE && flags & TANGENTIAL_VALID)));
  assert.ok(frames.at(-1)[1] & TANGENTIAL_VALID, 'it estimates again');
  assert.deepEqual([bench.machine.reboots, bench.lost], [0, 0]);
}

test('killed at any instant of a frame it costs no frame, and is started again', () => {
  const { kills, reboots, lost, bench } = killedAt(folder, tools, KILLS);
  assert.deepEqual([reboots, lost], [0, 0]);
  kills.forEach(({ late, both, estimates_again }, i) =>
    assert.ok(late >= 1 && late <= 2 && both === 0 && estimates_again, `kill ${i}: ${JSON.stringify(kills[i])}`),
  );
  bench.received = [];
  const { events } = bench.crash();
  assert.deepEqual(events, [], 'no crash');
});

for (const [what, [register, value]] of Object.entries({ 'a null pc': [15, 0], 'a stack that grows into its guard': [13, 0x2003fff0] })) {
  test(`${what} parks core 1`, () => {
    const bench = newBench();
    bench.until(() => bench.second.isAwake, 10, 'work of core 1');
    bench.received = [];
    kill(bench, ({ core }) => (core.registers[register] = value));
  });
}

const suspends = { sleeps: [false, 0], works: [true, 0], 'begins a contact of slow frames': [true, 3] };
for (const [when, [isAwake, long_ms]] of Object.entries(suspends)) {
  test(`a USB suspend while core 1 ${when}: both cores sleep, and go on after the resume`, () => {
    const bench = newBench();
    const { host, chip, client } = bench.machine;
    if (long_ms) client.write(bench.encoded('rate', '20'));
    if (long_ms) client.write(bench.encoded('pad', '12', '0'));
    let since_ms = Number.POSITIVE_INFINITY;
    const isLong = () => {
      since_ms = bench.second.isAwake === isAwake ? Math.min(since_ms, bench.now_ms) : Number.POSITIVE_INFINITY;
      return bench.now_ms - since_ms >= long_ms;
    };
    bench.until(isLong, 500, 'such a moment');
    host.suspend();
    bench.run(20);
    const before = [bench.second.cycles, chip.core0.cycles];
    bench.run(100);
    assert.equal(bench.second.cycles, before[0], 'core 1 sleeps with the bus');
    assert.ok(chip.core0.cycles - before[1] < 0.02 * 0.1 * 12e6, 'and core 0 nearly always');
    host.resume();
    bench.run(30);
    [bench.received, bench.last] = [[], null];
    client.write(bench.encoded('stream', 'contact'));
    bench.run(50);
    const frames = bench.frames();
    assert.ok(frames.length > (long_ms ? 0 : 50), `${frames.length}`);
    assert.deepEqual([has(frames, TANGENTIAL_LATE), has(frames, TANGENTIAL_VALID)], [0, frames.length]);
    assert.deepEqual([bench.machine.reboots, bench.lost, bench.second.state], [0, 0, 'runs']);
  });
}

test('a core 1 that is gone for good, or never starts, is reported, and the estimates go on', () => {
  const { frames, late, estimates, reported } = withoutCore1(folder, tools);
  assert.ok(frames > 50, `${frames}`);
  assert.deepEqual([late, estimates], [0, frames]);
  assert.deepEqual(reported, ['gone', 'never started']);
});

test('a reset by the watchdog ends core 1, and it is started again; the record tells that it had been late', () => {
  const bench = newBench();
  bench.second.powerDown();
  bench.run(20);
  bench.patch('app_run', 'fee7');
  bench.untilReset();
  const codes = bench.crash().events.map(([code]) => code);
  assert.ok(codes.includes(EVENT_WORKER), `${codes}`);
  assert.equal(bench.second.state, 'runs');
});
