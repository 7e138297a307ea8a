/**
 * Gives the emulated device to a virtual machine: the device's end of the usbredir protocol
 * (https://gitlab.freedesktop.org/spice/usbredir, docs/usb-redirection-protocol.md) as QEMU's usb-redir speaks it.
 *
 *     const server = await UsbRedirServer.start('/tmp/usb.sock');
 *     new Machine({ ..., makeClient: (parts) => server.attachTo(parts) });
 *     server.setPlugged(false);       // pull the cable, and push it in again
 *
 * UsbHost is the bus: it enumerates the device on its own, since the virtual machine's SET_ADDRESS does not come
 * through, and then carries out what comes. The cable is plugged while a virtual machine is connected. Bulk
 * transfers run side by side; resets, control requests and configurations one after another.
 *
 * Not carried by the protocol: frames, suspend and resume.
 */
import { once } from 'node:events';
import { lstatSync, unlinkSync } from 'node:fs';
import { createServer } from 'node:net';
import { InputError, inWords } from '../errors.mjs';
import { setupPacket } from './host.mjs';

const TYPE = {
  hello: 0,
  device_connect: 1,
  device_disconnect: 2,
  reset: 3,
  interface_info: 4,
  ep_info: 5,
  set_configuration: 6,
  get_configuration: 7,
  configuration_status: 8,
  set_alt_setting: 9,
  get_alt_setting: 10,
  alt_setting_status: 11,
  start_interrupt: 15,
  stop_interrupt: 16,
  interrupt_status: 17,
  cancel: 21,
  filter_reject: 22,
  filter_filter: 23,
  device_disconnect_ack: 24,
  control: 100,
  bulk: 101,
  interrupt: 103,
};
const CAP_CONNECT_DEVICE_VERSION = 1 << 1;
const CAP_FILTER = 1 << 2;
const CAP_EP_INFO_MAX_PACKET_SIZE = 1 << 4;
const CAP_64BIT_IDS = 1 << 5;
const CAP_32BIT_BULK_LENGTH = 1 << 6;
/** The last three are what QEMU's xHCI asks for. */
const CAPABILITIES = CAP_CONNECT_DEVICE_VERSION | CAP_FILTER | CAP_EP_INFO_MAX_PACKET_SIZE | CAP_64BIT_IDS | CAP_32BIT_BULK_LENGTH;

const STATUS = { ok: 0, cancelled: 1, invalid: 2, stall: 4 };
const SPEED_FULL = 1;
const UNUSED_ENDPOINT = 255;
const ENDPOINTS = 32;
const VERSION_BYTES = 64;
const READER_GRACE_MS = 2000;
const LARGEST_MESSAGE = 1 << 20;
const CLEAR_FEATURE = 1;

const endpointIndex = (address) => ((address & 0x80) >> 3) | (address & 15);

/** Requests that the protocol has messages for: the request, and the answer but for its status. */
const STANDARD = {
  [TYPE.set_configuration]: {
    setup: ([value]) => setupPacket(0x00, 9, value, 0, 0),
    answer: ([value]) => [TYPE.configuration_status, value],
  },
  [TYPE.get_configuration]: {
    setup: () => setupPacket(0x80, 8, 0, 0, 1),
    answer: (_, data) => [TYPE.configuration_status, data[0] ?? 0],
  },
  [TYPE.set_alt_setting]: {
    setup: ([number, setting]) => setupPacket(0x01, 11, setting, number, 0),
    answer: ([number, setting]) => [TYPE.alt_setting_status, number, setting],
  },
  [TYPE.get_alt_setting]: {
    setup: ([number]) => setupPacket(0x81, 10, 0, number, 1),
    answer: ([number], data) => [TYPE.alt_setting_status, number, data[0] ?? 0],
  },
};

/** A message with the short header of a hello or the long one of everything after. */
export function encodeMessage(type, id, payload = Buffer.alloc(0)) {
  const head = Buffer.alloc(type === TYPE.hello ? 12 : 16);
  head.writeUInt32LE(type, 0);
  head.writeUInt32LE(payload.length, 4);
  if (type === TYPE.hello) head.writeUInt32LE(Number(id), 8);
  else head.writeBigUInt64LE(BigInt(id), 8);
  return Buffer.concat([head, payload]);
}

export function encodeHello() {
  const payload = Buffer.alloc(VERSION_BYTES + 4);
  payload.write('fingertip emulator', 'latin1');
  payload.writeUInt32LE(CAPABILITIES, VERSION_BYTES);
  return encodeMessage(TYPE.hello, 0, payload);
}

export function encodeInterfaceInfo({ interfaces }) {
  const payload = Buffer.alloc(4 + 4 * ENDPOINTS);
  payload.writeUInt32LE(interfaces.length, 0);
  interfaces.forEach((it, i) => {
    [it.number, it.class, it.subclass, it.protocol].forEach((value, row) => payload.writeUInt8(value, 4 + row * ENDPOINTS + i));
  });
  return encodeMessage(TYPE.interface_info, 0, payload);
}

export function encodeEndpointInfo({ endpoints }) {
  const payload = Buffer.alloc(5 * ENDPOINTS);
  payload.fill(UNUSED_ENDPOINT, 0, ENDPOINTS);
  const put = (index, type, interval, number, maxPacket) => {
    payload[index] = type;
    payload[ENDPOINTS + index] = interval;
    payload[2 * ENDPOINTS + index] = number;
    payload.writeUInt16LE(maxPacket, 3 * ENDPOINTS + 2 * index);
  };
  put(endpointIndex(0), 0, 0, 0, 64);
  put(endpointIndex(0x80), 0, 0, 0, 64);
  for (const e of endpoints) put(endpointIndex(e.address), e.type, e.interval, e.interface, e.maxPacket);
  return encodeMessage(TYPE.ep_info, 0, payload);
}

export function encodeDeviceConnect({ device, vendor, product }) {
  const payload = Buffer.alloc(10);
  payload[0] = SPEED_FULL;
  payload.set(device.subarray(4, 7), 1);
  payload.writeUInt16LE(vendor, 4);
  payload.writeUInt16LE(product, 6);
  payload.set(device.subarray(12, 14), 8);
  return encodeMessage(TYPE.device_connect, 0, payload);
}

/** Cuts a byte stream into messages; the first is a hello. */
export class MessageReader {
  constructor(onMessage) {
    this.onMessage = onMessage;
    this.bytes = Buffer.alloc(0);
    this.first = true;
  }

  take(bytes) {
    this.bytes = Buffer.concat([this.bytes, bytes]);
    for (;;) {
      const head = this.first ? 12 : 16;
      if (this.bytes.length < head) return;
      const type = this.bytes.readUInt32LE(0);
      const length = this.bytes.readUInt32LE(4);
      if (length > LARGEST_MESSAGE || this.first !== (type === TYPE.hello)) throw new Error(`message of type ${type} and ${length} bytes`);
      if (this.bytes.length < head + length) return;
      const id = this.first ? 0n : this.bytes.readBigUInt64LE(8);
      const payload = this.bytes.subarray(head, head + length);
      this.bytes = this.bytes.subarray(head + length);
      this.first = false;
      this.onMessage(type, id, payload);
    }
  }
}

export class UsbRedirServer {
  /** @param where a path for a Unix socket; one that an emulator left there is replaced */
  static async start(where) {
    const server = new UsbRedirServer(where);
    await server.#listen();
    return server;
  }

  constructor(where) {
    this.where = where;
    this.socket = null;
    this.greeted = false;
    this.cableIn = true;
    this.host = null;
    this.report = null;
    this.stalled = false;
    this.arrived = [];
    this.unasked_ms = null;
    this.#forget();
  }

  async #listen() {
    if (lstatSync(this.where, { throwIfNoEntry: false })?.isSocket()) unlinkSync(this.where);
    this.server = createServer((socket) => this.#accept(socket));
    await new Promise((resolve, reject) => {
      this.server.once('error', (error) => reject(new InputError(`--usbredir ${this.where}: cannot listen (${inWords(error)})`)));
      this.server.listen({ path: this.where }, resolve);
    });
  }

  async stop() {
    this.socket?.destroy();
    await once(this.server.close(), 'close');
  }

  /** For Machine's `makeClient`. */
  attachTo({ host, report }) {
    this.host = host;
    this.report = report;
    host.onConfigured = () => this.#connectDevice();
    host.onDisconnected = () => this.#disconnectDevice();
    // Within emulated time, where a failure of the device ends the run.
    this.arrival = host.scope.createAlarm(() => this.#takeArrived());
    if (this.arrived.length) this.arrival.schedule(0);
    this.#updatePlug();
    return this;
  }

  setPlugged(cableIn) {
    this.cableIn = cableIn;
    this.#updatePlug();
  }

  /** Fault: the host polls bulk IN no more. */
  setStalled(on) {
    this.stalled = on;
    this.#pauseBulkIn();
  }

  /**
   * A packet lies ready that the virtual machine does not ask for. On a busy computer that is for want of processor time, which a real host
   * has: emulated time then waits, two seconds on the wall. After that the host is taken for one that does not read.
   */
  waitsForReader(now_ms) {
    if (!this.connected || !this.host.hasUnasked) {
      this.unasked_ms = null;
      return false;
    }
    this.unasked_ms ??= now_ms;
    return !this.arrived.length && !this.transfers.size && now_ms - this.unasked_ms < READER_GRACE_MS;
  }

  #pauseBulkIn() {
    for (const e of this.host.device?.endpoints ?? []) {
      if (e.type === 2 && e.address & 0x80) this.host.pause(e.address, this.stalled);
    }
  }

  #updatePlug() {
    const plugged = this.cableIn && this.greeted;
    if (!this.host || plugged === this.host.plugged) return;
    if (plugged) this.host.plug();
    else this.host.unplug();
  }

  #forget() {
    this.connected = false;
    this.transfers = new Map();
    this.waiting = [];
    this.busy = null;
    this.untouchedSinceReset = false;
  }

  #connectDevice() {
    const { device } = this.host;
    this.#forget();
    this.connected = true;
    this.#pauseBulkIn();
    this.socket.write(Buffer.concat([encodeInterfaceInfo(device), encodeEndpointInfo(device), encodeDeviceConnect(device)]));
  }

  #disconnectDevice() {
    if (this.connected) this.#send(TYPE.device_disconnect, 0n);
    this.#forget();
  }

  // Socket

  #accept(socket) {
    if (this.socket) {
      socket.destroy();
      return;
    }
    this.socket = socket;
    const reader = new MessageReader((type, id, payload) => this.#receive(type, id, payload));
    socket.setNoDelay(true);
    socket.on('error', () => {});
    socket.on('close', () => {
      this.socket = null;
      this.greeted = false;
      this.#updatePlug();
    });
    socket.on('data', (bytes) => {
      this.arrived.push({ reader, socket, bytes });
      this.arrival?.schedule(0);
    });
    socket.write(encodeHello());
  }

  #takeArrived() {
    for (const { reader, socket, bytes } of this.arrived.splice(0)) {
      if (socket === this.socket) reader.take(bytes);
    }
  }

  #send(type, id, payload) {
    this.socket?.write(encodeMessage(type, id, payload));
  }

  // What the virtual machine asks for

  #receive(type, id, payload) {
    if (type === TYPE.hello) {
      const capabilities = payload.length >= VERSION_BYTES + 4 ? payload.readUInt32LE(VERSION_BYTES) : 0;
      if ((capabilities & CAPABILITIES) !== CAPABILITIES)
        throw new Error(`its capabilities 0x${capabilities.toString(16)} lack some of 0x${CAPABILITIES.toString(16)}`);
      this.greeted = true;
      this.#updatePlug();
      return;
    }
    if (type === TYPE.filter_reject) {
      this.report.warn('usbredir', 'the virtual machine refused the device');
      return;
    }
    if (type === TYPE.filter_filter || type === TYPE.device_disconnect_ack || !this.connected) return;
    const untouched = this.untouchedSinceReset;
    this.untouchedSinceReset = false;
    if (STANDARD[type]) {
      this.#queueStandard(type, id, payload);
      return;
    }
    switch (type) {
      case TYPE.reset:
        // QEMU's xHCI asks twice where a port has one reset.
        this.untouchedSinceReset = true;
        if (!untouched) this.#queue({ start: (done) => this.host.resetDevice(done) });
        return;
      case TYPE.control:
        this.#queueControl(id, payload);
        return;
      case TYPE.bulk:
        this.#bulk(id, payload);
        return;
      case TYPE.start_interrupt:
        this.#startInterrupt(id, payload[0]);
        return;
      case TYPE.stop_interrupt:
        this.host.stopInterrupt(payload[0]);
        this.#send(TYPE.interrupt_status, id, Buffer.of(STATUS.ok, payload[0]));
        return;
      case TYPE.cancel:
        this.#cancel(id);
        return;
      default:
        throw new Error(`message of type ${type} and ${payload.length} bytes`);
    }
  }

  #endpointsOf(interfaceNumber) {
    return this.host.device.endpoints.filter((e) => e.interface === interfaceNumber).map((e) => e.address);
  }

  #endpoint(address) {
    return this.host.device.endpoints.find((e) => e.address === address);
  }

  /** A cable pulled ends the conversation about a transfer. */
  #finish(id, status, answer) {
    this.transfers.delete(id);
    if (status !== 'gone') answer(STATUS[status]);
  }

  // One after another: resets and everything on endpoint 0

  #queue(job) {
    this.waiting.push(job);
    this.#next();
  }

  #next() {
    if (this.busy || !this.waiting.length) return;
    const job = this.waiting.shift();
    this.busy = job;
    job.start(() => {
      if (this.busy !== job) return;
      this.busy = null;
      this.#next();
    });
  }

  #queueStandard(type, id, payload) {
    const { setup, answer } = STANDARD[type];
    this.#queueTransfer(id, setup(payload), null, (code, data) => {
      if (code === STATUS.ok && type === TYPE.set_configuration) this.host.restartToggles();
      if (code === STATUS.ok && type === TYPE.set_alt_setting) this.host.restartToggles(this.#endpointsOf(payload[0]));
      const [status, ...rest] = answer(payload, data);
      this.#send(status, id, Buffer.of(code, ...rest));
    });
  }

  #queueTransfer(id, setup, data, answer) {
    const job = {
      id,
      answer,
      start: (done) => {
        job.transfer = this.host.control(setup, data, (status, got) => {
          this.#finish(id, status, (code) => answer(code, got));
          if (status !== 'gone') done();
        });
      },
    };
    this.transfers.set(id, job);
    this.#queue(job);
  }

  #queueControl(id, payload) {
    const [, request, requestType] = payload;
    const value = payload.readUInt16LE(4);
    const index = payload.readUInt16LE(6);
    const length = payload.readUInt16LE(8);
    const isIn = (requestType & 0x80) !== 0;
    this.#queueTransfer(
      id,
      setupPacket(requestType, request, value, index, length),
      isIn ? null : Buffer.from(payload.subarray(10)),
      (code, got = Buffer.alloc(0)) => {
        const clearsHalt = requestType === 0x02 && request === CLEAR_FEATURE && value === 0;
        if (code === STATUS.ok && clearsHalt && this.#endpoint(index)) this.host.restartToggles([index]);
        const answer = Buffer.from(payload.subarray(0, 10));
        const data = isIn && code === STATUS.ok ? got : Buffer.alloc(0);
        answer[3] = code;
        answer.writeUInt16LE(isIn ? data.length : code === STATUS.ok ? length : 0, 8);
        this.#send(TYPE.control, id, Buffer.concat([answer, data]));
      },
    );
  }

  // Side by side

  #bulk(id, payload) {
    const address = payload[0];
    const length = payload.readUInt16LE(2) + payload.readUInt16LE(8) * 0x10000;
    const isIn = (address & 0x80) !== 0;
    const answer = (code, done, data = Buffer.alloc(0)) => {
      const head = Buffer.from(payload.subarray(0, 10));
      head[1] = code;
      head.writeUInt16LE(done & 0xffff, 2);
      head.writeUInt16LE(done >>> 16, 8);
      this.#send(TYPE.bulk, id, Buffer.concat([head, data]));
    };
    if (this.#endpoint(address)?.type !== 2) {
      answer(STATUS.invalid, 0);
      return;
    }
    const entry = {};
    this.transfers.set(id, entry);
    if (isIn) {
      entry.transfer = this.host.bulkIn(address, length, (status, data) =>
        this.#finish(id, status, (code) => answer(code, data.length, data)),
      );
    } else {
      const data = Buffer.from(payload.subarray(10));
      entry.transfer = this.host.bulkOut(address, data, (status) => this.#finish(id, status, (code) => answer(code, entry.transfer.at)));
    }
  }

  #startInterrupt(id, address) {
    const endpoint = this.#endpoint(address);
    const possible = endpoint?.type === 3 && (address & 0x80) !== 0;
    if (possible) {
      this.host.pollInterrupt(address, endpoint.interval, (data) => {
        const head = Buffer.from([address, STATUS.ok, data.length & 0xff, data.length >> 8]);
        this.#send(TYPE.interrupt, 0n, Buffer.concat([head, data]));
      });
    }
    this.#send(TYPE.interrupt_status, id, Buffer.of(possible ? STATUS.ok : STATUS.invalid, address));
  }

  #cancel(id) {
    const entry = this.transfers.get(id);
    if (!entry) return;
    if (entry.transfer) {
      this.host.cancel(entry.transfer);
      return;
    }
    this.waiting = this.waiting.filter((job) => job !== entry);
    this.#finish(id, 'cancelled', entry.answer);
  }
}
