/** Recordings of the page and of the tool hold the same; torn ones are told by a sentence. */
import assert from 'node:assert/strict';
import { File } from 'node:buffer'; // node 18 has it there alone
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import test from 'node:test';
import { CONTACT_FIELDS, Flag, PacketType } from '../../../host_tools/web/src/line/line_facts';
import type { Contact, DevicePacket, Info, Raw } from '../../../host_tools/web/src/line/line_facts';
import { ReadError, readItems } from '../../../host_tools/web/src/recording/replay_line';
import { core, decoded } from './library';
import { vector } from './vectors';

const STAGES = ['convert_us', 'read_us', 'queue_us', 'condition_us', 'fit_us', 'contact_us', 'total_us'] as const;

const tool = process.env['FINGERTIP_TOOL'] ?? '';
const folder = mkdtempSync(join(tmpdir(), 'fingertip-page-'));
test.after(() => rmSync(folder, { recursive: true }));
const path = (name: string): string => join(folder, name);

let state = 12345;
function random(): number {
  state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
  return state / 2 ** 32;
}
const integer = (below: number): number => Math.floor(random() * below);

const bits = new DataView(new ArrayBuffer(4));
/** Any finite float, now and then one that people would type. */
function anyFloat(): number {
  if (random() < 0.4) {
    return Math.fround((integer(20001) - 10000) / 10 ** integer(5));
  }
  do {
    bits.setUint32(0, integer(2 ** 32));
  } while (!Number.isFinite(bits.getFloat32(0)));
  return bits.getFloat32(0);
}

/** What a fingertip may say, in the order in which it says it. */
function session(): DevicePacket[] {
  const info = decoded(vector('info_grasp').frame) as Info;
  const packets: DevicePacket[] = [{ ...info, sequence: 0 }];
  let sequence = 1;
  const VALID = Flag.FIT_VALID | Flag.UNCERTAINTY_VALID | Flag.SLIP_VALID | Flag.WIDTHS_VALID | Flag.TANGENTIAL_VALID | Flag.VELOCITY_VALID;
  for (let frame = 1; frame < 600; frame++) {
    const t_us = 1_000_000 + 765 * frame + (frame > 400 ? -300_000 : 0);
    const flags = (integer(2 ** 25) & (random() < 0.5 ? ~0 : ~VALID)) | (random() < 0.3 ? VALID : 0);
    if (random() < 0.95) {
      const contact = core.blank(PacketType.CONTACT) as unknown as Contact;
      Object.assign(contact, { t_us, frame, flags: flags >>> 0, sequence: sequence++ & 0xffff });
      STAGES.forEach((stage) => (contact[stage] = integer(65536)));
      if (flags & Flag.FIT_VALID) {
        contact.sensors_used = integer(2 ** 32);
      }
      CONTACT_FIELDS.forEach((field) => (contact[field] = anyFloat()));
      packets.push(decoded(core.encode(contact))!); // leaves out what has no flag
    }
    if (random() < 0.95) {
      const raw = core.blank(PacketType.RAW) as unknown as Raw;
      const bits = { valid: integer(4), saturated: integer(4), doubtful: integer(4) };
      Object.assign(raw, { t_us, frame, flags: flags >>> 0, sequence: sequence++ & 0xffff, sensor_count: 2, ...bits });
      raw.temperature_cC = integer(65536) - 32768;
      for (let k = 0; k < 2; k++) {
        raw.pressure_Pa_q10[k] = integer(2 ** 32) - 2 ** 31;
        raw.baseline_Pa_q10[k] = integer(2 ** 20) - 2 ** 19;
      }
      packets.push(raw);
    }
    if (frame % 100 === 0) {
      const health = core.blank(PacketType.HEALTH) as unknown as DevicePacket & Record<string, number>;
      Object.assign(health, { capabilities: 15, uptime_s: frame, sensors_present: 1, sensors_prom_bad: 2 });
      packets.push({ ...health, t_us, sequence: sequence++ & 0xffff } as DevicePacket);
    }
    if (frame === 300) {
      packets.push({ ...info, osr: 256, t_us, sequence: sequence++ & 0xffff });
    }
  }
  return packets;
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

test("CSV: rows and comments are the tool's, byte by byte", async () => {
  writeFileSync(path('a.ftr'), frames(packets));
  convert('a.ftr', 'tool.csv');
  const own = Buffer.from(recorded('csv')).toString().split('\n');
  // The tool says who converted; events are not in a capture; its end line counts its own reading.
  const plain = (lines: string[]): string[] => lines.filter((line) => !/^# (recorded_by|started_utc|source|event|end):/.test(line));
  assert.deepEqual(plain(own), plain(readFileSync(path('tool.csv'), 'utf8').split('\n')));
});

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

test('torn and foreign files: a sentence, and what came before', async () => {
  const csv = Buffer.from(recorded('csv'));
  const mcap = Buffer.from(recorded('mcap'));
  const lines = csv.toString().split('\n');
  const text = (all: string[]): Buffer => Buffer.from(all.join('\n'));
  const damaged = Buffer.from(frames(packets).map((byte, i) => (i === 5000 ? byte ^ 2 || 3 : byte)));
  const row = lines.findIndex((line) => line.startsWith('t_us')) + 20;
  for (const [name, bytes, words, some] of [
    ['empty.csv', Buffer.alloc(0), /is empty/, false],
    ['x.txt', Buffer.from('hello\n'), /neither a recording/, false],
    ['torn.csv', csv.subarray(0, csv.length / 2), /:\d+: the last line is torn/, true],
    ['cut.csv', text([...lines.slice(0, row), '']), /no end line/, true],
    ['later.csv', text(['# fingertip-recording 3', ...lines.slice(1)]), /format "3" is unknown.*use the page of that version/, false],
    ['torn.mcap', mcap.subarray(0, (2 * mcap.length) / 3), /the last chunk is torn/, false], // of two: the head's, and that of all rows
    ['noise.ftr', Buffer.alloc(500), /holds no packet/, false],
    ['damaged.ftr', damaged, /has 1 damaged packets, which are left out/, true],
  ] as const) {
    const before: DevicePacket[] = [];
    const isSo = (error: unknown) => error instanceof ReadError && words.test(error.message) && error.message.startsWith(name);
    await assert.rejects(itemsOf(name, bytes, before), isSo);
    assert.equal(before.length > 0, some, `${name}: ${before.length}`);
  }
});
