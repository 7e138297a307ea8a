/** The lines that the packets of one fingertip become: libfingertip/recording_lines.cpp and
 * recording_writer.cpp. */
import { noCounts, type LineCounts } from '../line/framing';
import {
  Capability,
  PacketType,
  type Contact,
  type DevicePacket,
  type Info,
  type Raw,
} from '../line/packets';
import { FIRST_WORDS, headerText, infoPairs, packetText, rowText, type Columns, type Pairs } from './fields';

/** Takes a recording line by line; rows also as the packets behind them, valid during the call. */
export interface LineSink {
  line(text: string): void;
  row(text: string, contact: Contact | null, raw: Raw | null): void;
}

export class PacketLines {
  frames = 0;
  private readonly columns: Columns;
  private readonly raw_expected: boolean;
  private waiting: Contact | null = null;
  private told: Pairs = [];
  private before_restart_us = 0;
  private first_us = -1;
  private last_us = 0;

  /** extra: the recorder's own keys. */
  constructor(
    private readonly sink: LineSink,
    info: Info,
    extra: Pairs,
  ) {
    const both = Capability.FIT | Capability.RAW_STREAM;
    this.raw_expected = (info.capabilities & both) === both;
    this.columns = { sensor_count: info.sensor_count, has_tangential: true };
    sink.line(`${FIRST_WORDS}1`);
    this.comments(extra);
    this.info(info);
    sink.line(headerText(this.columns));
    this.packet(info);
  }

  packet(packet: DevicePacket): void {
    switch (packet.type) {
      case PacketType.CONTACT:
        this.writePending();
        if (this.raw_expected) {
          this.waiting = { ...packet };
        } else {
          this.row(packet, null);
        }
        break;
      case PacketType.RAW:
        if (packet.sensor_count !== this.columns.sensor_count) {
          throw new Error(
            `the fingertip now has ${packet.sensor_count} sensors instead of ${this.columns.sensor_count}: record anew`,
          );
        }
        if (this.waiting && this.waiting.frame === packet.frame && this.waiting.t_us === packet.t_us) {
          const contact = this.waiting;
          this.waiting = null;
          this.row(contact, packet);
        } else {
          this.writePending();
          this.row(null, packet);
        }
        break;
      case PacketType.HEALTH:
        this.comment('packet', 'health' + packetText(packet, 'health'));
        break;
      case PacketType.ACK:
        this.comment('packet', 'ack' + packetText(packet, 'ack'));
        break;
      case PacketType.INFO:
        this.writePending();
        this.info(packet);
        this.comment('packet', 'info' + packetText(packet, 'info'));
        break;
      default:
        break;
    }
  }

  event(text: string): void {
    this.comment('event', text);
  }

  /** Last of all; counts: what the line counted meanwhile. */
  finish(counts: LineCounts, reason: string): void {
    this.writePending();
    const { bytes: _, ...told } = { ...noCounts(), ...counts };
    const seconds =
      (this.before_restart_us + (this.first_us >= 0 ? this.last_us - this.first_us : 0)) / 1e6;
    const order = [
      'packets',
      'dropped_packets',
      'out_of_order',
      'crc_errors',
      'format_errors',
      'version_errors',
      'unknown_types',
    ] as const;
    this.sink.line(
      `# end: reason=${reason} frames=${this.frames} seconds=${seconds.toFixed(6)} ` +
        order.map((key) => `${key}=${told[key]}`).join(' '),
    );
  }

  private comment(key: string, value: string): void {
    this.writePending();
    this.sink.line(`# ${key}: ${value}`);
  }

  private comments(pairs: Pairs): void {
    for (const [key, value] of pairs) {
      this.sink.line(`# ${key}: ${value}`);
    }
  }

  /** Those of its fields that are new. */
  private info(info: Info): void {
    const pairs = infoPairs(info);
    const known = new Map(this.told);
    this.comments(pairs.filter(([key, value]) => known.get(key) !== value));
    this.told = pairs;
  }

  private writePending(): void {
    if (this.waiting) {
      const contact = this.waiting;
      this.waiting = null;
      this.row(contact, null);
    }
  }

  private row(contact: Contact | null, raw: Raw | null): void {
    const { t_us } = (contact ?? raw) as Contact | Raw;
    this.sink.row(rowText(contact, raw, this.columns), contact, raw);
    this.frames++;
    if (this.first_us >= 0 && t_us < this.last_us) {
      this.before_restart_us += this.last_us - this.first_us;
      this.first_us = -1;
    }
    if (this.first_us < 0) {
      this.first_us = t_us;
    }
    this.last_us = t_us;
  }
}
