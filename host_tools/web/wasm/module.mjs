// The page's WebAssembly modules, in the browser and in node: what they import, and errors.

/** An uncaught exception of C++, or the last output of a library that gave up. The message is for people. */
export class WasmError extends Error {}

/** The firmware ended itself, for its loader or in a panic; the module cannot be run again. */
export class FirmwareLeft extends Error {
  static LOADER = 1; // enum native_end

  constructor(how) {
    super('the firmware ended itself');
    this.how = how;
  }
}

/**
 * The bytes of one of the page's files.
 * @param {string} url
 */
export async function fetched(url) {
  const response = await fetch(url).catch(() => null);
  if (!response?.ok) {
    throw new WasmError(`${url}: the server answers ${response?.status ?? 'nothing'}; load the page again`);
  }
  return response.arrayBuffer();
}

/**
 * An instance of a compiled module: its exports, ready to be called. unpack: what core.wasm wants.
 * @param {WebAssembly.Module} module
 * @param {((packed: Uint8Array, size: number) => Uint8Array) | null} unpack
 */
export async function start(module, unpack = null) {
  let exports;
  let written = '';
  const memory = () => new DataView(exports.memory.buffer);
  /** @param {number} at */
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
          return bytes.length;
        } catch {
          return -1;
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
  /**
   * Calls name; after an error the stack is as it was.
   * @param {string} name
   * @param {...(number | bigint)} values
   * @returns {number}
   */
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
  const viewed = (Array) => (at, length) => new Array(exports.memory.buffer, at, length);
  /** Views of the memory; a call may move it, so they are good until the next one. */
  /** @type {(at: number, length: number) => Uint8Array<ArrayBuffer>} */
  const bytes = viewed(Uint8Array);
  /** @type {(at: number, length: number) => Uint32Array} */
  const words = viewed(Uint32Array);
  /** @type {(at: number, length: number) => Float64Array} */
  const doubles = viewed(Float64Array);
  /**
   * What the function returns that is called with the addresses of copies of these, which then go; a text gets its final zero, null is 0.
   * @param {(ArrayBufferView | string | null)[]} parts
   * @param {(...at: number[]) => number} use
   */
  const lend = (parts, use) => {
    const lent = parts.map((part) => {
      const view = typeof part === 'string' ? new TextEncoder().encode(`${part}\0`) : part;
      const at = view ? call('malloc', view.byteLength) : 0;
      if (view) {
        bytes(at, view.byteLength).set(new Uint8Array(view.buffer, view.byteOffset, view.byteLength));
      }
      return at;
    });
    try {
      return use(...lent);
    } finally {
      lent.forEach((at) => call('free', at));
    }
  };
  return { call, bytes, words, doubles, lend, textAt };
}
