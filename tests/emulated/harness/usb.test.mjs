/** The USB host against a small CDC device, and the device mistakes it must catch. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { scheduleHostScript } from '../../../host_tools/simulation/emulator/port/host_script.mjs';
import { makeMachine } from './bench.mjs';

const device = (defines = '', body = '') =>
  `${defines}\n#include "cdc.h"\nvoid main(void) { start_clocks(); usb_start(); ${body} for (;;) usb_poll(); }`;

function session(source, steps, seconds, { onArrival = () => {}, ...options } = {}) {
  const bytes = [];
  const packets = [];
  const onData = (b) => {
    bytes.push(...b);
    onArrival(machine.time.nanos, bytes.length);
  };
  const machine = makeMachine(source, { onData, onUsbPacket: (p) => packets.push(p), ...options });
  scheduleHostScript(steps, machine.scope, machine.client);
  machine.run(seconds * 1e9);
  return { machine, bytes, packets, result: machine.result };
}

test('enumeration as Linux does it, then echo', () => {
  const steps = [
    { t_s: 0.2, dtr: true },
    { t_s: 0.3, bytes: Uint8Array.of(1, 2, 3) },
  ];
  const { bytes, packets, result } = session(device(), steps, 0.4);
  assert.deepEqual(result.warnings, []);
  assert.deepEqual(bytes, [1, 2, 3]);
  assert.equal(result.usb.resets, 2);
  assert.deepEqual(result.usb.strings, { product: 'Pr', manufacturer: 'Mf', serial: 'S1' });
  const setups = packets.filter((p) => p.setup).map((p) => Buffer.from(p.data).toString('hex'));
  const descriptors = '8006000100004000 0005050000000000 8006000100001200 8006000600000a00 8006000200000900 8006000200004300';
  const strings = '800600030000ff00 800602030904ff00 800601030904ff00 800603030904ff00';
  assert.equal(setups.join(' '), `${descriptors} ${strings} 0009010000000000 2120000000000700 2122030000000000`);
});

test('realistic waits: the first request comes 160 ms after the pull-up', () => {
  const { packets } = session(device(), [], 0.3, { fastEnumeration: false });
  assert.ok(packets[0].t_ns > 159e6 && packets[0].t_ns < 165e6, `${packets[0].t_ns}`);
});

test('baud rate and DTR reach the device; a closed port is not read', () => {
  const steps = [
    { t_s: 0.2, dtr: true },
    { t_s: 0.3, dtr: false },
    { t_s: 0.31, baud: 1200 },
  ];
  const { machine, bytes } = session(device('#define STREAM'), steps, 0.5);
  const n = bytes.length;
  assert.ok(n > 1000);
  assertCounts(bytes);
  assert.equal(machine.client.baud, 1200);
  machine.run(0.6e9);
  assert.equal(bytes.length, n);
});

test('full speed carries at most 19 packets of 64 bytes in a frame', () => {
  const { packets } = session(device('#define STREAM'), [{ t_s: 0.1, dtr: true }], 0.3);
  const perFrame = new Map();
  for (const p of packets)
    if (p.endpoint === 2 && p.isIn) perFrame.set(Math.floor(p.t_ns / 1e6), (perFrame.get(Math.floor(p.t_ns / 1e6)) ?? 0) + 1);
  assert.ok(Math.max(...perFrame.values()) <= 20, `${Math.max(...perFrame.values())}`);
  const total = [...perFrame.values()].reduce((a, n) => a + n, 0);
  assert.ok(total / perFrame.size <= 19 && total / perFrame.size > 5);
});

/** Fails unless `bytes` count up modulo 256 from `first`. */
function assertCounts(bytes, first = 0) {
  const wrong = bytes.findIndex((b, i) => b !== ((first + i) & 255));
  assert.equal(wrong, -1, `byte ${wrong} is ${bytes[wrong]}`);
}

/** What `seconds` of the stream device give; `pauseAt` is the number of bytes before the longest time without any. */
function streamThrough(faults, seconds) {
  const arrivals = [];
  const { bytes, packets, result } = session(device('#define STREAM'), [{ t_s: 0.1, dtr: true }], seconds, {
    faults,
    onArrival: (t_ns, total) => arrivals.push({ t_ns, total }),
  });
  const waits_ns = arrivals.slice(1).map(({ t_ns }, i) => t_ns - arrivals[i].t_ns);
  return { bytes, packets, result, pauseAt: arrivals[waits_ns.indexOf(Math.max(...waits_ns))].total };
}

for (const [name, from_s, to_s] of [
  ['in mid-stream', 0.2, 0.3],
  ['from before the port opens', 0.05, 0.2],
]) {
  test(`a host that stalls ${name} stops the stream without losing or repeating a byte`, () => {
    const { bytes, packets, result } = streamThrough([{ type: 'host_stall', from_s, to_s }], 0.4);
    assert.deepEqual(result.warnings, []);
    assertCounts(bytes);
    const taken = (begin_s, end_s) =>
      packets.filter((p) => p.endpoint === 2 && p.isIn && p.t_ns > begin_s * 1e9 && p.t_ns < end_s * 1e9).length;
    assert.equal(taken(from_s + 1e-4, to_s), 0, 'no packet was taken in between');
    assert.ok(taken(to_s, 0.4) > 100, 'the stream went on');
    assert.ok(result.usb.in_bytes - bytes.length <= 64, 'all but a read under way was delivered');
  });
}

test('unplug and replug enumerate again; the stream goes on, short of the read that was under way', () => {
  const { bytes, result, pauseAt } = streamThrough([{ type: 'usb_unplug', from_s: 0.2, to_s: 0.3 }], 0.5);
  assert.deepEqual(result.warnings, []);
  assert.equal(result.usb.enumerations, 2);
  assert.ok(pauseAt > 10000 && bytes.length - pauseAt > 10000, `${pauseAt} and ${bytes.length - pauseAt} bytes`);
  assertCounts(bytes.slice(0, pauseAt));
  assertCounts(bytes.slice(pauseAt), bytes[pauseAt]);
  assert.ok(result.usb.in_bytes - bytes.length <= 2 * 64, 'the cable cost one packet, the end of the run another');
});

for (const [name, defines, pattern, body] of [
  ['controller without PHY', '#define MUXING 0', /TO_PHY is not set/],
  ['controller without VBUS', '#define POWER 0', /USB_PWR does not report that VBUS/],
  ['EP0 interrupt per buffer off: requests time out or lack an address', '#define PULLUP_BITS (1u << 16)', /no answer|not finished/],
  ['AVAILABLE in the same write', '#define ARM(c, v) (c) = (v) | 1 << 10', /same write as the other fields/],
  [
    'AVAILABLE too soon',
    '#define ARM(c, v) do { volatile uint32_t *q = &(c); uint32_t w = (v), a = w | 1 << 10; __asm volatile("str %1, [%0]\\n str %2, [%0]" :: "l"(q), "l"(w), "l"(a) : "memory"); } while (0)',
    /ns after the other fields/,
  ],
  ['address never set', '#define NO_ADDRESS', /no answer to SETUP .* at address 5/],
  ['endpoints not enabled', '#define NO_ENABLE', /is the endpoint enabled/],
  [
    'wrong data PID',
    '',
    /sent DATA1, expected DATA0/,
    'for (;;) { usb_poll(); if (dtr) { pid_in2 = 1; const uint8_t x = 0; bulk_in(&x, 1); for (;;) usb_poll(); } }',
  ],
  ['buffer not aligned', '', /not 64-byte aligned/, 'REG(0x50100010) = 1u << 31 | 2 << 26 | 0x1e8;'],
  ['buffer taken back from the controller', '', /owns the buffer/, 'for (;;) { usb_poll(); if (dtr) { OUT_CTL(2) = 0; } }'],
]) {
  test(`fails: ${name}`, () => {
    const { result } = session(device(defines, body), [{ t_s: 0.1, dtr: true }], 6);
    assert.equal(result.end_reason, 'failure', JSON.stringify(result.warnings));
    assert.match(result.warnings.join('\n'), pattern);
  });
}

test('fails: no pull-up leaves the device unseen', () => {
  const { result } = session(device('#define PULLUP_BITS 0'), [], 0.3);
  assert.equal(result.usb.configured, false);
});

for (const [name, pattern, body, faults] of [
  ['an abort', /erratum E2/, 'REG(0x50110060) = 1;', []],
  ['a busy hub', /no answer to SETUP/, '', [{ type: 'usb_busy_hub', from_s: 0 }]],
]) {
  test(`fails: ${name} before revision B2`, () => {
    const { result } = session(device('', body), [], 0.3, { revision: 1, faults });
    assert.match(result.warnings.join('\n'), pattern);
  });
}
