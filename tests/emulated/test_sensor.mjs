/**
 * An image for the MS5837-30BA: boots, reads the PROMs of such sensors and streams the figures of their datasheet's
 * worked example.
 *
 * usage: test_sensor.mjs FOLDER_WITH_IMAGE FINGERTIP COMMAND_FRAME
 */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { D1, D2, streamExample } from './harness/sensor_example.mjs';

const [images, fingertip, command_frame] = process.argv.slice(2);

test("the datasheet's example comes out of the image", () => {
  const { codes, rows, wrong } = streamExample(images, { fingertip, command_frame });
  assert.ok(
    codes.every((code) => Math.min(Math.abs(code - D1), Math.abs(code - D2)) < 4),
    `the codes of the example: ${codes}`,
  );
  assert.ok(rows.length > 50, `${rows.length} rows`);
  const last = rows.at(-1);
  // In the example they rest at 4 bar: no air, so the array is doubtful.
  assert.deepEqual([last.valid, last.saturated, last.doubtful], [2 ** 15 - 1, 0, 2 ** 15 - 1]);
  assert.equal(wrong, 0, `of ${16 * rows.length} figures`);
});
