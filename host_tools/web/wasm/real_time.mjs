// The simulated fingertip in real time, whatever the clock: what the page's worker does.
import { Firmware, joined } from './firmware.mjs';
import { FirmwareLeft } from './module.mjs';

const SLICE_us = 5000; // small enough that the line's queue, 4096 bytes, never fills up
const BUSY_ms = 20; // at one go: then others have their turn
const BEHIND_ms = 1000; // more than it catches up with: the computer slept

/** Time in which the firmware starts, and stores its pad where it does not know it. */
const START_us = 300e3;
const STORE_us = 1000e3;
const LASTING = ['choose', 'friction'];

export class RealTime {
  /**
   * module: of simulated.wasm. objects: bytes of the file of objects. clock: milliseconds that go on. on_bytes: called with what the
   * line brings, and Firmware.truth() then. on_left: called with the reason where the firmware is gone until it is opened again.
   * @param {{
   *   module: WebAssembly.Module,
   *   objects: Uint8Array,
   *   options: { serial?: string, seed?: number, errors?: string, parallelBus?: boolean },
   *   clock: () => number,
   *   on_bytes: (bytes: Uint8Array<ArrayBuffer>, truth: ReturnType<Firmware['truth']>) => void,
   *   on_left: (why: string) => void,
   * }} parts
   */
  constructor(parts) {
    Object.assign(this, parts);
    this.firmware = null;
    this.kept = null;
    this.unsent = new Uint8Array(0);
    this.isOpen = false;
    this.lasting = new Map(); // commands that outlast a restart
  }

  async plugIn() {
    const firmware = await Firmware.of(this.module);
    firmware.setWorld({ objects: this.objects, ...this.options });
    firmware.powerUp({ ...this.options, kept: this.kept });
    this.lasting.forEach((values, name) => firmware.act(name, ...values));
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

  /** @param {Uint8Array} bytes */
  send(bytes) {
    this.unsent = joined([this.unsent, bytes]);
  }

  /** As Firmware.act. */
  act(name, ...values) {
    if (LASTING.includes(name)) {
      this.lasting.set(name, values);
    }
    this.firmware?.act(name, ...values);
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
    }
    const parts = [];
    const due_us = 1e3 * (begin_ms - this.begin_ms);
    let left = null;
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
      left = error.how === FirmwareLeft.LOADER ? 'it went to its loader' : 'its firmware ended itself';
    }
    const bytes = joined(parts);
    if (this.isOpen && bytes.length > 0) {
      this.on_bytes(bytes, this.firmware.truth());
    }
    if (left) {
      this.kept = this.firmware.kept();
      this.firmware = null;
      this.close();
      this.on_left(`${left}; connect again, and it restarts`);
    }
  }
}
