/** What of a fingertip the pictures of its pad show, in mm and N, apart from how they draw it. */
import { Flag } from '../line/line_facts';
import { WARNING_FLAGS } from '../model/flags';
import type { Found } from '../model/fingertip';
import { hasSensor, type Readings } from '../model/history';
import type { ShownContact, ShownLayout } from './shown';

/** Rim of the pad beyond the outermost sensors. */
export const RIM_mm = 6;
/** Height of a bar and of the surface at full scale; the root of the pressure, as its colour. */
export const HEIGHT_mm = 17;
export const THICKNESS_mm = 6;
/** Length of the arrow whose tangential force is as large as the normal force: rubber slides at a
 * half to one of it. */
const ARROW_mm = 30;
/** A tangential force below this number of its standard deviations has no direction. */
const ARROW_SDS = 2;
/** Length of the arrow of the normal force: half of MOST_mm at 5 N. */
const MOST_mm = 40;
const HALF_N = 5;

export interface Place {
  x_mm: number;
  y_mm: number;
}

/** A place and the radius of its standard deviation. */
export interface Spot extends Place {
  sd_mm: number;
}

export interface Arrow {
  along_x: number;
  along_y: number;
  /** 0: the load may be none; then sd_mm is its size. */
  length_mm: number;
  sd_mm: number;
  slides: boolean;
}

export interface Scene {
  layout: ShownLayout;
  count: number;
  /** Null where a sensor has no reading. */
  pressure_Pa: (number | null)[];
  broken: boolean[];
  saturated: boolean[];
  doubtful: boolean[];
  fit: {
    contact: ShownContact;
    doubtful: boolean;
    /** Radius of one standard deviation; 0 where there is none. */
    sd_mm: number;
    force_mm: number;
    /** Force with one standard deviation less and more. */
    force_low_mm: number;
    force_high_mm: number;
    arrow: Arrow | null;
    /** Two contacts, the stronger first, instead of the place of one. */
    two: Spot[];
    /** From the place of a long contact to its end. */
    edge: { x_mm: number; y_mm: number } | null;
  } | null;
  /** Places of the last second, oldest first. */
  trail: readonly Place[];
  /** What really is, of a simulated fingertip. */
  truth: Place | null;
  alarm: 'slips' | 'slides' | 'moves' | null;
  /** By a calibration under way. */
  found: Found | null;
}

export function sceneOf(
  layout: ShownLayout,
  contact: ShownContact | null,
  readings: Readings | null,
  trail: readonly Place[],
  truth: Place | null,
  found: Found | null = null,
): Scene {
  const count = layout.x_mm.length;
  const has = (map: number | undefined, k: number) => hasSensor(map ?? 0, k);
  const tared = contact === null || (contact.flags & Flag.TARED) !== 0;
  const sensors = Array.from({ length: count }, (_, k) => k);
  const flags = contact?.flags ?? 0;
  return {
    layout,
    count,
    pressure_Pa: sensors.map((k) => (readings && tared && has(readings.valid, k) ? (readings.pressure_Pa[k] ?? null) : null)),
    broken: sensors.map((k) => readings !== null && !has(readings.valid, k) && !has(readings.saturated, k)),
    saturated: sensors.map((k) => has(readings?.saturated, k)),
    doubtful: sensors.map((k) => has(readings?.doubtful, k)),
    fit: contact && flags & Flag.FIT_VALID ? fitOf(contact) : null,
    trail,
    truth,
    alarm: flags & Flag.SLIDING ? 'slides' : flags & Flag.SLIP ? 'slips' : flags & Flag.MOVING ? 'moves' : null,
    found,
  };
}

function fitOf(contact: ShownContact): Scene['fit'] {
  const sure = (contact.flags & Flag.UNCERTAINTY_VALID) !== 0;
  const sd_N = sure ? contact.force_sd_N : 0;
  return {
    contact,
    doubtful: (contact.flags & WARNING_FLAGS) !== 0,
    sd_mm: sure ? contact.location_sd_mm : 0,
    force_mm: forceLength(contact.force_N),
    force_low_mm: forceLength(contact.force_N - sd_N),
    force_high_mm: forceLength(contact.force_N + sd_N),
    arrow: contact.flags & Flag.TANGENTIAL_VALID && contact.force_N > 0 ? arrowOf(contact) : null,
    two:
      contact.flags & Flag.TWO_CONTACTS
        ? [
            { x_mm: contact.x1_mm, y_mm: contact.y1_mm, sd_mm: contact.location1_sd_mm },
            { x_mm: contact.x2_mm, y_mm: contact.y2_mm, sd_mm: contact.location2_sd_mm },
          ]
        : [],
    edge: contact.flags & Flag.EDGE ? edgeOf(contact) : null,
  };
}

function edgeOf(contact: ShownContact): { x_mm: number; y_mm: number } {
  const angle_rad = (contact.edge_angle_deg * Math.PI) / 180;
  const half_mm = contact.edge_length_mm / 2;
  return { x_mm: half_mm * Math.cos(angle_rad), y_mm: half_mm * Math.sin(angle_rad) };
}

function arrowOf(contact: ShownContact): Arrow {
  const size_N = Math.hypot(contact.qx_N, contact.qy_N);
  const directed = size_N > ARROW_SDS * contact.q_sd_N;
  return {
    along_x: directed ? contact.qx_N / size_N : 0,
    along_y: directed ? contact.qy_N / size_N : 0,
    length_mm: directed ? ARROW_mm * Math.min(contact.tangential_ratio, 1.5) : 0,
    sd_mm: Math.min((ARROW_mm * contact.q_sd_N) / contact.force_N, ARROW_mm),
    slides: (contact.flags & Flag.SLIDING) !== 0,
  };
}

export function forceLength(force_N: number): number {
  const pressed_N = Math.max(0, force_N);
  return (MOST_mm * pressed_N) / (pressed_N + HALF_N);
}

export function padSize(layout: ShownLayout): { x_mm: number; y_mm: number } {
  const reach = (values: ArrayLike<number>) => RIM_mm + Math.max(...Array.from(values, (value) => Math.abs(value)));
  return { x_mm: reach(layout.x_mm), y_mm: reach(layout.y_mm) };
}
