// What fingertip_player does with a scenario, by the firmware in simulated.wasm: the bytes of the line.
// usage: node play.mjs simulated.wasm SCENARIO.csv COMMANDS OUTPUT.ftr [objects.bin]
// COMMANDS: those of fingertip_player --commands. With a file of objects its pad is used, 12 mm without
// ends, as by fingertip_player --pad 12. Prints {"seconds", "cpu_s"}.
import fs from 'node:fs';
import { Firmware, joined } from './firmware.mjs';

const SLICE_us = 5000; // as of fingertip_player
const TRUTHS = 7; // columns before the sensors, after t_s

/** Rows of a file that fingertip_player has taken: of a right form. */
function rowsOf(path, sensors) {
  const text = fs.readFileSync(path, 'utf8');
  const metadata = (name, unless) => Number(new RegExp(`^# *${name} *: *(.*)$`, 'm').exec(text)?.[1] ?? unless);
  const temperature_degC = metadata('temperature_degC', 25);
  const temperature_at = /^t_s.*$/m.exec(text)[0].trim().split(',').indexOf('temperature_degC');
  const table = text.match(/^[0-9.].*$/gm).map((line) => line.split(',').map(Number));
  return {
    ambient_Pa: metadata('ambient_Pa', 101325),
    times_s: table.map(([t_s]) => t_s),
    pressures_Pa: table.flatMap((cells) => cells.slice(1 + TRUTHS, 1 + TRUTHS + sensors)),
    temperatures_degC: table.map((cells) => cells[temperature_at] ?? temperature_degC),
  };
}

const [wasm, scenario, commands, output, objects] = process.argv.slice(2);
const firmware = await Firmware.of(new WebAssembly.Module(fs.readFileSync(wasm)));
const rows = rowsOf(scenario, firmware.sensors);
const seconds = rows.times_s.at(-1);
firmware.setRows(rows);
if (objects) {
  firmware.setWorld({ objects: fs.readFileSync(objects) });
  firmware.usePad();
}
firmware.powerUp({});
firmware.open();
const sent = fs.readFileSync(commands);
if (firmware.send(sent) !== sent.length) {
  throw new Error('the firmware does not take its commands');
}
const received = [];
const end_us = Math.floor(1e6 * seconds);
const begin = process.cpuUsage();
for (let t_us = 0; t_us < end_us; ) {
  t_us = Math.min(t_us + SLICE_us, end_us);
  firmware.runUntil(t_us);
  received.push(firmware.receive());
}
const { user, system } = process.cpuUsage(begin);
fs.writeFileSync(output, joined(received));
console.log(JSON.stringify({ seconds, cpu_s: 1e-6 * (user + system) }));
