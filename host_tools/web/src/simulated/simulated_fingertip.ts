/**
 * A fingertip without hardware: the firmware's own code on simulated sensors under simulated
 * rubber, in a worker, in real time. Simulated figures, all of them.
 * host_tools/web/wasm/world.hpp explains the pad and what happens to it.
 */
import type { Line } from '../line/line';
import { NO_TRUTH, type Hand } from '../view/shown';
import type { FromWorker, ToWorker } from './worker';

/** What may press on the pad, in the order of the file of objects (host_tools/web/tables/objects_of_twin.cpp); mass_g: when it is dropped. */
const OBJECTS = [
  { name: 'sphere15', title: 'ball of 15 mm, 300 g', mass_g: 300 },
  { name: 'sphere6', title: 'ball of 6 mm', mass_g: 100 },
  { name: 'cube12', title: 'cube of 12 mm', mass_g: 100 },
  { name: 'cube24', title: 'plate of 24 mm', mass_g: 200 },
  { name: 'cylinder24', title: 'lying cylinder, 24 mm', mass_g: 200 },
  { name: 'lime', title: 'lime', mass_g: 70 },
];
/** Of the pad, as `twin scenario --effects`: gains as cast. */
const ERRORS = 'gain=10';

export class SimulatedFingertip implements Line, Hand {
  readonly label = 'simulated fingertip';
  readonly objects = OBJECTS;
  truth = NO_TRUTH;

  private readonly worker: Worker;
  private object = 0;
  private receive: ((bytes: Uint8Array, at_ms: number) => void) | null = null;
  private closed: ((why: string) => void) | null = null;
  private opening: { done: () => void; failed: (error: Error) => void } | null = null;

  /** serial: sixteen hexadecimal digits distinguish several. seed: of noise and of the pad's errors. */
  constructor(
    private readonly serial: string,
    private readonly seed: number,
  ) {
    this.worker = new Worker(new URL('./worker.ts', import.meta.url), { type: 'module' });
    this.worker.addEventListener('message', (event: MessageEvent<FromWorker>) => this.take(event.data));
    this.worker.addEventListener('error', (event) =>
      this.take({ kind: 'failed', why: `${event.message || 'its worker did not start'}; load the page again` }),
    );
  }

  open(receive: (bytes: Uint8Array, at_ms: number) => void, closed: (why: string) => void): Promise<void> {
    this.receive = receive;
    this.closed = closed;
    const file = (name: string): string => new URL(`wasm/${name}`, document.baseURI).href;
    const { serial, seed } = this;
    return new Promise((done, failed) => {
      this.opening = { done, failed };
      const options = { serial, seed, errors: ERRORS, parallelBus: true };
      this.post({ kind: 'open', wasm: file('simulated.wasm'), objects: file('objects.bin'), options });
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

  choose(name: string): void {
    this.object = OBJECTS.findIndex((object) => object.name === name);
    this.act('choose', this.object);
  }

  press({ x_mm, y_mm, force_N }: Parameters<Hand['press']>[0]): void {
    this.act('press', x_mm, y_mm, force_N);
  }

  lift(): void {
    this.act('lift');
  }

  drop(x_mm: number, y_mm: number): void {
    this.act('drop', x_mm, y_mm, OBJECTS[this.object].mass_g);
  }

  hold({ x_mm, y_mm, force_N, load_N, angle_deg }: Parameters<NonNullable<Hand['hold']>>[0]): void {
    this.act('hold', x_mm, y_mm, force_N, load_N, angle_deg);
  }

  setFriction(friction: number): void {
    this.act('friction', friction);
  }

  /** Ends the worker, for good. */
  dispose(): void {
    this.worker.terminate();
    this.receive = this.closed = null;
  }

  private post(message: ToWorker): void {
    this.worker.postMessage(message);
  }

  private act(name: string, ...values: number[]): void {
    this.post({ kind: 'act', name, values });
  }

  private take(message: FromWorker): void {
    switch (message.kind) {
      case 'opened':
        this.opening?.done();
        break;
      case 'failed':
        this.opening?.failed(new Error(`the simulated fingertip cannot start: ${message.why}`));
        break;
      case 'bytes':
        this.truth = message.truth;
        this.receive?.(message.bytes, message.at_ms - performance.timeOrigin);
        break;
      case 'left': {
        const { closed } = this;
        this.receive = this.closed = null;
        this.truth = NO_TRUTH;
        closed?.(message.why);
        break;
      }
    }
  }
}
