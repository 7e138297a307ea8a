/** A moment out of the last minutes, as the pad's picture shows it. */
import { FLAG, WARNING_BITS } from './flags';
import { rowAt } from './buckets';
import type { Place } from './pad_scene';
import type { ShownContact, ShownHistory } from './shown';

const TRAIL_s = 1;
const TRAIL_POINTS = 24;

/** row: absolute, kept. What the history has no column for is 0, and its flag off. */
export function contactAt(history: ShownHistory, row: number): ShownContact {
  const i = row % history.capacity;
  const qx_N = history.qx_N[i] ?? 0;
  const qy_N = history.qy_N[i] ?? 0;
  const force_N = history.force_N[i] ?? 0;
  return {
    flags: (history.flags[i] ?? 0) & ~(FLAG.WIDTHS_VALID | FLAG.VELOCITY_VALID),
    x_mm: history.x_mm[i] ?? 0,
    y_mm: history.y_mm[i] ?? 0,
    p0_Pa: history.p0_Pa[i] ?? 0,
    sigma_mm: history.sigma_mm[i] ?? 0,
    force_N,
    location_sd_mm: history.location_sd_mm[i] ?? 0,
    force_sd_N: history.force_sd_N[i] ?? 0,
    slip_mm: history.slip_mm[i] ?? 0,
    sigma_x_mm: 0,
    sigma_y_mm: 0,
    width_correlation: 0,
    qx_N,
    qy_N,
    q_sd_N: history.q_sd_N[i] ?? 0,
    tangential_ratio: force_N > 0 ? Math.hypot(qx_N, qy_N) / force_N : 0,
    vx_mm_s: 0,
    vy_mm_s: 0,
  };
}

/** Places without a warning in the second before a row, oldest first; none from before its contact
 * began. */
export function trailAt(history: ShownHistory, row: number): Place[] {
  const trail: Place[] = [];
  const newest_s = history.t_s[row % history.capacity] ?? 0;
  const step_s = TRAIL_s / TRAIL_POINTS;
  for (let i = 0; i < TRAIL_POINTS; i++) {
    const at = rowAt(history, newest_s - i * step_s);
    if (at > row || at < history.first) {
      continue;
    }
    const slot = at % history.capacity;
    const flags = history.flags[slot] ?? 0;
    if (!(flags & FLAG.CONTACT)) {
      break;
    }
    if (flags & FLAG.FIT_VALID && !(flags & WARNING_BITS)) {
      trail.unshift({ x_mm: history.x_mm[slot] ?? 0, y_mm: history.y_mm[slot] ?? 0 });
    }
  }
  return trail;
}
