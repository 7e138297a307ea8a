// The firmware in simulated.wasm, one powered up: its line, its time, what it keeps. For the page's worker and for node.
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
    const arrays = [Float64Array.from(times_s), Float32Array.from(pressures_Pa), Float32Array.from(temperatures_degC)];
    this.wasm.lend(arrays, (...at) => this.wasm.call('rows_begin', times_s.length, ambient_Pa, ...at));
  }

  /**
   * The pad and its objects: objects of the file web_tables writes, errors as of `twin scenario
   * --effects`. Throws WasmError.
   */
  setWorld({ objects, errors = 'none', seed = 1 }) {
    this.wasm.lend([objects, errors], (file, text) => this.wasm.call('world_begin', file, objects.length, text, seed));
  }

  /** The command that sets the firmware's pad profile; not before setWorld. */
  padCommand() {
    return this.wasm.bytes(this.wasm.call('pad_command_at'), this.wasm.call('pad_command_bytes')).slice();
  }

  /** Sets that profile from power-up on, without storing it. */
  usePad() {
    this.wasm.call('pad_use');
  }

  /** What happens to the pad from now on, world.hpp: choose object; press x_mm y_mm force_N; hold x_mm y_mm force_N load_N angle_deg;
   * drop x_mm y_mm mass_g; lift; friction value. */
  act(name, ...values) {
    this.wasm.call(`world_${name}`, ...values);
  }

  truth() {
    const [t_s, contact, x_mm, y_mm, force_N, qx_N, qy_N, slips] = this.wasm.doubles(this.wasm.call('world_truth'), 8);
    return { t_us: Math.round(1e6 * t_s), contact: contact !== 0, x_mm, y_mm, force_N, qx_N, qy_N, slips: slips !== 0 };
  }

  /** Time 0. kept: of an earlier one's kept(). */
  powerUp({ serial = '0000000000000001', seed = 1, parallelBus = false, kept = null }) {
    this.wasm.lend([serial, kept], (serial_at, kept_at) => this.wasm.call('power_up', serial_at, seed, parallelBus ? 1 : 0, kept_at));
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
    for (let at = 0; at < bytes.length; at += most) {
      const part = bytes.subarray(at, at + most);
      this.wasm.bytes(this.wasm.call('line_bytes'), part.length).set(part);
      if (this.wasm.call('line_take', part.length) !== 0) {
        return at;
      }
    }
    return bytes.length;
  }

  /** What it has sent since the last call. */
  receive() {
    const parts = [];
    for (let count; (count = this.wasm.call('line_receive')) > 0; ) {
      parts.push(this.wasm.bytes(this.wasm.call('line_bytes'), count).slice());
    }
    return joined(parts);
  }

  /** A copy of what it keeps without power. */
  kept() {
    return this.wasm.bytes(this.wasm.call('flash_now'), this.wasm.call('flash_bytes')).slice();
  }
}

/** @param {Uint8Array[]} parts */
export function joined(parts) {
  const all = new Uint8Array(parts.reduce((sum, part) => sum + part.length, 0));
  let at = 0;
  for (const part of parts) {
    all.set(part, at);
    at += part.length;
  }
  return all;
}
