import type { FirmwareTruth } from './firmware.mjs';

export interface RealTimeOptions {
  serial?: string;
  seed?: number;
  noise?: number;
  errors?: string;
  parallelBus?: boolean;
}

export class RealTime {
  constructor(parts: {
    module: WebAssembly.Module;
    objects: Uint8Array;
    options: RealTimeOptions;
    on: {
      bytes(bytes: Uint8Array): void;
      truth(truth: FirmwareTruth): void;
      left(why: string): void;
    };
    clock: () => number;
  });
  readonly skipped_ms: number;
  open(): Promise<void>;
  close(): void;
  send(bytes: Uint8Array): void;
  act(name: 'choose' | 'press' | 'hold' | 'drop' | 'lift' | 'setFriction', ...values: unknown[]): void;
  unplug(): void;
  tick(): void;
}
