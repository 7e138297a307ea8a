/** A fingertip's model over a line that the test speaks on: answers, refusals, losses, going and coming back; history; clocks. */
import assert from 'node:assert/strict';
import test from 'node:test';
import type { Line } from '../../../host_tools/web/src/line/line';
import { Flag, PacketType, Result, Stream, WIRE_VERSION } from '../../../host_tools/web/src/line/line_facts';
import type { Contact, Info, Raw } from '../../../host_tools/web/src/line/line_facts';
import { CommandError, Fingertip, OtherFingertip } from '../../../host_tools/web/src/model/fingertip';
import { PATIENCE } from '../../../host_tools/web/src/model/patience';
import { History } from '../../../host_tools/web/src/model/history';
import { commandsFor } from '../../../host_tools/web/src/steps/settings';
import { core, decoded } from './library';
import { vector } from './vectors';

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
  device_us = 5_000_000;
  sequence = 0;
  receive: (bytes: Uint8Array, at_ms: number) => void = () => undefined;
  closed: (why: string) => void = () => undefined;

  constructor(private readonly serial = '') {}

  open(receive: SpokenLine['receive'], closed: SpokenLine['closed']): Promise<void> {
    this.receive = receive;
    this.closed = closed;
    receive(Uint8Array.of(7, 7, 0), performance.now()); // the end of a frame that was under way
    return Promise.resolve();
  }

  close(): Promise<void> {
    return Promise.resolve();
  }

  say(packet: object & { type: number }): void {
    this.device_us += 100;
    this.receive(core.encode({ t_us: this.device_us, ...packet, sequence: this.sequence++ & 0xffff }), performance.now());
  }

  send(frame: Uint8Array): Promise<void> {
    if (this.version !== WIRE_VERSION) {
      const known = core.infoFrameOfVersion(this.version);
      if (Buffer.compare(frame, known) === 0) {
        this.receive(known, performance.now()); // an empty packet will do: the version is judged first
      }
      return Promise.resolve();
    }
    const command = decoded(frame) as Asked | null;
    if (!command) {
      return Promise.resolve();
    }
    this.commands.push(command.type);
    if (this.silent) {
      return Promise.resolve();
    }
    this.streams = command.streams ?? this.streams;
    if (--this.hears > 0) {
      if (this.refuses_repeats && this.first) {
        queueMicrotask(() => this.acknowledge(command, Result.NOT_NOW));
      }
      this.first ??= () => this.answer(command);
      return Promise.resolve();
    }
    queueMicrotask(this.first ?? (() => this.answer(command)));
    this.first = null;
    return Promise.resolve();
  }

  private first: (() => void) | null = null;

  private acknowledge({ type, sequence, t_us }: Asked, result: number): void {
    this.say({ type: PacketType.ACK, command: type, result, command_sequence: sequence, host_time_us: t_us });
  }

  private answer(command: Asked): void {
    const { CMD_INFO, CMD_HEALTH, CMD_CRASH } = PacketType;
    const name = { [CMD_INFO]: 'info_grasp', [CMD_HEALTH]: 'health', [CMD_CRASH]: 'crash' }[command.type];
    this.acknowledge(command, name ? Result.DONE : this.result);
    if (name && --this.loses < 0) {
      this.say({ ...decoded(vector(name).frame)!, t_us: this.device_us, ...(this.serial && { serial: this.serial }) });
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
  assert.ok(fingertip.clock.estimate);
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
  assert.equal((await fingertip.askCrash())?.kind, 3);
  assert.equal((await fingertip.askHealth()).type, PacketType.HEALTH);
  assert.equal(fingertip.crash?.stuck, 5);
  await fingertip.close();
  await assert.rejects(fingertip.tare(), /not connected/);
});

test('an answer to the first try is one, however late; a packet that was lost is asked for again', async () => {
  const [fingertip, line] = await opened();
  const usual = { ...PATIENCE };
  try {
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
  } finally {
    Object.assign(PATIENCE, usual);
  }
});

test('the cable is pulled amid a command: it fails at once, with words; another line has it back', async () => {
  const [fingertip, line] = await opened();
  line.say(contactOf(7, 9_000_000));
  line.silent = true;
  const waiting = fingertip.tare();
  const failed = assert.rejects(waiting, /plug it in/);
  line.closed('unplugged: plug it in again');
  await failed;
  assert.equal(fingertip.state, 'closed');
  assert.equal(fingertip.why, 'unplugged: plug it in again');

  await assert.rejects(fingertip.open(new SpokenLine('OTHER')), OtherFingertip);
  assert.equal(fingertip.state, 'closed');
  assert.equal(fingertip.name, 'E66058388347A12C');

  const back = new SpokenLine();
  await fingertip.open(back);
  back.say(contactOf(1, 1_000)); // it restarted
  back.say(rawOf(1, 1_000, [0, 0]));
  const { history } = fingertip;
  assert.equal(history?.end, 2);
  assert.ok(history.t_s[1]! > history.t_s[0]!);
  assert.equal(fingertip.lost, 0);
  await fingertip.close();
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
  history.addRaw(rawOf(5, 5010, [3, 3], { flags: Flag.TARED })); // without its contact packet: a row of its own
  assert.equal(history.end, 23);
  assert.equal(history.flags[22 % 8], Flag.TARED);
  assert.ok(Number.isNaN(history.columns.force_N[22 % 8]));
});

test('settings: commands for what differs', () => {
  const info = decoded(vector('info_grasp').frame) as Info;
  const now = { rate: '20', osr: '1024', slip_threshold: '0.75', slip_window: '100', prior: '3.125:0.5', limit: '0.625' };
  assert.deepEqual(commandsFor(info, now), []);
  assert.deepEqual(commandsFor(info, { rate: 'max', osr: '256', slip_window: '50', prior: '3.1', limit: '0.5' }), [
    { type: PacketType.CMD_RATE, rate_mHz: 0 },
    { type: PacketType.CMD_OSR, osr: 256 },
    { type: PacketType.CMD_SLIP, threshold_mm: 0.75, window_ms: 50 },
    { type: PacketType.CMD_PRIOR, sigma_mm: 3.1, width_mm: 0.5 },
    { type: PacketType.CMD_LOCATION_LIMIT, limit_mm: 0.5 },
  ]);
});
