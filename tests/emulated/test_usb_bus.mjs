/**
 * The release image on the bus: closed in mid-packet; suspend, resume, and a reset instead of a resume.
 *
 * usage: test_usb_bus.mjs BUILD_OF_IMAGES FINGERTIP COMMAND_FRAME
 */
import assert from 'node:assert/strict';
import { setupPacket } from '../../host_tools/simulation/emulator/usb/host.mjs';
import { ImageBench } from './harness/image_bench.mjs';

const [images, fingertip, command_frame] = process.argv.slice(2);
const LINE_CODING_115200 = '00c20100000008';

const arrivals_ns = [];
const bench = new ImageBench(images, { fingertip, command_frame }, 'pico_mux', { onUsbPacket: (p) => arrivals_ns.push(p.t_ns) });
const { machine } = bench;
const { host, client } = machine;
const streams = bench.encoded('stream', 'contact,raw');
const run = (seconds) => bench.run(1000 * seconds);
const count = () => bench.bytes;
const control = (packet) => {
  let answer = null;
  host.control(packet, null, (status, data) => {
    answer = { status, data: Buffer.from(data).toString('hex') };
  });
  run(0.02);
  return answer;
};

// A packet under way may be cut where the port closes or the bus falls asleep, nowhere else.
let cuts = 0;
const close = () => {
  cuts++;
  return control(setupPacket(0x21, 0x22, 0, 0, 0));
};
const suspend = () => {
  cuts++;
  host.suspend();
};

const streamFor = (seconds) => {
  const before = count();
  client.write(streams);
  run(seconds);
  assert.ok(count() > before + seconds * 20000, `${count() - before} bytes in ${seconds} s`);
};

run(0.4);
assert.ok(host.configured);
streamFor(0.5);

// DTR dropped while packets are on the bus, at sixty moments of the stream: the toggle stays in step.
for (let i = 0; i < 60; i++) {
  assert.equal(close().status, 'ok');
  assert.equal(control(setupPacket(0x21, 0x22, 3, 0, 0)).status, 'ok');
  const from = count();
  client.write(streams);
  run(0.03 + i * 13e-6);
  assert.ok(count() > from, `nothing after closing ${i}`);
}

// Asleep and awake in mid-stream: silence, then the same configuration, and the stream when it is asked for again.
suspend();
const asleep_ns = machine.time.nanos;
run(0.5);
assert.ok(
  arrivals_ns.every((t_ns) => t_ns < asleep_ns + 1e6),
  'a packet on a suspended bus',
);
host.resume();
const before = count();
run(0.1);
assert.equal(count(), before, 'streams end with a suspend');
assert.deepEqual(control(setupPacket(0x80, 8, 0, 0, 1)), { status: 'ok', data: '01' });
streamFor(0.5);

// Three times in a row, the last too short for the device to notice.
for (const seconds of [0.01, 0.3, 0.002]) {
  suspend();
  run(seconds);
  host.resume();
  run(0.05);
}
streamFor(0.3);

// A host that lost its power over the night resets the device instead.
suspend();
run(0.2);
let addressed = false;
host.resetDevice(() => {
  addressed = true;
});
run(0.1);
assert.ok(addressed);
assert.deepEqual(control(setupPacket(0x00, 9, 1, 0, 0)), { status: 'ok', data: '' });
host.restartToggles();
assert.deepEqual(control(setupPacket(0xa1, 0x21, 0, 0, 7)), { status: 'ok', data: LINE_CODING_115200 });
client.setDtr(false);
run(0.02);
client.setDtr(true);
streamFor(0.3);

// Pulled while it sleeps.
suspend();
run(0.1);
host.unplug();
run(0.1);
host.plug();
run(0.2);
assert.ok(host.configured);
streamFor(0.3);

assert.deepEqual(machine.result.warnings, []);
assert.equal(machine.result.reboots, 0);
const end = bench.recording().at(-1);
process.stdout.write(`${end}\n`);
const [, crc, format] = /crc_errors=(\d+) format_errors=(\d+)/.exec(end);
assert.ok(Number(crc) + Number(format) <= cuts, `${cuts} cuts, yet ${end}`);
