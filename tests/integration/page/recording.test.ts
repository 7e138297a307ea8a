/** Recordings of the page and of the tool hold the same; torn ones are told by a sentence. */
import assert from 'node:assert/strict';
import { File } from 'node:buffer'; // node 18 has it there alone
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import test from 'node:test';
import { PacketType } from '../../../host_tools/web/src/line/line_facts';
import type { Contact, DevicePacket, Info, Raw } from '../../../host_tools/web/src/line/line_facts';
import { ReadError, Replay, readItems } from '../../../host_tools/web/src/recording/replay_line';
import { core, source, vector } from './library';

const tool = process.env['FINGERTIP_TOOL'] ?? '';
const folder = mkdtempSync(join(tmpdir(), 'fingertip-page-'));
test.after(() => rmSync(folder, { recursive: true }));
const path = (name: string): string => join(folder, name);

/** Packets of both streams and others, with a fingertip that starts again amid them. */
function session(): DevicePacket[] {
  const [info, health, contact, raw] = ['info_grasp', 'health', 'contact_grasp', 'raw'].map(vector) as [Info, DevicePacket, Contact, Raw];
  const packets: DevicePacket[] = [info];
  for (let frame = 1; frame < 600; frame++) {
    const t_us = 1_000_000 + 765 * frame - (frame > 400 ? 300_000 : 0) + (frame > 500 ? 5_000_000 : 0);
    const x_mm = Math.fround(1.1 * frame);
    packets.push(
      ...(frame % 20 ? [{ ...contact, frame, t_us, x_mm }] : []),
      ...(frame % 19 ? [{ ...raw, sensor_count: 2, frame, t_us }] : []),
    );
    packets.push(...(frame % 100 ? [] : [{ ...health, t_us }]), ...(frame === 300 ? [{ ...info, osr: 256, t_us }] : []));
  }
  return packets.map((packet, i) => ({ ...packet, sequence: i }));
}

const packets = session();
/** Between two frames: an event parts the packets of one. */
const EVENT_AFTER = packets.findIndex(({ type }, i) => i >= 700 && type === PacketType.RAW);
const EXTRA: [string, string][] = [
  ['recorded_by', 'a test'],
  ['started_utc', '2026-08-05T12:00:00.125Z'],
];

function recorded(kind: 'csv' | 'mcap'): Uint8Array {
  const parts: Uint8Array[] = [];
  const writer = new core.Writer(kind, packets[0] as Info, EXTRA);
  packets.forEach((packet, i) => {
    writer.packet(packet);
    if (i === EVENT_AFTER) {
      writer.event('gone 2026-08-05T12:00:01.000Z');
    }
  });
  writer.finish('stopped', { ...new core.Decoder().counts, packets: packets.length });
  for (let bytes; (bytes = writer.take()); ) {
    parts.push(bytes);
  }
  writer.free();
  return Buffer.concat(parts);
}

/** Appends to `all`, which so has what came before an error. */
async function itemsOf(name: string, bytes: Uint8Array, all: DevicePacket[] = []): Promise<DevicePacket[]> {
  for await (const { packet } of readItems(new File([new Uint8Array(bytes)], name))) {
    all.push(packet);
  }
  return all;
}

const frames = (all: DevicePacket[]): Buffer => Buffer.concat(all.map((packet) => core.encode(packet)));

function convert(from: string, to: string): void {
  execFileSync(tool, ['convert', path(from), path(to), '--overwrite'], { stdio: 'pipe' });
}

test('what the page and the tool recorded is read back, packet by packet', async () => {
  const wanted = frames(packets);
  const csv = recorded('csv');
  writeFileSync(path('own.csv'), csv);
  writeFileSync(path('own.mcap'), recorded('mcap'));
  convert('own.csv', 'tool.mcap');
  convert('own.mcap', 'back.csv');
  assert.deepEqual(readFileSync(path('back.csv')), Buffer.from(csv));
  assert.deepEqual(frames(await itemsOf('own.csv', csv)), wanted);
  assert.deepEqual(frames(await itemsOf('own.mcap', recorded('mcap'))), wanted);
  assert.deepEqual(frames(await itemsOf('tool.mcap', readFileSync(path('tool.mcap')))), wanted);
  assert.deepEqual(frames(await itemsOf('a.ftr', wanted)), wanted);
});

test('a replay keeps its pace, waits, skips and hands out everything', async (t) => {
  const replay = new Replay(new File([new Uint8Array(recorded('csv'))], 'own.csv') as unknown as globalThis.File);
  let [now_ms, bytes, ended, shown] = [0, 0, '', { silent_ms: NaN }];
  const ticks: (() => void)[] = [];
  t.mock.method(performance, 'now', () => now_ms);
  t.mock.method(globalThis, 'setTimeout', (tick: () => void) => ticks.push(tick));
  const receive = ({ length }: Uint8Array): void => void (bytes += length);
  replay.onLine = (line) => void (line.open(receive, (why) => (ended = why)), (shown = line as typeof shown));
  const after = async (ms: number, change: Partial<Replay> = {}): Promise<string> => {
    Object.assign(replay, change);
    now_ms += ms;
    for (ticks.pop()?.(); ticks.length === 0 && !ended; ) {
      await new Promise(setImmediate);
    }
    return replay.seconds.toFixed(2);
  };
  await replay.start();
  assert.equal(await after(40), '0.04');
  assert.equal(await after(40, { speed: 3 }), '0.16');
  assert.equal(await after(20, { paused: true }), '0.16');
  replay.skip(0.1);
  assert.equal(await after(0), '0.26');
  replay.skip(1);
  await after(0);
  assert.equal(Math.round(shown.silent_ms / 100), 12); // it is at 1.26 s, and frame 500 was at 0.08 s
  replay.skip(10);
  await after(0);
  assert.deepEqual([ended, bytes], ['the replay has ended', frames(packets).length]);
});

test('a replay of two: one that was closed stays away; one that restarted has lost nothing', async () => {
  const closed = (): void => undefined;
  const replayed = async (bytes: Uint8Array, onLine: Replay['onLine']): Promise<void> => {
    const replay = new Replay(new File([new Uint8Array(bytes)], 'a.csv') as unknown as globalThis.File);
    const ended = new Promise<unknown>((onEnd) => Object.assign(replay, { onLine, onEnd, speed: 1e6 }));
    await replay.start();
    await ended;
  };
  let opened = 0;
  await replayed(source('tests/fuzz/corpus/recording/two').subarray(1), (line) => {
    const receive = ++opened === 2 ? () => void line.close() : closed;
    void line.open(receive, closed);
  });
  assert.equal(opened, 2);
  const decoder = new core.Decoder();
  const writer = new core.Writer('csv', packets[0] as Info, []);
  for (let i = 0; i < 10; i++) {
    writer.packet({ ...packets[i]!, sequence: i < 5 ? 40_000 + i : i });
    writer.event(['gone', 'back'][i - 4] ?? 'request'); // one that is back identifies itself first
  }
  writer.finish('stopped', decoder.counts);
  const receive = (bytes: Uint8Array): void => decoder.feed(bytes, closed);
  await replayed(writer.take()!, (line) => void line.open(receive, closed));
  assert.equal(decoder.counts.dropped_packets, 0);
});

test('torn and foreign files: a sentence, and what came before', async () => {
  const csv = Buffer.from(recorded('csv'));
  const mcap = Buffer.from(recorded('mcap'));
  const lines = csv.toString().split('\n');
  const text = (all: string[]): Buffer => Buffer.from(all.join('\n'));
  const damaged = Buffer.from(frames(packets).map((byte, i) => (i === 5000 ? byte ^ 2 || 3 : byte)));
  const row = lines.findIndex((line) => line.startsWith('t_us')) + 20;
  for (const [name, bytes, words, some] of [
    ['torn.csv', csv.subarray(0, csv.length / 2), /:\d+: the last line is torn/, true],
    ['cut.csv', text([...lines.slice(0, row), '']), /no end line/, true],
    ['later.csv', text(['# fingertip-recording 3', ...lines.slice(1)]), /format "3" is unknown.*use the page of that version/, false],
    ['torn.mcap', mcap.subarray(0, (2 * mcap.length) / 3), /the last chunk is torn/, false], // of two: the head's, and that of all rows
    ['noise.ftr', Buffer.alloc(500), /holds no packet/, false],
    ['noise.mcap', Buffer.alloc(500, 'noise'), /choose another/, false],
    ['letter.txt', Buffer.from('Dear reader,\n'), /recording.*choose another/, false],
    ['empty.csv', Buffer.alloc(0), /choose another/, false],
    ['damaged.ftr', damaged, /has 1 damaged packets, which are left out/, true],
  ] as const) {
    const before: DevicePacket[] = [];
    const isSo = (error: unknown) => error instanceof ReadError && words.test(error.message) && error.message.startsWith(name);
    await assert.rejects(itemsOf(name, bytes, before), isSo);
    assert.equal(before.length > 0, some, `${name}: ${before.length}`);
  }
});
