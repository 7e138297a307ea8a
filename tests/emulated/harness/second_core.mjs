/** Scene grasp on pico_parallel, held by a press of its pad: its second core, and what becomes of the frames when that is stopped. */
import assert from 'node:assert/strict';
import { Prng } from '../../../host_tools/simulation/emulator/prng.mjs';
import { parseScenario } from '../../../host_tools/simulation/emulator/scenario.mjs';
import { HEADER } from './bench.mjs';
import { CrashBench, split } from './crash_bench.mjs';

const CONTACT = 0x01;
// contact_flags.h
export const [HELD, TANGENTIAL_VALID, TANGENTIAL_LATE, SHAPE_VALID] = [1 << 6, 1 << 20, 1 << 25, 1 << 26];
export const EVENT_WORKER = 10; // crash.h
const SECOND = 1 << 5; // of the capabilities, line.toml
const PRESS_s = 0.6;

/** A round press of some 5 N between the sensors. */
function press() {
  const pressures = Array.from({ length: 15 }, (_, k) => {
    const [dx, dy] = [9 * (Math.floor(k / 5) - 1) - 1.5, 9 * ((k % 5) - 2) + 4];
    return Math.round(25000 * Math.exp(-(dx * dx + dy * dy) / (2 * 5.7 ** 2)));
  });
  const row = (t_s, values) => `${t_s},0,0,0,0,0,0,0,${values.join(',')}\n`;
  const none = new Array(15).fill(0);
  return parseScenario(
    `# fingertip-scenario 1\n# ambient_Pa: 100000\n# temperature_degC: 25\n${HEADER}\n${row(0, none)}${row(PRESS_s, none)}${row(PRESS_s + 0.01, pressures)}`,
    'press.csv',
  );
}

/** folder: of the image; tools: as ImageBench. */
export class SecondCoreBench extends CrashBench {
  constructor(folder, tools, options) {
    super(null, tools, 'pico_parallel', { folder, scenario: press(), ...options });
    this.stream();
    for (const command of [
      ['osr', '256'],
      ['pad', '12', '0'],
      ['stream', 'contact'],
    ]) {
      this.run(20);
      this.machine.client.write(this.encoded(...command));
    }
    this.until(() => this.now_ms > 1000 * PRESS_s + 100, 1000, 'press');
    this.received = [];
    this.last = null;
    this.lost = 0;
  }

  get second() {
    return this.machine.chip.second;
  }

  /** [number, flags] of the contacts since last asked that are not held; counts those that are missing. */
  frames() {
    const bytes = Buffer.concat(this.received);
    const whole = bytes.lastIndexOf(0) + 1; // the rest is of a packet under way
    const frames = split(bytes.subarray(0, whole))
      .filter((packet) => packet[1] === CONTACT && packet.length > 20)
      .map((packet) => [packet.readUInt32LE(12), packet.readUInt32LE(16)]);
    for (const [number] of frames) {
      this.lost += this.last === null ? 0 : number - this.last - 1;
      this.last = number;
    }
    this.received = [bytes.subarray(whole)];
    return frames.filter(([, flags]) => !(flags & HELD));
  }
}

export const has = (frames, flag) => frames.filter(([, flags]) => flags & flag).length;

/** Where a frame's time is that long, ms. */
const FRAME_ms = 0.7645;
const SETTLE_ms = 5;
const AFTER_ms = 20;

/** Kills core 1 at so many instants that are spread over a frame: what each did, and frames that were lost in all. */
export function killedAt(folder, tools, count) {
  const bench = new SecondCoreBench(folder, tools);
  const kills = [];
  for (let i = 0; i < count; i++) {
    bench.run(SETTLE_ms + (FRAME_ms * i) / count);
    bench.frames();
    bench.second.powerDown();
    bench.run(AFTER_ms);
    const frames = bench.frames();
    kills.push({
      late: has(frames, TANGENTIAL_LATE),
      both: frames.filter(([, flags]) => flags & TANGENTIAL_LATE && flags & TANGENTIAL_VALID).length,
      without_load: frames.length - has(frames, TANGENTIAL_VALID),
      estimates_again: Boolean(frames.at(-1)?.[1] & TANGENTIAL_VALID),
    });
  }
  return { kills, reboots: bench.machine.reboots, lost: bench.lost, bench };
}

/** Core 1 goes away for good: 100 ms of frames, and when health and the record of a crash report it; also after a start without it. */
export function withoutCore1(folder, tools) {
  const bench = new SecondCoreBench(folder, tools);
  const kind = Object.getPrototypeOf(bench.second);
  const { powerUp } = kind;
  const runs = () => (bench.health().capabilities & SECOND) !== 0;
  assert.ok(runs());
  try {
    kind.powerUp = () => {};
    bench.second.powerDown();
    bench.run(AFTER_ms);
    bench.frames();
    bench.run(100);
    const frames = bench.frames();
    const reported = ['gone', 'never started'].filter(() => {
      const health = !runs();
      bench.patch('app_run', 'fee7'); // b .
      bench.untilReset();
      const [, detail] = bench.crash().events.find(([code]) => code === EVENT_WORKER) ?? [];
      bench.received = [];
      bench.stream();
      return health && detail === 1;
    });
    return { frames: frames.length, late: has(frames, TANGENTIAL_LATE), estimates: has(frames, TANGENTIAL_VALID), reported };
  } finally {
    kind.powerUp = powerUp;
  }
}

const PAUSE_ms = [25, 2000];
/** Frames without a load in a row: one that says so, and those that a fresh estimate takes. */
const WITHOUT_LOAD_MAX = 4;

/** Kills core 1 now and then for so many hours: frames, and what went wrong. */
export function soaked(folder, tools, hours, seed) {
  const bench = new SecondCoreBench(folder, tools);
  const random = new Prng(seed);
  const end_ms = bench.now_ms + 3.6e6 * hours;
  const found = { hours, kills: 0, frames: 0, long_without_load: 0 };
  let without = 0;
  while (bench.now_ms < end_ms) {
    bench.run(random.range(...PAUSE_ms));
    for (const [, flags] of bench.frames()) {
      found.frames += 1;
      without = flags & TANGENTIAL_VALID ? 0 : without + 1;
      found.long_without_load += without === WITHOUT_LOAD_MAX + 1 ? 1 : 0;
    }
    bench.second.powerDown();
    found.kills += 1;
  }
  return { ...found, lost: bench.lost, reboots: bench.machine.reboots };
}
