/**
 * Power cuts in short, and that a wrong value, one that does not last and a failed start are found.
 *
 * usage: test_power_cuts.mjs BUILD_OF_IMAGES FINGERTIP COMMAND_FRAME
 *        test_power_cuts.mjs BUILD_OF_IMAGES FINGERTIP COMMAND_FRAME BOARD KIND STEP_us      prints the figures of one kind as JSON
 */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { powerCuts, verdict } from './harness/power_cuts.mjs';

const [images, fingertip, command_frame, board = 'pico_mux', kind, step_us] = process.argv.slice(2);
const bench = { images, tools: { fingertip, command_frame }, board };

if (kind) {
  process.stdout.write(`${JSON.stringify(powerCuts(bench, [kind], Number(step_us))[kind])}\n`);
} else {
  test('whatever is cut it starts again and holds the old or the new', (t) => {
    const coarse = powerCuts(bench, ['erase', 'mend', 'reset'], 9700);
    const found = { ...coarse, ...powerCuts(bench, ['write'], 400) };
    for (const [each, { cuts, not_started, wrong_values, brought, what }] of Object.entries(found)) {
      t.diagnostic(`${each}: ${cuts} cuts, ${brought} brought the new`);
      assert.deepEqual([not_started, wrong_values, what], [0, 0, []], each);
      assert.ok(cuts >= 1, `${each}: ${cuts}`);
    }
  });

  test('what is wrong is found', () => {
    const good = { osr: 512, stored: 2, present: 0x7fff, prom_bad: 0, complete: 9 };
    const with_ = (change) => verdict(good, { ...good, ...change });
    assert.deepEqual([with_({}), verdict({ ...good, osr: 2048 }, { ...good, osr: 2048 })], ['kept', 'brought']);
    assert.deepEqual([{ osr: 1024 }, { osr: 2048 }, { stored: 8 }].map(with_), Array(3).fill('wrong_values'));
    assert.deepEqual([{ present: 0x7ffe }, { complete: 0 }, { prom_bad: 1 }].map(with_), Array(3).fill('not_started'));
  });
}
