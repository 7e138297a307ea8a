/**
 * The CDC port as a pseudo-terminal. pty_port.py holds the terminal; the two exchange frames over its stdin and
 * stdout: one byte type, u32 little-endian length, payload.
 *
 *     from the helper: 'R' ready, 'O' opened, 'C' closed, 'B' u32 baud rate changed, 'D' bytes from the client,
 *                      'A' u32 bytes taken by the client, or discarded as there is none
 *     to the helper:   'D' bytes for the client
 *
 * At most WINDOW bytes wait for the client; beyond that the emulated host stops reading the device.
 */
import { spawn } from 'node:child_process';
import { setTimeout as sleep } from 'node:timers/promises';
import { fileURLToPath } from 'node:url';
import { InputError, inWords } from '../errors.mjs';

const PYTHON = '/usr/bin/python3';
const WINDOW = 16384;
/** A client that takes nothing for longer does not mean to. */
const READER_GRACE_MS = 2000;

export class PtyPort {
  static start(link) {
    const port = new PtyPort(link);
    return new Promise((resolve, reject) => {
      port.onReady = () => resolve(port);
      port.onFailure = (message) => reject(new InputError(message));
    });
  }

  constructor(link) {
    this.isOpen = false;
    this.failure = null;
    this.cdc = null;
    this.outstanding = 0;
    this.full_ms = null;
    this.received = Buffer.alloc(0);
    this.early = [];
    this.errors = '';
    this.child = spawn(PYTHON, [fileURLToPath(new URL('./pty_port.py', import.meta.url)), link], {
      stdio: ['pipe', 'pipe', 'pipe'],
      detached: true,
    });
    this.child.on('error', (error) => this.#lost(`cannot start ${PYTHON} (${inWords(error)})`));
    this.child.stderr.on('data', (text) => {
      this.errors += text;
    });
    this.exited = new Promise((resolve) => {
      this.child.on('close', (code) => {
        if (!this.stopping) this.#lost(this.errors.trim().split('\n').at(-1) || `pty_port.py ended with ${code}`);
        resolve();
      });
    });
    this.child.stdin.on('error', () => {});
    this.child.stdout.on('data', (bytes) => this.#receive(bytes));
  }

  #lost(message) {
    this.failure ??= message;
    this.onFailure?.(message);
  }

  #receive(bytes) {
    this.received = Buffer.concat([this.received, bytes]);
    while (this.received.length >= 5) {
      const length = this.received.readUInt32LE(1);
      if (this.received.length < 5 + length) return;
      const type = String.fromCharCode(this.received[0]);
      const payload = this.received.subarray(5, 5 + length);
      this.received = this.received.subarray(5 + length);
      if (type === 'R') this.onReady?.();
      else if (type === 'A') this.#taken(payload.readUInt32LE(0));
      else if (this.cdc) this.#deliver(type, payload);
      else {
        if (type === 'O' || type === 'C') this.isOpen = type === 'O';
        this.early.push([type, Buffer.from(payload)]);
      }
    }
  }

  /** From now on the client's doings reach this CDC client. */
  connect(cdc) {
    this.cdc = cdc;
    for (const [type, payload] of this.early) this.#deliver(type, payload);
    this.early = [];
  }

  #deliver(type, payload) {
    if (type === 'O' || type === 'C') {
      this.isOpen = type === 'O';
      if (!this.isOpen) {
        this.outstanding = 0;
        this.cdc.setBlocked(false);
      }
      this.cdc.setDtr(this.isOpen);
    } else if (type === 'B') this.cdc.setBaud(payload.readUInt32LE(0));
    else if (type === 'D') this.cdc.write(payload);
  }

  #frame(type, payload) {
    const head = Buffer.alloc(5);
    head[0] = type.charCodeAt(0);
    head.writeUInt32LE(payload.length, 1);
    this.child.stdin.write(Buffer.concat([head, payload]));
  }

  send(bytes) {
    if (!this.isOpen) return;
    this.outstanding += bytes.length;
    this.#frame('D', bytes);
    if (this.outstanding >= WINDOW) this.cdc.setBlocked(true);
  }

  #taken(count) {
    this.outstanding = Math.max(0, this.outstanding - count);
    if (this.outstanding < WINDOW) this.cdc?.setBlocked(false);
  }

  /** A client of a busy machine has not taken what waits for it yet. */
  waitsForReader(now_ms) {
    if (!this.isOpen || this.outstanding < WINDOW) {
      this.full_ms = null;
      return false;
    }
    this.full_ms ??= now_ms;
    return now_ms - this.full_ms < READER_GRACE_MS;
  }

  /** Give the client up to a second to take what was sent. */
  async drain() {
    for (let i = 0; i < 100 && this.outstanding > 0 && this.isOpen && !this.failure; i++) await sleep(10);
  }

  async stop() {
    this.stopping = true;
    this.child.stdin.end();
    await this.exited;
  }
}
