/**
 * The library (libfingertip/fingertip.h) in the page: what the line, recordings, clocks and names are is its matter. It is there
 * once loadCore resolved, which is before anything else of the page starts.
 */
import { CoreError, load } from '../wasm/core.mjs';
import type { Contact, DevicePacket, Info, Raw } from './line/line_facts';

export { CoreError };

/** The counts of a line, as at the end of a recording. */
export interface LineCounts {
  bytes: number;
  /** Undamaged and of a known type. */
  packets: number;
  /** Missing from the sequence. */
  dropped_packets: number;
  /** Repeated, or older than one before. */
  out_of_order: number;
  crc_errors: number;
  /** Right or no CRC, but no frame of this protocol. */
  format_errors: number;
  version_errors: number;
  /** Undamaged, from a newer firmware. */
  unknown_types: number;
}

export interface Decoder {
  readonly counts: LineCounts;
  /** The version of the last packet that counted as a version error; 0: none yet. */
  readonly other_version: number;
  /** The last of their kind, overwritten by the next. */
  readonly contact: Contact;
  readonly raw: Raw;
  /** handler: called for each packet that these bytes complete; info, health, ack and crash are objects of their own. */
  feed(bytes: Uint8Array, handler: (packet: DevicePacket) => void): void;
  /** The line was interrupted: join again, and expect no particular sequence number. */
  restart(): void;
}

export interface ClockEstimate {
  /** The time of the last exchange. */
  device_us: number;
  /** The page's clock at that time. */
  host_us: number;
  /** Positive: the fingertip's clock is fast. */
  drift_ppm: number;
  /** No error at that time is larger. */
  uncertainty_us: number;
}

export interface ClockFit {
  /** null before the first exchange. */
  readonly estimate: ClockEstimate | null;
  readonly jumps: number;
  /** In order of device time; sent_us and received_us on the page's clock. */
  add(exchange: { sent_us: number; received_us: number; device_us: number }): void;
  /** The fingertip was gone: its clock may be another. */
  restart(): void;
}

/** Reads a file's bytes, fed from the first on; a CoreError states what is wrong with them. */
export interface Reader {
  feed(bytes: Uint8Array): void;
  /** null: feed more. undefined: that was all. packet is null for an event. time_us: of a row, else NaN. */
  next(): { device: number; time_us: number; packet: DevicePacket | null } | null | undefined;
  /** It is a capture of a line, no recording. */
  readonly is_capture: boolean;
  readonly has_end: boolean;
  readonly counts: LineCounts;
  readonly other_version: number;
  free(): void;
}

export interface Writer {
  packet(packet: DevicePacket): void;
  event(text: string): void;
  /** Last of all, before the last take. */
  finish(reason: string, counts: LineCounts): void;
  readonly frames: number;
  /** The next bytes of the file; null: none until now. */
  take(): Uint8Array<ArrayBuffer> | null;
  free(): void;
}

export interface Core {
  newDecoder(): Decoder;
  newClockFit(): ClockFit;
  /** size: of the file in bytes. */
  newReader(name: string, size: number): Reader;
  /** comments: the recorder's own keys. */
  newWriter(kind: 'csv' | 'mcap', info: Info, comments: [string, string][]): Writer;
  /** The frame of a packet or command, delimiter included. Throws CoreError, which names the field, on a value that none may hold. */
  encode(packet: object & { type: number; sequence: number; t_us: number }): Uint8Array<ArrayBuffer>;
  /** The info command as another version of the protocol has it: who speaks that version answers. */
  infoFrameOfVersion(version: number): Uint8Array<ArrayBuffer>;
  /** A packet whose numbers are 0. */
  blank(type: number): { type: number; sequence: number; t_us: number };
  /** "CONTACT FIT_VALID", an unknown bit as "bit29". */
  flagsText(flags: number): string;
  commandName(type: number): string;
  /** For the end of a sentence. */
  resultText(result: number): string;
  /** "fit,slip,raw,tangential": what a firmware can do; "none". */
  capabilitiesText(capabilities: number): string;
  /** "calibration,settings,pad": what a fingertip keeps without power; "nothing". */
  storedText(stored: number): string;
  /** The shortest decimal that reads back as the same float. */
  shortest(value: number): string;
  /** What a UF2 file is the firmware of. Throws CoreError unless it is whole, undamaged, and for the RP2040. */
  firmwareOf(name: string, bytes: Uint8Array): { board: string; version: string; git_hash: string };
}

export let core: Core;

/** Unpacks zstd in MCAP files of other programs; a reader of files sets it. */
let unpack: ((packed: Uint8Array, size: number) => Uint8Array) | null = null;
export function setUnpack(of_zstd: (packed: Uint8Array, size: number) => Uint8Array): void {
  unpack = of_zstd;
}

/** From the bytes of core.wasm. */
export async function loadCore(bytes: BufferSource): Promise<void> {
  core = await load(bytes, (packed, size) => {
    if (!unpack) {
      throw new Error('nothing unpacks zstd');
    }
    return unpack(packed, size);
  });
}
