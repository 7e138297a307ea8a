/**
 * The Linux cdc_acm driver's part: 9600 8N1 after binding, 16 reads of two packets while the port is open,
 * DTR and RTS on open, bulk OUT in order. A read is delivered when it ends: on a short packet, or with 128 bytes.
 */
import { setupPacket } from './host.mjs';

const READS = 16;
const PACKETS_PER_READ = 2;

export class CdcClient {
  /** @param options host; report; onData(bytes): a finished read */
  constructor({ host, report, onData }) {
    this.host = host;
    this.report = report;
    this.onData = onData;
    this.baud = 9600;
    this.dtr = false;
    this.stalled = false;
    this.blocked = false;
    this.reads = new Set();
    this.writes = [];
    this.bound = null;
    host.onConfigured = (device) => this.#bind(device);
    host.onDisconnected = () => {
      this.bound = null;
      this.reads.clear();
      this.writes = [];
      this.writing = false;
    };
  }

  #bind(device) {
    const communication = device.interfaces.find((i) => i.class === 2 && i.subclass === 2);
    const data = device.interfaces.find((i) => i.class === 10);
    const endpoint = (type, isIn) => device.endpoints.find((e) => e.type === type && ((e.address & 0x80) !== 0) === isIn);
    const [bulkIn, bulkOut, notification] = [endpoint(2, true), endpoint(2, false), endpoint(3, true)];
    if (!communication || !data || !bulkIn || !bulkOut || !notification) {
      this.host.block.rp2040.fail('usb host', 'the device is no CDC ACM device: an interface or endpoint is missing');
    }
    this.bound = { interface: communication.number, bulkIn, bulkOut, notification };
    this.host.pause(bulkIn.address, this.stalled);
    this.#sendLineCoding();
    if (this.dtr) this.#open();
  }

  #request(request, value, data) {
    const packet = setupPacket(0x21, request, value, this.bound.interface, data?.length ?? 0);
    this.host.control(packet, data, (status) => {
      if (status === 'stall') this.report.warn('usb host', `the device stalled CDC request 0x${request.toString(16)}`);
    });
  }

  #sendLineCoding() {
    const b = this.baud;
    this.#request(0x20, 0, Uint8Array.of(b & 0xff, (b >> 8) & 0xff, (b >> 16) & 0xff, b >>> 24, 0, 0, 8));
  }

  setBaud(baud) {
    this.baud = baud;
    if (this.bound) this.#sendLineCoding();
  }

  setDtr(on) {
    if (on === this.dtr) return;
    this.dtr = on;
    if (!this.bound) return;
    if (on) this.#open();
    else {
      this.#request(0x22, 0);
      this.host.stopInterrupt(this.bound.notification.address);
      for (const read of [...this.reads]) this.host.cancel(read);
    }
  }

  #open() {
    this.#request(0x22, 3);
    const { notification } = this.bound;
    this.host.pollInterrupt(notification.address, notification.interval, () => {});
    this.#read();
    this.#write();
  }

  /** Fault: the host stops polling IN; a packet on the bus still arrives. */
  setStalled(on) {
    this.stalled = on;
    if (this.bound) this.host.pause(this.bound.bulkIn.address, on);
  }

  /** The consumer of `onData` is full: stop reading until it is resumed. */
  setBlocked(on) {
    this.blocked = on;
    if (!on) this.#read();
  }

  #read() {
    if (!this.bound || !this.dtr || this.blocked) return;
    const { bulkIn } = this.bound;
    while (this.reads.size < READS) {
      const read = this.host.bulkIn(bulkIn.address, PACKETS_PER_READ * bulkIn.maxPacket, (status, data) => {
        this.reads.delete(read);
        if (data.length) this.onData(data);
        if (status === 'stall') this.host.block.rp2040.fail('usb host', 'the bulk IN endpoint stalled');
        if (status === 'ok') this.#read();
      });
      this.reads.add(read);
    }
  }

  write(bytes) {
    this.writes.push(Uint8Array.from(bytes));
    this.#write();
  }

  #write() {
    if (!this.bound || !this.dtr || this.writing || !this.writes.length) return;
    this.writing = true;
    this.host.bulkOut(this.bound.bulkOut.address, this.writes[0], (status) => {
      this.writing = false;
      if (status === 'stall') this.host.block.rp2040.fail('usb host', 'the bulk OUT endpoint stalled');
      if (status !== 'ok') return;
      this.writes.shift();
      this.#write();
    });
  }
}
