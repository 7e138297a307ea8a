/** Firmware images: UF2 (https://github.com/microsoft/uf2) for the RP2040's boot ROM, as
 * cmake/bin2uf2.py writes them. */

import { core } from '../core';

export interface Image {
  name: string;
  bytes: Uint8Array<ArrayBuffer>;
  /** What the build marked in it. */
  board: string;
  version: string;
  git_hash: string;
}

const BLOCK_bytes = 512;
const DATA_AT = 32;
const PAGE_bytes = 256;
const FLASH_BASE = 0x10000000;
/** "CRC ": behind the page of each block, before the CRC-32 of all pages. */
const CHECKSUM_MARK = 0x43524320;
const MAGIC = [0x0a324655, 0x9e5d5157, 0x0ab16f30];
const FAMILY_RP2040 = 0xe48bff56;
const FLAG_FAMILY = 0x2000;

/** Throws Error, a sentence, unless it is a whole firmware of a fingertip for the RP2040. */
export function readImage(name: string, bytes: Uint8Array<ArrayBuffer>): Image {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.length);
  const count = bytes.length / BLOCK_bytes;
  if (bytes.length === 0 || !Number.isInteger(count) || view.getUint32(0, true) !== MAGIC[0]) {
    throw new Error(`${name} is no whole UF2 file: choose fingertip-BOARD.uf2 of the build`);
  }
  const flash = new Uint8Array(count * PAGE_bytes);
  for (let k = 0; k < count; k++) {
    const at = k * BLOCK_bytes;
    const word = (offset: number): number => view.getUint32(at + offset, true);
    if (
      word(0) !== MAGIC[0] ||
      word(4) !== MAGIC[1] ||
      word(BLOCK_bytes - 4) !== MAGIC[2] ||
      word(12) !== FLASH_BASE + k * PAGE_bytes ||
      word(16) !== PAGE_bytes ||
      word(20) !== k ||
      word(24) !== count
    ) {
      throw new Error(`${name} is damaged or cut short (block ${k + 1} of ${count}): copy it anew`);
    }
    if (!(word(8) & FLAG_FAMILY) || word(28) !== FAMILY_RP2040) {
      throw new Error(`${name} is for another chip: choose an image for the RP2040`);
    }
    flash.set(bytes.subarray(at + DATA_AT, at + DATA_AT + PAGE_bytes), k * PAGE_bytes);
  }
  const content = new TextDecoder('latin1').decode(flash);
  const marked = (what: string): string =>
    new RegExp(`fingertip-${what}=([!-~]+)`).exec(content)?.[1] ?? '';
  const [board, version, git_hash] = ['board', 'version', 'git'].map(marked) as [string, string, string];
  if (!board || !version || !git_hash) {
    throw new Error(`${name} is no firmware of a fingertip: choose fingertip-BOARD.uf2 of the build`);
  }
  const crc = core.crc32(flash);
  for (let k = 0; k < count; k++) {
    const at = k * BLOCK_bytes + DATA_AT + PAGE_bytes;
    if (view.getUint32(at) !== CHECKSUM_MARK || view.getUint32(at + 4, true) !== crc) {
      throw new Error(`${name} is damaged (its checksum differs): copy it anew`);
    }
  }
  return { name, bytes, board, version, git_hash };
}
