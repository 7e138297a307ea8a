/** Records one fingertip from now on, over its going and coming back. */
import { Writer, countsSince, type LineCounts } from '../core';
import { PacketType } from '../line/line_facts';
import type { Fingertip } from '../model/fingertip';
import type { Output } from './output';

export { chooseOutput } from './output';

export type RecordingKind = 'csv' | 'mcap';

/** Packets between two writes: some 70 kB. */
const PART_packets = 256;

const utcNow = (): string => new Date().toISOString();

/** "E66058388347A12C_20260805T120000.csv" */
export function recordingName(fingertip: Fingertip, kind: RecordingKind): string {
  const at = utcNow().replace(/[-:]/g, '').slice(0, 15);
  return `${fingertip.name.replace(/[^A-Za-z0-9]+/g, '_')}_${at}.${kind}`;
}

export class Recorder {
  /** Why it ended before its command; empty: it did not. */
  failure = '';
  private writer: Writer | null = null;
  private packets = 0;
  private before: LineCounts;
  private readonly end_tap: () => void;
  private readonly end_listen: () => void;
  private is_gone = false;

  /** Begins with the next info packet: ask for one. onFailure: recording ended by itself. */
  constructor(
    readonly fingertip: Fingertip,
    kind: RecordingKind,
    readonly output: Output,
    version: string,
    private readonly onFailure: (why: string) => void,
  ) {
    this.before = fingertip.counts;
    this.end_tap = fingertip.tap((packet) =>
      this.guard(() => {
        if (this.is_gone) {
          this.is_gone = false;
          this.writer?.event(`back ${utcNow()}`);
        }
        if (!this.writer && packet.type === PacketType.INFO) {
          this.before = { ...fingertip.counts, packets: fingertip.counts.packets - 1 };
          this.writer = new Writer(kind, packet, [
            ['recorded_by', `fingertip page ${version}`],
            ['started_utc', utcNow()],
            ['port', fingertip.line.label],
            ['started_device_us', String(packet.t_us)],
          ]);
        }
        this.writer?.packet(packet);
        if (++this.packets % PART_packets === 0) {
          this.write();
        }
      }),
    );
    this.end_listen = fingertip.listen(() => {
      if (fingertip.state === 'closed' && !this.is_gone) {
        this.is_gone = true;
        this.guard(() => this.writer?.event(`gone ${utcNow()}`));
      }
    });
  }

  get frames(): number {
    return this.writer?.frames ?? 0;
  }

  /** Rejects with an Error whose message states what was not written. */
  async finish(reason = 'stopped'): Promise<void> {
    this.end_tap();
    this.end_listen();
    this.writer?.finish(reason, countsSince(this.before, this.fingertip.counts));
    this.write();
    await this.output.finish();
  }

  private write(): void {
    for (let bytes; (bytes = this.writer?.take()); ) {
      this.output.write(bytes);
    }
  }

  private guard(write: () => void): void {
    if (this.failure) {
      return;
    }
    try {
      write();
      this.failure = this.output.failure;
    } catch (error) {
      this.failure = error instanceof Error ? error.message : String(error);
    }
    if (this.failure) {
      this.onFailure(this.failure);
    }
  }
}
