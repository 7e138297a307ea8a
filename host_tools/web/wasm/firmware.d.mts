import type { WasmModule } from './module.mjs';

export interface FirmwareTruth {
  t_us: number;
  contact: boolean;
  x_mm: number;
  y_mm: number;
  force_N: number;
  qx_N: number;
  qy_N: number;
  slips: boolean;
}

export interface Press {
  x_mm: number;
  y_mm: number;
  force_N: number;
}

export class Firmware {
  static of(module: WebAssembly.Module): Promise<Firmware>;
  readonly wasm: WasmModule;
  readonly sensors: number;
  setRows(rows: {
    ambient_Pa: number;
    times_s: ArrayLike<number>;
    pressures_Pa: ArrayLike<number>;
    temperatures_degC: ArrayLike<number>;
  }): void;
  setWorld(world: { objects: Uint8Array; errors?: string; seed?: number }): void;
  padCommand(): Uint8Array;
  usePad(command: Uint8Array): void;
  choose(object: number): void;
  press(hand: Press): void;
  hold(grip: Press & { load_N: number; angle_deg: number }): void;
  drop(x_mm: number, y_mm: number, mass_g: number): void;
  lift(): void;
  setFriction(friction: number): void;
  truth(): FirmwareTruth;
  powerUp(options: {
    serial?: string;
    seed?: number;
    noise?: number;
    promSpread?: number;
    parallelBus?: boolean;
    kept?: Uint8Array | null;
  }): void;
  runUntil(t_us: number): void;
  open(): void;
  close(): void;
  send(bytes: Uint8Array): number;
  receive(): Uint8Array;
  kept(): Uint8Array;
}
