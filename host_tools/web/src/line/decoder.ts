/**
 * Bytes of the line to packets, with an account of everything that went wrong on the way.
 *
 * After any damage decoding goes on after the next 0x00. The frame that is under way when a
 * receiver joins is torn by nature: its failure counts as nothing. Contact and raw packets are
 * decoded into one object each, which the next one overwrites: nothing is allocated for them.
 */
import {
  CRC_BYTES,
  HEADER_BYTES,
  MAX_FRAME_BYTES,
  WIRE_VERSION,
  cobsDecode,
  crc32,
  noCounts,
  type LineCounts,
} from './framing';
import {
  PacketType,
  blank,
  decodeBody,
  trimInfo,
  type Contact,
  type DevicePacket,
  type Info,
  type Raw,
} from './packets';

export class Decoder {
  readonly counts: LineCounts = noCounts();
  /** Of the last packet that counted as a version error; 0: none yet. */
  other_version = 0;
  /** The last of their kind, overwritten by the next. */
  readonly contact = blank(PacketType.CONTACT) as unknown as Contact;
  readonly raw = blank(PacketType.RAW) as unknown as Raw;

  private readonly kept = new Uint8Array(MAX_FRAME_BYTES);
  private length = 0;
  private overlong = false;
  private joining = true;
  private expected = -1;
  private readonly packet = new Uint8Array(MAX_FRAME_BYTES);
  private readonly view = new DataView(this.packet.buffer);
  private source: Uint8Array = this.kept;
  private from = 0;
  private to = 0;

  /** handler: called for each packet that these bytes complete; info, health, ack and crash are
   * objects of their own. */
  feed(bytes: Uint8Array, handler: (packet: DevicePacket) => void): void {
    this.counts.bytes += bytes.length;
    let from = 0;
    for (;;) {
      const end = bytes.indexOf(0, from);
      const part = (end < 0 ? bytes.length : end) - from;
      if (end >= 0 && this.length === 0 && !this.overlong && part <= MAX_FRAME_BYTES) {
        this.frame(bytes, from, end, handler);
      } else {
        this.keep(bytes, from, from + part);
        if (end >= 0) {
          const length = this.length;
          const overlong = this.overlong;
          this.length = 0;
          this.overlong = false;
          if (overlong) {
            this.counts.format_errors += this.joining ? 0 : 1;
            this.joining = false;
          } else {
            this.frame(this.kept, 0, length, handler);
          }
        }
      }
      if (end < 0) {
        return;
      }
      from = end + 1;
    }
  }

  /** A copy of the last packet's frame, COBS bytes without the delimiter; in the handler alone. */
  frameBytes(): Uint8Array<ArrayBuffer> {
    return new Uint8Array(this.source.subarray(this.from, this.to));
  }

  /** The line was interrupted: join anew, and expect no particular sequence number. */
  restart(): void {
    this.length = 0;
    this.overlong = false;
    this.joining = true;
    this.expected = -1;
  }

  private keep(bytes: Uint8Array, from: number, to: number): void {
    if (this.length + to - from > MAX_FRAME_BYTES) {
      this.overlong = true;
    } else {
      this.kept.set(bytes.subarray(from, to), this.length);
      this.length += to - from;
    }
  }

  private frame(
    source: Uint8Array,
    from: number,
    to: number,
    handler: (packet: DevicePacket) => void,
  ): void {
    const torn = this.joining;
    this.joining = false;
    if (from === to) {
      return;
    }
    const { counts, packet, view } = this;
    const used = cobsDecode(source, from, to, packet) - CRC_BYTES;
    if (used < HEADER_BYTES) {
      counts.format_errors += torn ? 0 : 1;
      return;
    }
    if (crc32(packet, used) !== view.getUint32(used, true)) {
      counts.crc_errors += torn ? 0 : 1;
      return;
    }
    if (packet[0] !== WIRE_VERSION) {
      counts.version_errors++;
      this.other_version = packet[0];
      return;
    }
    const type = packet[1];
    const sequence = view.getUint16(2, true);
    let to_packet: DevicePacket;
    switch (type) {
      case PacketType.CONTACT:
        to_packet = this.contact;
        break;
      case PacketType.RAW:
        to_packet = this.raw;
        break;
      case PacketType.INFO:
      case PacketType.HEALTH:
      case PacketType.ACK:
      case PacketType.CRASH:
        to_packet = blank(type) as unknown as DevicePacket;
        break;
      default:
        counts.unknown_types++;
        this.follow(sequence);
        return;
    }
    if (!decodeBody(view, used, to_packet as unknown as Record<string, number>)) {
      counts.format_errors += torn ? 0 : 1;
      return;
    }
    to_packet.sequence = sequence;
    to_packet.t_us = view.getUint32(4, true) + view.getUint32(8, true) * 2 ** 32;
    counts.packets++;
    this.follow(sequence);
    if (type === PacketType.INFO) {
      trimInfo(to_packet as Info);
    }
    this.source = source;
    this.from = from;
    this.to = to;
    handler(to_packet);
  }

  private follow(sequence: number): void {
    if (this.expected >= 0) {
      const ahead = (sequence - this.expected) & 0xffff;
      if (ahead < 0x8000) {
        this.counts.dropped_packets += ahead;
      } else {
        this.counts.out_of_order++;
      }
    }
    this.expected = (sequence + 1) & 0xffff;
  }
}
