/**
 * The release images before hosts that are seldom met, and on silicon at its corners.
 *
 * usage: test_odd_hosts.mjs BUILD_OF_IMAGES FINGERTIP COMMAND_FRAME
 */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Storms } from './harness/storms.mjs';

const [images, fingertip, command_frame] = process.argv.slice(2);
const storms = new Storms(images, { fingertip, command_frame });
const BOARDS = ['pico_mux', 'pico_parallel'];

for (const board of BOARDS) {
  test(`${board}: a host that resets twice before it asks for anything`, () => {
    assert.equal(storms.ehciDetaches(board, 2), 0);
  });

  for (const [revision, held_ms] of [
    [1, 920],
    [2, 3000],
  ]) {
    test(`${board}: a reset of the bus that lasts ${held_ms} ms, on revision B${revision}`, () => {
      assert.equal(storms.se0Bites(board, revision, held_ms), 0);
    });
  }

  test(`${board}: what writes to code, constants or vectors ends in a crash record`, () => {
    const { tried, trapped } = storms.codeWrites(board);
    assert.equal(trapped, tried);
  });

  test(`${board}: a suspend that cuts a frame does not cost the first answer after the resume`, () => {
    assert.equal(storms.tornAfterResume(board, 20), 0);
  });

  for (const [rosc_MHz, after_ms, how] of [
    [6.5, 10, 'fault'],
    [12, 10, 'fault'],
    [12, 100, 'fault'],
    [12, 50, 'unfed'],
  ]) {
    test(`${board}: the chip resets itself (${how}) ${after_ms} ms into a slow erase, with a ring oscillator of ${rosc_MHz} MHz`, () => {
      assert.ok(storms.eraseResetRecovered(board, rosc_MHz * 1e6, after_ms, how));
    });
  }

  const revision = board === 'pico_mux' ? 1 : 2;
  test(`${board}: what a host no longer wants is taken back, on revision B${revision}`, () => {
    assert.equal(storms.wrongAfterWithdrawal(board, revision, 60), 0);
  });
}

test('a flash interface that hangs for a moment leaves nothing behind that spoils what is stored later', () => {
  assert.equal(storms.lostAfterStall('pico_mux', 8), 0);
});

test('a PROM that is wrong in spite of its CRC is doubted from the start, and no other', (t) => {
  const { planted, wrong, undoubted, innocent_doubted } = storms.promCollisions('pico_parallel', 5);
  t.diagnostic(`${wrong} of ${planted} wrong`);
  assert.ok(wrong >= 5, `${wrong}`);
  assert.deepEqual([undoubted, innocent_doubted], [0, 0]);
});
