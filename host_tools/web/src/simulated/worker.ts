/** Runs a simulated fingertip beside the page. */
import { RealTime } from '../../wasm/real_time.mjs';
import type { FromWorker, ToWorker } from './messages';

const TICK_ms = 4;
const TRUTH_ms = 16;

let fingertip: Promise<RealTime> | null = null;

function post(message: FromWorker, transfer: Transferable[] = []): void {
  postMessage(message, { transfer });
}

async function fetched(url: string): Promise<ArrayBuffer> {
  const response = await fetch(url);
  if (!response.ok) {
    throw new Error(`${url}: ${response.status}`);
  }
  return response.arrayBuffer();
}

async function start(message: ToWorker & { kind: 'start' }): Promise<RealTime> {
  const [wasm, objects] = await Promise.all([fetched(message.wasm), fetched(message.objects)]);
  let truth_sent_ms = 0;
  const made = new RealTime({
    module: await WebAssembly.compile(wasm),
    objects: new Uint8Array(objects),
    options: message.options,
    clock: () => performance.now(),
    on: {
      bytes(bytes) {
        const at_ms = performance.timeOrigin + performance.now();
        post({ kind: 'bytes', bytes, at_ms }, [bytes.buffer as ArrayBuffer]);
      },
      truth(truth) {
        const now_ms = performance.now();
        if (now_ms - truth_sent_ms >= TRUTH_ms) {
          truth_sent_ms = now_ms;
          post({ kind: 'truth', truth });
        }
      },
      left: (why) => post({ kind: 'left', why }),
    },
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
  if (message.kind === 'start') {
    fingertip = start(message);
    // Sent to the page that opens it.
    fingertip.catch(() => {});
    return;
  }
  if (message.kind === 'open') {
    try {
      await (await fingertip)?.open();
      post({ kind: 'opened' });
    } catch (error) {
      post({ kind: 'failed', why: error instanceof Error ? error.message : String(error) });
    }
    return;
  }
  const running = await fingertip?.catch(() => null);
  if (!running) {
    return;
  }
  switch (message.kind) {
    case 'close':
      running.close();
      break;
    case 'unplug':
      running.unplug();
      break;
    case 'send':
      running.send(message.bytes);
      break;
    case 'act':
      running.act(message.name, ...message.values);
      break;
  }
}

addEventListener('message', (event: MessageEvent<ToWorker>) => void take(event.data));
