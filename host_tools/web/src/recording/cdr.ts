/** CDR as ROS 2 serializes its messages: little-endian, every number aligned to its own size,
 * counted from behind the four bytes that say so. */

const HEAD_BYTES = 4;

export class CdrWriter {
  private view = new DataView(new ArrayBuffer(1024));
  private at = HEAD_BYTES;
  private static readonly encoder = new TextEncoder();

  constructor() {
    this.view.setUint8(1, 1);
  }

  u8(value: number | boolean): void {
    this.view.setUint8(this.room(1), Number(value));
  }
  u16(value: number): void {
    this.view.setUint16(this.room(2), value, true);
  }
  u32(value: number): void {
    this.view.setUint32(this.room(4), value, true);
  }
  u64(value: number | bigint): void {
    this.view.setBigUint64(this.room(8), BigInt(value), true);
  }
  f32(value: number): void {
    this.view.setFloat32(this.room(4), value, true);
  }
  f64(value: number): void {
    this.view.setFloat64(this.room(8), value, true);
  }
  text(text: string): void {
    const bytes = CdrWriter.encoder.encode(text);
    this.u32(bytes.length + 1);
    const at = this.room(1, bytes.length + 1);
    new Uint8Array(this.view.buffer).set(bytes, at);
    this.view.setUint8(at + bytes.length, 0);
  }

  bytes(): Uint8Array<ArrayBuffer> {
    return new Uint8Array(this.view.buffer.slice(0, this.at) as ArrayBuffer);
  }

  private room(size: number, length = size): number {
    const begin = this.at + ((size - ((this.at - HEAD_BYTES) % size)) % size);
    const end = begin + length;
    if (end > this.view.byteLength) {
      const larger = new Uint8Array(Math.max(end, 2 * this.view.byteLength));
      larger.set(new Uint8Array(this.view.buffer, 0, this.at));
      this.view = new DataView(larger.buffer);
    }
    this.at = end;
    return begin;
  }
}

/** Throws RangeError beyond the end. */
export class CdrReader {
  private readonly view: DataView;
  private at = HEAD_BYTES;
  private static readonly decoder = new TextDecoder('utf-8', { fatal: true });

  constructor(private readonly all: Uint8Array) {
    this.view = new DataView(all.buffer, all.byteOffset, all.byteLength);
    if (this.view.getUint32(0) !== 0x00010000) {
      throw new RangeError('no little-endian CDR');
    }
  }

  u8(): number {
    return this.view.getUint8(this.next(1));
  }
  u16(): number {
    return this.view.getUint16(this.next(2), true);
  }
  u32(): number {
    return this.view.getUint32(this.next(4), true);
  }
  u64(): number {
    return Number(this.view.getBigUint64(this.next(8), true));
  }
  f32(): number {
    return this.view.getFloat32(this.next(4), true);
  }
  f64(): number {
    return this.view.getFloat64(this.next(8), true);
  }
  text(): string {
    const length = this.u32();
    if (length < 1 || this.at + length > this.all.length) {
      throw new RangeError('a text beyond the end');
    }
    const text = CdrReader.decoder.decode(this.all.subarray(this.at, this.at + length - 1));
    this.at += length;
    return text;
  }

  private next(size: number): number {
    const begin = this.at + ((size - ((this.at - HEAD_BYTES) % size)) % size);
    this.at = begin + size;
    return begin;
  }
}
