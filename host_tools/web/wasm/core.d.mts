import type { Core } from '../src/core';

export class CoreError extends Error {
  readonly status: number;
}

export function load(bytes: BufferSource, unpack: (packed: Uint8Array, size: number) => Uint8Array): Promise<Core>;
