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
  private readonly lines: PacketLines;
  private readonly before: LineCounts;
  private readonly end_tap: () => void;
  private readonly end_listen: () => void;
  private was_live = true;

  /** The fingertip's info must be known. onFailure: recording ended by itself. */
  constructor(
    readonly fingertip: Fingertip,
    readonly kind: RecordingKind,
    readonly output: Output,
    version: string,
    private readonly onFailure: (why: string) => void,
  ) {
    const { info } = fingertip;
    if (!info) {
      throw new Error('the fingertip has not told yet who it is: wait a moment');
    }
    this.sink = kind === 'csv' ? new CsvSink(output) : new McapSink(output);
    const extra: Pairs = [
      ['recorded_by', `fingertip page ${version}`],
      ['started_utc', utcText(Date.now())],
      ['port', fingertip.line.label],
    ];
    const estimate = fingertip.clock.estimate;
    if (estimate) {
      const now_us = performance.now() * 1000;
      const device_us =
        estimate.device_us + (now_us - estimate.host_us) * (1 + estimate.drift_ppm * 1e-6);
      extra.push(['started_device_us', String(Math.max(0, Math.round(device_us)))]);
    }
    this.before = { ...fingertip.counts };
    this.lines = new PacketLines(this.sink, info, extra);
    this.end_tap = fingertip.tap((packet) => {
      if (packet.type !== PacketType.CRASH) {
        this.guard(() => this.lines.packet(packet));
      }
    });
    this.end_listen = fingertip.listen(() => {
      const live = fingertip.state !== 'closed';
      if (live !== this.was_live) {
        this.was_live = live;
        this.guard(() => this.lines.event(`${live ? 'back' : 'gone'} ${utcText(Date.now())}`));
      }
    });
  }

  get frames(): number {
    return this.lines.frames;
  }

  /** Rejects with an Error whose message says what was not written. */
  async finish(reason = 'stopped'): Promise<void> {
    this.end_tap();
    this.end_listen();
    const counts = noCounts();
    for (const key of Object.keys(counts) as (keyof LineCounts)[]) {
      counts[key] = this.fingertip.counts[key] - this.before[key];
    }
    this.lines.finish(counts, reason);
    await this.sink.finish();
    await this.output.finish();
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
