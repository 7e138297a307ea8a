// The tool's judgement from judges.wasm, host_tools/tool/calibration and host_tools/tool/doctor: the same numbers, bounds and sentences as
// `fingertip calibrate` and `fingertip doctor`. For src/steps and for node.
//
// A fingertip's packets go in as frames: the bytes of one frame of the line, COBS encoded, without
// its delimiter. An exception of C++ becomes a WasmError, whose message states what to do.
import { start } from './module.mjs';

/** @typedef {Omit<Extract<import('../src/line/line_facts').Command, { type: 0x88 }>, 'type' | 'sensor_count'>} Calibration of the calibrate command */

class Session {
  constructor(wasm, kind, handle) {
    Object.assign(this, { wasm, kind, handle });
  }

  /** Gives the bytes, then calls kind_name of this session with values. */
  ask(name, bytes = null, ...values) {
    give(this.wasm, bytes);
    return this.wasm.call(`${this.kind}_${name}`, this.handle, ...values);
  }

  answer(name, ...values) {
    this.ask(name, ...values);
    const bytes = this.wasm.bytes(this.wasm.call('answer_at'), this.wasm.call('answer_bytes'));
    return JSON.parse(new TextDecoder().decode(bytes));
  }

  free() {
    this.wasm.call(`${this.kind}_free`, this.handle);
  }
}

function give(wasm, bytes) {
  if (bytes) {
    wasm.bytes(wasm.call('room', bytes.length), bytes.length).set(bytes);
  }
}

/** Others than the session's packets are nothing to it. */
class PressSession extends Session {
  /**
   * True: a placement or pull was completed; some 50 ms then, else some microseconds.
   * @param {Uint8Array} frame
   */
  take(frame) {
    return this.ask('take', frame) !== 0;
  }
}

/** Of raw packets. */
class Gains extends PressSession {
  takeBack() {
    this.ask('take_back');
  }
  /**
   * text: a sentence, why, and what to do; empty before the first placement. advice: what to do now. kept: it fits
   * the others. wanted: the best next place. gain: of each sensor, once they can be solved.
   * @returns {{
   *   state: 'more' | 'good' | 'refused', text: string, advice: string, progress: string,
   *   placements: { x_mm: number, y_mm: number, kept: boolean }[], wanted: { x_mm: number, y_mm: number } | null, gain: number[],
   * }}
   */
  status() {
    return this.answer('status');
  }
  /**
   * What the calibrate command carries, and how far the firmware's fit scatters over the placements without it and with it. Throws unless good.
   * @param {number | null} force_N the weight's, or null where it is unknown
   * @param {number} date_s
   * @returns {{
   *   calibration: Calibration,
   *   before: { location_mm: number, force: number }, after: { location_mm: number, force: number },
   * }}
   */
  result(force_N, date_s) {
    return this.answer('result', null, force_N ?? NaN, date_s);
  }
}

/** Of contact packets. */
class Pulls extends PressSession {
  /**
   * last: "pull 3 at x ...: reads 0.98 N towards 90 degrees"; empty before the first.
   * @returns {{ state: 'more' | 'good' | 'refused', text: string, advice: string, last: string }}
   */
  status() {
    return this.answer('status');
  }
  /**
   * What the pad command carries beside the rest of the profile that the fingertip has now, by its info. Throws unless good.
   * @param {Uint8Array} info_frame
   * @returns {{ tangential_scale: number, tangential_scale_sd: number }}
   */
  result(info_frame) {
    return this.answer('result', info_frame);
  }
}

/** As `fingertip doctor` examines: info, health, crash, then contact and raw packets for ten seconds while nothing touches the pad, then health again. */
class Doctor extends Session {
  /**
   * @param {'info' | 'before' | 'crash' | 'take' | 'after'} what take: contact and raw packets, in order
   * @param {Uint8Array} frame
   */
  give(what, frame) {
    this.ask(what, frame);
  }
  /** Duration of the packets taken, device time. */
  seconds() {
    return this.ask('seconds');
  }
  /** What the line counted during the measurement. */
  line({ bytes, packets, dropped_packets, out_of_order, crc_errors, format_errors }) {
    this.ask('line', null, bytes, packets, dropped_packets, out_of_order, crc_errors, format_errors);
  }
  /**
   * advice: what to do; empty where all is well.
   * @returns {{ verdict: 'ok' | 'warn' | 'bad', check: string, text: string, advice: string }[]}
   */
  findings() {
    return this.answer('status');
  }
}

/**
 * From the bytes of judges.wasm. gains: from placements of one weight; pulls: the tangential scale from pulls of known_N. Both throw where
 * the firmware cannot.
 * @param {BufferSource | Promise<BufferSource>} bytes
 */
export async function load(bytes) {
  const wasm = await start(await WebAssembly.compile(await bytes));
  return {
    gains(info_frame) {
      give(wasm, info_frame);
      return new Gains(wasm, 'gains', wasm.call('gains_begin'));
    },
    pulls(info_frame, known_N) {
      give(wasm, info_frame);
      return new Pulls(wasm, 'pulls', wasm.call('pulls_begin', known_N));
    },
    examination({ port, tool_version }) {
      give(wasm, new TextEncoder().encode(port));
      return new Doctor(wasm, 'doctor', wasm.call('doctor_begin', ...tool_version));
    },
  };
}
