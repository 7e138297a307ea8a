/** A fingertip's model over a line that the test speaks on: answers, refusals, losses, going and coming back; history; what is done with it. */
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import test from 'node:test';
import type { Line } from '../../../host_tools/web/src/line/line';
import { SerialLine } from '../../../host_tools/web/src/line/serial_line';
import { Flag, PacketType, Result, Stream, WIRE_VERSION } from '../../../host_tools/web/src/line/line_facts';
import type { Contact, Info, Raw } from '../../../host_tools/web/src/line/line_facts';
import { CommandError, Fingertip, OtherFingertip } from '../../../host_tools/web/src/model/fingertip';
import { PATIENCE } from '../../../host_tools/web/src/model/patience';
import { History } from '../../../host_tools/web/src/model/history';
import { Recorder } from '../../../host_tools/web/src/recording/recorder';
import { App } from '../../../host_tools/web/src/steps/app';
import { commandsFor, set } from '../../../host_tools/web/src/steps/settings';
import { tare } from '../../../host_tools/web/src/steps/tare';
import { factsOf } from '../../../host_tools/web/src/view/health_facts';
import { Shown } from '../../../host_tools/web/src/view/shown';
import { load as loadJudges } from '../../../host_tools/web/wasm/judges.mjs';
import { core, decoded, vector } from './library';

function contactOf(frame: number, t_us: number, more: Partial<Contact> = {}): Contact {
  return { ...(core.blank(PacketType.CONTACT) as unknown as Contact), frame, t_us, ...more };
}

function rawOf(frame: number, t_us: number, above_Pa: number[], more: Partial<Raw> = {}): Raw {
  const raw = { ...(core.blank(PacketType.RAW) as unknown as Raw), frame, t_us, valid: 2 ** above_Pa.length - 1, ...more };
  raw.sensor_count = above_Pa.length;
  above_Pa.forEach((value, k) => {
    raw.pressure_Pa_q10[k] = (100_000 + value) * 1024;
    raw.baseline_Pa_q10[k] = 100_000 * 1024;
  });
  return raw;
}

type Asked = { type: number; sequence: number; t_us: number; streams?: number };

/** A fingertip as its line shows it. */
class SpokenLine implements Line {
  readonly label = 'a test';
  result: number = Result.DONE;
  streams = 0;
  commands: number[] = [];
  /** Version of the protocol that it speaks. */
  version: number = WIRE_VERSION;
  silent = false;
  /** Answers only once it has heard so many commands more, and then the first of them. */
  hears = 1;
  /** Says meanwhile that the repeats are not possible now. */
  refuses_repeats = false;
  /** So many of the packets that follow an acknowledgement do not arrive. */
  loses = 0;
  /** A command right behind whose acknowledgement it ends. */
  ends_after = 0;
  device_us = 5_000_000;
  sequence = 0;
  receive: (bytes: Uint8Array, at_ms: number) => void = () => undefined;
  closed: (why: string) => void = () => undefined;

  constructor(private readonly serial = '') {}

  async open(receive: SpokenLine['receive'], closed: SpokenLine['closed']): Promise<void> {
    this.receive = receive;
    this.closed = closed;
    receive(Uint8Array.of(7, 7, 0), performance.now()); // the end of a frame that was under way
  }

  async close(): Promise<void> {}

  say(packet: object & { type: number }): void {
    this.device_us += 100;
    this.receive(core.encode({ t_us: this.device_us, ...packet, sequence: this.sequence++ & 0xffff }), performance.now());
  }

  async send(frame: Uint8Array): Promise<void> {
    if (this.version !== WIRE_VERSION) {
      const known = core.infoFrameOfVersion(this.version);
      if (Buffer.compare(frame, known) === 0) {
        this.receive(known, performance.now()); // an empty packet will do: the version is judged first
      }
      return;
    }
    const command = decoded(frame) as Asked | null;
    if (!command) {
      return;
    }
    this.commands.push(command.type);
    if (this.silent) {
      return;
    }
    this.streams = command.streams ?? this.streams;
    if (--this.hears > 0) {
      if (this.refuses_repeats && this.first) {
        queueMicrotask(() => this.acknowledge(command, Result.NOT_NOW));
      }
      this.first ??= () => this.answer(command);
      return;
    }
    queueMicrotask(this.first ?? (() => this.answer(command)));
    this.first = null;
  }

  private first: (() => void) | null = null;

  private acknowledge({ type, sequence, t_us }: Asked, result: number): void {
    this.say({ type: PacketType.ACK, command: type, result, command_sequence: sequence, host_time_us: t_us });
    if (this.ends_after === type) {
      this.closed('unplugged');
    }
  }

  private answer(command: Asked): void {
    const { CMD_INFO, CMD_HEALTH, CMD_CRASH } = PacketType;
    const name = { [CMD_INFO]: 'info_grasp', [CMD_HEALTH]: 'health', [CMD_CRASH]: 'crash' }[command.type];
    this.acknowledge(command, name ? Result.DONE : this.result);
    if (name && --this.loses < 0) {
      this.say({ ...vector(name), t_us: this.device_us, ...(this.serial && { serial: this.serial }) });
    }
  }
}

const open: Fingertip[] = [];
// Or the timers of one whose test failed would keep the process.
test.afterEach(() => Promise.all(open.splice(0).map((each) => each.close())));

async function opened(): Promise<[Fingertip, SpokenLine]> {
  const line = new SpokenLine();
  const fingertip = new Fingertip(line);
  open.push(fingertip);
  await fingertip.open();
  return [fingertip, line];
}

test('it opens: info, streams, then live; frames reach model, history and taps', async () => {
  const [fingertip, line] = await opened();
  assert.equal(fingertip.state, 'live');
  assert.equal(fingertip.name, 'E66058388347A12C');
  assert.equal(line.streams, Stream.CONTACT | Stream.RAW | Stream.HEALTH);
  const seen: number[] = [];
  const end = fingertip.tap((packet) => seen.push(packet.type));
  const flags = Flag.CONTACT | Flag.FIT_VALID;
  line.say(contactOf(1, 6_000_000, { flags, force_N: 1.5 }));
  line.say(rawOf(1, 6_000_000, [875, 1125]));
  line.sequence += 4;
  line.say(contactOf(2, 6_001_000, { flags: 0 }));
  end();
  line.say(contactOf(3, 6_002_000));
  assert.deepEqual(seen, [1, 2, 1]);
  assert.equal(fingertip.lost, 4);
  assert.deepEqual([fingertip.contacts, fingertip.raws], [3, 1]);
  const { history } = fingertip;
  assert.ok(history);
  assert.equal(history.end, 3);
  assert.equal(history.columns.force_N[0], 1.5);
  assert.ok(Number.isNaN(history.columns.force_N[1]));
  assert.deepEqual([...history.readingsAt(0)!.pressure_Pa], [1000, 1000]); // over the gains 0.875 and 1.125
  assert.equal(history.readingsAt(1), null);
  await fingertip.close();
  assert.equal(line.streams, 0);
  assert.equal(fingertip.state, 'closed');
});

test('refusals and questions: what a command is answered', async () => {
  const [fingertip, line] = await opened();
  line.result = Result.NOT_NOW;
  await assert.rejects(fingertip.tare(), (error) => error instanceof CommandError && error.result === Result.NOT_NOW);
  assert.equal(line.commands.filter((each) => each === PacketType.CMD_TARE).length, 1);
  line.result = Result.UNKNOWN_COMMAND;
  await assert.rejects(fingertip.tare(true), /does not know this command/);
  line.result = Result.DONE;
  await fingertip.tare();
  const timer = test.mock.method(globalThis, 'setTimeout');
  await assert.rejects(fingertip.command({ type: PacketType.CMD_RATE, rate_mHz: -1 }), /rate/);
  assert.equal(timer.mock.callCount(), 0, 'what no packet holds is not sent again');
  timer.mock.restore();
  assert.equal((await fingertip.askCrash())?.kind, 3);
  assert.equal((await fingertip.askHealth()).type, PacketType.HEALTH);
  await fingertip.close();
  await assert.rejects(fingertip.tare(), /not connected/);
});

test('an answer to the first try is one, however late; a packet that was lost is asked for again', async (t) => {
  const [fingertip, line] = await opened();
  const usual = { ...PATIENCE };
  t.after(() => Object.assign(PATIENCE, usual));
  Object.assign(PATIENCE, { tries: 3, answer_ms: 1 });
  line.hears = 3;
  await fingertip.tare();
  line.hears = 3;
  line.refuses_repeats = true;
  await fingertip.tare();
  line.loses = 2;
  assert.equal((await fingertip.askHealth()).type, PacketType.HEALTH);
  assert.ok(line.loses < 0);
  Object.assign(PATIENCE, { tries: 2 });
  line.loses = 1e6;
  await assert.rejects(fingertip.askHealth(), /no answer came; try again/);
});

test('the cable is pulled amid a command: it fails at once, with words; another line has it back', async () => {
  const [fingertip, line] = await opened();
  const framed_ms = performance.now() / 2;
  line.receive(core.encode({ ...contactOf(7, 9_000_000), sequence: line.sequence++ }), framed_ms);
  let text = '';
  const output = { name: '', failure: '', write: (bytes: Uint8Array) => void (text += Buffer.from(bytes)), finish: async () => {} };
  const recorder = new Recorder(fingertip, 'csv', output, '0', assert.fail);
  await fingertip.askInfo();
  line.silent = true;
  const waiting = fingertip.tare();
  const failed = assert.rejects(waiting, /plug it in/);
  line.closed('unplugged: plug it in again');
  await failed;
  assert.deepEqual([fingertip.state, fingertip.why], ['closed', 'unplugged: plug it in again']);

  await assert.rejects(fingertip.open(new SpokenLine('OTHER')), OtherFingertip);
  assert.deepEqual([fingertip.state, fingertip.name], ['closed', 'E66058388347A12C']);

  const back = new SpokenLine();
  await fingertip.open(back);
  assert.equal(fingertip.contacts, 0, 'the contact from before is not the newest');
  back.say(contactOf(1, 1_000)); // it restarted
  back.say(rawOf(1, 1_000, [0, 0]));
  const { history } = fingertip;
  assert.equal(history?.end, 2);
  assert.ok(history.t_s[1]! >= history.t_s[0]! + framed_ms / 1000, 'not since another was heard');
  assert.equal(fingertip.lost, 0);
  await recorder.finish();
  assert.match(text, /# event: gone .*\n# event: back .*\n# packet: info /);
  assert.equal(text.split('# event').length, 3, 'nothing of another is recorded');
  await fingertip.close();
});

test('closed amid a step of its opening: it stays closed, its line too', async () => {
  let opened = (): void => undefined;
  const close = test.mock.fn(async () => {});
  const late = Object.assign(new SpokenLine(), { close, open: () => new Promise<void>((done) => (opened = done)) });
  const fingertip = new Fingertip(late);
  const refused = assert.rejects(fingertip.open(), /disconnected by you/);
  await fingertip.close();
  opened();
  await refused;
  assert.deepEqual([close.mock.callCount(), late.commands], [2, []]);
  const brief = Object.assign(new SpokenLine(), { ends_after: PacketType.CMD_STREAM });
  await assert.rejects(new Fingertip(brief).open(), /unplugged/);
});

test('two clicks on "Disconnect" take one off the page, once its recording is whole; a tare ends with its fingertip', async () => {
  const app = new App();
  const [[first], [second, line]] = [await opened(), await opened()];
  app.fingertips.push(first, second);
  let whole = (): void => undefined;
  const stream = { write: async () => {}, close: () => new Promise<void>((done) => (whole = done)) };
  const showSaveFilePicker = async () => ({ name: 'a.csv', createWritable: async () => stream });
  Object.assign(globalThis, { window: { showSaveFilePicker } });
  await app.record(first, 'csv');
  const left = Promise.all([app.disconnect(first), app.disconnect(first)]);
  await new Promise(setImmediate);
  assert.deepEqual([app.recorders.size, app.unsaved.size], [0, 1]);
  whole();
  await left;
  assert.deepEqual([app.fingertips, app.unsaved.size], [[second], 0]);
  let said = '';
  app.notice = (text) => (said = text);
  line.ends_after = PacketType.CMD_TARE;
  await tare(app, second);
  assert.match(said, /not tared: unplugged/);
});

test('a simulated fingertip that cannot be opened keeps out none of the others; a port that is none leaves the choice, one of other USB ids is left alone', async (t) => {
  let looks = 0;
  Object.assign(globalThis, { document: { baseURI: 'http://here/' } });
  t.mock.method(globalThis, 'setTimeout', (then: () => void) => void setImmediate(then));
  t.mock.method(globalThis, 'fetch', async (url: string) => {
    const all = Response.json(looks === 0 ? [{ serial: 'A' }, { serial: 'B' }] : [], { status: looks > 0 ? 404 : 200 });
    return /simulated$/.test(url) && ++looks ? all : new Response('too many lines are open', { status: 503 });
  });
  let asked = 0;
  const open = () => Promise.reject(new DOMException('', 'NetworkError'));
  const port = { getInfo: () => ({ usbVendorId: 0x1209, usbProductId: 1 }), open, close: open };
  const other = { ...port, getInfo: () => ({ usbVendorId: 0x10c4, usbProductId: 0xea60 }), open: () => (asked++, open()) };
  const serial = { getPorts: async () => [other, port], requestPort: async () => (asked++, port) };
  Object.defineProperty(globalThis, 'navigator', { value: {}, configurable: true, writable: true });
  const app = new App();
  app.start();
  while (looks < 2) {
    await new Promise(setImmediate);
  }
  assert.equal(app.fingertips.length, 2);
  Object.assign(globalThis, { navigator: { serial } });
  await app.connect();
  await app.connect();
  assert.equal(asked, 1);
});

test('a port takes commands that come at once; one that hangs is closed', async () => {
  const sent: number[] = [];
  const write = async ([byte]: Uint8Array, { signal }: WritableStreamDefaultController): Promise<void> => {
    await new Promise<void>((done, fail) => (byte ? done() : signal.addEventListener('abort', () => fail(signal.reason))));
    sent.push(byte!);
  };
  const [readable, writable] = [new ReadableStream(), new WritableStream({ write })];
  const close = async () => assert.ok(!writable.locked && !readable.locked && sent.push(-1));
  const port = { readable, writable, close, open: async () => {}, setSignals: async () => {}, getInfo: () => ({}) };
  const line = new SerialLine(port as unknown as SerialPort);
  await line.open(() => undefined, assert.fail);
  await Promise.all([line.send(Uint8Array.of(1)), line.send(Uint8Array.of(2))]);
  const hangs = assert.rejects(line.send(Uint8Array.of(0)), /takes no more commands/);
  await new Promise(setImmediate);
  await line.close();
  await hangs;
  assert.deepEqual(sent, [1, 2, -1]);
});

test('what is shown as present is of a frame that has just come, by the rate that is set', async () => {
  const [fingertip, line] = await opened();
  const shown = new Shown(fingertip, 0);
  const facts = (now_ms: number) =>
    Object.fromEntries(factsOf(shown, now_ms).flatMap((group) => group.facts.map((each) => [each.name, each.value])));
  const at = (ms: number, packet: object & { type: number }) =>
    line.receive(core.encode({ sequence: line.sequence++, t_us: 1000 * ms, ...packet }), ms);
  at(1e6, contactOf(1, 1e9, { flags: Flag.TARED, total_us: 1500 }));
  at(1e6, rawOf(1, 1e9, [0]));
  assert.deepEqual([facts(1e6 + 600)['latency'], facts(1e6 + 600)['answer']], ['1.50 ms', undefined]); // no health packet has come
  at(1e6 + 900, vector('health'));
  const { frames, latency, temperature, answer } = facts(1e6 + 1000);
  assert.deepEqual([shown.isCurrent(1e6 + 1000), shown.state(1e6 + 1000).words], [false, 'stalled for 1 s']);
  assert.deepEqual([frames, latency, temperature, answer], ['0 /s', undefined, undefined, '0 of 2']);
  fingertip.info!.rate_mHz = 1000;
  assert.deepEqual([shown.isCurrent(1e6 + 1000), shown.state(1e6 + 1000).words], [true, 'live']);
  const isKnown = (t_s: number, now_ms: number) => shown.moment(t_s, now_ms).contact !== null;
  assert.deepEqual([isKnown(Infinity, 1e6 + 1000), isKnown(Infinity, 1e6 + 5000), isKnown(1000, 1e6 + 5000)], [true, false, true]);
  fingertip.health!.sensors_present = 0;
  const words = (['live', 'silent'] as const).map((state) => Object.assign(fingertip, { state }) && shown.state(1e6 + 5000).words);
  assert.deepEqual(words, ['no sensor answers', 'stalled for 5 s']);
});

test('the doctor judges what was asked and measured, and what the line counted', async () => {
  const judges = await loadJudges(readFileSync(process.env['FINGERTIP_CORE']!.replace('core.wasm', 'judges.wasm')));
  const examination = judges.examination({ port: 'a port', tool_version: [7, 6, 5] });
  for (const [what, name] of Object.entries({ info: 'info_grasp', before: 'health', crash: 'crash', take: 'raw', after: 'health' })) {
    examination.give(what as 'info', core.frameOf(vector(name)));
  }
  examination.line({ bytes: 9000, packets: 200, dropped_packets: 3, out_of_order: 4, crc_errors: 5, format_errors: 6 });
  const text = JSON.stringify(examination.findings());
  assert.match(text, /"a port".*this tool is of version 7\.6\.5.*the watchdog struck.*200 packets, 3 lost, 11 damaged/);
  examination.free();
});

test('another version of the protocol, and what is no fingertip, are told apart', async () => {
  const line = new SpokenLine();
  line.version = 4;
  const old = new Fingertip(line);
  await assert.rejects(old.open(), /version 4 of the protocol.*Flash/);
  assert.equal(old.state, 'closed');
  const mute = Object.assign(new SpokenLine(), { silent: true });
  await assert.rejects(new Fingertip(mute).open(), /is no fingertip/);
  mute.open = () => Promise.resolve();
  mute.send = () => new Promise(() => undefined);
  await assert.rejects(new Fingertip(mute).open(), /nothing answers on this port/);
});

test('history: a ring with absolute numbers, times that never fall, frames that are missing', () => {
  const history = new History(2, 8);
  for (let i = 0; i < 20; i++) {
    const frame = i < 12 ? i : i + 3;
    history.addContact(contactOf(frame, 1000 * frame, { flags: Flag.FIT_VALID, x_mm: i }));
    history.addRaw(rawOf(frame, 1000 * frame, [i, -i], i % 2 ? { flags: Flag.HELD, valid: 0 } : {}));
  }
  assert.deepEqual([history.begin, history.end], [12, 20]);
  assert.equal(history.lost[12 % 8], 3);
  assert.equal(history.lost[13 % 8], 0);
  assert.equal(history.columns.x_mm[19 % 8], 19);
  assert.deepEqual([...history.readingsAt(19)!.pressure_Pa], [19, -19]); // held: those of the frame before
  assert.equal(history.readingsAt(19)!.valid, 3);
  assert.equal(history.readingsAt(3), null);
  assert.equal(history.rowAt(0.018), 15);
  assert.equal(history.rowAt(9), 20);
  history.gap_s = 2;
  history.addContact(contactOf(0, 10));
  history.addRaw(rawOf(0, 10, [1, 1]));
  history.addContact(contactOf(1, 1010));
  assert.equal(history.end, 22);
  assert.ok(Math.abs(history.t_s[20 % 8]! - 2.022) < 1e-9);
  assert.ok(Math.abs(history.t_s[21 % 8]! - 2.023) < 1e-9);
  history.addRaw(rawOf(5, 5010, [3, 3], { flags: Flag.TARED | Flag.FIT_VALID })); // without its contact packet: a row of its own
  assert.deepEqual([history.end, history.flags[22 % 8]], [23, Flag.TARED]);
  history.addContact(contactOf(6, 6010)); // without its raw packet
  history.addRaw(rawOf(7, 7010, [3, 3], { flags: Flag.HELD, valid: 0 }));
  assert.equal(history.readingsAt(24)?.valid, 3);
  assert.ok(Number.isNaN(history.columns.force_N[22 % 8]));
});

/* What each vector decodes to is compared with the library and Python in tests/formats. */
test('values that no packet may hold are refused', () => {
  assert.throws(() => core.encode(contactOf(1, 1, { flags: Flag.FIT_VALID, x_mm: NaN })), /x_mm/);
  assert.throws(() => core.encode(contactOf(2 ** 32, 1)), /frame/);
  assert.throws(() => core.encode({ ...contactOf(1, 1), type: 0x7f } as object as Contact), core.CoreError);
  assert.throws(() => core.encode({ ...core.blank(PacketType.INFO), sensor_count: 1, board: 'longer than sixteen' } as Info), /board/);
});

test('settings: commands for what differs; what it has is asked for after a refusal too', async () => {
  const info = vector('info_grasp') as Info;
  const now = { rate: '20', osr: '1024', slip_threshold: '0.75', slip_window: '100', prior: '3.125:0.5', limit: '0.625' };
  assert.deepEqual(commandsFor(info, now), []);
  assert.deepEqual(commandsFor(info, { rate: 'max', osr: '256', slip_window: '50', prior: '3.1', limit: '0.5' }), [
    { type: PacketType.CMD_RATE, rate_mHz: 0 },
    { type: PacketType.CMD_OSR, osr: 256 },
    { type: PacketType.CMD_SLIP, threshold_mm: 0.75, window_ms: 50 },
    { type: PacketType.CMD_PRIOR, sigma_mm: 3.1, width_mm: 0.5 },
    { type: PacketType.CMD_LOCATION_LIMIT, limit_mm: 0.5 },
  ]);
  assert.throws(() => commandsFor(info, { rate: '20:30' }), /too many values/);
  const [fingertip, line] = await opened();
  line.result = Result.OUT_OF_RANGE;
  await assert.rejects(set(fingertip, commandsFor(info, { osr: '256' })), /range/);
  assert.equal(line.commands.at(-1), PacketType.CMD_INFO);
});
