// The simulated fingertip as the page's worker runs it, on a clock of its own.
// usage: node scene.mjs simulated.wasm objects.bin COMMANDS OUTPUT.ftr
// COMMANDS: of fingertip_player --commands. Prints JSON: what was seen on the way.
import fs from 'node:fs';
import { RealTime } from '../../../host_tools/web/wasm/real_time.mjs';

const [wasm, objects, commands, output] = process.argv.slice(2);
const module = new WebAssembly.Module(fs.readFileSync(wasm));
const file = new Uint8Array(fs.readFileSync(objects));
const seen = { left: [], errors: [], truths: [], bytes_closed: 0 };
let now_ms = 5000;
let parts = [];
let truth = null;

function made(options, bytes = file) {
  const on_bytes = (received, newest) => {
    parts.push(received);
    truth = newest;
  };
  return new RealTime({ module, objects: bytes, options, clock: () => now_ms, on_bytes, on_left: (why) => seen.left.push(why) });
}

const fingertip = made({ errors: 'none', parallelBus: true, serial: '00000000C0FFEE00' });
// A page that is busy now and then.
function run(seconds, tick_ms = 4) {
  for (const end_ms = now_ms + 1000 * seconds; now_ms < end_ms; now_ms += tick_ms) {
    fingertip.tick();
  }
}
function note(name) {
  seen.truths.push({ name, ...truth });
}

// Nothing is told before it is opened.
run(0.1);
await fingertip.open();
fingertip.send(new Uint8Array(fs.readFileSync(commands)));
run(1.5);
fingertip.act('press', 2, -3, 6);
run(1);
note('press');
for (let i = 0; i < 100; i++) {
  fingertip.act('press', 2, -3 + 0.04 * i, 6);
  run(0.01, 10);
}
note('drag');
fingertip.act('lift');
run(1, 40);
note('lift');
fingertip.act('hold', 0, 0, 6, 2, 90);
run(1);
note('hold');
fingertip.act('lift');
run(0.6);
fingertip.act('choose', 5);
fingertip.act('drop', -2, 5, 300);
run(2);
note('drop');
fs.writeFileSync(output, Buffer.concat(parts));

// The computer slept: it goes on from where it was.
const before_us = truth.t_us;
now_ms += 60e3;
run(0.2);
seen.after_sleep_s = 1e-6 * (truth.t_us - before_us);

fingertip.close();
parts = [];
run(0.5);
seen.bytes_closed = parts.length;

// To its loader and back: it knows its pad still.
await fingertip.open();
fingertip.send(new Uint8Array(fs.readFileSync(`${commands}.loader`)));
run(0.5);
parts = [];
await fingertip.open();
fingertip.send(new Uint8Array(fs.readFileSync(commands)));
run(0.5);
fs.writeFileSync(`${output}.again`, Buffer.concat(parts));

for (const [options, bytes] of [
  [{ errors: 'rust=3' }, file],
  [{ errors: 'gain=1e9' }, file],
  [{}, file.subarray(0, 1000)],
]) {
  try {
    await made(options, bytes).open();
  } catch (error) {
    seen.errors.push(error.message);
  }
}
console.log(JSON.stringify(seen));
