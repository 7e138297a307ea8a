// The firmware in simulated.wasm, one powered up: its line, its time, what it keeps. For the page's
// worker and for node.
import { start } from './module.mjs';

export class Firmware {
  /** Not powered up yet. */
  static async of(module) {
    return new Firmware(await start(module));
  }

  constructor(wasm) {
    this.wasm = wasm;
    this.sensors = wasm.call('sensor_count');
  }

  /**
   * A scenario instead of the pad: rows of times (s), pressures above ambient on each sensor (Pa)
   * and temperatures (degC).
   */
  setRows({ ambient_Pa, times_s, pressures_Pa, temperatures_degC }) {
    const count = times_s.length;
    this.wasm.call('rows_begin', count, ambient_Pa);
    this.wasm.doubles(this.wasm.call('rows_times'), count).set(times_s);
    this.wasm.floats(this.wasm.call('rows_pressures'), count * this.sensors).set(pressures_Pa);
    this.wasm.floats(this.wasm.call('rows_temperatures'), count).set(temperatures_degC);
    this.ofRows = true;
  }

  /**
   * The pad and its objects: objects of the file web_tables writes, errors as of `twin scenario
   * --effects`. Throws WasmError.
   */
  setWorld({ objects, errors = 'none', seed = 1 }) {
    const text = new TextEncoder().encode(errors);
    this.wasm.bytes(this.wasm.call('errors_begin', text.length), text.length).set(text);
    this.wasm.bytes(this.wasm.call('objects_begin', objects.length), objects.length).set(objects);
    this.wasm.call('world_begin', seed);
  }

  /** The command that sets the firmware's pad profile; not before setWorld. */
  padCommand() {
    return this.wasm.bytes(this.wasm.call('pad_command_at'), this.wasm.call('pad_command_bytes')).slice();
  }

  /** Sets the pad profile from power-up on, without storing it: a command as padCommand's. */
  usePad(command) {
    this.wasm.bytes(this.wasm.call('line_bytes'), command.length).set(command);
    if (this.wasm.call('pad_of_command', command.length) !== 0) {
      throw new Error('no command that sets a pad profile');
    }
  }

  /** What the hand does from now on; world.hpp. */
  choose(object) {
    this.wasm.call('world_choose', object);
  }
  press({ x_mm, y_mm, force_N }) {
    this.wasm.call('world_press', x_mm, y_mm, force_N);
  }
  hold({ x_mm, y_mm, force_N, load_N, angle_deg }) {
    this.wasm.call('world_hold', x_mm, y_mm, force_N, load_N, (angle_deg * Math.PI) / 180);
  }
  drop(x_mm, y_mm, mass_g) {
    this.wasm.call('world_drop', x_mm, y_mm, 1e-3 * mass_g);
  }
  lift() {
    this.wasm.call('world_lift');
  }
  setFriction(friction) {
    this.wasm.call('world_friction', friction);
  }

  truth() {
    const [t_s, contact, x_mm, y_mm, force_N, qx_N, qy_N, slips] = this.wasm.doubles(this.wasm.call('world_truth'), 8);
    return {
      t_us: Math.round(1e6 * t_s),
      contact: contact !== 0,
      x_mm,
      y_mm,
      force_N,
      qx_N,
      qy_N,
      slips: slips !== 0,
    };
  }

  /** Time 0. kept: of an earlier one's kept(). */
  powerUp({ serial, seed = 1, noise = 1, promSpread = 0.03, parallelBus = false, kept = null }) {
    if (serial) {
      this.wasm.bytes(this.wasm.call('serial_number'), 16).set(new TextEncoder().encode(serial).subarray(0, 16));
    }
    if (kept) {
      this.wasm.bytes(this.wasm.call('flash_to_start_with'), kept.length).set(kept);
    }
    const flags = [parallelBus, this.ofRows, kept].map((flag) => (flag ? 1 : 0));
    this.wasm.call('power_up', seed, noise, promSpread, ...flags);
  }

  /** Throws FirmwareLeft where it ends itself. */
  runUntil(t_us) {
    this.wasm.call('run_until', t_us);
  }

  open() {
    this.wasm.call('line_open');
  }
  close() {
    this.wasm.call('line_close');
  }

  /** How many of the bytes it took, from the first on; the others are for later. */
  send(bytes) {
    const most = this.wasm.call('line_takes');
    for (let at = 0; at < bytes.length; ) {
      const part = bytes.subarray(at, at + most);
      this.wasm.bytes(this.wasm.call('line_bytes'), part.length).set(part);
      if (this.wasm.call('line_take', part.length) !== 0) {
        return at;
      }
      at += part.length;
    }
    return bytes.length;
  }

  /** What it has sent since the last call. */
  receive() {
    const parts = [];
    let length = 0;
    for (let count; (count = this.wasm.call('line_receive')) > 0; ) {
      parts.push(this.wasm.bytes(this.wasm.call('line_bytes'), count).slice());
      length += count;
    }
    if (parts.length === 1) {
      return parts[0];
    }
    const all = new Uint8Array(length);
    let at = 0;
    for (const part of parts) {
      all.set(part, at);
      at += part.length;
    }
    return all;
  }

  /** A copy of what it keeps without power. */
  kept() {
    return this.wasm.bytes(this.wasm.call('flash_now'), this.wasm.call('flash_bytes')).slice();
  }
}
