// What the simulated fingertip costs at its highest rate, while an object is dragged over the pad.
// usage: node cost.mjs simulated.wasm objects.bin COMMANDS SECONDS
// COMMANDS: sent at first. Prints {"start_ms", "frames_per_s", "cpu_percent", "memory_MB"}: of one core.
import fs from 'node:fs';
import { Firmware } from './firmware.mjs';

const SLICE_us = 5000;

const [wasm, objects, commands, seconds] = process.argv.slice(2);
const bytes = fs.readFileSync(wasm);
const file = fs.readFileSync(objects);
const begin_ms = performance.now();
const firmware = await Firmware.of(await WebAssembly.compile(bytes));
firmware.setWorld({ objects: file, errors: 'gain=10' });
firmware.powerUp({ parallelBus: true });
firmware.open();
firmware.send(firmware.padCommand());
let t_us = 0;
let packets = 0;
function run(span_s) {
  for (const end_us = t_us + 1e6 * span_s; t_us < end_us; ) {
    t_us += SLICE_us;
    firmware.runUntil(t_us);
    for (const byte of firmware.receive()) {
      packets += byte === 0 ? 1 : 0;
    }
  }
}
run(1);
const start_ms = performance.now() - begin_ms;
firmware.send(fs.readFileSync(commands));
run(0.5);

packets = 0;
const before = process.cpuUsage();
const whole_s = Number(seconds);
for (let s = 0; s < whole_s; s += 0.02) {
  firmware.act('press', 6 * Math.sin(s), 12 * Math.cos(0.7 * s), 5 + 3 * Math.sin(2 * s));
  run(0.02);
}
const { user, system } = process.cpuUsage(before);
console.log(
  JSON.stringify({
    start_ms,
    frames_per_s: packets / whole_s,
    cpu_percent: (1e-4 * (user + system)) / whole_s,
    memory_MB: 1e-6 * firmware.wasm.size_bytes(),
  }),
);
