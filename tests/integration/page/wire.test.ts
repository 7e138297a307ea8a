import assert from 'node:assert/strict';
import test from 'node:test';
import { CoreError } from '../../../host_tools/web/src/core';
import { Flag, PacketType, type Contact } from '../../../host_tools/web/src/line/line_facts';
import { core } from './library';

/* What each vector decodes to is compared with the library and Python in tests/formats. */
test('values that no packet may hold are refused', () => {
  const contact = { ...core.blank(PacketType.CONTACT), type: PacketType.CONTACT, sequence: 0, t_us: 0 };
  assert.throws(() => core.encode({ ...contact, flags: Flag.FIT_VALID, x_mm: NaN } as object as Contact), /x_mm/);
  assert.throws(() => core.encode({ ...contact, frame: 2 ** 32 } as object as Contact), /frame/);
  assert.throws(() => core.encode({ ...contact, type: 0x7f } as object as Contact), CoreError);
  const text = { ...core.blank(PacketType.INFO), type: PacketType.INFO, sensor_count: 1, board: 'longer than sixteen' };
  assert.throws(() => core.encode(text), /board/);
});
