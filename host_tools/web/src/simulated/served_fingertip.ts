/**
 * A fingertip of `fingertip simulate` on this computer, which the server of the page, `fingertip
 * web`, passes on (host_tools/web/server/simulations.hpp). Simulated figures, all of them.
 */
import type { Line } from '../line/line';
import { NO_TRUTH, type Hand } from '../view/shown';

export interface Served {
  serial: string;
  /** A hand is obeyed: it was started with --mouse. */
  hand: boolean;
}

const ASK_ms = 33;

const at = (path: string, query: Record<string, string> = {}): string => {
  const url = new URL(path, document.baseURI);
  Object.entries(query).forEach(([name, value]) => url.searchParams.set(name, value));
  return url.href;
};

/** Those that run now. null: this server knows none, or refuses them to this page, now and later. Throws where it does not answer. */
export async function findServed(refused: (why: string) => void): Promise<Served[] | null> {
  const answer = await fetch(at('simulated'));
  if (answer.status === 403) {
    refused((await answer.text()).trim());
  }
  const isList = answer.ok && (answer.headers.get('content-type') ?? '').startsWith('application/json');
  return isList ? ((await answer.json()) as Served[]) : null;
}

export class ServedFingertip implements Line {
  readonly label: string;
  /** Some 30 ms old. */
  truth = NO_TRUTH;
  /** A ball of 15 mm, on rubber of 12 mm. */
  readonly press: Hand['press'] | undefined;

  private readonly client = Array.from(crypto.getRandomValues(new Uint8Array(8)), (byte) => byte.toString(16).padStart(2, '0')).join('');
  private readonly aborter = new AbortController();
  private timer: ReturnType<typeof setInterval> | undefined;
  private asking = false;
  private command = '';

  constructor(readonly served: Served) {
    this.label = `simulated ${served.serial.slice(-4)}`;
    this.press = served.hand
      ? ({ x_mm, y_mm, force_N }) => this.ask(`press ${[x_mm, y_mm, force_N].map((value) => value.toFixed(3)).join(' ')}`)
      : undefined;
  }

  lift(): void {
    void this.ask('lift');
  }

  async open(receive: (bytes: Uint8Array, at_ms: number) => void, closed: (why: string) => void): Promise<void> {
    const query = { serial: this.served.serial, client: this.client };
    const answer = await fetch(at('simulated/line', query), { signal: this.aborter.signal });
    if (!answer.ok || !answer.body) {
      throw new Error(`the simulated fingertip cannot be reached: ${(await answer.text()).trim()}`);
    }
    this.timer = setInterval(() => void this.ask(''), ASK_ms);
    void this.read(answer.body.getReader(), receive, closed);
  }

  async send(bytes: Uint8Array): Promise<void> {
    const answer = await this.post('simulated/line', bytes.slice());
    if (!answer.ok) {
      throw new Error((await answer.text()).trim());
    }
  }

  close(): Promise<void> {
    this.end();
    this.aborter.abort();
    return Promise.resolve();
  }

  private async read(
    reader: ReadableStreamDefaultReader<Uint8Array>,
    receive: (bytes: Uint8Array, at_ms: number) => void,
    closed: (why: string) => void,
  ): Promise<void> {
    try {
      for (let piece = await reader.read(); !piece.done; piece = await reader.read()) {
        receive(piece.value, performance.now());
      }
    } catch {
      // The server has ended, or close() was called.
    }
    this.end();
    if (!this.aborter.signal.aborted) {
      closed('the simulation has ended: start "fingertip simulate" again and it comes back by itself');
    }
  }

  private post(path: string, body: BodyInit): Promise<Response> {
    return fetch(at(path, { client: this.client }), { method: 'POST', body });
  }

  /** What the hand does, and what is true; one request at a time, so a slow server gets the newest. */
  private async ask(command: string): Promise<void> {
    this.command = command || this.command;
    if (this.asking) {
      return;
    }
    this.asking = true;
    const sent = this.command;
    this.command = '';
    try {
      const answer = await this.post('simulated/hand', sent);
      if (answer.ok && this.timer !== undefined) {
        const truth = (await answer.json()) as Partial<typeof NO_TRUTH>;
        const { force_N = 0 } = truth;
        this.truth = { ...NO_TRUTH, ...truth, contact: force_N > 0 };
      }
    } catch {
      // The line reports that the server has ended.
    }
    this.asking = false;
    if (this.command !== '' && this.timer !== undefined) {
      void this.ask('');
    }
  }

  private end(): void {
    clearInterval(this.timer);
    this.timer = undefined;
    this.truth = NO_TRUTH;
  }
}
