/** Records one fingertip from now on, over its going and coming back. */
import { noCounts, type LineCounts } from '../line/framing';
import { PacketType } from '../line/packets';
import type { Fingertip } from '../model/fingertip';
import { CsvSink } from './csv_sink';
import type { Pairs } from './fields';
import { PacketLines } from './lines';
import { McapSink } from './mcap_sink';
import type { Output } from './output';
import { utcText } from './text';

export { chooseOutput } from './output';

export type RecordingKind = 'csv' | 'mcap';

export const MEDIA_TYPES: Record<RecordingKind, string> = {
  csv: 'text/csv',
  mcap: 'application/octet-stream',
};

/** "E66058388347A12C_20260805T120000.csv" */
export function recordingName(fingertip: Fingertip, kind: RecordingKind, now_ms = Date.now()): string {
  const at = utcText(now_ms).replace(/[-:]/g, '').slice(0, 15);
  return `${fingertip.name.replace(/[^A-Za-z0-9]+/g, '_')}_${at}.${kind}`;
}

export class Recorder {
  /** Why it ended before it was told to; empty: it did not. */
  failure = '';
  private readonly sink: CsvSink | McapSink;
  private lines: PacketLines | null = null;
  private before = noCounts();
  private readonly end_tap: () => void;
  private readonly end_listen: () => void;
  private was_live = true;

  /** Begins with the next info packet: ask for one. onFailure: recording ended by itself. */
  constructor(
    readonly fingertip: Fingertip,
    readonly kind: RecordingKind,
    readonly output: Output,
    version: string,
    private readonly onFailure: (why: string) => void,
  ) {
    this.sink = kind === 'csv' ? new CsvSink(output) : new McapSink(output);
    this.end_tap = fingertip.tap((packet) => {
      if (this.lines) {
        const { lines } = this;
        this.guard(() => lines.packet(packet));
      } else if (packet.type === PacketType.INFO) {
        this.before = { ...fingertip.counts, packets: fingertip.counts.packets - 1 };
        this.guard(() => {
          this.lines = new PacketLines(this.sink, packet, this.head(version, packet.t_us));
        });
      }
    });
    this.end_listen = fingertip.listen(() => {
      const live = fingertip.state !== 'closed';
      if (live !== this.was_live) {
        this.was_live = live;
        this.guard(() => this.lines?.event(`${live ? 'back' : 'gone'} ${utcText(Date.now())}`));
      }
    });
  }

  get frames(): number {
    return this.lines?.frames ?? 0;
  }

  /** Rejects with an Error whose message says what was not written. */
  async finish(reason = 'stopped'): Promise<void> {
    this.end_tap();
    this.end_listen();
    const counts = noCounts();
    for (const key of Object.keys(counts) as (keyof LineCounts)[]) {
      counts[key] = this.fingertip.counts[key] - this.before[key];
    }
    this.lines?.finish(counts, reason);
    await this.sink.finish();
    await this.output.finish();
  }

  private head(version: string, device_us: number): Pairs {
    return [
      ['recorded_by', `fingertip page ${version}`],
      ['started_utc', utcText(Date.now())],
      ['port', this.fingertip.line.label],
      ['started_device_us', String(device_us)],
    ];
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
