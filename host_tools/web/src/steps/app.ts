/** What the page does with fingertips: finds them, has them come back, records, replays. */
import type { Line } from '../line/line';
import { SerialLine, hasWebSerial, rememberedPorts, requestPort, whyNoWebSerial } from '../line/serial_line';
import { Fingertip, OtherFingertip } from '../model/fingertip';
import type { Recorder, RecordingKind } from '../recording/recorder';
import type { Replay } from '../recording/replay_line';
import { ServedFingertip, findServed } from '../simulated/served_fingertip';
import { SimulatedFingertip } from '../simulated/simulated_fingertip';
import { version } from '../../package.json';
import { wordsOf } from '../view/elements';

export const PAGE_VERSION = version;

// Fetched when they are first needed: the page is there sooner.
const recording = () => import('../recording/recorder');
const replaying = () => import('../recording/replay_line');

/** Linux gives a port its group and rights a moment after it is there. */
const RIGHTS_ms = 300;
/** Between two searches for fingertips of `fingertip simulate`. */
const LOOK_ms = 1500;

const NONE_CHOSEN =
  'No fingertip was chosen. None in the list: plug one in, with a cable that carries data. No list: allow this site ' +
  'to use serial ports in the settings of the browser.';

export class App {
  /** In the order in which they came. */
  readonly fingertips: Fingertip[] = [];
  readonly recorders = new Map<Fingertip, Recorder>();
  /** Recordings until they are written whole, or have failed. */
  readonly unsaved = new Set<Recorder>();
  readonly replays = new Map<Fingertip, Replay>();
  /** Shows a message to the user: a plain one for a while, a bad one until it is closed; set by main. */
  notice: (text: string, kind: 'plain' | 'bad') => void = () => undefined;

  private readonly listeners = new Set<() => void>();
  private readonly leaving = new WeakSet<Fingertip>();
  private readonly ports = new Map<SerialPort, Fingertip>();
  /** Fingertips of `fingertip simulate`, by serial number; null: the user took it off the page. */
  private readonly served = new Map<string, Fingertip | null>();
  private finding: Promise<void> = Promise.resolve();
  private simulated = 0;

  /** Called after a fingertip came or went, and after a recording or a replay began, ended, paused or got another speed.
   * Returns what ends it. */
  listen(listener: () => void): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }

  /** Takes up the ports that the page may use and the fingertips that this computer simulates, now
   * and as they come. */
  start(): void {
    void this.lookForServed();
    if (hasWebSerial()) {
      void this.find();
      navigator.serial.addEventListener('connect', (event) => {
        const port = event.target as SerialPort;
        setTimeout(() => void this.find(port), RIGHTS_ms);
      });
    }
  }

  /** Asks for a port; ports that the page may use already and that are not open come first, unless they were tried and were none. */
  async connect(): Promise<void> {
    try {
      if (!hasWebSerial()) {
        throw new Error(whyNoWebSerial());
      }
      const isWaiting = (port: SerialPort): boolean => !this.isOpen(port) && this.ports.get(port)?.info !== null;
      if ((await rememberedPorts()).some(isWaiting)) {
        await this.find();
        return;
      }
      const port = await requestPort();
      if (port) {
        await this.find(port);
      } else {
        this.notice(NONE_CHOSEN, 'plain');
      }
    } catch (error) {
      this.notice(wordsOf(error), 'bad');
    }
  }

  simulate(): void {
    const serial = `51${String(++this.simulated).padStart(14, '0')}`;
    const fingertip = new Fingertip(new SimulatedFingertip(serial, this.simulated));
    this.add(fingertip);
    fingertip.open().catch((error: unknown) => this.failed(fingertip, error));
  }

  async replay(file: File): Promise<void> {
    const replay = new (await replaying()).Replay(file);
    replay.onLine = (line: Line) => {
      const fingertip = new Fingertip(line, { is_replay: true });
      this.replays.set(fingertip, replay);
      this.add(fingertip);
      void fingertip.open();
    };
    replay.onEnd = (problem) => {
      if (problem) {
        this.notice(problem, 'bad');
      }
      this.changed();
    };
    await replay.start();
    this.changed();
  }

  changeReplay(replay: Replay | undefined, change: Partial<Pick<Replay, 'paused' | 'speed'>>): void {
    if (replay) {
      Object.assign(replay, change);
      this.changed();
    }
  }

  /** Closes it and takes it off the page. */
  async disconnect(fingertip: Fingertip): Promise<void> {
    if (this.leaving.has(fingertip)) {
      return;
    }
    this.leaving.add(fingertip);
    await this.stopRecording(fingertip);
    await fingertip.close().catch(() => undefined);
    for (const [port, each] of this.ports) {
      if (each === fingertip) {
        this.ports.delete(port);
      }
    }
    for (const [serial, each] of this.served) {
      if (each === fingertip) {
        this.served.set(serial, null);
      }
    }
    if (fingertip.line instanceof SimulatedFingertip) {
      fingertip.line.dispose();
    }
    this.replays.delete(fingertip);
    this.fingertips.splice(this.fingertips.indexOf(fingertip), 1);
    this.changed();
  }

  /** False: nothing was chosen. Throws Error, a sentence. */
  async record(fingertip: Fingertip, kind: RecordingKind): Promise<boolean> {
    const { Recorder, chooseOutput, recordingName } = await recording();
    const output = await chooseOutput(recordingName(fingertip, kind));
    if (!output) {
      return false;
    }
    const recorder = new Recorder(fingertip, kind, output, PAGE_VERSION, (why) => {
      this.notice(why, 'bad');
      void this.stopRecording(fingertip);
    });
    this.recorders.set(fingertip, recorder);
    this.unsaved.add(recorder);
    this.changed();
    try {
      await fingertip.askInfo();
    } catch (error) {
      await this.stopRecording(fingertip);
      throw error;
    }
    return true;
  }

  async stopRecording(fingertip: Fingertip): Promise<void> {
    const recorder = this.recorders.get(fingertip);
    if (!recorder) {
      return;
    }
    this.recorders.delete(fingertip);
    this.changed();
    try {
      await recorder.finish();
      this.notice(`${recorder.output.name}: ${recorder.frames} frames recorded`, 'plain');
    } catch (error) {
      if (!recorder.failure) {
        this.notice(wordsOf(error), 'bad');
      }
    } finally {
      this.unsaved.delete(recorder);
    }
  }

  /** The serial port that it has or had; null: it is on none. */
  portOf(fingertip: Fingertip): SerialPort | null {
    return fingertip.line instanceof SerialLine ? fingertip.line.port : null;
  }

  private isOpen(port: SerialPort): boolean {
    const state = this.ports.get(port)?.state;
    return state !== undefined && state !== 'closed';
  }

  /** One port after the other: two attempts at one would disturb each other. */
  private find(only?: SerialPort): Promise<void> {
    this.finding = this.finding.then(async () => {
      const ports = only ? [only] : await rememberedPorts();
      for (const port of ports) {
        if (!this.isOpen(port)) {
          await this.take(port);
        }
      }
    });
    return this.finding;
  }

  /** Opens a port as the fingertip that it was before, or as another that is away; else as a new one. */
  private async take(port: SerialPort): Promise<void> {
    const known = this.ports.get(port);
    const others = this.fingertips.filter((each) => each.state === 'closed' && each !== known && each.line instanceof SerialLine);
    for (const fingertip of [...(known ? [known] : []), ...others]) {
      try {
        await fingertip.open(new SerialLine(port));
        this.ports.set(port, fingertip);
        return;
      } catch (error) {
        if (!(error instanceof OtherFingertip)) {
          this.ports.set(port, fingertip);
          this.failed(fingertip, error);
          return;
        }
      }
    }
    const fingertip = new Fingertip(new SerialLine(port));
    this.ports.set(port, fingertip);
    this.add(fingertip);
    await fingertip.open().catch((error: unknown) => this.failed(fingertip, error));
  }

  /** Unless its user just takes it off the page. */
  private failed(fingertip: Fingertip, error: unknown): void {
    if (!this.leaving.has(fingertip)) {
      this.notice(`${fingertip.name}: ${wordsOf(error)}`, 'bad');
    }
  }

  private async lookForServed(): Promise<void> {
    try {
      const found = await findServed((why) => this.notice(`simulated fingertips: ${why}`, 'plain'));
      if (found === null) {
        return;
      }
      for (const serial of [...this.served.keys()]) {
        // One that the user took off comes back with a new simulation.
        if (this.served.get(serial) === null && !found.some((each) => each.serial === serial)) {
          this.served.delete(serial);
        }
      }
      for (const each of found) {
        const known = this.served.get(each.serial);
        if (known === undefined) {
          const fingertip = new Fingertip(new ServedFingertip(each));
          this.served.set(each.serial, fingertip);
          this.add(fingertip);
          await fingertip.open().catch(() => undefined); // it shows why
        } else if (known?.state === 'closed') {
          await known.open(new ServedFingertip(each)).catch(() => undefined);
        }
      }
    } catch {
      // The server has just ended: the next search shows it.
    }
    setTimeout(() => void this.lookForServed(), LOOK_ms);
  }

  private add(fingertip: Fingertip): void {
    this.fingertips.push(fingertip);
    this.changed();
  }

  private changed(): void {
    this.listeners.forEach((listener) => listener());
  }
}
