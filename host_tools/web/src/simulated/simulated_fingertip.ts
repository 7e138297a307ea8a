/**
 * A fingertip without hardware: the firmware's own code on simulated sensors under simulated
 * rubber, in a worker, in real time. Simulated figures, all of them.
 *
 * The pad: 12 mm of silicone without ends (host_tools/simulation/twin), 30 by 50 mm, x across, y along, origin
 * in the middle, sensors within 9 and 18 mm. An object is chosen, then a hand presses and drags it,
 * it is dropped as a weight, or a grip holds it while a load pulls. Friction is Coulomb's with the
 * rubber's give before it: what is dragged sticks, gives, then slips
 * (host_tools/web/wasm/world.hpp). Places beyond the pad and values beyond their ranges are no
 * error: nothing is touched there, and what is too much counts as the most.
 */
import type { Line } from '../line/line';
import type { FirmwareTruth } from '../../wasm/firmware.mjs';
import type { FromWorker, ToWorker } from './messages';
import { OBJECTS, type SimulatedObject } from './objects';

export type { SimulatedObject } from './objects';

/** A hand that holds the object. */
export interface Hand {
  x_mm: number;
  y_mm: number;
  /** Down, 0..50. */
  force_N: number;
}

/** A grip that presses the object on the pad while a load, its weight, pulls it along the pad. It
 * stays where it was first held, until it slides; one that slid off stays lost until it is let go. */
export interface Grip extends Hand {
  /** 0..50; the object's weight, so its mass follows. */
  load_N: number;
  /** From x towards y. */
  angle_deg: number;
}

/** What really happens, at most some 20 ms before the newest bytes. t_us: device time, as in the
 * packets. Place, force and pull are 0 without contact; slips: all of the contact slides. */
export type Truth = FirmwareTruth;

export interface SimulatedOptions {
  /** Sixteen hexadecimal digits distinguish several. */
  serial?: string;
  /** Seed of noise and of the pad's errors; 1. */
  seed?: number;
  /** Times the data sheet's noise; 1. */
  noise?: number;
  /** Errors of pad and sensors, as in `twin scenario --effects`: "gain=10,drift"; gains as cast,
   * "gain=10", by default; "none": a perfect pad. */
  errors?: string;
  /** Where simulated.wasm and objects.bin are; the page's folder wasm/. */
  files?: string;
}

const NOTHING: Truth = {
  t_us: 0,
  contact: false,
  x_mm: 0,
  y_mm: 0,
  force_N: 0,
  qx_N: 0,
  qy_N: 0,
  slips: false,
};

export class SimulatedFingertip implements Line {
  readonly label = 'simulated fingertip';
  readonly objects: readonly SimulatedObject[] = OBJECTS;
  /** Called with each new truth, some 60 a second while it runs. */
  onTruth: ((truth: Truth) => void) | null = null;

  private readonly worker: Worker;
  private newest: Truth = NOTHING;
  private object = 0;
  private receive: ((bytes: Uint8Array, at_ms: number) => void) | null = null;
  private closed: ((why: string) => void) | null = null;
  private opening: { done: () => void; failed: (error: Error) => void } | null = null;

  constructor(options: SimulatedOptions = {}) {
    const { files = 'wasm/', errors = 'gain=10', ...others } = options;
    const folder = new URL(files, document.baseURI);
    this.worker = new Worker(new URL('./worker.ts', import.meta.url), { type: 'module' });
    this.worker.addEventListener('message', (event: MessageEvent<FromWorker>) => this.take(event.data));
    this.worker.addEventListener('error', (event) => this.take({ kind: 'failed', why: event.message || 'its worker did not start' }));
    this.post({
      kind: 'start',
      wasm: new URL('simulated.wasm', folder).href,
      objects: new URL('objects.bin', folder).href,
      options: { ...others, errors, parallelBus: true },
    });
  }

  get truth(): Truth {
    return this.newest;
  }

  open(receive: (bytes: Uint8Array, at_ms: number) => void, closed: (why: string) => void): Promise<void> {
    this.receive = receive;
    this.closed = closed;
    return new Promise((done, failed) => {
      this.opening = { done, failed };
      this.post({ kind: 'open' });
    });
  }

  send(bytes: Uint8Array): Promise<void> {
    this.post({ kind: 'send', bytes: bytes.slice() });
    return Promise.resolve();
  }

  /** The line only: the fingertip goes on, and can be opened again. */
  close(): Promise<void> {
    this.receive = this.closed = null;
    this.post({ kind: 'close' });
    return Promise.resolve();
  }

  /** Chooses an object by name; lifts the one that was there. */
  choose(name: string): void {
    const at = OBJECTS.findIndex((object) => object.name === name);
    if (at < 0) {
      throw new Error(`there is no object "${name}"`);
    }
    this.object = at;
    this.act('choose', at);
  }

  /** Presses, and drags along as x_mm and y_mm change; null lifts. */
  press(hand: Hand | null): void {
    if (hand) {
      this.act('press', { ...hand });
    } else {
      this.act('lift');
    }
  }

  /** Lets the chosen object fall from 3 mm; it lies there until it is lifted or pressed. */
  drop(x_mm: number, y_mm: number): void {
    this.act('drop', x_mm, y_mm, OBJECTS[this.object]?.mass_g ?? 0);
  }

  /** Holds, and lets it slip where the load is more than friction holds; null lets go. */
  hold(grip: Grip | null): void {
    if (grip) {
      this.act('hold', { ...grip });
    } else {
      this.act('lift');
    }
  }

  /** Static friction, 0.1..1.5; 0.5 at first. Kinetic is 0.8 of it. */
  setFriction(friction: number): void {
    this.act('setFriction', friction);
  }

  /** Pulls the plug; with the next open it restarts, with what it had kept. */
  unplug(): void {
    this.post({ kind: 'unplug' });
  }

  /** Ends the worker, for good. */
  dispose(): void {
    this.worker.terminate();
    this.receive = this.closed = null;
  }

  private post(message: ToWorker): void {
    this.worker.postMessage(message);
  }

  private act(name: (ToWorker & { kind: 'act' })['name'], ...values: unknown[]): void {
    this.post({ kind: 'act', name, values });
  }

  private take(message: FromWorker): void {
    switch (message.kind) {
      case 'opened':
        this.opening?.done();
        this.opening = null;
        break;
      case 'failed':
        this.opening?.failed(new Error(`the simulated fingertip cannot start (${message.why}); load the page again`));
        this.opening = null;
        break;
      case 'bytes':
        this.receive?.(message.bytes, message.at_ms - performance.timeOrigin);
        break;
      case 'truth':
        this.newest = message.truth;
        this.onTruth?.(message.truth);
        break;
      case 'left': {
        const closed = this.closed;
        this.receive = this.closed = null;
        this.newest = NOTHING;
        closed?.(message.why);
        break;
      }
    }
  }
}
