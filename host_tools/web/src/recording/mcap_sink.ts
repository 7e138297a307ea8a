/**
 * A recording as an MCAP file of ROS 2 messages: the topics, schemas, messages and metadata of
 * libfingertip/mcap_recording.cpp, for a recording of one fingertip. Chunks are not compressed.
 */
import { McapWriter } from '@mcap/core';
import type { Contact, Raw } from '../line/packets';
import { WARNING_FLAGS } from '../model/flags';
import { isList, type Pairs } from './fields';
import type { LineSink } from './lines';
import type { Output } from './output';
import {
  CONTACT,
  LINE,
  contactMessage,
  fullName,
  health,
  lineMessage,
  nameInRos,
  place,
  pressures,
  schemaOf,
  warnings,
  wrench,
  type Header,
} from './ros_messages';

const CHUNK_bytes = 1 << 20;

interface Message {
  topic: string;
  time_ns: bigint;
  data: Uint8Array<ArrayBuffer>;
}

const TOPICS: [string, string][] = [
  ['contact', CONTACT],
  ['wrench', 'geometry_msgs/WrenchStamped'],
  ['place', 'geometry_msgs/PointStamped'],
  ['pressures', 'sensor_msgs/PointCloud2'],
];
const LINES = '/fingertip/lines';
const DIAGNOSTICS = '/diagnostics';

function keyAndValue(text: string): [string, string] | null {
  const colon = text.indexOf(': ');
  return text.startsWith('#') && colon >= 0
    ? [text.slice(1, colon).trim(), text.slice(colon + 2).trim()]
    : null;
}

export class McapSink implements LineSink {
  private head: string[] | null = [];
  private readonly keys = new Map<string, string>();
  private readonly calibration = new Map<string, string>();
  private serial = '';
  private frame_id = '';
  private x_mm: number[] = [];
  private y_mm: number[] = [];
  private sensors = 0;
  private number = 0;
  private begin_ns = 0n;
  private now_ns = 0n;
  private event_ns = 0n;
  private anchor: { ns: bigint; device_us: number } | null = null;
  private last_us = 0;
  private warned = -1;

  private readonly writer: McapWriter;
  private readonly channels = new Map<string, { id: number; count: number }>();
  private waiting: Message[] = [];
  private last: Promise<void> = Promise.resolve();
  private length = 0;

  constructor(output: Pick<Output, 'write'>) {
    this.writer = new McapWriter({
      writable: {
        position: () => BigInt(this.length),
        write: (bytes) => {
          this.length += bytes.length;
          output.write(new Uint8Array(bytes));
          return Promise.resolve();
        },
      },
      chunkSize: CHUNK_bytes,
    });
  }

  line(text: string): void {
    if (this.head) {
      this.head.push(text);
      if (!text.startsWith('#')) {
        this.begin(this.head);
      }
      return;
    }
    this.putLine(text);
    this.comment(text);
  }

  row(_text: string, contact: Contact | null, raw: Raw | null): void {
    const { t_us } = (contact ?? raw) as Contact | Raw;
    this.tick(t_us);
    const header: Header = { time_ns: this.now_ns, frame_id: this.frame_id };
    const root = `/fingertip/${nameInRos(this.serial)}/`;
    this.put(`${root}contact`, contactMessage(header, ++this.number, contact, raw));
    if (contact) {
      this.put(`${root}wrench`, wrench(header, contact));
      this.put(`${root}place`, place(header, contact));
    }
    if (raw && Math.min(this.x_mm.length, this.y_mm.length) >= raw.sensor_count) {
      this.put(`${root}pressures`, pressures(header, raw, this.x_mm, this.y_mm));
    }
    if (contact && (contact.flags & WARNING_FLAGS) !== this.warned) {
      this.warned = contact.flags & WARNING_FLAGS;
      this.put(
        DIAGNOSTICS,
        warnings({ time_ns: this.now_ns, frame_id: '' }, this.serial, this.warned),
      );
    }
  }

  async finish(): Promise<void> {
    if (this.head) {
      this.begin(this.head);
    }
    this.flush();
    await this.last;
    await this.writer.end();
  }

  /** The head is complete. */
  private begin(head: string[]): void {
    this.head = null;
    for (const text of head) {
      const pair = keyAndValue(text);
      if (pair) {
        this.keys.set(...pair);
        this.deviceKey(...pair);
      }
    }
    this.serial = this.keys.get('serial') ?? '';
    this.frame_id = `fingertip_${nameInRos(this.serial)}`;
    this.begin_ns = BigInt(Date.parse(this.keys.get('started_utc') ?? '') || 0) * 1_000_000n;
    this.now_ns = this.begin_ns;
    const device_us = this.keys.get('started_device_us');
    this.anchor = device_us ? { ns: this.begin_ns, device_us: Number(device_us) } : null;
    const calibration = new Map(this.calibration);
    const keys = new Map(this.keys);
    const { now_ns } = this;
    this.last = this.last.then(() => this.start(keys, calibration, now_ns));
    head.forEach((text) => this.putLine(text));
  }

  private async start(
    keys: Map<string, string>,
    calibration: Map<string, string>,
    now_ns: bigint,
  ): Promise<void> {
    const { writer } = this;
    await writer.start({ profile: 'ros2', library: 'fingertip' });
    await writer.addMetadata({ name: 'fingertip_recording', metadata: keys });
    if (calibration.size > 0) {
      await writer.addAttachment({
        logTime: now_ns,
        createTime: now_ns,
        name: `calibration_${this.serial}.json`,
        mediaType: 'application/json',
        data: new TextEncoder().encode(this.json([...calibration])),
      });
    }
    const schemas = new Map<string, number>();
    const names = [CONTACT, LINE, ...TOPICS.slice(1).map(([, name]) => name), 'diagnostic_msgs/DiagnosticArray'];
    for (const name of names) {
      schemas.set(
        name,
        await writer.registerSchema({
          name: fullName(name),
          encoding: 'ros2msg',
          data: new TextEncoder().encode(schemaOf(name)),
        }),
      );
    }
    const root = `/fingertip/${nameInRos(this.serial)}/`;
    for (const [topic, name] of [
      [LINES, LINE],
      [DIAGNOSTICS, 'diagnostic_msgs/DiagnosticArray'],
      ...TOPICS.map(([topic, name]) => [root + topic, name]),
    ]) {
      const id = await writer.registerChannel({
        topic,
        schemaId: schemas.get(name) ?? 0,
        messageEncoding: 'cdr',
        metadata: new Map([['offered_qos_profiles', '']]),
      });
      this.channels.set(topic, { id, count: 0 });
    }
  }

  private json(pairs: Pairs): string {
    const values = pairs.map(([key, value]) => {
      const numbers = value.split(' ').join(', ');
      return `, "${key}": ${isList(key) ? `[${numbers}]` : numbers}`;
    });
    return `{"serial": "${this.serial}"${values.join('')}}`;
  }

  private putLine(text: string): void {
    this.put(LINES, lineMessage({ time_ns: this.now_ns, frame_id: '' }, ++this.number, text));
  }

  private comment(text: string): void {
    const pair = keyAndValue(text);
    if (!pair) {
      return;
    }
    const [key, value] = pair;
    if (key === 'event') {
      const ms = Date.parse(value.slice(value.lastIndexOf(' ') + 1));
      this.event_ns = Number.isNaN(ms) ? this.event_ns : BigInt(ms) * 1_000_000n;
    } else if (key === 'packet') {
      const [name, ...words] = value.split(' ');
      const fields = words
        .map((word): [string, string] => [
          word.slice(0, word.indexOf('=')),
          word.slice(word.indexOf('=') + 1),
        ])
        .filter(([field]) => field !== 'sequence' && field !== 't_us');
      if (name === 'health') {
        this.put(
          DIAGNOSTICS,
          health({ time_ns: this.now_ns, frame_id: '' }, this.serial, this.sensors, fields),
        );
      }
    } else {
      this.deviceKey(key, value);
    }
  }

  private deviceKey(key: string, value: string): void {
    if (key === 'x_mm' || key === 'y_mm') {
      this[key] = value.split(' ').map(Number);
    } else if (key === 'sensors') {
      this.sensors = Number(value);
    } else if (/^(calibration_|force_scale|gain|pad_)/.test(key)) {
      this.calibration.set(key, value);
    }
  }

  private tick(t_us: number): void {
    if (!this.anchor) {
      this.anchor = { ns: this.begin_ns, device_us: t_us };
    } else if (t_us < this.last_us) {
      const ns = this.event_ns > this.now_ns ? this.event_ns : this.now_ns;
      this.anchor = { ns, device_us: t_us }; // it started anew
    }
    this.last_us = t_us;
    this.now_ns = this.anchor.ns + BigInt(t_us - this.anchor.device_us) * 1000n;
  }

  private put(topic: string, data: Uint8Array<ArrayBuffer>): void {
    this.waiting.push({ topic, time_ns: this.now_ns, data });
    if (this.waiting.length >= 256) {
      this.flush();
    }
  }

  /** The writer takes one message after the other. */
  private flush(): void {
    const messages = this.waiting;
    this.waiting = [];
    this.last = this.last.then(async () => {
      for (const { topic, time_ns, data } of messages) {
        const channel = this.channels.get(topic);
        if (channel) {
          await this.writer.addMessage({
            channelId: channel.id,
            sequence: channel.count++,
            logTime: time_ns,
            publishTime: time_ns,
            data,
          });
        }
      }
    });
  }
}
