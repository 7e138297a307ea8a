/** What the page makes of each input of the corpus, as by_library says it: `node by_page.mjs JOBS.json > answers.json`. The page has no salvage,
 * and shows all fingertips of a file: such jobs are left out, or one is picked. */
import { readFileSync } from 'node:fs';
import { basename } from 'node:path';
import { Decoder } from '../../host_tools/web/src/line/decoder';
import { PacketType, encodePacket, type Command, type DevicePacket, type Info } from '../../host_tools/web/src/line/packets';
import { PACKET_KEYS, infoPairs, rowText } from '../../host_tools/web/src/recording/fields';
import { readItems } from '../../host_tools/web/src/recording/reader';
import { commandsFor } from '../../host_tools/web/src/steps/settings';

interface Job {
  name: string;
  kind: 'recording' | 'stream' | 'setting';
  input: string;
  salvage: boolean;
  device: string;
}
type Answer = Record<string, unknown> | string;

const KINDS: [RegExp, string][] = [
  [/later version/, 'other format'],
  [/no recording of a fingertip|neither a recording|is empty|before a recording begins/, 'no recording'],
  [/./, 'damaged'],
];

function packetAnswer(packet: DevicePacket): Record<string, unknown> {
  const told: Record<string, unknown> = { sequence: packet.sequence, t_us: packet.t_us };
  const fields = packet as unknown as Record<string, unknown>;
  const named = (kind: 'health' | 'ack'): Record<string, unknown> => {
    for (const { key, field } of PACKET_KEYS[kind]) {
      told[key] = typeof fields[field] === 'bigint' ? String(fields[field]) : fields[field];
    }
    return { [kind]: told };
  };
  switch (packet.type) {
    case PacketType.CONTACT:
      return { contact: rowText(packet, null, { sensor_count: 0, has_tangential: true }) };
    case PacketType.RAW:
      return { raw: rowText(null, packet, { sensor_count: packet.sensor_count, has_tangential: true }) };
    case PacketType.HEALTH:
      return named('health');
    case PacketType.ACK:
      return named('ack');
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
        rows.push(job.device ? { time_us: item.time_us.toFixed(1), row: told } : told);
      } else {
        packets.push(told);
        info ??= packet.type === PacketType.INFO ? infoPairs(packet) : null;
      }
    }
  } catch (error) {
    const text = error instanceof Error ? error.message : String(error);
    if (!/no end line|breaks off: its recorder/.test(text)) {
      return { refused: KINDS.find(([pattern]) => pattern.test(text))?.[1], text };
    }
    has_end = false;
  }
  return { rows, packets, info, has_end, skipped: 0 };
}

function stream(job: Job): Answer {
  const packets: unknown[] = [];
  const decoder = new Decoder();
  decoder.feed(readFileSync(job.input), (packet) => {
    const sent = { ...packet, t_us: BigInt(packet.t_us) } as unknown as DevicePacket;
    packets.push({
      ...packetAnswer(packet),
      frame: hex(encodePacket(sent)),
      ...(packet.type === PacketType.INFO ? { keys: infoPairs(packet) } : {}),
    });
  });
  const { bytes: _, ...counts } = decoder.counts;
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
  const info = { slip_threshold_mm: 1, slip_window_ms: 100, rate_mHz: 1, osr: 1, prior_sigma_mm: 1.5, prior_width_mm: 1.5, location_limit_mm: 1.5 };
  try {
    const [command] = commandsFor(info as unknown as Info, { [key]: value });
    return hex(encodePacket({ sequence: 0, t_us: 0n, ...command } as unknown as Command & DevicePacket));
  } catch (error) {
    return { refused: 'bad value', text: String(error) };
  }
}

/** What the page has no way to ask, and what is damaged in the rows of one of two: it shows neither. */
const LEFT_OUT = /^fuzz|^two_(cell|comment|head|chance)_/;
const jobs = (JSON.parse(readFileSync(process.argv[2]!, 'utf8')) as Job[]).filter(
  (job) => !job.salvage && !LEFT_OUT.test(job.name) && (job.device !== '' || !job.name.startsWith('two')) && job.device !== 'CCCC',
);
const answers: Record<string, Answer> = {};
for (const job of jobs) {
  answers[job.name] = job.kind === 'recording' ? await recording(job) : job.kind === 'stream' ? stream(job) : setting(job);
}
process.stdout.write(JSON.stringify(answers));
