// What fingertip_player does with a scenario, by the firmware in simulated.wasm: the bytes of the
// line.
// usage: node play.mjs simulated.wasm SCENARIO.csv COMMANDS OUTPUT.ftr [objects.bin]
// COMMANDS: those of fingertip_player --commands. With a file of objects its pad is used, 12 mm without
// ends, as by fingertip_player --pad 12. Prints {"seconds", "cpu_s", "bytes"}.
import fs from 'node:fs';
import { Firmware } from './firmware.mjs';

const SLICE_us = 5000; // as of fingertip_player
const TRUTHS = 7; // columns before the sensors, after t_s

/** Rows of a file that fingertip_player has taken: of a right form. */
function rowsOf(path, sensors) {
  const lines = fs.readFileSync(path, 'utf8').split('\n');
  const metadata = new Map();
  let header = null;
  const times_s = [];
  const pressures_Pa = [];
  const temperatures_degC = [];
  for (const raw of lines) {
    const line = raw.trim();
    if (line.startsWith('#')) {
      const colon = line.indexOf(':');
      if (colon > 0 && !header) {
        metadata.set(line.slice(1, colon).trim(), line.slice(colon + 1).trim());
      }
    } else if (line && !header) {
      header = line.split(',').map((name) => name.trim());
    } else if (line) {
      const cells = line.split(',').map(Number);
      times_s.push(cells[0]);
      for (let k = 0; k < sensors; k++) {
        pressures_Pa.push(cells[1 + TRUTHS + k]);
      }
      const at = header.indexOf('temperature_degC');
      temperatures_degC.push(at < 0 ? Number(metadata.get('temperature_degC') ?? 25) : cells[at]);
    }
  }
  return {
    ambient_Pa: Number(metadata.get('ambient_Pa') ?? 101325),
    times_s,
    pressures_Pa,
    temperatures_degC,
  };
}

const [wasm, scenario, commands, output, objects] = process.argv.slice(2);
const firmware = await Firmware.of(new WebAssembly.Module(fs.readFileSync(wasm)));
const rows = rowsOf(scenario, firmware.sensors);
const seconds = rows.times_s.at(-1);
firmware.setRows(rows);
if (objects) {
  firmware.setWorld({ objects: fs.readFileSync(objects) });
  firmware.usePad(firmware.padCommand());
}
firmware.powerUp({});
firmware.open();
const sent = fs.readFileSync(commands);
if (firmware.send(sent) !== sent.length) {
  throw new Error('the firmware does not take its commands');
}
const file = fs.openSync(output, 'w');
const end_us = Math.floor(1e6 * seconds);
const begin = process.cpuUsage();
let bytes = 0;
for (let t_us = SLICE_us; ; t_us += SLICE_us) {
  firmware.runUntil(Math.min(t_us, end_us));
  const received = firmware.receive();
  fs.writeSync(file, received);
  bytes += received.length;
  if (t_us >= end_us) {
    break;
  }
}
fs.closeSync(file);
const { user, system } = process.cpuUsage(begin);
console.log(JSON.stringify({ seconds, cpu_s: 1e-6 * (user + system), bytes }));
