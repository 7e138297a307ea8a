/** Frames of the line (firmware/wire/PROTOCOL.md): COBS, CRC-32/ISO-HDLC, resynchronisation. */

export { MAX_FRAME_BYTES, WIRE_VERSION } from './line_facts';
export const HEADER_BYTES = 12;
export const CRC_BYTES = 4;

const CRC_TABLES = (() => {
  const tables = Array.from({ length: 4 }, () => new Uint32Array(256));
  const [first, ...others] = tables as [Uint32Array, Uint32Array, Uint32Array, Uint32Array];
  for (let byte = 0; byte < 256; byte++) {
    let crc = byte;
    for (let bit = 0; bit < 8; bit++) {
      crc = crc & 1 ? (crc >>> 1) ^ 0xedb88320 : crc >>> 1;
    }
    first[byte] = crc >>> 0;
  }
  let before = first;
  for (const table of others) {
    for (let byte = 0; byte < 256; byte++) {
      const crc = before[byte];
      table[byte] = (crc >>> 8) ^ first[crc & 0xff];
    }
    before = table;
  }
  return tables as [Uint32Array, Uint32Array, Uint32Array, Uint32Array];
})();

/** CRC-32/ISO-HDLC of bytes[0, length). "123456789" gives 0xCBF43926. */
export function crc32(bytes: Uint8Array, length = bytes.length): number {
  const [t0, t1, t2, t3] = CRC_TABLES;
  let crc = 0xffffffff;
  let i = 0;
  for (; i + 4 <= length; i += 4) {
    crc ^=
      bytes[i] |
      (bytes[i + 1] << 8) |
      (bytes[i + 2] << 16) |
      (bytes[i + 3] << 24);
    crc =
      t3[crc & 0xff] ^
      t2[(crc >>> 8) & 0xff] ^
      t1[(crc >>> 16) & 0xff] ^
      t0[crc >>> 24];
  }
  for (; i < length; i++) {
    crc = (crc >>> 8) ^ t0[(crc ^ bytes[i]) & 0xff];
  }
  return ~crc >>> 0;
}

/** Encodes bytes[0, length) and appends the delimiter. */
export function cobsEncode(bytes: Uint8Array, length = bytes.length): Uint8Array<ArrayBuffer> {
  const frame = new Uint8Array(length + Math.floor(length / 254) + 2);
  let code_at = 0;
  let out = 1;
  for (let i = 0; i < length; i++) {
    if (out - code_at === 255) {
      frame[code_at] = 255;
      code_at = out++;
    }
    const byte = bytes[i];
    if (byte === 0) {
      frame[code_at] = out - code_at;
      code_at = out++;
    } else {
      frame[out++] = byte;
    }
  }
  frame[code_at] = out - code_at;
  frame[out++] = 0;
  return frame.slice(0, out);
}

/** Decodes frame[from, to), no delimiter, into out; its length, or 0 for bytes that no encoder
 * produces. */
export function cobsDecode(frame: Uint8Array, from: number, to: number, out: Uint8Array): number {
  let length = 0;
  while (from < to) {
    const code = frame[from++];
    const end = from + code - 1;
    if (code === 0 || end > to) {
      return 0;
    }
    while (from < end) {
      const byte = frame[from++];
      if (byte === 0) {
        return 0;
      }
      out[length++] = byte;
    }
    if (code !== 255 && from < to) {
      out[length++] = 0;
    }
  }
  return length;
}

/** What the line counted, as the end of a recording says it. */
export interface LineCounts {
  bytes: number;
  /** Undamaged and of a known type. */
  packets: number;
  /** Missing from the sequence. */
  dropped_packets: number;
  /** Repeated, or older than one before. */
  out_of_order: number;
  crc_errors: number;
  /** Right or no CRC, but no frame of this protocol. */
  format_errors: number;
  version_errors: number;
  /** Undamaged, from a newer firmware. */
  unknown_types: number;
}

export function noCounts(): LineCounts {
  return {
    bytes: 0,
    packets: 0,
    dropped_packets: 0,
    out_of_order: 0,
    crc_errors: 0,
    format_errors: 0,
    version_errors: 0,
    unknown_types: 0,
  };
}
