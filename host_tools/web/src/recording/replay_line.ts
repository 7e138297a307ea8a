/**
 * A file as the lines of its fingertips, at the pace at which it was recorded. Each fingertip in it
 * has a line; all share the reading and the clock.
 */
import { Decompress } from 'fzstd';
import { CoreError, Reader, encode, setUnpack } from '../core';
import type { Line } from '../line/line';
import { PacketType, type DevicePacket } from '../line/line_facts';
import { pause } from '../model/patience';

/** No more than size bytes, whatever the file holds; fewer where it holds fewer. */
setUnpack((packed, size) => {
  const bytes = new Uint8Array(size);
  let filled = 0;
  new Decompress((part) => {
    bytes.set(part, filled);
    filled += part.length;
  }).push(packed, true);
  return bytes.subarray(0, filled);
});

/** What is wrong with a file: a sentence with the place; what came before it was handed out. */
export class ReadError extends Error {
  /** status: enum fingertip_status, 0 where the library found nothing wrong. */
  constructor(
    message: string,
    readonly status = 0,
  ) {
    super(message);
  }
}

export interface Item {
  /** Number of the fingertip in the file, from 0. */
  device: number;
  /** Time on the recorder's clock in a recording of several, else on the fingertip's; NaN for a packet
   * without a time. */
  time_us: number;
  packet: DevicePacket;
  /** Its port vanished before it: the fingertip's numbers begin again. */
  is_restarted: boolean;
}

/** What to do about an error, by enum fingertip_status. */
const ADVICE: Record<number, string> = {
  [-3]: 'choose another',
  [-4]: 'use the page of that version',
  [-5]: 'what came before is shown; "fingertip convert --salvage" takes what can be read of the rest',
  [-6]: 'choose another',
};

const AT_ONCE_bytes = 1 << 18;

/** All that is in a file: a recording (.csv, .mcap), or bytes of a line (.ftr). Throws ReadError. */
export async function* readItems(file: File): AsyncGenerator<Item, void, undefined> {
  const reader = new Reader(file.name, file.size);
  const gone = new Set<number>();
  let packets = 0;
  try {
    for (;;) {
      const item = reader.next();
      if (item === undefined) {
        break;
      }
      if (item === null) {
        const from = reader.wants;
        reader.feed(new Uint8Array(await file.slice(from, from + AT_ONCE_bytes).arrayBuffer()));
      } else if (item.packet) {
        packets++;
        yield { device: item.device, time_us: item.time_us, packet: item.packet, is_restarted: gone.delete(item.device) };
      } else if (item.event.startsWith('gone')) {
        gone.add(item.device);
      }
    }
    const problem = problemOf(reader, packets);
    if (problem) {
      throw new ReadError(`${file.name} ${problem}`);
    }
  } catch (error) {
    throw error instanceof CoreError
      ? new ReadError([error.message, ADVICE[error.status]].filter(Boolean).join(': '), error.status)
      : error;
  } finally {
    reader.free();
  }
}

/** The problem of a file that was read to its end; empty: none. */
function problemOf(reader: Reader, packets: number): string {
  if (!reader.is_capture) {
    return reader.has_end ? '' : 'has no end line: it was cut short, its recorder killed or its disk full. What there is, is shown';
  }
  const { crc_errors, format_errors, version_errors } = reader.counts;
  if (packets === 0) {
    return version_errors > 0
      ? `is of a firmware that speaks version ${reader.other_version} of the protocol: use the tool of that version`
      : 'holds no packet of a fingertip: choose another';
  }
  const damaged = crc_errors + format_errors;
  return damaged > 0 ? `has ${damaged} damaged packets, which are left out; the rest is shown` : '';
}

/** A page that was asleep goes on where it was. */
const STEP_MOST_ms = 250;
const TICK_ms = 10;

class ReplayLine implements Line {
  private receive: ((bytes: Uint8Array, at_ms: number) => void) | null = null;
  private closed: ((why: string) => void) | null = null;
  private sequence = 0;
  private ahead = 0;
  private last_us = NaN;

  /** How long nothing was recorded, where the replay is. */
  get silent_ms(): number {
    return (this.replay.now_us - this.last_us) / 1000;
  }
  /** From its info packet; empty before. */
  serial = '';

  constructor(private readonly replay: Replay) {}

  /** The file, and of several fingertips in it also which one. */
  get label(): string {
    const { file, holdsSeveral } = this.replay;
    return holdsSeveral && this.serial ? `${file.name}: fingertip ${this.serial.slice(-4)}` : file.name;
  }

  open(receive: (bytes: Uint8Array, at_ms: number) => void, closed: (why: string) => void): Promise<void> {
    this.receive = receive;
    this.closed = closed;
    return Promise.resolve();
  }

  send(): Promise<void> {
    return Promise.reject(new Error('this is a replay: it takes no commands'));
  }

  close(): Promise<void> {
    this.receive = this.closed = null;
    this.replay.left(this);
    return Promise.resolve();
  }

  take({ time_us, packet, is_restarted }: Item): void {
    this.last_us = Number.isNaN(time_us) ? this.last_us : time_us;
    if (packet.type === PacketType.INFO) {
      this.serial = packet.serial;
    }
    // Where they begin again they go on here: nothing was lost.
    this.ahead = is_restarted ? this.sequence - packet.sequence : this.ahead;
    const sequence = (packet.sequence + this.ahead) & 0xffff;
    this.sequence = sequence + 1;
    this.receive?.(encode({ ...packet, sequence }), performance.now());
  }

  end(why: string): void {
    const { closed } = this;
    this.receive = this.closed = null;
    closed?.(why);
  }
}

export class Replay {
  /** Called with the line of each fingertip in the file as it is first met; open it at once. */
  onLine: (line: Line) => void = () => undefined;
  /** Called once: empty at the end, else what is wrong with the file, a sentence. */
  onEnd: (problem: string) => void = () => undefined;
  paused = false;
  /** Times the pace of the recording. */
  speed = 1;
  /** Length of the recording. */
  seconds = 0;

  private readonly lines: (ReplayLine | null)[] = []; // null: closed
  private readonly items: AsyncGenerator<Item, void, undefined>;
  private next: Item | null = null;
  private first_us = NaN;
  now_us = NaN;
  private shown_ms = 0;
  private stopped = false;

  constructor(readonly file: File) {
    this.items = readItems(file);
  }

  /** Resolves once the first frames are there, or the file turned out to have none. */
  async start(): Promise<void> {
    this.shown_ms = performance.now();
    await this.advance();
    void this.run();
  }

  /** What lies between comes at once. */
  skip(seconds: number): void {
    this.now_us += seconds * 1e6;
  }

  get holdsSeveral(): boolean {
    return this.lines.length > 1;
  }

  left(line: Line): void {
    const at = this.lines.findIndex((each) => each === line);
    if (at >= 0) {
      this.lines[at] = null;
    }
    this.stopped ||= this.lines.every((each) => !each);
  }

  private async run(): Promise<void> {
    while (!this.stopped) {
      await pause(TICK_ms);
      await this.advance();
    }
  }

  /** All that is due. */
  private async advance(): Promise<void> {
    const now_ms = performance.now();
    if (!this.paused) {
      this.now_us += Math.min(STEP_MOST_ms, now_ms - this.shown_ms) * 1000 * this.speed;
    }
    this.shown_ms = now_ms;
    try {
      while (!this.stopped) {
        if (!this.next) {
          const { value, done } = await this.items.next();
          if (done) {
            this.end('');
            return;
          }
          this.next = value;
        }
        const { time_us } = this.next;
        if (!Number.isNaN(time_us)) {
          // The first, or a fingertip that restarted while it was recorded.
          if (Number.isNaN(this.now_us) || time_us < this.first_us + (this.seconds - 1) * 1e6) {
            this.first_us = time_us - this.seconds * 1e6;
            this.now_us = time_us;
          }
          if (time_us > this.now_us) {
            return;
          }
          this.seconds = (time_us - this.first_us) / 1e6;
        }
        this.hand(this.next);
        this.next = null;
      }
    } catch (error) {
      this.end(error instanceof ReadError ? error.message : `${this.file.name} cannot be read (${String(error)})`);
    }
  }

  private hand(item: Item): void {
    const { device, packet } = item;
    if (!(device in this.lines)) {
      if (packet.type !== PacketType.INFO && packet.type !== PacketType.RAW && packet.type !== PacketType.CONTACT) {
        return;
      }
      const line = new ReplayLine(this);
      this.lines[device] = line;
      this.onLine(line);
    }
    this.lines[device]?.take(item);
  }

  private end(problem: string): void {
    this.stopped = true;
    this.now_us = this.first_us + this.seconds * 1e6;
    this.lines.forEach((line) => line?.end(`the replay has ended${problem ? ' before the end of the file' : ''}`));
    this.onEnd(problem);
  }
}
