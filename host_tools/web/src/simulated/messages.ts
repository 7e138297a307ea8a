/** Between the page and the worker of a simulated fingertip. */
import type { FirmwareTruth } from '../../wasm/firmware.mjs';
import type { RealTimeOptions } from '../../wasm/real_time.mjs';

export type ToWorker =
  | { kind: 'start'; wasm: string; objects: string; options: RealTimeOptions }
  | { kind: 'open' }
  | { kind: 'close' }
  | { kind: 'unplug' }
  | { kind: 'send'; bytes: Uint8Array }
  | {
      kind: 'act';
      name: 'choose' | 'press' | 'hold' | 'drop' | 'lift' | 'setFriction';
      values: unknown[];
    };

export type FromWorker =
  | { kind: 'opened' }
  | { kind: 'failed'; why: string }
  /** at_ms: since the Unix epoch. */
  | { kind: 'bytes'; bytes: Uint8Array; at_ms: number }
  | { kind: 'truth'; truth: FirmwareTruth }
  | { kind: 'left'; why: string };
