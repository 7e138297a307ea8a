/** What a program tells the sensors of a board while it runs. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { LivePressures } from '../../../host_tools/simulation/emulator/live_pressures.mjs';

const above = (live, sensor, t_ns) => live.at_ns(sensor, t_ns).pressure_Pa - 101325;

test('linear within a slice, held after the last', () => {
  const live = new LivePressures(2, 500);
  assert.equal(above(live, 0, 0), 0);
  assert.equal(above(live, 1, 900), 0);
  live.add([10, 20]);
  assert.equal(above(live, 0, 250), 5);
  assert.equal(above(live, 1, 500), 20);
  assert.equal(above(live, 1, 700), 20);
  live.add([30, -20]);
  assert.equal(above(live, 0, 250), 5);
  assert.equal(above(live, 0, 750), 20);
  assert.equal(above(live, 1, 750), 0);
  assert.equal(above(live, 1, 5000), -20);
});
