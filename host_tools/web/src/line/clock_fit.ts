/**
 * A fingertip's clock in terms of the page's, from commands and their acknowledgements: the method
 * of libfingertip/clock_fit.hpp. A straight line must pass between the sending and the answer of
 * every exchange of the last half minute; slow exchanges do not touch it, so a page that stalls
 * does no harm.
 */

const WINDOW_us = 30e6;
const EXCHANGES = 512;
/** Crystals are good to 100 ppm with all their errors, at both ends. */
const SLOPE_LIMIT = 200e-6;
/** What drift is worth in gap: while the exchanges span less time than this, they do not tell it. */
const DRIFT_COST_us = 1.5e6;
const STEPS = 40;

export interface ClockExchange {
  /** The page's clock. */
  sent_us: number;
  received_us: number;
  device_us: number;
}

export interface ClockEstimate {
  /** Of the last exchange. */
  device_us: number;
  /** At that time. */
  host_us: number;
  /** Positive: the fingertip's clock is fast. */
  drift_ppm: number;
  /** No error at that time is larger. */
  uncertainty_us: number;
}

/** Where a function that first rises and then falls is highest. */
function highest(low: number, high: number, value: (at: number) => number): number {
  for (let i = 0; i < STEPS; i++) {
    const a = low + (high - low) / 3;
    const b = high - (high - low) / 3;
    if (value(a) < value(b)) {
      low = a;
    } else {
      high = b;
    }
  }
  return (low + high) / 2;
}

/** The last place on the way from inside to outside where the function is not negative. */
function edge(inside: number, outside: number, value: (at: number) => number): number {
  if (value(outside) >= 0) {
    return outside;
  }
  for (let i = 0; i < STEPS; i++) {
    const middle = (inside + outside) / 2;
    if (value(middle) >= 0) {
      inside = middle;
    } else {
      outside = middle;
    }
  }
  return inside;
}

export class ClockFit {
  /** null before the first exchange. */
  estimate: ClockEstimate | null = null;
  jumps = 0;
  private exchanges: ClockExchange[] = [];

  /** In order of device time. */
  add(exchange: ClockExchange): void {
    const last = this.exchanges[this.exchanges.length - 1];
    if (exchange.received_us < exchange.sent_us || (last && exchange.device_us < last.device_us)) {
      return;
    }
    this.exchanges.push(exchange);
    this.exchanges = this.exchanges
      .filter((each) => exchange.device_us - each.device_us <= WINDOW_us)
      .slice(-EXCHANGES);
    this.estimate = this.fit();
    if (!this.estimate) {
      this.jumps++;
      while (!this.estimate) {
        this.exchanges = this.exchanges.slice(Math.ceil(this.exchanges.length / 2));
        if (this.exchanges.length === 0) {
          this.exchanges = [exchange];
        }
        this.estimate = this.fit();
      }
    }
  }

  /** The fingertip was gone: its clock may be another. */
  restart(): void {
    this.exchanges = [];
    this.estimate = null;
  }

  /** The page's clock, us, at a device time; NaN before the first exchange. */
  hostAt(device_us: number): number {
    const estimate = this.estimate;
    return estimate
      ? estimate.host_us + (device_us - estimate.device_us) / (1 + estimate.drift_ppm * 1e-6)
      : NaN;
  }

  private fit(): ClockEstimate | null {
    const last = this.exchanges[this.exchanges.length - 1] as ClockExchange;
    /** Limits at the time of the last exchange of a line of this slope, relative to its sending. */
    const limit = (slope: number, upper: boolean): number => {
      let tightest = upper ? Infinity : -Infinity;
      for (const exchange of this.exchanges) {
        const ago_us = last.device_us - exchange.device_us;
        const host_us = (upper ? exchange.received_us : exchange.sent_us) - last.sent_us;
        const here = host_us + ago_us * (1 + slope);
        tightest = upper ? Math.min(tightest, here) : Math.max(tightest, here);
      }
      return tightest;
    };
    const gap = (slope: number): number => limit(slope, true) - limit(slope, false);
    const widest = highest(-SLOPE_LIMIT, SLOPE_LIMIT, gap);
    if (gap(widest) < 0) {
      return null;
    }
    const slowest = edge(widest, -SLOPE_LIMIT, gap);
    const fastest = edge(widest, SLOPE_LIMIT, gap);
    const slope = highest(slowest, fastest, (at) => gap(at) - DRIFT_COST_us * Math.abs(at));
    const middle = (limit(slope, true) + limit(slope, false)) / 2;
    const latest = limit(highest(slowest, fastest, (at) => limit(at, true)), true);
    const earliest = limit(highest(slowest, fastest, (at) => -limit(at, false)), false);
    return {
      device_us: last.device_us,
      host_us: last.sent_us + middle,
      drift_ppm: (1 / (1 + slope) - 1) * 1e6,
      uncertainty_us: Math.max(latest - middle, middle - earliest),
    };
  }
}
