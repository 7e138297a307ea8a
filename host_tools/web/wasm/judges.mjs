// The tool's judgement from judges.wasm: src/judges/judges.ts explains each part.
import { start } from './module.mjs';

class Session {
  constructor(wasm, kind, handle) {
    Object.assign(this, { wasm, kind, handle });
  }

  /** Gives the bytes, then calls kind_name of this session with values. */
  ask(name, bytes = null, ...values) {
    if (this.handle === 0) {
      throw new Error(`${this.kind}: asked after it was freed`);
    }
    give(this.wasm, bytes);
    return this.wasm.call(`${this.kind}_${name}`, this.handle, ...values);
  }

  answer(name, ...values) {
    this.ask(name, ...values);
    const bytes = this.wasm.bytes(this.wasm.call('answer_at'), this.wasm.call('answer_bytes'));
    return JSON.parse(new TextDecoder().decode(bytes));
  }

  free() {
    if (this.handle !== 0) {
      this.wasm.call(`${this.kind}_free`, this.handle);
      this.handle = 0;
    }
  }
}

function give(wasm, bytes) {
  if (bytes) {
    wasm.bytes(wasm.call('room', bytes.length), bytes.length).set(bytes);
  }
}

class Gains extends Session {
  take(frame) {
    return this.ask('take', frame) !== 0;
  }
  takeBack() {
    this.ask('take_back');
  }
  status() {
    return this.answer('status');
  }
  result(force_N, date_s) {
    return this.answer('result', null, force_N ?? NaN, date_s);
  }
}

class Pulls extends Session {
  take(frame) {
    return this.ask('take', frame) !== 0;
  }
  status() {
    return this.answer('status');
  }
  result(info_frame) {
    return this.answer('result', info_frame);
  }
}

class Doctor extends Session {
  info(frame) {
    this.ask('info', frame);
  }
  before(frame) {
    this.ask('before', frame);
  }
  after(frame) {
    this.ask('after', frame);
  }
  crash(frame) {
    this.ask('crash', frame);
  }
  take(frame) {
    this.ask('take', frame);
  }
  seconds() {
    return this.ask('seconds');
  }
  line(counts) {
    const { bytes, packets, dropped_packets, out_of_order, crc_errors, format_errors } = counts;
    this.ask('line', null, bytes, packets, dropped_packets, out_of_order, crc_errors, format_errors);
  }
  failure(code, text) {
    this.ask('failure', new TextEncoder().encode(`${code}\n${text}`));
  }
  findings() {
    return this.answer('status');
  }
}

/** From the bytes of judges.wasm. */
export async function load(bytes) {
  const wasm = await start(await WebAssembly.compile(bytes));
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
