/** What the page makes of each input of the corpus, as by_library says it: `node by_page.mjs JOBS.json > answers.json`. The page has no salvage,
 * and shows all fingertips of a file: such jobs are left out, or one is picked. */
import { readFileSync } from 'node:fs';
import { basename } from 'node:path';
import * as core from '../../host_tools/web/src/core';
import { PacketType, type Command, type DevicePacket, type Info } from '../../host_tools/web/src/line/line_facts';
import { ReadError, readItems } from '../../host_tools/web/src/recording/replay_line';
import { commandsFor } from '../../host_tools/web/src/steps/settings';

interface Job {
  name: string;
  kind: 'recording' | 'stream' | 'setting';
  input: string;
  salvage: boolean;
  device: string;
}
type Answer = Record<string, unknown> | string;

/** By enum fingertip_status. */
const KINDS: Record<number, string> = { [-3]: 'no recording', [-4]: 'other format', 0: 'damaged', [-5]: 'damaged', [-6]: 'damaged' };

/** The lines that a recording has of a packet, and the head before it: what the page would write. */
function written(packet: DevicePacket, info: Info): [string[], string[]] {
  const writer = new core.Writer('csv', info, []);
  const text = (): string => {
    let all = '';
    for (let bytes; (bytes = writer.take()); ) {
      all += Buffer.from(bytes).toString();
    }
    return all;
  };
  const head = text().trimEnd().split('\n');
  writer.packet(packet);
  const lines = text().trimEnd().split('\n');
  writer.free();
  return [head, lines];
}

function infoOf(sensor_count: number): Info {
  return { ...(core.blank(PacketType.INFO) as Info), sensor_count };
}

/** Its keys and values. */
function infoPairs(info: Info): [string, string][] {
  return written(info, info)[0]
    .slice(1, -1)
    .map((line) => [line.slice(2, line.indexOf(': ')), line.slice(line.indexOf(': ') + 2)]);
}

function packetAnswer(packet: DevicePacket): Record<string, unknown> {
  const told: Record<string, unknown> = { sequence: packet.sequence, t_us: packet.t_us };
  switch (packet.type) {
    case PacketType.CONTACT:
      return { contact: written(packet, infoOf(1))[1][0]!.slice(0, -2) }; // without the columns of a sensor
    case PacketType.RAW:
      return { raw: written(packet, infoOf(packet.sensor_count))[1][0] };
    case PacketType.HEALTH:
    case PacketType.ACK:
    case PacketType.SYNC: {
      const [kind, ...words] = written(packet, infoOf(1))[1][0]!.replace('# packet: ', '').split(' ');
      for (const [key, value] of words.map((word) => word.split('=') as [string, string])) {
        told[key] = key === 'host_time_us' ? value : Number(value);
      }
      return { [kind!]: told };
    }
    case PacketType.INFO:
      return { info: told };
    default:
      return { other: told };
  }
}

function hex(bytes: Uint8Array): string {
  return Buffer.from(bytes).toString('hex');
}

async function recording(job: Job): Promise<Answer> {
  const bytes = readFileSync(job.input);
  const wanted = job.device.toUpperCase() === 'BBBB' ? 1 : 0;
  const rows: unknown[] = [];
  const packets: unknown[] = [];
  let info: unknown = null;
  let has_end = true;
  try {
    for await (const item of readItems(new File([bytes], basename(job.input)))) {
      if (item.device !== wanted) {
        continue;
      }
      const { packet } = item;
      const told = packetAnswer(packet);
      if (packet.type === PacketType.CONTACT || packet.type === PacketType.RAW) {
        rows.push(job.device ? { time_us: fixed(item.time_us), row: told } : told);
      } else {
        packets.push(told);
        info ??= packet.type === PacketType.INFO ? infoPairs(packet) : null;
      }
    }
  } catch (error) {
    const text = error instanceof Error ? error.message : String(error);
    if (!/no end line/.test(text)) {
      return { refused: KINDS[error instanceof ReadError ? error.status : 1], text };
    }
    has_end = false;
  }
  return { rows, packets, info, has_end, skipped: 0 };
}

/** With one decimal, also where toFixed would write an exponent. */
function fixed(value: number): string {
  return Math.abs(value) < 1e21 ? value.toFixed(1) : `${BigInt(value)}.0`;
}

/** Times from 2^53 us on, which is 285 years, are rounded in the page, as libfingertip/fingertip.h says. */
function isRounded(packet: DevicePacket): boolean {
  return Object.entries(packet).some(([name, value]) => name.endsWith('_us') && Number(value) > Number.MAX_SAFE_INTEGER);
}

/** null: not compared. */
function stream(job: Job): Answer | null {
  const packets: unknown[] = [];
  const decoder = new core.Decoder();
  let rounded = false;
  decoder.feed(readFileSync(job.input), (packet) => {
    rounded ||= isRounded(packet);
    packets.push({
      ...packetAnswer(packet),
      frame: hex(core.encode(packet)),
      ...(packet.type === PacketType.INFO ? { keys: infoPairs(packet) } : {}),
    });
  });
  const { bytes: _, ...counts } = decoder.counts;
  if (rounded) {
    return null;
  }
  return {
    packets,
    counts: Object.entries(counts)
      .map(([name, count]) => `${name}=${count}`)
      .join(' '),
    other_version: decoder.other_version,
  };
}

function setting(job: Job): Answer {
  const [key, value] = job.input.split('=') as [string, string];
  const info = {
    slip_threshold_mm: 1,
    slip_window_ms: 100,
    rate_mHz: 1,
    osr: 1,
    prior_sigma_mm: 1.5,
    prior_width_mm: 1.5,
    location_limit_mm: 1.5,
    sync: 9,
  };
  try {
    const [command] = commandsFor(info as unknown as Info, { [key]: value });
    return hex(core.encode({ sequence: 0, t_us: 0, ...(command as Command) }));
  } catch (error) {
    return { refused: 'bad value', text: String(error) };
  }
}

await core.loadCore(readFileSync(process.env['FINGERTIP_CORE'] ?? ''));

/** What the page has no way to ask; and a packet that names no fingertip, which is the first one's for a reader of all. */
const LEFT_OUT = /^fuzz|^part|^two_comment_packet_of_all/;
const jobs = (JSON.parse(readFileSync(process.argv[2]!, 'utf8')) as Job[]).filter(
  (job) => !job.salvage && !LEFT_OUT.test(job.name) && (job.device !== '' || !job.name.startsWith('two')) && job.device !== 'CCCC',
);
const answers: Record<string, Answer> = {};
for (const job of jobs) {
  const answer = job.kind === 'recording' ? await recording(job) : job.kind === 'stream' ? stream(job) : setting(job);
  if (answer !== null) {
    answers[job.name] = answer;
  }
}
process.stdout.write(JSON.stringify(answers));
