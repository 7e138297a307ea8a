/** The sentences for a screen reader, at a rate that one can listen to. */
import { Flag } from '../line/line_facts';
import { WARNING_FLAGS, warningsOf } from '../model/flags';
import type { ShownContact } from './shown';

/** Between two sentences. */
const PACE_ms = 2500;
/** While nothing begins or ends a change of force below this share of it is not spoken. */
const NOTED_PART = 0.25;

interface Spoken {
  contact: boolean;
  slips: boolean;
  warnings: number;
  force_N: number;
  state: string;
}

export class Speech {
  private spoken: Spoken = { contact: false, slips: false, warnings: 0, force_N: 0, state: '' };
  private at_ms = -Infinity;

  /** A sentence, or null where there is nothing new or it would be too soon. contact: null where nothing is known. state: "live". */
  sentence(contact: ShownContact | null, state: string, now_ms: number): string | null {
    if (now_ms - this.at_ms < PACE_ms) {
      return null;
    }
    const flags = contact?.flags ?? 0;
    const was = this.spoken;
    const is: Spoken = {
      ...was,
      ...(contact && {
        contact: (flags & Flag.CONTACT) !== 0,
        slips: (flags & (Flag.SLIP | Flag.SLIDING)) !== 0,
        warnings: flags & WARNING_FLAGS,
        force_N: flags & Flag.FIT_VALID ? contact.force_N : 0,
      }),
      state,
    };
    const parts: string[] = [];
    if (is.state !== was.state) {
      parts.push(is.state);
    }
    const forceNoted = Math.abs(is.force_N - was.force_N) > NOTED_PART * Math.max(is.force_N, was.force_N, 0.2);
    if (is.contact && (!was.contact || forceNoted) && contact && flags & Flag.FIT_VALID) {
      parts.push(
        `${was.contact ? '' : 'contact, '}${is.force_N.toFixed(1)} newtons at ` +
          `${contact.x_mm.toFixed(0)}, ${contact.y_mm.toFixed(0)} millimetres`,
      );
    } else if (is.contact !== was.contact) {
      parts.push(is.contact ? 'contact' : 'no contact');
    }
    if (is.slips !== was.slips && is.contact) {
      parts.push(is.slips ? 'slips' : 'slips no longer');
    }
    const fresh = warningsOf(is.warnings & ~was.warnings);
    if (fresh.length > 0) {
      parts.push(`doubtful: ${fresh.map((warning) => warning.meaning).join(', ')}`);
    } else if (was.warnings && !is.warnings && is.contact) {
      parts.push('no warnings');
    }
    if (parts.length === 0) {
      return null;
    }
    this.spoken = is;
    this.at_ms = now_ms;
    const sentence = parts.join('; ');
    return `${sentence.charAt(0).toUpperCase()}${sentence.slice(1)}.`;
  }
}
