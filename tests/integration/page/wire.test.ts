import assert from 'node:assert/strict';
import test from 'node:test';
import { CoreError } from '../../../host_tools/web/src/core';
import { Flag, PacketType, type Contact } from '../../../host_tools/web/src/line/line_facts';
import { core, decoded } from './library';
import { readVectors, vector } from './vectors';

test('every field of every packet has the value that its vector names', () => {
  let compared = 0;
  for (const each of readVectors()) {
    const fields = decoded(each.frame) as unknown as Record<string, unknown>;
    for (const [name, value] of each.values) {
      if (typeof fields[name] === 'number' && name !== 'sequence') {
        assert.equal(fields[name], value, `${each.name}: ${name}`);
        compared++;
      }
    }
  }
  assert.ok(compared >= 80, `${compared} values`);
});

test('arrays and texts have the values that the vectors name', () => {
  const info = decoded(vector('info_grasp').frame);
  const raw = decoded(vector('raw').frame);
  assert.ok(info?.type === PacketType.INFO && raw?.type === PacketType.RAW);
  assert.equal(info.serial, 'E66058388347A12C');
  assert.equal(info.git_hash, '0123456789ab+');
  assert.deepEqual([...info.gain], [0.875, 1.125]);
  assert.deepEqual([...info.off_y_um], [-125, 2000]);
  assert.deepEqual([...info.x_mm], [-4.5, 4.5]);
  assert.equal(info.pad_edge_force[2], 0.0390625);
  assert.equal(raw.pressure_Pa_q10[0], 100000 * 1024);
  assert.equal(raw.baseline_Pa_q10[2], -(2 ** 31));
});

test('values that no packet may hold are refused', () => {
  const contact = { ...core.blank(PacketType.CONTACT), type: PacketType.CONTACT, sequence: 0, t_us: 0 };
  assert.throws(() => core.encode({ ...contact, flags: Flag.FIT_VALID, x_mm: NaN } as object as Contact), /x_mm/);
  assert.throws(() => core.encode({ ...contact, frame: 2 ** 32 } as object as Contact), /frame/);
  assert.throws(() => core.encode({ ...contact, type: 0x7f } as object as Contact), CoreError);
  const text = { ...core.blank(PacketType.INFO), type: PacketType.INFO, sensor_count: 1, board: 'longer than sixteen' };
  assert.throws(() => core.encode(text), /board/);
});
