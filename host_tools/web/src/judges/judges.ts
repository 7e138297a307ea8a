/**
 * The tool's own judgement, compiled from host_tools/tool/calibration and host_tools/tool/doctor: the same
 * numbers, bounds and sentences as `fingertip calibrate` and `fingertip doctor`.
 *
 * A fingertip's packets go in as frames: the bytes of one frame of the line, COBS encoded, without
 * its delimiter. An exception of C++ becomes a JudgeError, whose message states what to do.
 */
import { load } from '../../wasm/judges.mjs';
import { WasmError } from '../../wasm/module.mjs';
import type { LineCounts } from '../core';

/** What the judges know; one for the page. */
export interface Judges {
  /** Gains from placements of one weight. Throws JudgeError where its firmware cannot. */
  gains(info_frame: Uint8Array): GainSession;
  /** The tangential scale from pulls of known_N. Throws JudgeError where its firmware cannot. */
  pulls(info_frame: Uint8Array, known_N: number): PullSession;
  examination(facts: { port: string; tool_version: [number, number, number] }): Examination;
}

export { WasmError as JudgeError };

/** Fetched once, when a dialog needs them: 130 kB compressed. files: the folder of judges.wasm. */
export async function loadJudges(files = 'wasm/'): Promise<Judges> {
  const url = new URL(`${files}judges.wasm`, document.baseURI);
  const response = await fetch(url);
  if (!response.ok) {
    throw new WasmError(`${url.href}: ${response.status}; load the page again`);
  }
  return load(await response.arrayBuffer());
}

export type SessionState = 'more' | 'good' | 'refused';

export interface GainStatus {
  state: SessionState;
  /** "none" if good, else a word: too_few, cluster, drift, ... (calibration/judge.hpp). */
  reason: string;
  /** A sentence: why, and what to do; empty before the first placement. */
  text: string;
  /** What to do now: "set the weight down on its round foot, best near x 4 y 9 mm". */
  advice: string;
  /** "12 placements, the last at ...; gains known to 3.1 %, wanted 1.5 %" */
  progress: string;
  finder: 'resting' | 'settling' | 'taken' | 'refused';
  /** The present pressures, [sensor], above those before the contact. */
  above_Pa: number[];
  /** kept: fits the others. */
  placements: { x_mm: number; y_mm: number; kept: boolean }[];
  /** Where the next one helps most. */
  wanted: { x_mm: number; y_mm: number } | null;
  /** Sensors whose gain is not known well enough yet; of those, the ones without any reading. */
  unsure: number[];
  silent: number[];
  /** [sensor], relative to their mean; empty before they can be solved. */
  gain: number[];
  gain_sd: number[];
}

export interface Scatter {
  location_mm: number;
  force: number;
}

export interface GainResult {
  /** What the calibrate command carries. */
  calibration: {
    date_s: number;
    placements: number;
    force_scale: number;
    force_scale_sd: number;
    sigma_um: number;
    sigma_sd_um: number;
    dip_share_q16: number;
    dip_sd_um: number;
    ambient_kPa: number;
    gain: number[];
    gain_sd: number[];
    off_x_um: number[];
    off_y_um: number[];
    wider_q15: number[];
  };
  /** How far the firmware's fit scatters over the placements without the calibration, and with it. */
  before: Scatter;
  after: Scatter;
}

export interface GainSession {
  /** A raw packet's frame, others are nothing to it. True: a placement was completed; some 50 ms
   * then, else some microseconds. */
  take(frame: Uint8Array): boolean;
  takeBack(): void;
  status(): GainStatus;
  /** force_N: the weight's, or null where it is unknown. Throws JudgeError unless good. */
  result(force_N: number | null, date_s: number): GainResult;
  free(): void;
}

export interface PullStatus {
  state: SessionState;
  text: string;
  advice: string;
  finder: 'free' | 'settling' | 'resting' | 'pulled' | 'taken' | 'refused';
  /** "pull 3 at x ...: reads 0.98 N towards 90 degrees"; empty before the first. */
  last: string;
  pulls: { x_mm: number; y_mm: number; qx_N: number; qy_N: number }[];
}

export interface PullSession {
  /** A contact packet's frame. True: a pull was completed. */
  take(frame: Uint8Array): boolean;
  status(): PullStatus;
  /** What the pad command carries beside the rest of the profile that the fingertip has now, by its
   * info. Throws JudgeError unless good. */
  result(info_frame: Uint8Array): { tangential_scale: number; tangential_scale_sd: number };
  free(): void;
}

export interface Finding {
  verdict: 'ok' | 'warn' | 'bad';
  check: string;
  text: string;
  /** What to do; empty where all is well. */
  advice: string;
  sensors: number[];
}

/** The codes of libfingertip/error.hpp. */
export type FailureCode = 'no_port' | 'port_in_use' | 'cannot_open' | 'not_a_fingertip' | 'gone' | 'no_answer' | 'other_version' | 'other';

/** What the line counted during the measurement. */
export type MeasuredCounts = Pick<LineCounts, 'bytes' | 'packets' | 'dropped_packets' | 'out_of_order' | 'crc_errors' | 'format_errors'>;

/**
 * As `fingertip doctor` does it: info, health, crash, then contact and raw packets for ten seconds
 * while nothing touches the pad, then health again.
 */
export interface Examination {
  info(frame: Uint8Array): void;
  before(health_frame: Uint8Array): void;
  crash(frame: Uint8Array): void;
  /** Contact and raw packets, in order. */
  take(frame: Uint8Array): void;
  /** Duration of the packets taken, device time. */
  seconds(): number;
  after(health_frame: Uint8Array): void;
  line(counts: MeasuredCounts): void;
  /** What ended it early. */
  failure(code: FailureCode, text: string): void;
  findings(): Finding[];
  free(): void;
}
