/** A moment out of the last minutes, or the newest, as the pad's picture shows it. */
import { CONTACT_FIELDS, Flag } from '../line/line_facts';
import { WARNING_FLAGS } from '../model/flags';
import type { History, Readings } from '../model/history';
import type { Place } from './pad_scene';
import type { ShownContact } from './shown';

/** What is known of it. */
export interface Moment {
  contact: ShownContact | null;
  readings: Readings | null;
  trail: readonly Place[];
}

export const NOTHING_KNOWN: Moment = { contact: null, readings: null, trail: [] };
const TRAIL_s = 1;
const TRAIL_POINTS = 24;

/** Infinity: the newest. Nothing where no frame came for longer than longest_s, or is kept. */
export function momentAt(history: History, t_s: number, longest_s: number): Moment {
  const row = Math.min(history.rowAt(t_s), history.end - 1);
  if (row < history.begin || history.t_s[history.slot(row)] > t_s + longest_s) {
    return NOTHING_KNOWN;
  }
  // A contact packet comes before the raw packet of its frame.
  const readings = history.readingsAt(row) ?? history.readingsAt(row - 1);
  return { contact: contactAt(history, row), readings, trail: trailAt(history, row) };
}

/** row: one that is kept. */
function contactAt(history: History, row: number): ShownContact {
  const slot = history.slot(row);
  const contact = { flags: history.flags[slot] ?? 0 } as ShownContact;
  for (const field of CONTACT_FIELDS) {
    contact[field] = history.columns[field][slot] || 0;
  }
  return contact;
}

/** Places without a warning in the second before a row, oldest first; none from before its contact
 * began. */
function trailAt(history: History, row: number): Place[] {
  const trail: Place[] = [];
  const newest_s = history.t_s[history.slot(row)] ?? 0;
  const step_s = TRAIL_s / TRAIL_POINTS;
  for (let i = 0; i < TRAIL_POINTS; i++) {
    const at = history.rowAt(newest_s - i * step_s);
    if (at > row || at < history.begin) {
      continue;
    }
    const slot = history.slot(at);
    const flags = history.flags[slot] ?? 0;
    if (!(flags & Flag.CONTACT)) {
      break;
    }
    if (flags & Flag.FIT_VALID && !(flags & WARNING_FLAGS)) {
      trail.unshift({ x_mm: history.columns.x_mm[slot] ?? 0, y_mm: history.columns.y_mm[slot] ?? 0 });
    }
  }
  return trail;
}
