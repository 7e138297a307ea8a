/**
 * The flash chip of a Pico, a W25Q16JV (Winbond, revision H): 2 MiB behind a serial interface.
 *
 * Modelled: read (03h), page program (02h), sector erase (20h), write enable (06h), read status (05h) and read unique
 * id (4Bh). Programming only clears bits, needs write enable, and keeps the chip busy like an erase; while it is busy
 * it answers nothing but read status. What a chip would pass over in silence fails the run: a change without write
 * enable, another command while busy, bytes beyond the end of a page, a command that is not modelled.
 *
 * A reset of the RP2040 does not reach it. When its power goes, what was under way is cut short: of the bits that were
 * to change some have changed, some have not, and some read differently from now on, at each reading or at each
 * power-up, until they are programmed or erased again.
 */
import { Prng } from '../prng.mjs';

export const FLASH_BYTES = 2 * 1024 * 1024;
const PAGE_BYTES = 256;
const SECTOR_BYTES = 4096;

const OP = { program: 0x02, read: 0x03, status: 0x05, writeEnable: 0x06, erase: 0x20, uniqueId: 0x4b };
const KNOWN = new Set(Object.values(OP));

/** Datasheet 9.6, typical and maximum: page program, sector erase. The typical page is that of older revisions, 0.7 ms. */
export const BUSY_NS = { typical: { program: 0.7e6, erase: 45e6 }, slowest: { program: 3e6, erase: 400e6 } };

export class FlashMemory {
  /** @param options time: SimulatedTime; serial: 8-byte unique id; seed: of what a power cut leaves; speed: of BUSY_NS */
  constructor({ time, serial, seed = 1, speed = 'typical' }) {
    this.time = time;
    this.serial = serial;
    this.prng = new Prng(seed ^ 0xf1a5);
    this.busy_ns = BUSY_NS[speed];
    this.bytes = new Uint8Array(FLASH_BYTES).fill(0xff);
    /** Bits that read as they like, by byte. */
    this.unstable = new Map();
    this.resolvesAtPowerUp = false;
    /** Erases and page programs that were completed. */
    this.erases = 0;
    this.programs = 0;
    /** Called at each step of a change: when one begins, and when it ends. */
    this.onStep = () => {};
    this.fail = () => {};
    this.alarm = time.scope().createAlarm(() => this.#complete());
    this.#reset();
  }

  #reset() {
    this.operation = null;
    this.busyUntil_ns = 0;
    this.writeEnabled = false;
    this.command = [];
    this.alarm.cancel();
  }

  get isBusy() {
    return this.operation !== null;
  }

  select() {
    this.command = [];
  }

  /** What a command changes begins when chip select rises. */
  deselect() {
    const { command } = this;
    const [op] = command;
    this.command = [];
    if (op === undefined) return;
    if (op === OP.writeEnable) this.writeEnabled = true;
    else if (op === OP.uniqueId && command.length < 13) {
      this.fail(
        'flash',
        `chip select rose after ${command.length} of the 13 bytes of a unique-id read; keep the FIFO fed or force chip select`,
      );
    } else if (op === OP.program) {
      this.#needsWriteEnable('page programmed');
      const at = this.#address(command);
      const data = Uint8Array.from(command.slice(4));
      if (command.length < 5) this.fail('flash', 'page program without data');
      if ((at % PAGE_BYTES) + data.length > PAGE_BYTES)
        this.fail('flash', `page program of ${data.length} bytes at 0x${at.toString(16)} passes the end of the page`);
      this.#begin({ kind: 'program', at, data });
    } else if (op === OP.erase) {
      this.#needsWriteEnable('sector erased');
      if (command.length !== 4) this.fail('flash', `sector erase of ${command.length} bytes; it has 4`);
      this.#begin({ kind: 'erase', at: this.#address(command) & ~(SECTOR_BYTES - 1) });
    }
  }

  #needsWriteEnable(what) {
    if (!this.writeEnabled) this.fail('flash', `${what} without write enable`);
  }

  #address(command) {
    return ((command[1] << 16) | (command[2] << 8) | command[3]) & (FLASH_BYTES - 1);
  }

  exchange(byte) {
    this.command.push(byte);
    const { command } = this;
    const index = command.length - 1;
    const op = command[0];
    if (index === 0) {
      if (!KNOWN.has(op)) this.fail('flash', `command 0x${op.toString(16)} is not modelled`);
      if (this.isBusy && op !== OP.status)
        this.fail('flash', `command 0x${op.toString(16)} while the flash is busy; it would be passed over`);
      return 0xff;
    }
    switch (op) {
      case OP.status:
        return (this.isBusy ? 1 : 0) | (this.writeEnabled ? 2 : 0);
      case OP.uniqueId:
        return index >= 5 && index < 13 ? this.serial[index - 5] : 0xff;
      case OP.read:
        return index < 4 ? 0xff : this.#readByte((this.#address(command) + index - 4) & (FLASH_BYTES - 1));
    }
    return 0xff;
  }

  #readByte(at) {
    const torn = this.unstable.get(at);
    if (torn === undefined || this.resolvesAtPowerUp) return this.bytes[at];
    return this.bytes[at] ^ (torn & this.prng.uint32() & 0xff);
  }

  #begin(operation) {
    this.operation = operation;
    const busy_ns = this.busy_ns[operation.kind];
    this.busyUntil_ns = this.time.nanos + busy_ns;
    this.alarm.schedule(busy_ns);
    this.onStep(operation, 'begins');
  }

  #complete() {
    const { operation } = this;
    const { kind, at, data } = operation;
    if (kind === 'erase') {
      this.bytes.fill(0xff, at, at + SECTOR_BYTES);
      this.erases += 1;
      if (this.unstable.size) for (let i = at; i < at + SECTOR_BYTES; i++) this.unstable.delete(i);
    } else {
      this.programs += 1;
      data.forEach((byte, i) => {
        this.bytes[at + i] &= byte;
        const torn = (this.unstable.get(at + i) ?? 0) & byte;
        if (torn) this.unstable.set(at + i, torn);
        else this.unstable.delete(at + i);
      });
    }
    this.operation = null;
    this.writeEnabled = false;
    this.onStep(operation, 'ends');
  }

  /** How far the bits have come, in chances of 256: those that have arrived, and those on their way. */
  #progress() {
    const kind = this.prng.uint32() & 3;
    if (kind === 0) return { arrived: 0, torn: 1 };
    if (kind === 1) return { arrived: 256, torn: 1 };
    return { arrived: this.prng.uint32() & 0xff, torn: this.prng.uint32() & 0xff };
  }

  #bits(chance) {
    let bits = 0;
    for (let i = 0; i < 8; i++) bits = (bits << 1) | ((this.prng.uint32() & 0xff) < chance ? 1 : 0);
    return bits;
  }

  #cutByte(at, changing, to, { arrived, torn }) {
    if (!changing) return;
    const there = changing & this.#bits(arrived);
    const between = changing & this.#bits(torn);
    this.bytes[at] = (this.bytes[at] & ~there) | (to & there);
    const left = ((this.unstable.get(at) ?? 0) & ~there) | between;
    if (left) this.unstable.set(at, left);
    else this.unstable.delete(at);
  }

  /** Power goes, and comes back. */
  cutPower() {
    const progress = this.#progress();
    const { operation } = this;
    if (operation?.kind === 'program') {
      operation.data.forEach((byte, i) => {
        const at = operation.at + i;
        this.#cutByte(at, (this.bytes[at] | (this.unstable.get(at) ?? 0)) & ~byte & 0xff, 0, progress);
      });
    } else if (operation) {
      // All bits are programmed first, then all are erased.
      const erasing = this.prng.uint32() & 1;
      for (let at = operation.at; at < operation.at + SECTOR_BYTES; at++) {
        if (erasing) {
          this.bytes[at] = 0;
          this.unstable.delete(at);
        }
        this.#cutByte(at, 0xff, erasing ? 0xff : 0, progress);
      }
    }
    this.#reset();
    this.resolvesAtPowerUp = (this.prng.uint32() & 1) === 1;
    for (const [at, torn] of this.unstable) this.bytes[at] ^= torn & this.prng.uint32() & 0xff;
  }
}
