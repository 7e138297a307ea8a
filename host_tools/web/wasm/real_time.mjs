// The simulated fingertip in real time, whatever the clock: what the page's worker does.
import { Firmware } from './firmware.mjs';
import { FirmwareLeft } from './module.mjs';

const SLICE_us = 5000; // small enough that the line's queue, 4096 bytes, never fills up
const BUSY_ms = 20; // at one go: then others have their turn
const BEHIND_ms = 1000; // more than it catches up with: the computer slept

/** Time in which the firmware starts, and stores its pad where it does not know it. */
const START_us = 300e3;
const STORE_us = 1000e3;

export class RealTime {
  /**
   * module: of simulated.wasm. objects: bytes of the file of objects. options: serial, seed, noise,
   * errors (twin --effects), parallelBus. clock: milliseconds that go on.
   * Calls on.bytes(bytes), on.truth(truth) and on.left(why): the firmware is gone until it is opened
   * again.
   */
  constructor({ module, objects, options, on, clock }) {
    Object.assign(this, { module, objects, options, on, clock });
    this.firmware = null;
    this.kept = null;
    this.unsent = new Uint8Array(0);
    this.isOpen = false;
    this.object = 0;
    this.friction = null;
    /** Time in which it could not keep up, for those who ask. */
    this.skipped_ms = 0;
  }

  async plugIn() {
    const firmware = await Firmware.of(this.module);
    firmware.setWorld({
      objects: this.objects,
      errors: this.options.errors,
      seed: this.options.seed,
    });
    firmware.powerUp({ ...this.options, kept: this.kept });
    firmware.choose(this.object);
    if (this.friction !== null) {
      firmware.setFriction(this.friction);
    }
    this.t_us = 0;
    this.runFor(firmware, START_us);
    if (!this.kept) {
      firmware.open();
      firmware.send(firmware.padCommand());
      this.runFor(firmware, STORE_us);
      firmware.close();
    }
    this.firmware = firmware;
    this.begin_ms = this.clock() - 1e-3 * this.t_us;
  }

  runFor(firmware, span_us) {
    const end_us = this.t_us + span_us;
    while (this.t_us < end_us) {
      this.t_us = Math.min(this.t_us + SLICE_us, end_us);
      firmware.runUntil(this.t_us);
      firmware.receive();
    }
  }

  async open() {
    if (!this.firmware) {
      await this.plugIn();
    }
    // Commands that came before it noticed that its line had closed would be lost.
    this.runFor(this.firmware, SLICE_us);
    this.firmware.open();
    this.isOpen = true;
  }

  close() {
    this.firmware?.close();
    this.isOpen = false;
    this.unsent = new Uint8Array(0);
  }

  send(bytes) {
    const all = new Uint8Array(this.unsent.length + bytes.length);
    all.set(this.unsent);
    all.set(bytes, this.unsent.length);
    this.unsent = all;
  }

  /** press, hold, drop, lift as of Firmware; choose and setFriction outlast a restart. */
  act(name, ...values) {
    if (name === 'choose') {
      this.object = values[0];
    } else if (name === 'setFriction') {
      this.friction = values[0];
    }
    this.firmware?.[name](...values);
  }

  unplug() {
    this.gone('unplugged');
  }

  gone(why) {
    if (this.firmware) {
      this.kept = this.firmware.kept();
      this.firmware = null;
      this.isOpen = false;
      this.unsent = new Uint8Array(0);
      this.on.left(why);
    }
  }

  /** To be called every few milliseconds. */
  tick() {
    if (!this.firmware) {
      return;
    }
    const begin_ms = this.clock();
    const behind_ms = begin_ms - this.begin_ms - 1e-3 * this.t_us;
    if (behind_ms > BEHIND_ms) {
      this.begin_ms += behind_ms;
      this.skipped_ms += behind_ms;
    }
    const parts = [];
    const due_us = 1e3 * (begin_ms - this.begin_ms);
    try {
      while (this.t_us + SLICE_us <= due_us && this.clock() - begin_ms < BUSY_ms) {
        if (this.unsent.length > 0) {
          this.unsent = this.unsent.slice(this.firmware.send(this.unsent));
        }
        this.t_us += SLICE_us;
        this.firmware.runUntil(this.t_us);
        parts.push(this.firmware.receive());
      }
    } catch (error) {
      if (!(error instanceof FirmwareLeft)) {
        throw error;
      }
      this.pass(parts);
      this.gone(
        error.how === FirmwareLeft.LOADER
          ? 'it went to its loader; connect again, and it restarts'
          : 'its firmware ended itself; connect again, and it restarts',
      );
      return;
    }
    this.pass(parts);
    this.on.truth(this.firmware.truth());
  }

  pass(parts) {
    const bytes = new Uint8Array(parts.reduce((sum, part) => sum + part.length, 0));
    let at = 0;
    for (const part of parts) {
      bytes.set(part, at);
      at += part.length;
    }
    if (this.isOpen && bytes.length > 0) {
      this.on.bytes(bytes);
    }
  }
}
