/**
 * The image of scene grasp with its second core: it estimates the load; killed, faulted or run into its stack's guard it costs
 * no frame, the frames say so, and it is started again.
 *
 * usage: test_second_core.mjs FOLDER_OF_IMAGE FINGERTIP COMMAND_FRAME
 */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { parseScenario } from '../../host_tools/simulation/emulator/scenario.mjs';
import { HEADER } from './harness/bench.mjs';
import { CrashBench, split } from './harness/crash_bench.mjs';

const [folder, fingertip, command_frame] = process.argv.slice(2);
const CONTACT = 0x01;
// contact_flags.h
const [HELD, TANGENTIAL_VALID, TANGENTIAL_LATE, SHAPE_VALID] = [1 << 6, 1 << 20, 1 << 25, 1 << 26];
const EVENT_WORKER = 10; // crash.h
const PRESS_s = 0.6;

/** A round press of some 5 N between the sensors. */
function press() {
  const pressures = Array.from({ length: 15 }, (_, k) => {
    const [dx, dy] = [9 * (Math.floor(k / 5) - 1) - 1.5, 9 * ((k % 5) - 2) + 4];
    return Math.round(25000 * Math.exp(-(dx * dx + dy * dy) / (2 * 5.7 ** 2)));
  });
  const row = (t_s, values) => `${t_s},0,0,0,0,0,0,0,${values.join(',')}\n`;
  const none = new Array(15).fill(0);
  return parseScenario(`# fingertip-scenario 1\n# ambient_Pa: 100000\n# temperature_degC: 25\n${HEADER}\n${row(0, none)}${row(PRESS_s, none)}${row(PRESS_s + 0.01, pressures)}`, 'press.csv');
}

class Bench extends CrashBench {
  constructor(options) {
    super(null, { fingertip, command_frame }, 'pico_parallel', { folder, scenario: press(), ...options });
    this.stream();
    for (const command of [['osr', '256'], ['pad', '12', '0'], ['stream', 'contact']]) {
      this.run(20);
      this.machine.client.write(this.encoded(...command));
    }
    this.until(() => this.now_ms > 1000 * PRESS_s + 100, 1000, 'press');
    this.received = [];
  }

  get second() {
    return this.machine.chip.second;
  }

  /** [number, flags] of the contacts since last asked; none may be missing. */
  frames() {
    const frames = split(Buffer.concat(this.received)).filter((packet) => packet[1] === CONTACT && packet.length > 20).map((packet) => [packet.readUInt32LE(12), packet.readUInt32LE(16)]);
    frames.slice(1).forEach(([number], i) => assert.equal(number, frames[i][0] + 1, 'a frame is lost'));
    this.received = [];
    return frames.filter(([, flags]) => !(flags & HELD));
  }
}

const has = (frames, flag) => frames.filter(([, flags]) => flags & flag).length;

test('core 1 estimates the load of every frame and says what presses, while core 0 sleeps', () => {
  const bench = new Bench();
  const [second, first] = [bench.second.cycles, bench.machine.chip.core0.cycles];
  bench.run(100);
  const frames = bench.frames();
  assert.ok(frames.length > 125, `${frames.length}`);
  assert.equal(has(frames, TANGENTIAL_VALID), frames.length);
  assert.equal(has(frames, SHAPE_VALID), frames.length);
  const share = (cycles) => cycles / (0.1 * 125e6);
  assert.ok(share(bench.second.cycles - second) > 0.3, 'it is busy');
  assert.ok(share(bench.machine.chip.core0.cycles - first) < 0.8, 'core 0 sleeps a fifth of the time');
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
  assert.equal(bench.machine.reboots, 0);
}

test('killed at any instant of a frame it costs no frame, and is started again', () => {
  const bench = new Bench();
  for (let i = 0; i < 24; i++) {
    bench.run(5 + 0.7645 * i / 24);
    bench.frames();
    kill(bench, (second) => second.powerDown());
  }
  bench.received = [];
  const { events } = bench.crash();
  assert.deepEqual(events, [], 'no crash');
});

test('a fault of core 1 parks it', () => {
  const bench = new Bench();
  bench.until(() => bench.second.isAwake, 10, 'work of core 1');
  bench.received = [];
  kill(bench, ({ core }) => (core.registers[15] = 0));
});

test('a stack of core 1 that grows into its guard parks it', () => {
  const bench = new Bench();
  bench.until(() => bench.second.isAwake, 10, 'work of core 1');
  bench.received = [];
  kill(bench, ({ core }) => (core.registers[13] = 0x2003fff0));
});

test('a reset by the watchdog ends core 1, and it is started again; the record tells that it had been late', () => {
  const bench = new Bench();
  bench.second.powerDown();
  bench.run(20);
  bench.patch('app_run', 'fee7');
  bench.untilReset();
  const { events } = bench.crash();
  assert.ok(events.some(([code]) => code === EVENT_WORKER), `${events}`);
  assert.equal(bench.second.state, 'runs');
});
