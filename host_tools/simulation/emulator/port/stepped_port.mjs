/**
 * The CDC port on stdin and stdout, for a program that has a clock of its own: emulated time passes only as far as that
 * program asks. Frames either way: one byte type, u32 little-endian length, payload; times are u64, ns since power-on.
 *
 *     from the program: 'Z' time                  the program's clock when the power comes; first of all, or not at all
 *                       'O' time                  a client opens the port at that time
 *                       'C' time                  it closes it
 *                       'D' time, bytes           it writes them
 *                       'W' time, u8 0|1          it takes no more bytes (1), or some again (0)
 *                       'R' time, u64 margin_ns   run until that time, or by the margin beyond the first bytes for the client
 *                       'E'                       the run ends
 *     to the program:   'D' time, bytes           for the client
 *                       'T' time, u8 0|1          ends the answer to 'R': emulated time now; 1: the run has ended
 *
 * What happens "at" a time must be requested before emulated time is there. A pipe that
 * closes without 'E' breaks the run off, as wrong usage does.
 */
import { readSync, writeFileSync } from 'node:fs';
import { InputError } from '../errors.mjs';

const CHUNK = 65536;

export class SteppedPort {
  constructor() {
    this.received = Buffer.alloc(0);
    this.chunk = Buffer.alloc(CHUNK);
    this.sent = [];
    this.zero_ns = 0;
  }

  connect(scope, cdc) {
    this.cdc = cdc;
    this.coming = [];
    this.alarm = scope.createAlarm(() => {
      this.#happen(this.coming.shift());
      if (this.coming.length) this.alarm.scheduleAt(this.coming[0].at_ns);
    });
  }

  /** Bytes for the client, at this time. */
  send(bytes, now_ns) {
    this.sent.push(this.#frame('D', now_ns, bytes));
  }

  get hasSent() {
    return this.sent.length > 0;
  }

  /** Until time is to pass: { until_ns, margin_ns }; null: the run ends. */
  next() {
    for (;;) {
      const head = this.#read(5);
      const type = String.fromCharCode(head[0]);
      const payload = this.#read(head.readUInt32LE(1));
      if (type === 'E') return null;
      const at_ns = Number(payload.readBigUInt64LE(0));
      if (type === 'Z') {
        this.zero_ns = at_ns;
        continue;
      }
      if (type === 'R') return { until_ns: at_ns, margin_ns: Number(payload.readBigUInt64LE(8)) };
      this.coming.push({ at_ns, type, bytes: Uint8Array.from(payload.subarray(8)) });
      if (this.coming.length === 1) this.alarm.scheduleAt(at_ns);
    }
  }

  #happen({ type, bytes }) {
    const { cdc } = this;
    if (type === 'O' || type === 'C') {
      if (type === 'C') cdc.setBlocked(false);
      cdc.setDtr(type === 'O');
    } else if (type === 'D') cdc.write(bytes);
    else if (type === 'W') cdc.setBlocked(bytes[0] === 1);
  }

  /** Time has passed until now. */
  answer(now_ns, hasEnded) {
    writeFileSync(1, Buffer.concat([...this.sent.splice(0), this.#frame('T', now_ns, [hasEnded ? 1 : 0])]));
  }

  #frame(type, at_ns, bytes) {
    const frame = Buffer.alloc(13 + bytes.length);
    frame[0] = type.charCodeAt(0);
    frame.writeUInt32LE(8 + bytes.length, 1);
    frame.writeBigUInt64LE(BigInt(Math.round(at_ns)), 5);
    frame.set(bytes, 13);
    return frame;
  }

  #read(length) {
    while (this.received.length < length) {
      const count = readSync(0, this.chunk, 0, CHUNK);
      if (count === 0) throw new InputError('the program on standard input is gone');
      this.received = Buffer.concat([this.received, this.chunk.subarray(0, count)]);
    }
    const bytes = this.received.subarray(0, length);
    this.received = this.received.subarray(length);
    return bytes;
  }
}
