export class WasmError extends Error {}

export class FirmwareLeft extends Error {
  static readonly LOADER: number;
  readonly how: number;
}

export interface WasmModule {
  readonly exports: Record<string, unknown>;
  call(name: string, ...values: number[]): number;
  bytes(at: number, length: number): Uint8Array;
  floats(at: number, length: number): Float32Array;
  words(at: number, length: number): Uint32Array;
  doubles(at: number, length: number): Float64Array;
}

export function start(module: WebAssembly.Module, unpack?: (packed: Uint8Array, size: number) => Uint8Array): Promise<WasmModule>;
