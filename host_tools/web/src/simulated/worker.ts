/** Runs a simulated fingertip beside the page. */
import { WasmError, fetched } from '../../wasm/module.mjs';
import { RealTime } from '../../wasm/real_time.mjs';
import type { ShownTruth } from '../view/shown';

export type ToWorker =
  /** Of the first, the addresses of simulated.wasm and of the file of objects, and RealTime's options. */
  | { kind: 'open'; wasm: string; objects: string; options: ConstructorParameters<typeof RealTime>[0]['options'] }
  | { kind: 'close' }
  | { kind: 'send'; bytes: Uint8Array }
  /** As of RealTime. */
  | { kind: 'act'; name: string; values: number[] };

export type FromWorker =
  | { kind: 'opened' }
  /** why: and what to do. */
  | { kind: 'failed'; why: string }
  /** at_ms: since the Unix epoch. */
  | { kind: 'bytes'; bytes: Uint8Array; at_ms: number; truth: ShownTruth }
  | { kind: 'left'; why: string };

const TICK_ms = 4;

let fingertip: Promise<RealTime> | null = null;

function post(message: FromWorker, transfer: Transferable[] = []): void {
  postMessage(message, { transfer });
}

async function start({ wasm, objects, options }: ToWorker & { kind: 'open' }): Promise<RealTime> {
  const made = new RealTime({
    module: await WebAssembly.compile(await fetched(wasm)),
    objects: new Uint8Array(await fetched(objects)),
    options,
    clock: () => performance.now(),
    on_bytes: (bytes, truth) => post({ kind: 'bytes', bytes, at_ms: performance.timeOrigin + performance.now(), truth }, [bytes.buffer]),
    on_left: (why) => post({ kind: 'left', why }),
  });
  const tick = () => {
    try {
      made.tick();
      setTimeout(tick, TICK_ms);
    } catch (error) {
      post({ kind: 'left', why: `the simulated fingertip broke down: ${String(error)}` });
    }
  };
  tick();
  return made;
}

async function take(message: ToWorker): Promise<void> {
  if (message.kind === 'open') {
    try {
      fingertip ??= start(message);
      await (await fingertip).open();
      post({ kind: 'opened' });
    } catch (error) {
      post({ kind: 'failed', why: error instanceof WasmError ? error.message : `${String(error)}; load the page again` });
    }
    return;
  }
  const running = await fingertip?.catch(() => null);
  if (message.kind === 'close') {
    running?.close();
  } else if (message.kind === 'send') {
    running?.send(message.bytes);
  } else {
    running?.act(message.name, ...message.values);
  }
}

addEventListener('message', (event: MessageEvent<ToWorker>) => void take(event.data));
