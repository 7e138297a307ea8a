/**
 * The sync pin of the release images: edges from outside are stamped to a microsecond, whatever the firmware is at and however
 * fast they come, and pulses come when they shall.
 *
 * usage: test_sync.mjs BUILD_OF_IMAGES FINGERTIP COMMAND_FRAME REPORT.json
 */
import assert from 'node:assert/strict';
import { mkdirSync, writeFileSync } from 'node:fs';
import { dirname } from 'node:path';
import { after, test } from 'node:test';
import { Prng } from '../../host_tools/simulation/emulator/prng.mjs';
import { ImageBench } from './harness/image_bench.mjs';

const [images, fingertip, command_frame, report] = process.argv.slice(2);
const BOARDS = ['pico_mux', 'pico_parallel'];
const LIMIT_us = 1;
const GLITCH_ns = 340;
const EDGE_ns = 400;
const KEPT = 48;
const PER_ms = 2;
/** A fault that ends in a recovery of the bus, which on pico_parallel resets DMA. */
const RESETS_BUS = {
  pico_mux: { type: 'sda_stuck_low', sensor: 3, from_s: 0.35 },
  pico_parallel: { type: 'scl_stuck_low', from_s: 0.35, to_s: 0.36 },
};
/** The wire is quiet so long. */
const QUIET_ms = 300;
const measured = {};

/** The greatest of what was found so far. */
const note = (name, value) => {
  measured[name] = Math.max(measured[name] ?? 0, value);
};

after(() => {
  mkdirSync(dirname(report), { recursive: true });
  writeFileSync(report, `${JSON.stringify(measured, null, 1)}\n`);
});

/** A bench whose sync pin is driven by `next`; changes: all of the pin, with their times. */
class Bench extends ImageBench {
  constructor(name, { next = null, ...options } = {}) {
    const changes = [];
    super(images, { fingertip, command_frame }, name, {
      ...options,
      sync: { next, onLevel: (high, t_ns) => changes.push({ high, t_ns }) },
    });
    this.changes = changes;
  }

  /** Streams, and the pin set, before the wire wakes up. */
  begin(mode) {
    this.streams_ms = this.stream();
    this.machine.client.write(this.encoded('sync', mode));
    this.run(5);
    assert.ok(this.now_ms < QUIET_ms, `${this.now_ms}`);
    this.changes.length = 0;
  }

  /** On the device's clock. */
  device_us(t_ns) {
    const { zero_ns, tick_ns } = this.machine.chip.timer;
    return (t_ns - zero_ns) / tick_ns;
  }

  edges() {
    return this.recording()
      .filter((line) => line.startsWith('# packet: sync'))
      .map((line) => {
        const fields = Object.fromEntries([...line.matchAll(/(\w+)=(\S+)/g)].map(([, key, value]) => [key, value]));
        return { t_us: Number(fields.t_us), number: Number(fields.number), high: fields.level === '1' };
      });
  }

  /** Each edge that was sent against the change of the pin that it is; the greatest error, us. */
  judge(edges, changes = this.changes) {
    let worst_us = 0;
    for (const { t_us, number, high } of edges) {
      const change = changes[number - 1];
      assert.ok(change && change.high === high, `edge ${number} is none of the ${changes.length} that there were`);
      worst_us = Math.max(worst_us, Math.abs(t_us - this.device_us(change.t_ns)));
    }
    return worst_us;
  }
}

/** Edges of these distances, in ns, from the end of the quiet on; the first rises. */
const spaced = (distance_ns, count = Infinity) => {
  let made = 0;
  return (t_ns) => (made < count ? { at_ns: made ? t_ns + distance_ns(made) : 1e6 * QUIET_ms, high: made++ % 2 === 0 } : null);
};

for (const name of BOARDS) {
  test(`${name}: edges at any time are stamped to a microsecond, while all streams are on`, (t) => {
    const prng = new Prng(31);
    const bench = new Bench(name, { next: spaced(() => prng.range(1e6, 5e6)) });
    bench.begin('in');
    bench.run(QUIET_ms + 1000 - bench.now_ms);
    const edges = bench.edges();
    assert.ok(edges.length > 200 && bench.changes.length - edges.length <= 4, `${edges.length} of ${bench.changes.length}`);
    assert.deepEqual(
      edges.map(({ number }) => number),
      edges.map((_, i) => i + 1),
    );
    const worst_us = bench.judge(edges);
    t.diagnostic(`${edges.length} edges, the worst off by ${worst_us.toFixed(3)} us`);
    note('sync_error_us_max', worst_us);
    assert.ok(worst_us <= LIMIT_us, `off by ${worst_us} us`);
    bench.end();
  });

  test(`${name}: a storm of edges costs next to no frames, and what is dropped is counted`, (t) => {
    const storm_ms = 150;
    const edges_of_storm = 2000 * storm_ms;
    const prng = new Prng(33);
    const bench = new Bench(name, { next: spaced((made) => (made < edges_of_storm ? 500 : prng.range(30e6, 40e6))) });
    bench.begin('in');
    bench.run(QUIET_ms - bench.now_ms);
    const before = bench.rows().length;
    const [from_ms, quiet_ms] = [bench.now_ms, 100];
    bench.run(storm_ms);
    const during = bench.rows();
    bench.run(300);
    const edges = bench.edges();
    const late = edges.filter(({ number }) => number > edges_of_storm);
    const worst_us = bench.judge(edges);
    const share = (during.length - before) / storm_ms / (before / (from_ms - bench.streams_ms));
    t.diagnostic(
      `${edges.length} edges of ${bench.changes.length} sent, the worst off by ${worst_us.toFixed(3)} us; ${(100 * share).toFixed(1)} % of the frames`,
    );
    note('sync_storm_frames_lost_max', 1 - share);
    assert.ok(share > 0.93, `${share} of the frames`);
    assert.ok(edges.length <= PER_ms * (storm_ms + quiet_ms) && edges.length > storm_ms, `${edges.length} edges`);
    assert.ok(late.length >= 8 && late.every(({ number }, i) => number === edges_of_storm + 1 + i), 'after the storm every edge counts');
    note('sync_error_us_max', worst_us);
    assert.ok(worst_us <= LIMIT_us, `off by ${worst_us} us`);
    bench.end();
  });

  test(`${name}: a burst that fits is sent whole, and glitches are no edges`, () => {
    const bench = new Bench(name, { next: spaced((made) => (made < KEPT ? EDGE_ns : made % 2 ? GLITCH_ns : 3e6), KEPT + 40) });
    bench.begin('in');
    bench.run(QUIET_ms + 100 - bench.now_ms);
    const edges = bench.edges();
    assert.deepEqual(
      edges.map(({ number }) => number),
      Array.from({ length: KEPT }, (_, i) => i + 1),
    );
    assert.ok(bench.judge(edges) <= LIMIT_us);
    assert.equal(bench.changes.length, KEPT + 40);
    bench.end();
  });

  test(`${name}: while it is off the pin is left alone and is not read`, () => {
    const bench = new Bench(name, { next: spaced(() => 1e6) });
    bench.stream();
    bench.run(QUIET_ms + 50 - bench.now_ms);
    assert.deepEqual(bench.edges(), []);
    const { pins, pio } = bench.machine.chip;
    assert.equal((pins.low | pins.high) & (1 << bench.machine.Board.syncPin), 0);
    assert.ok(!pio[1].enabled);
    bench.end();
  });

  test(`${name}: each second of its clock the pin rises, and the stamps say when it did`, (t) => {
    const bench = new Bench(name);
    bench.begin('second');
    bench.run(2600);
    const edges = bench.edges();
    const worst_us = bench.judge(edges);
    assert.ok(worst_us <= LIMIT_us, `off by ${worst_us} us`);
    note('sync_error_us_max', worst_us);
    assert.equal(edges.length, bench.changes.length);
    const rises = edges.filter(({ high }) => high);
    const late_us = Math.max(...bench.changes.filter(({ high }) => high).map(({ t_ns }) => bench.device_us(t_ns) % 1e6));
    t.diagnostic(`rises up to ${late_us.toFixed(1)} us late`);
    note('sync_second_late_us_max', late_us);
    assert.ok(rises.length >= 2 && late_us <= 20, `${rises.length} rises, ${late_us} us late`);
    edges.filter(({ high }) => !high).forEach(({ t_us }, i) => assert.ok(Math.abs(t_us - rises[i].t_us - 100e3) <= 20));
    bench.end();
  });

  test(`${name}: at each frame the pin is high while the sensors convert, and the middle is the frame's time`, (t) => {
    const bench = new Bench(name);
    bench.begin('frame');
    bench.run(400);
    assert.deepEqual(bench.edges(), []);
    const frames = bench.rows();
    const pulses = bench.changes.flatMap(({ high, t_ns }, i, all) =>
      high && all[i + 1] ? [[bench.device_us(t_ns), bench.device_us(all[i + 1].t_ns)]] : [],
    );
    let off_us = 0;
    let matched = 0;
    for (const [from_us, to_us] of pulses.slice(0, -3)) {
      const inside = frames.filter(({ t_us }) => t_us > from_us && t_us < to_us);
      assert.equal(inside.length, 1, `${inside.length} frames in a pulse from ${from_us} to ${to_us} us`);
      off_us = Math.max(off_us, Math.abs((from_us + to_us) / 2 - inside[0].t_us));
      matched += 1;
    }
    t.diagnostic(`${matched} pulses, their middle up to ${off_us.toFixed(1)} us from the frame's time`);
    note('sync_frame_off_us_max', off_us);
    assert.ok(matched > 50 && off_us <= 100, `${matched} pulses, ${off_us} us`);
    bench.end();
  });

  test(`${name}: a bus that is recovered, and a suspend, cost edges of that time at most`, () => {
    const prng = new Prng(32);
    const bench = new Bench(name, { next: spaced(() => prng.range(2e6, 6e6)), faults: [RESETS_BUS[name]] });
    bench.begin('in');
    bench.run(500);
    const edges = bench.edges();
    assert.ok(edges.length >= 0.9 * bench.changes.length, `${edges.length} of ${bench.changes.length}`);
    const worst_us = bench.judge(edges);
    note('sync_error_us_max', worst_us);
    assert.ok(worst_us <= LIMIT_us, `off by ${worst_us} us`);
    const { host, client } = bench.machine;
    host.suspend();
    bench.run(400);
    host.resume();
    bench.run(31);
    const sent = bench.edges().length;
    bench.received.length = 0;
    client.write(bench.encoded('stream', 'contact,raw,health'));
    bench.run(200);
    const again = bench.edges();
    assert.ok(again.length > 20, `${again.length} after ${sent}`);
    const first = bench.changes.findIndex(({ t_ns }) => Math.abs(bench.device_us(t_ns) - again[0].t_us) <= LIMIT_us);
    assert.ok(first >= 0 && bench.judge(again, bench.changes.slice(first + 1 - again[0].number)) <= LIMIT_us);
    assert.ok(again[0].number < 20, 'the numbers begin again');
    bench.end();
  });
}
