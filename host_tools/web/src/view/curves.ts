/** The points of a trace out of its intervals, for uPlot: lists of the same length, null where a line
 * is broken. */
import { Trust, roundAbove, type Buckets, type ColumnName } from './buckets';

/** good: a solid line; doubtful: a dashed one, which meets it; sdLow, sdHigh: the band. */
export interface Curves {
  readonly good: (number | null)[];
  readonly doubtful: (number | null)[];
  readonly sdLow: (number | null)[];
  readonly sdHigh: (number | null)[];
}

export interface Chart {
  t_s: number[];
  curves: Map<ColumnName, Curves>;
  /** The largest of the values without a warning, to either side; of those with one if there are no others; 0: there is none. */
  most: Map<ColumnName, number>;
}

/** Broken where frames were lost and where for longer than break_s no frame came. */
export function chartOf(buckets: Buckets, columns: readonly ColumnName[], first: number, last: number, break_s: number): Chart {
  const width_s = buckets.width_s;
  const slots: number[] = [];
  const t_s: number[] = [];
  let before = -1;
  for (let b = first; b <= last; b++) {
    const slot = buckets.slot(b);
    if (slot < 0) {
      continue;
    }
    const broken = before >= 0 && (buckets.lost[slot] > 0 || (b - before) * width_s > break_s + width_s);
    if (broken) {
      t_s.push(b * width_s);
      slots.push(-1);
    }
    t_s.push((b + 0.25) * width_s, (b + 0.75) * width_s);
    slots.push(slot, slot);
    before = b;
  }
  const chart: Chart = { t_s, curves: new Map(), most: new Map() };
  for (const name of columns) {
    const track = buckets.tracks.get(name)!;
    const { length } = t_s;
    const [good, doubtful, sdLow, sdHigh] = [0, 1, 2, 3].map(() => new Array<number | null>(length).fill(null));
    const most = { [Trust.none]: 0, [Trust.doubtful]: 0, [Trust.good]: 0 };
    let trusted = Trust.none;
    let second = false;
    let trustBefore = Trust.none;
    for (let i = 0; i < length; i++) {
      const slot = slots[i];
      if (slot < 0) {
        trustBefore = Trust.none;
        second = false;
        continue;
      }
      const trust: Trust = track.trust[slot];
      const low = track.low[slot];
      const high = track.high[slot];
      const value = second === (track.rises[slot] === 1) ? high : low;
      if (trust !== Trust.none) {
        (trust === Trust.good ? good : doubtful)[i] = value;
        /* Where one ends and the other begins the dashes reach over. */
        if (trustBefore === Trust.good && trust === Trust.doubtful) {
          doubtful[i - 1] = good[i - 1];
        } else if (trustBefore === Trust.doubtful && trust === Trust.good) {
          doubtful[i] = value;
        }
        trusted = Math.max(trusted, trust);
        most[trust] = Math.max(most[trust], -low, high);
        if (!Number.isNaN(track.sdLow[slot])) {
          sdLow[i] = track.sdLow[slot];
          sdHigh[i] = track.sdHigh[slot];
        }
      }
      trustBefore = trust;
      second = !second;
    }
    chart.curves.set(name, { good, doubtful, sdLow, sdHigh });
    chart.most.set(name, most[trusted]);
  }
  return chart;
}

/** A run of intervals in which a flag was set. */
export interface Span {
  from_s: number;
  to_s: number;
}

/** lost: 'lost' instead of a flag's bit gives where frames are missing. */
export function spansOf(buckets: Buckets, bit: number | 'lost', first: number, last: number, break_s: number): Span[] {
  const spans: Span[] = [];
  const width_s = buckets.width_s;
  for (let b = first; b <= last; b++) {
    const slot = buckets.slot(b);
    if (slot < 0) {
      continue;
    }
    const is = bit === 'lost' ? buckets.lost[slot] > 0 : (buckets.flags[slot] & bit) !== 0;
    if (!is) {
      continue;
    }
    const from_s = b * width_s;
    const before = spans[spans.length - 1];
    if (before && from_s - before.to_s <= break_s) {
      before.to_s = from_s + width_s;
    } else {
      spans.push({ from_s, to_s: from_s + width_s });
    }
  }
  return spans;
}

/** "5.5 s", from a minute on "1:05.5": of a time that is not negative. */
export function clock(t_s: number): string {
  const t_ms = Math.round(1000 * t_s);
  const minutes = Math.floor(t_ms / 60_000);
  const seconds = String((t_ms % 60_000) / 1000);
  return minutes > 0 ? `${minutes}:${seconds.replace(/^\d(?!\d)/, '0$&')}` : `${seconds} s`;
}

/** Round values from low to high: of most steps, but three values where the range has zero in its middle or at its end. */
export function ticksOf(low: number, high: number, most: number): number[] {
  let step = roundAbove((high - low) / Math.max(most, 2));
  while ((high - low) / step < 2) {
    step = roundAbove(step / 2.5);
  }
  const first = Math.ceil(low / step - 1e-9);
  return Array.from({ length: Math.floor(high / step + 1e-9) - first + 1 }, (_, i) => (first + i) * step);
}
