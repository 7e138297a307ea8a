/** The page's library, loaded before the tests that import this. */
import { readFileSync } from 'node:fs';
import * as core from '../../../host_tools/web/src/core';
import type { DevicePacket } from '../../../host_tools/web/src/line/line_facts';

await core.loadCore(readFileSync(process.env['FINGERTIP_CORE'] ?? ''));

/** A file of this repository. */
export const source = (path: string): Buffer => readFileSync(`${process.env['FINGERTIP_SOURCE']}/${path}`);

/** The packet of a frame, as a decoder hands it out; null: it is none. */
export function decoded(frame: Uint8Array): DevicePacket | null {
  let found: DevicePacket | null = null;
  new core.Decoder().feed(Uint8Array.of(0, ...frame), (packet) => (found = packet));
  return found;
}

/** That of tests/vectors/wire, assembled by hand from PROTOCOL.md. */
export function vector(name: string): DevicePacket {
  const [, frame] = source(`tests/vectors/wire/${name}.txt`).toString().replace(/#.*/g, '').split('frame');
  return decoded(Uint8Array.from(frame!.trim().split(/\s+/), (byte) => parseInt(byte, 16)))!;
}

export { core };
