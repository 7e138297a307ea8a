/** The page's library, loaded before the tests that import this. */
import { readFileSync } from 'node:fs';
import * as core from '../../../host_tools/web/src/core';
import type { DevicePacket } from '../../../host_tools/web/src/line/line_facts';

await core.loadCore(readFileSync(process.env['FINGERTIP_CORE'] ?? ''));

/** The packet of a frame, as a decoder hands it out; null: it is none. */
export function decoded(frame: Uint8Array): DevicePacket | null {
  let found: DevicePacket | null = null;
  new core.Decoder().feed(Uint8Array.of(0, ...frame), (packet) => (found = packet));
  return found;
}

export { core };
