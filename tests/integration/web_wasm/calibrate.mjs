// Calibrates the simulated fingertip as a user of the page does: drops the weight near where it is
// wanted, lifts it, until the judge has enough.
// usage: node calibrate.mjs simulated.wasm objects.bin judges.wasm COMMANDS WEIGHT_g
// COMMANDS: start the stream of pressures. Prints {"text", "drops", "gain"}.
import fs from 'node:fs';
import { Firmware } from '../../../host_tools/web/wasm/firmware.mjs';
import { load } from '../../../host_tools/web/wasm/judges.mjs';

const INFO_BYTES = 200; // longer than any raw packet
const SLICE_us = 5000;
const DROPS_MAX = 40;

const [wasm, objects, judges_wasm, commands, weight_g] = process.argv.slice(2);
const judges = await load(fs.readFileSync(judges_wasm));
const firmware = await Firmware.of(new WebAssembly.Module(fs.readFileSync(wasm)));
firmware.setWorld({ objects: fs.readFileSync(objects), errors: 'gain=10' });
firmware.powerUp({ parallelBus: true });
firmware.open();
firmware.send(fs.readFileSync(commands));

let session = null;
let rest = new Uint8Array(0);
let t_us = 0;
function run(seconds) {
  for (const end_us = t_us + 1e6 * seconds; t_us < end_us; ) {
    t_us += SLICE_us;
    firmware.runUntil(t_us);
    const bytes = Buffer.concat([rest, firmware.receive()]);
    let begin = 0;
    for (let end; (end = bytes.indexOf(0, begin)) >= 0; begin = end + 1) {
      const frame = bytes.subarray(begin, end);
      if (session && frame.length > 0) {
        session.take(frame);
      } else if (frame.length > INFO_BYTES) {
        session = judges.gains(frame);
      }
    }
    rest = bytes.subarray(begin);
  }
}

run(1.5);
let drops = 0;
while (session.status().state === 'more' && drops < DROPS_MAX) {
  const { x_mm, y_mm } = session.status().wanted ?? { x_mm: 0, y_mm: 0 };
  // As well as a hand can.
  firmware.drop(x_mm + 0.5 * ((7 * drops) % 5) - 1, y_mm + 0.6 * ((3 * drops) % 5) - 1.2, Number(weight_g));
  run(2.2);
  firmware.lift();
  run(1);
  drops++;
}
const { text } = session.status();
const { calibration } = session.result(9.80665e-3 * Number(weight_g), 0);
console.log(JSON.stringify({ text, drops, gain: calibration.gain }));
