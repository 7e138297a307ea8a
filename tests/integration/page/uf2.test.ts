import assert from 'node:assert/strict';
import test from 'node:test';
import { CoreError } from '../../../host_tools/web/src/core';
import { core } from './library';
import { crc32 } from './vectors';

/** Of the second boot stage, as the RP2040's boot ROM has it: RP2040 datasheet 2.8.1.3.1. */
function bootCrc(bytes: Uint8Array): number {
  let crc = ~0;
  for (const byte of bytes) {
    crc ^= byte << 24;
    for (let bit = 0; bit < 8; bit++) {
      crc = (crc << 1) ^ (crc < 0 ? 0x04c11db7 : 0);
    }
  }
  return crc >>> 0;
}

function image(marks: string, family = 0xe48bff56): Uint8Array<ArrayBuffer> {
  const COUNT = 4;
  const flash = new Uint8Array(COUNT * 256);
  flash.set(new TextEncoder().encode(marks), 300);
  new DataView(flash.buffer).setUint32(252, bootCrc(flash.subarray(0, 252)), true);
  const bytes = new Uint8Array(COUNT * 512);
  const view = new DataView(bytes.buffer);
  for (let k = 0; k < COUNT; k++) {
    const words = [0x0a324655, 0x9e5d5157, 0x2000, 0x10000000 + 256 * k, 256, k, COUNT, family];
    words.forEach((word, i) => view.setUint32(512 * k + 4 * i, word, true));
    bytes.set(flash.subarray(256 * k, 256 * k + 256), 512 * k + 32);
    bytes.set(new TextEncoder().encode('CRC '), 512 * k + 288);
    view.setUint32(512 * k + 292, crc32(flash), true);
    view.setUint32(512 * k + 508, 0x0ab16f30, true);
  }
  return bytes;
}
const MARKS = 'x fingertip-board=pico_mux\0 fingertip-version=0.1.0\0fingertip-git=0123456789ab+\0';

test('a firmware image is read with what it is', () => {
  const { board, version, git_hash } = core.firmwareOf('a.uf2', image(MARKS));
  assert.deepEqual([board, version, git_hash], ['pico_mux', '0.1.0', '0123456789ab+']);
});

test('what is none, or damaged, or of another chip is refused with words', () => {
  const good = image(MARKS);
  const with_bit = (at: number): Uint8Array<ArrayBuffer> => good.map((byte, i) => (i === at ? byte ^ 1 : byte));
  for (const [bytes, words] of [
    [new Uint8Array(0), /no UF2 file/],
    [new Uint8Array(512), /no UF2 file/],
    [good.slice(0, 700), /damaged \(block 1: cut off/],
    [good.slice(0, 1024), /numbered 0 of 4/],
    [with_bit(700), /the CRC of the image differs/],
    [with_bit(1024 + 20), /damaged/],
    [image(MARKS, 0x12345678), /another chip/],
    [image('nothing'), /no Fingertip firmware/],
  ] as const) {
    assert.throws(
      () => core.firmwareOf('a.uf2', bytes),
      (error) => error instanceof CoreError && words.test(error.message),
      String(words),
    );
  }
});
