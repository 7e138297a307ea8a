/**
 * One fingertip: its line, its last packets, their history over the last minutes, and its commands.
 * The view reads. Listeners are called on rare changes alone (state, info, health), not on packets:
 * draw on requestAnimationFrame from `contact`, `raw` and `history`.
 */
import * as core from '../core';
import type { Line } from '../line/line';
import {
  Capability,
  PacketType,
  Result,
  Stored,
  Stream,
  WIRE_VERSION,
  type Ack,
  type Command,
  type Contact,
  type Crash,
  type DevicePacket,
  type Health,
  type Info,
  type Raw,
} from '../line/line_facts';
import { History } from './history';
import { PATIENCE, pause } from './patience';

/** opening: until its info came. live: it streams. silent: nothing for a while, though the line is
 * open. closed: by the page, or it left; `why` has the reason. */
export type FingertipState = 'opening' | 'live' | 'silent' | 'closed';

/** Why a command failed, a sentence; result: Result of the acknowledgement, null where none came. */
export class CommandError extends Error {
  constructor(
    message: string,
    readonly result: number | null,
  ) {
    super(message);
  }
}

/** Another fingertip answered than the one that was expected back. */
export class OtherFingertip extends Error {}

/** Takes every packet as it comes. Contact and raw packets are overwritten by the next. */
export type PacketTap = (packet: DevicePacket) => unknown;

const SILENT_ms = 1500;
/** Versions of the protocol that ever were. */
const OLDEST_VERSION = 1;

/** Commands that write flash, so that their answer may take long. */
const STORING: ReadonlySet<number> = new Set([
  PacketType.CMD_CALIBRATE,
  PacketType.CMD_ERASE_CALIBRATION,
  PacketType.CMD_KEEP,
  PacketType.CMD_PAD,
  PacketType.CMD_ERASE_PAD,
]);
/** Commands that a packet of their own answers, after the acknowledgement. */
type Question = typeof PacketType.CMD_INFO | typeof PacketType.CMD_HEALTH | typeof PacketType.CMD_CRASH;

interface Waiting {
  command: number;
  sequence: number;
  sent_us: number;
  done: (ack: Ack) => void;
  failed: (error: Error) => void;
}

/** What a calibration under way has found. wanted: the best next place; gain: [sensor], empty as long as they are unknown. */
export interface Found {
  readonly placements: readonly { x_mm: number; y_mm: number; kept: boolean }[];
  readonly wanted: { x_mm: number; y_mm: number } | null;
  readonly gain: readonly number[];
}

export class Fingertip {
  state: FingertipState = 'opening';
  /** Why it is closed, and what to do. */
  why = '';
  info: Info | null = null;
  health: Health | null = null;
  /** null: no calibration is under way. */
  found: Found | null = null;
  /** null until its info came. */
  history: History | null = null;
  /** Packets of either kind since it was opened. */
  contacts = 0;
  raws = 0;
  /** performance.now() of the last bytes, and of the last contact or raw packet or the opening. */
  heard_ms = 0;
  framed_ms = 0;
  /** A replay: it takes no commands. */
  readonly is_replay: boolean;

  private readonly decoder = new core.Decoder();
  private readonly listeners = new Set<() => void>();
  private readonly taps = new Set<PacketTap>();
  /** Those of questions, which hear another fingertip too. */
  private readonly asking = new Set<PacketTap>();
  private readonly waiting = new Set<Waiting>();
  private sequence = 0;
  private other_serial = '';
  /** Since it was opened its info came: it is no other. */
  private is_identified = false;
  private timer: ReturnType<typeof setInterval> | undefined;

  constructor(
    public line: Line,
    { is_replay = false } = {},
  ) {
    this.is_replay = is_replay;
  }

  /** The serial number, or what the line is called until it is known. */
  get name(): string {
    return this.info?.serial || this.line.label;
  }

  /** The newest contact and raw packet, overwritten in place; meaningless until contacts or raws is
   * above 0. */
  get contact(): Contact {
    return this.decoder.contact;
  }

  get raw(): Raw {
    return this.decoder.raw;
  }

  get counts(): core.LineCounts {
    return this.decoder.counts;
  }

  /** Packets that did not arrive whole. */
  get lost(): number {
    return this.counts.dropped_packets;
  }

  /** Called after state, info, health or what a calibration found changed. Returns what ends it. */
  listen(listener: () => void): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }

  setFound(found: Found | null): void {
    this.found = found;
    this.changed();
  }

  tap(tap: PacketTap): () => void {
    this.taps.add(tap);
    return () => this.taps.delete(tap);
  }

  /** Opens its line, or another after it was gone, asks who it is, and lets it stream all it can.
   * Rejects with an Error whose message states what to do; it is closed then. */
  async open(line: Line = this.line): Promise<void> {
    this.line = line;
    this.state = 'opening';
    this.why = '';
    this.is_identified = this.is_replay;
    this.contacts = this.raws = 0;
    this.health = null;
    this.decoder.restart();
    if (this.history && this.framed_ms > 0) {
      this.history.gap_s = (performance.now() - this.framed_ms) / 1000;
    }
    this.changed();
    const checkOpen = (): void => {
      if (this.line !== line || this.state === 'closed') {
        throw new Error(this.why); // closed meanwhile
      }
    };
    try {
      await line.open(
        (bytes, at_ms) => this.receive(bytes, at_ms),
        (why) => {
          if (this.line === line) {
            this.gone(why);
          }
        },
      );
      if (this.is_replay) {
        return;
      }
      checkOpen();
      await this.identify();
      await this.stream(Stream.CONTACT | Stream.RAW | Stream.HEALTH);
      checkOpen();
    } catch (error) {
      const why =
        error instanceof OtherFingertip ? 'it is not there: plug it in again' : error instanceof Error ? error.message : String(error);
      await line.close().catch(() => undefined);
      if (this.line === line && (this.state as FingertipState) !== 'closed') {
        this.gone(why);
      }
      throw error;
    }
    this.state = 'live';
    this.framed_ms = performance.now();
    this.timer = setInterval(() => this.tick(), 250);
    this.changed();
  }

  async close(): Promise<void> {
    if (this.state === 'closed') {
      return;
    }
    if (!this.is_replay && this.state !== 'opening') {
      await this.stream(0).catch(() => undefined);
    }
    const { line } = this; // it may have come back on another
    this.gone('disconnected by you; press "Connect" to have it back');
    await line.close();
  }

  /** Sends a command and waits for its acknowledgement; sends it again where none comes. Rejects with
   * CommandError where it is refused, with Error where nothing answers. */
  async command(command: Command): Promise<Ack> {
    if (this.is_replay) {
      throw new CommandError('this is a replay: it takes no commands', null);
    }
    const ack = await this.exchange(command);
    if (ack.result !== Result.DONE) {
      throw new CommandError(`${core.commandName(command.type)}: ${core.resultText(ack.result)}`, ack.result);
    }
    return ack;
  }

  /** Streams, of those that this firmware has. */
  async stream(streams: number): Promise<void> {
    const capabilities = this.info?.capabilities ?? 0;
    const possible =
      (capabilities & Capability.FIT ? Stream.CONTACT : 0) | (capabilities & Capability.RAW_STREAM ? Stream.RAW : 0) | Stream.HEALTH;
    await this.command({ type: PacketType.CMD_STREAM, streams: streams & possible });
  }

  /** Measures the zero again. Refused with Result.NOT_NOW in contact unless forced. */
  async tare(force = false): Promise<void> {
    await this.command({ type: PacketType.CMD_TARE, force: force ? 1 : 0 });
  }

  async askInfo(): Promise<Info> {
    return (await this.ask(PacketType.CMD_INFO, PacketType.INFO)) as Info;
  }

  async askHealth(): Promise<Health> {
    return (await this.ask(PacketType.CMD_HEALTH, PacketType.HEALTH)) as Health;
  }

  /** null: the first firmware of this version does not know the command. */
  async askCrash(): Promise<Crash | null> {
    try {
      return (await this.ask(PacketType.CMD_CRASH, PacketType.CRASH)) as Crash;
    } catch (error) {
      if (error instanceof CommandError && error.result === Result.UNKNOWN_COMMAND) {
        return null;
      }
      throw error;
    }
  }

  /** The command, then the packet that follows its acknowledgement. */
  private async ask(command: Question, answer: number): Promise<DevicePacket> {
    let take!: (packet: DevicePacket) => void;
    const came = new Promise<DevicePacket>((done) => (take = done));
    const tap: PacketTap = (packet) => packet.type === answer && take(packet);
    this.asking.add(tap);
    try {
      for (let tries = PATIENCE.tries; tries > 0; tries--) {
        await this.command({ type: command });
        const packet = await Promise.race([came, pause(PATIENCE.answer_ms)]);
        if (packet) {
          return packet;
        }
      }
      throw new CommandError(`${core.commandName(command)}: no answer came; try again`, null);
    } finally {
      this.asking.delete(tap);
    }
  }

  private async identify(): Promise<void> {
    this.other_serial = '';
    try {
      await this.askInfo();
      if (this.other_serial) {
        throw new OtherFingertip(`${this.other_serial} answers instead of ${this.name}`);
      }
    } catch (error) {
      const is_refused = error instanceof CommandError && error.result !== null;
      if (error instanceof OtherFingertip || is_refused || this.state === 'closed') {
        throw error;
      }
      const version = await this.otherVersion();
      if (version !== 0) {
        throw new Error(
          `it speaks version ${version} of the protocol, this page version ${WIRE_VERSION}: ` +
            (version < WIRE_VERSION
              ? 'press "Flash" and install the firmware that belongs to this page'
              : 'use the page that belongs to its firmware'),
        );
      }
      throw new Error(
        this.counts.bytes === 0
          ? 'nothing answers on this port: it may be something else than a fingertip; choose another, ' +
              'or unplug the fingertip and plug it in again'
          : 'what answers on this port is no fingertip: choose another port',
      );
    }
  }

  /** 0: whatever is there does not speak any version of the protocol. */
  private async otherVersion(): Promise<number> {
    for (let version = OLDEST_VERSION; version < WIRE_VERSION + 3; version++) {
      if (version !== WIRE_VERSION) {
        this.line.send(core.infoFrameOfVersion(version)).catch(() => undefined); // a port that hangs never ends it
      }
    }
    const until_ms = performance.now() + PATIENCE.version_ms;
    while (this.decoder.other_version === 0 && (this.state as FingertipState) !== 'closed' && performance.now() < until_ms) {
      await pause(20);
    }
    return this.decoder.other_version;
  }

  private exchange(command: Command): Promise<Ack> {
    if (this.state === 'closed') {
      return Promise.reject(new CommandError('the fingertip is not connected', null));
    }
    const answer_ms = STORING.has(command.type) ? PATIENCE.stored_ms : PATIENCE.answer_ms;
    return new Promise((done, failed) => {
      const sent: Waiting[] = [];
      let refused: Ack | null = null;
      let timer: ReturnType<typeof setTimeout>;
      const end = (): void => {
        clearTimeout(timer);
        sent.forEach((each) => this.waiting.delete(each));
      };
      const fail = (error: Error): void => {
        end();
        failed(error);
      };
      const send = (): void => {
        if (sent.length >= PATIENCE.tries) {
          end();
          const name = core.commandName(command.type);
          return refused ? done(refused) : failed(new Error(`${name}: the fingertip does not answer; unplug it and plug it in again`));
        }
        const sequence = this.sequence++ & 0xffff;
        const sent_us = Math.round(performance.now() * 1000);
        const frame = core.encode({ ...command, sequence, t_us: sent_us });
        const waiting: Waiting = {
          command: command.type,
          sequence,
          sent_us,
          done: (ack) => {
            // Not possible now: the try before may be under way.
            if (ack.result === Result.NOT_NOW && waiting !== sent[0]) {
              refused = ack;
              return;
            }
            end();
            done(ack);
          },
          failed: fail,
        };
        sent.push(waiting);
        this.waiting.add(waiting);
        timer = setTimeout(send, answer_ms);
        this.line.send(frame).catch((error: unknown) => fail(error instanceof Error ? error : new Error(String(error))));
      };
      send();
    });
  }

  private receive(bytes: Uint8Array, at_ms: number): void {
    this.heard_ms = at_ms;
    if (this.state === 'silent' || (this.is_replay && this.state === 'opening')) {
      this.state = 'live';
      this.changed();
    }
    this.decoder.feed(bytes, this.take);
  }

  private readonly take = (packet: DevicePacket): void => {
    const is_other = packet.type === PacketType.INFO && this.info !== null && this.info.serial !== packet.serial;
    if (is_other) {
      this.other_serial = packet.serial;
    }
    this.is_identified ||= packet.type === PacketType.INFO && !is_other;
    if (packet.type === PacketType.ACK) {
      this.acknowledge(packet);
    }
    this.asking.forEach((tap) => tap(packet));
    if (is_other || !this.is_identified) {
      return;
    }
    switch (packet.type) {
      case PacketType.CONTACT:
        this.framed_ms = this.heard_ms;
        this.contacts++;
        this.history?.addContact(packet);
        break;
      case PacketType.RAW:
        this.framed_ms = this.heard_ms;
        this.raws++;
        this.history ??= new History(packet.sensor_count);
        this.history.addRaw(packet);
        break;
      case PacketType.INFO:
        if (this.history?.sensor_count !== packet.sensor_count) {
          this.history = new History(packet.sensor_count);
        }
        this.info = packet;
        this.history.gain = packet.stored & Stored.CALIBRATION ? packet.gain : [];
        break;
      case PacketType.HEALTH:
        this.health = packet;
        break;
    }
    for (const tap of this.taps) {
      tap(packet);
    }
    if (packet.type === PacketType.INFO || packet.type === PacketType.HEALTH) {
      this.changed();
    }
  };

  private acknowledge(ack: Ack): void {
    const waiting = [...this.waiting].find((each) => each.command === ack.command && each.sequence === ack.command_sequence);
    if (waiting && waiting.sent_us === ack.host_time_us) {
      waiting.done(ack);
    }
  }

  private tick(): void {
    if (this.state === 'live' && performance.now() - this.heard_ms > SILENT_ms) {
      this.state = 'silent';
      this.changed();
    }
  }

  private gone(why: string): void {
    clearInterval(this.timer);
    this.state = 'closed';
    this.why = why;
    for (const waiting of [...this.waiting]) {
      waiting.failed(new CommandError(why, null));
    }
    this.changed();
  }

  private changed(): void {
    this.listeners.forEach((listener) => listener());
  }
}
