/**
 * TCA9548A eight-channel I2C switch (Texas Instruments SCPS207).
 *
 * One control byte, bit n connects channel n, any mix at once; the byte takes effect at the STOP. A low RESET disconnects every channel.
 * Reading gives the control byte. What is behind a connected channel takes part in every transfer.
 */
import { I2cTarget } from './i2c_bus.mjs';

const NONE = Object.freeze([]);

export class Tca9548a extends I2cTarget {
  constructor(address, index) {
    super(address);
    this.index = index;
    this.channels = Array.from({ length: 8 }, () => []);
    this.control = 0;
    this.pending = null;
    this.inReset = false;
    /** Fault: answers nothing and stays as it is until its RESET is pulsed. */
    this.stuck = false;
    /** What each control byte connects, as far as it was asked for. */
    this.connectedBy = new Map();
    this.onReset = () => {};
  }

  connect(channel, target) {
    this.channels[channel].push(target);
    this.connectedBy.clear();
  }

  get connected() {
    if (this.inReset) return NONE;
    let connected = this.connectedBy.get(this.control);
    if (!connected) {
      connected = this.channels.flatMap((targets, channel) => ((this.control >> channel) & 1 ? targets : []));
      this.connectedBy.set(this.control, connected);
    }
    return connected;
  }

  get holdsSda() {
    return this.connected.some((t) => t.holdsSda);
  }

  setReset(low) {
    if (low === this.inReset) return;
    this.inReset = low;
    if (!low) return;
    this.control = 0;
    this.pending = null;
    this.phase = 'idle';
    for (const t of this.channels.flat()) t.stop();
    this.onReset();
  }

  acknowledgesAddress() {
    return !this.inReset && !this.stuck;
  }

  receive(byte) {
    this.pending = byte;
    return true;
  }

  transmit() {
    return this.control;
  }

  start() {
    super.start();
    for (const t of this.connected) t.start();
  }

  write(byte) {
    let acknowledged = super.write(byte);
    for (const t of this.connected) acknowledged = t.write(byte) || acknowledged;
    return acknowledged;
  }

  read() {
    let byte = 0xff;
    let drivers = 0;
    for (const answer of [super.read(), ...this.connected.map((t) => t.read())]) {
      if (answer === null) continue;
      byte &= answer;
      drivers += 1;
    }
    return drivers ? { byte, drivers } : null;
  }

  readAcknowledged(acknowledged) {
    super.readAcknowledged(acknowledged);
    for (const t of this.connected) t.readAcknowledged(acknowledged);
  }

  stop() {
    super.stop();
    for (const t of this.connected) t.stop();
    if (this.pending !== null) {
      this.control = this.pending;
      this.pending = null;
    }
  }

  clock() {
    for (const t of this.connected) t.clock();
  }
}
