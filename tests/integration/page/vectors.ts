/** The byte images of tests/vectors/wire, assembled by hand from PROTOCOL.md. */
import { readFileSync, readdirSync } from 'node:fs';
import { join } from 'node:path';

const folder = join(process.env['FINGERTIP_SOURCE'] ?? '.', 'tests/vectors/wire');

export interface Vector {
  name: string;
  packet: Uint8Array;
  frame: Uint8Array;
  /** name -> number, of the comments that name a field: "# bus_nacks 134744071". */
  values: Map<string, number>;
}

export function readVectors(): Vector[] {
  return readdirSync(folder)
    .sort()
    .map((name) => {
      const bytes: Record<string, number[]> = { packet: [], frame: [] };
      let to: number[] = [];
      const values = new Map<string, number>();
      for (const line of readFileSync(join(folder, name), 'ascii').split('\n')) {
        const said = /# (\w+) (-?[0-9.]+)(?: |$)/.exec(line);
        if (said && bytes['frame']!.length === 0) {
          values.set(said[1]!, Number(said[2]));
        }
        for (const word of line.replace(/#.*/, '').trim().split(/\s+/).filter(Boolean)) {
          if (word in bytes) {
            to = bytes[word]!;
          } else {
            to.push(parseInt(word, 16));
          }
        }
      }
      return {
        name: name.replace('.txt', ''),
        packet: Uint8Array.from(bytes['packet']!),
        frame: Uint8Array.from(bytes['frame']!),
        values,
      };
    });
}

export function vector(name: string): Vector {
  const found = readVectors().find((each) => each.name === name);
  if (!found) {
    throw new Error(`there is no vector ${name}`);
  }
  return found;
}

/** COBS of the tests' own, written from the paper; both frames have their delimiter. */
export function cobsEncode(bytes: Uint8Array): Uint8Array<ArrayBuffer> {
  const frame: number[] = [];
  let run: number[] = [];
  const end = (): void => {
    frame.push(run.length + 1, ...run);
    run = [];
  };
  bytes.forEach((byte, i) => {
    if (byte === 0) {
      end();
    } else {
      run.push(byte);
    }
    if (run.length === 254 && i < bytes.length - 1) {
      frame.push(255, ...run);
      run = [];
    }
  });
  end();
  return Uint8Array.of(...frame, 0);
}

export function cobsDecode(frame: Uint8Array): Uint8Array<ArrayBuffer> {
  const bytes: number[] = [];
  for (let at = 0; at < frame.length - 1; ) {
    const code = frame[at] ?? 0;
    bytes.push(...frame.subarray(at + 1, at + code));
    at += code;
    if (code < 255 && at < frame.length - 1) {
      bytes.push(0);
    }
  }
  return Uint8Array.from(bytes);
}

/** CRC-32/ISO-HDLC, bit by bit. */
export function crc32(bytes: Uint8Array): number {
  let crc = ~0;
  for (const byte of bytes) {
    crc ^= byte;
    for (let bit = 0; bit < 8; bit++) {
      crc = (crc >>> 1) ^ (crc & 1 ? 0xedb88320 : 0);
    }
  }
  return ~crc >>> 0;
}
