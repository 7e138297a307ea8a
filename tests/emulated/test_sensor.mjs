/**
 * An image for the MS5837-30BA: boots, reads the PROMs of such sensors and streams the figures of their datasheet's
 * worked example (10/2015, page 7; rev. C2 of 12/2019, page 11).
 *
 * usage: test_sensor.mjs FOLDER_WITH_IMAGE FINGERTIP COMMAND_FRAME
 */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { compensate, crc4, findSensor } from '../../host_tools/simulation/emulator/board/ms5840.mjs';
import { parseScenario } from '../../host_tools/simulation/emulator/scenario.mjs';
import { HEADER } from './harness/bench.mjs';
import { ImageBench } from './harness/image_bench.mjs';

const [images, fingertip, command_frame] = process.argv.slice(2);
const SENSOR = 'ms5837_30ba';
const EXAMPLE = [0x1a << 5, 34982, 36352, 20328, 22354, 26646, 26146];
const [D1, D2] = [4958179, 6815414];
const [PRESSURE_mbar, TEMPERATURE_cC] = [3999.8, 1981];
const WORDS = [...EXAMPLE];
WORDS[0] |= crc4(EXAMPLE) << 12;

/** All sensors are the example's part, at its pressure and temperature, without noise. */
function bench() {
  const { pressure_Pa, temperature_cdegC } = compensate(WORDS, D1, D2, findSensor(SENSOR));
  const scenario = parseScenario(`# fingertip-scenario 1\n# ambient_Pa: ${pressure_Pa}\n# temperature_degC: ${temperature_cdegC / 100}\n${HEADER}\n0${',0'.repeat(22)}\n`, 'example.csv');
  const transfers = [];
  const it = new ImageBench(images, { fingertip, command_frame }, 'pico_parallel', { scenario, sensor: SENSOR, onBusTransfer: (transfer) => transfers.push(transfer) });
  for (const sensor of it.machine.board.sensors) {
    sensor.prom = WORDS;
    sensor.prng = { normal: () => 0, range: () => 0 };
  }
  return { it, transfers };
}

/** Rows of the recording, by column. */
function rowsOf(lines) {
  const table = lines.filter((line) => !line.startsWith('#')).map((line) => line.split(','));
  return table.slice(1).map((values) => Object.fromEntries(values.map((value, i) => [table[0][i], value])));
}

test("the datasheet's example comes out of the image", () => {
  const { it, transfers } = bench();
  it.stream();
  it.run(300);
  const codes = new Set(transfers.filter(({ read, bytes }) => read && bytes.length === 3).map(({ bytes }) => (bytes[0] << 16) | (bytes[1] << 8) | bytes[2]));
  assert.deepEqual([...codes].sort(), [D1, D2], 'the sensors answer with the codes of the example');
  const rows = rowsOf(it.recording());
  assert.ok(rows.length > 50, `${rows.length} rows`);
  const last = rows.at(-1);
  assert.deepEqual([last.valid, last.saturated, last.doubtful], [String(2 ** 15 - 1), '0', '0']);
  assert.equal(Math.round(100 * last.temperature_degC), TEMPERATURE_cC);
  let wrong = 0;
  for (const row of rows) for (let k = 0; k < 15; k++) wrong += Math.floor(row[`s${k}_Pa`] / 10) / 10 !== PRESSURE_mbar;
  assert.equal(wrong, 0, `of ${15 * rows.length} pressures`);
  it.end();
});
