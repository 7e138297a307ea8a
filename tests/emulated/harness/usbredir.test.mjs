/** The usbredir server against the protocol's sizes and a scripted virtual machine. */
import assert from 'node:assert/strict';
import { once } from 'node:events';
import { existsSync, mkdtempSync, rmSync } from 'node:fs';
import { connect } from 'node:net';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, test } from 'node:test';
import * as usbredir from '../../../host_tools/simulation/emulator/usb/usbredir.mjs';
import { makeMachine } from './bench.mjs';

const { encodeHello, encodeMessage, MessageReader, UsbRedirServer } = usbredir;
const folder = mkdtempSync(join(tmpdir(), 'usbredir-'));
after(() => rmSync(folder, { recursive: true }));

const DEVICE = {
  device: Uint8Array.of(18, 1, 0, 2, 0xef, 2, 1, 64, 9, 0x12, 1, 0, 0x34, 0x12, 1, 2, 3, 1),
  vendor: 0x1209,
  product: 1,
  interfaces: [
    { number: 0, class: 2, subclass: 2, protocol: 0 },
    { number: 1, class: 10, subclass: 0, protocol: 0 },
  ],
  endpoints: [
    { address: 0x81, type: 3, maxPacket: 16, interval: 16, interface: 0 },
    { address: 0x02, type: 2, maxPacket: 64, interval: 0, interface: 1 },
    { address: 0x82, type: 2, maxPacket: 64, interval: 0, interface: 1 },
  ],
};

test('messages have the sizes and places of the protocol', () => {
  const hello = encodeHello();
  assert.equal(hello.length, 12 + 68);
  assert.equal(hello.readUInt32LE(12 + 64), 0x76);
  const interfaces = usbredir.encodeInterfaceInfo(DEVICE);
  assert.equal(interfaces.length, 16 + 132);
  assert.deepEqual([...interfaces.subarray(16 + 4 + 32, 16 + 4 + 34)], [2, 10]);
  const endpoints = usbredir.encodeEndpointInfo(DEVICE).subarray(16);
  assert.equal(endpoints.length, 160);
  assert.deepEqual([endpoints[0], endpoints[1], endpoints[2], endpoints[16], endpoints[17], endpoints[18]], [0, 255, 2, 0, 3, 2]);
  assert.equal(endpoints[32 + 17], 16);
  assert.equal(endpoints.readUInt16LE(96 + 2 * 18), 64);
  assert.deepEqual([...usbredir.encodeDeviceConnect(DEVICE).subarray(16)], [1, 0xef, 2, 1, 0x09, 0x12, 1, 0, 0x34, 0x12]);
});

test('a message may come in any pieces; a first message that is no hello is refused', () => {
  const stream = Buffer.concat([encodeHello(), encodeMessage(3, 7n), encodeMessage(101, 2n ** 40n, Buffer.from('abc'))]);
  const seen = [];
  const reader = new MessageReader((type, id, payload) => seen.push([type, id, payload.length]));
  for (const byte of stream) reader.take(Buffer.of(byte));
  assert.deepEqual(seen, [
    [0, 0n, 68],
    [3, 7n, 0],
    [101, 2n ** 40n, 3],
  ]);
  assert.throws(() => new MessageReader(() => {}).take(encodeMessage(3, 7n)));
});

/** Runs `script(vm)` against the echo device of cdc.h behind a server. */
async function session(script) {
  const path = join(folder, 'usb.sock');
  const server = await UsbRedirServer.start(path);
  const packets = [];
  const machine = makeMachine('#include "cdc.h"\nvoid main(void) { start_clocks(); usb_start(); for (;;) usb_poll(); }', {
    makeClient: (parts) => server.attachTo(parts),
    onUsbPacket: (p) => packets.push(p),
  });
  const socket = connect(path);
  await once(socket, 'connect');
  const inbox = [];
  const reader = new MessageReader((type, id, payload) => inbox.push({ type, id, payload: Buffer.from(payload) }));
  socket.on('data', (bytes) => reader.take(bytes));
  const hello = encodeHello();
  hello.writeUInt32LE(0xff, 12 + 64);
  const vm = {
    machine,
    packets,
    server,
    socket,
    send: (type, id, payload) => socket.write(encodeMessage(type, id, payload)),
    setup: (id, hex, data = Buffer.alloc(0)) => {
      const s = Buffer.from(hex, 'hex');
      vm.send(100, id, Buffer.concat([Buffer.of(s[0] & 0x80, s[1], s[0], 0xaa), s.subarray(2), data]));
    },
    bulk: (id, address, length, data = Buffer.alloc(0)) => {
      const head = Buffer.alloc(10);
      head[0] = address;
      head.writeUInt16LE(length, 2);
      vm.send(101, id, Buffer.concat([head, data]));
    },
    /** The next message; the device runs meanwhile, at most a second. */
    next: async () => {
      const end_ns = machine.time.nanos + 1e9;
      while (!inbox.length && machine.time.nanos < end_ns) {
        if (!machine.run(machine.time.nanos + 1e6)) break;
        await new Promise((resolve) => setImmediate(resolve));
      }
      assert.ok(inbox.length, `no message; ${machine.endReason ?? ''} ${machine.result.warnings}`);
      return inbox.shift();
    },
    expect: async (type, id) => {
      const message = await vm.next();
      assert.deepEqual([message.type, message.id], [type, id]);
      return message.payload;
    },
    quiet: async () => {
      for (let i = 0; i < 50; i++) {
        machine.run(machine.time.nanos + 1e6);
        await new Promise((resolve) => setImmediate(resolve));
      }
      assert.deepEqual(inbox, []);
    },
  };
  try {
    await vm.expect(0, 0n);
    socket.write(hello);
    for (const type of [4, 5, 1]) await vm.expect(type, 0n);
    await script(vm);
    assert.deepEqual(machine.result.warnings, []);
  } finally {
    socket.destroy();
    await server.stop();
  }
  assert.ok(!existsSync(path));
}

test('a device connects once it is enumerated; requests, data and stalls go through', () =>
  session(async (vm) => {
    vm.setup(1n, '8006000100001200');
    const device = await vm.expect(100, 1n);
    assert.deepEqual([device[3], device.readUInt16LE(8), device.length], [0, 18, 28]);
    vm.setup(2n, '8006000600000a00');
    const qualifier = await vm.expect(100, 2n);
    assert.deepEqual([qualifier[3], qualifier.readUInt16LE(8), qualifier.length], [4, 0, 10]);
    vm.setup(4n, '2122030000000000');
    assert.equal((await vm.expect(100, 4n))[3], 0);
    vm.bulk(5n, 0x82, 128);
    vm.bulk(6n, 0x02, 3, Buffer.from('abc'));
    const answers = [await vm.next(), await vm.next()].sort((a, b) => a.payload[0] - b.payload[0]);
    const told = answers.map((a) => `${a.id} ${a.payload[1]} ${a.payload.readUInt16LE(2)} ${a.payload.subarray(10)}`);
    assert.deepEqual(told, ['6 0 3 ', '5 0 3 abc']);
  }));

test('a cancelled read is answered once and takes no data', () =>
  session(async (vm) => {
    vm.setup(2n, '2122030000000000');
    await vm.expect(100, 2n);
    vm.bulk(3n, 0x82, 128);
    await vm.quiet();
    vm.send(21, 3n);
    assert.equal((await vm.expect(101, 3n))[1], 1);
    vm.send(21, 3n);
    await vm.quiet();
    vm.bulk(4n, 0x82, 128);
    vm.bulk(5n, 0x02, 1, Buffer.from('x'));
    const answers = [await vm.next(), await vm.next()];
    const { payload } = answers.find((a) => a.id === 4n);
    assert.equal(payload.subarray(10).toString(), 'x');
  }));

test('resets that follow each other are one, and the device has an address afterwards', () =>
  session(async (vm) => {
    const { resets } = vm.machine.host.statistics;
    vm.bulk(1n, 0x82, 128);
    vm.send(3, 2n);
    vm.send(3, 3n);
    assert.equal((await vm.expect(101, 1n))[1], 1);
    vm.setup(4n, '8006000100001200');
    assert.equal((await vm.expect(100, 4n))[3], 0);
    assert.equal(vm.machine.host.statistics.resets, resets + 1);
  }));

test('a pulled cable ends every transfer without an answer; pushed in, the device connects again', () =>
  session(async (vm) => {
    vm.bulk(1n, 0x82, 128);
    await vm.quiet();
    vm.server.setPlugged(false);
    await vm.expect(2, 0n);
    vm.setup(2n, '8006000100001200');
    await vm.quiet();
    vm.server.setPlugged(true);
    for (const type of [4, 5, 1]) await vm.expect(type, 0n);
  }));

test('emulated time waits two seconds for a reader that is late, never for what it has asked for', () =>
  session(async (vm) => {
    const { server } = vm;
    vm.setup(2n, '2122030000000000');
    await vm.expect(100, 2n);
    assert.equal(server.waitsForReader(0), false, 'nothing lies ready');
    vm.bulk(3n, 0x02, 3, Buffer.from('abc'));
    await vm.expect(101, 3n);
    await vm.quiet();
    const waits = [10, 2009, 2010, 9000].map((now_ms) => server.waitsForReader(now_ms));
    assert.deepEqual(waits, [true, true, false, false]);
    vm.bulk(4n, 0x82, 128);
    assert.equal((await vm.expect(101, 4n)).subarray(10).toString(), 'abc');
    assert.equal(server.waitsForReader(9001), false, 'it was read');
    vm.bulk(5n, 0x02, 1, Buffer.from('d'));
    await vm.expect(101, 5n);
    await vm.quiet();
    assert.equal(server.waitsForReader(9002), true, 'a reader again, so it gets its time again');
    vm.setup(6n, '8006000100001200');
    while (!server.arrived.length) await new Promise((resolve) => setImmediate(resolve));
    assert.equal(server.waitsForReader(9003), false, 'what the machine asked for comes first');
    await vm.expect(100, 6n);
  }));
