/**
 * The worked example of the MS5837-30BA's datasheet (10/2015, page 7; rev. C2 of 12/2019, page 11) on an image for that
 * sensor: all sensors are the example's part, at its pressure and temperature, with hardly any noise: none repeats itself for long.
 */
import { compensate, crc4, findSensor } from '../../../host_tools/simulation/emulator/board/ms5840.mjs';
import { parseScenario } from '../../../host_tools/simulation/emulator/scenario.mjs';
import { HEADER } from './bench.mjs';
import { ImageBench } from './image_bench.mjs';

const SENSOR = 'ms5837_30ba';
const EXAMPLE = [0x1a << 5, 34982, 36352, 20328, 22354, 26646, 26146];
const WORDS = [...EXAMPLE];
WORDS[0] |= crc4(EXAMPLE) << 12;
export const [D1, D2] = [4958179, 6815414];
export const [PRESSURE_mbar, TEMPERATURE_cC] = [3999.8, 1981];

/** What 0.3 s of it bring: the codes on the bus, the rows of the recording, and how many pressures and temperatures are not the example's. */
export function streamExample(images, tools) {
  const { pressure_Pa, temperature_cdegC } = compensate(WORDS, D1, D2, findSensor(SENSOR));
  const scenario = parseScenario(
    `# fingertip-scenario 1\n# ambient_Pa: ${pressure_Pa}\n# temperature_degC: ${temperature_cdegC / 100}\n${HEADER}\n0${',0'.repeat(22)}\n`,
    'example.csv',
  );
  const transfers = [];
  const bench = new ImageBench(images, tools, 'pico_parallel', {
    scenario,
    sensor: SENSOR,
    onBusTransfer: (transfer) => transfers.push(transfer),
  });
  for (const sensor of bench.machine.board.sensors) {
    sensor.prom = WORDS;
    let drawn = 0;
    sensor.prng = { normal: () => (drawn++ % 2) / 70, range: () => 0 };
  }
  bench.stream();
  bench.run(300);
  const codes = new Set(
    transfers.filter(({ read, bytes }) => read && bytes.length === 3).map(({ bytes }) => (bytes[0] << 16) | (bytes[1] << 8) | bytes[2]),
  );
  const rows = bench.rows();
  let wrong = 0;
  for (const row of rows) {
    wrong += Math.round(100 * row.temperature_degC) === TEMPERATURE_cC ? 0 : 1;
    for (let k = 0; k < 15; k++) wrong += Math.floor(row[`s${k}_Pa`] / 10) / 10 === PRESSURE_mbar ? 0 : 1;
  }
  bench.end();
  return { codes: [...codes].sort(), rows, wrong };
}
