// The page's WebAssembly modules, in the browser and in node: what they import, and errors.

/** An uncaught exception of C++, or the last output of a library that gave up. The message is for people. */
export class WasmError extends Error {}

/** The firmware ended itself, for its loader or in a panic; the module cannot be run again. */
export class FirmwareLeft extends Error {
  constructor(how) {
    super(how === FirmwareLeft.LOADER ? 'left for its loader' : 'ended itself');
    this.how = how;
  }
}
FirmwareLeft.LOADER = 1; // enum native_end

/** An instance of a compiled module: its exports, ready to be called. unpack: what core.wasm wants. */
export async function start(module, unpack = null) {
  let exports;
  let written = '';
  const memory = () => new DataView(exports.memory.buffer);
  const textAt = (at) => {
    const bytes = new Uint8Array(exports.memory.buffer, at);
    return new TextDecoder().decode(bytes.subarray(0, bytes.indexOf(0)));
  };
  const imports = {
    fingertip: {
      leave(how) {
        throw new FirmwareLeft(how);
      },
      unpack(at, length, to, size) {
        try {
          const bytes = unpack(new Uint8Array(exports.memory.buffer, at, length), size);
          new Uint8Array(exports.memory.buffer, to, size).set(bytes);
          return bytes.length === size ? 1 : 0;
        } catch {
          return 0;
        }
      },
    },
    wasi_snapshot_preview1: {
      // Standard error alone is written to: the last words before a trap.
      fd_write(_file, vectors, count, total) {
        let bytes = 0;
        for (let i = 0; i < count; i++) {
          const length = memory().getUint32(vectors + 8 * i + 4, true);
          const words = new Uint8Array(exports.memory.buffer, memory().getUint32(vectors + 8 * i, true), length);
          written = (written + new TextDecoder().decode(words)).slice(-400);
          bytes += length;
        }
        memory().setUint32(total, bytes, true);
        return 0;
      },
      fd_close: () => 8, // no such file
      fd_seek: () => 8,
      proc_exit(code) {
        throw new WasmError(written || `ended with ${code}`);
      },
    },
  };
  const instance = await WebAssembly.instantiate(module, imports);
  exports = instance.exports;
  exports._initialize();
  /** Calls name; after an error the stack is as it was. */
  const call = (name, ...values) => {
    const stack = exports.__stack_pointer.value;
    try {
      return exports[name](...values);
    } catch (error) {
      exports.__stack_pointer.value = stack;
      if (error instanceof WebAssembly.Exception) {
        throw new WasmError(textAt(exports.exception_text()));
      }
      throw error instanceof WebAssembly.RuntimeError && written ? new WasmError(written) : error;
    }
  };
  return {
    exports,
    call,
    /** Views of the memory; a call may move it, so they are good until the next one. */
    bytes: (at, length) => new Uint8Array(exports.memory.buffer, at, length),
    floats: (at, length) => new Float32Array(exports.memory.buffer, at, length),
    words: (at, length) => new Uint32Array(exports.memory.buffer, at, length),
    doubles: (at, length) => new Float64Array(exports.memory.buffer, at, length),
  };
}
