/** What the view reads of a fingertip, and nothing else: the model offers it, tests make it up. The
 * view only reads, and only when it draws. */

/** The newest contact, or that of a moment in the past. A value whose flag is off is 0. */
export interface ShownContact {
  readonly flags: number;
  readonly x_mm: number;
  readonly y_mm: number;
  readonly p0_Pa: number;
  readonly sigma_mm: number;
  readonly force_N: number;
  readonly location_sd_mm: number;
  readonly force_sd_N: number;
  readonly slip_mm: number;
  readonly sigma_x_mm: number;
  readonly sigma_y_mm: number;
  readonly width_correlation: number;
  readonly qx_N: number;
  readonly qy_N: number;
  readonly q_sd_N: number;
  readonly tangential_ratio: number;
  readonly vx_mm_s: number;
  readonly vy_mm_s: number;
}

/** Bitmaps by sensor; pressure_Pa as the fit gets it: above the zero, over the gain. */
export interface ShownReadings {
  readonly valid: number;
  readonly saturated: number;
  readonly doubtful: number;
  readonly pressure_Pa: ArrayLike<number>;
}

/** Where the sensors are, origin in the middle of the pad, x across the strips, y along them. */
export interface ShownLayout {
  readonly x_mm: ArrayLike<number>;
  readonly y_mm: ArrayLike<number>;
}

/** Columns of the last minutes. Row i, of first to end - 1, is at i % capacity; end only grows.
 * t_s never falls. lost: frames that are missing right before this one. */
export interface ShownHistory {
  readonly first: number;
  readonly end: number;
  readonly capacity: number;
  readonly t_s: Float64Array;
  readonly flags: Uint32Array;
  readonly lost: Uint32Array;
  readonly x_mm: Float32Array;
  readonly y_mm: Float32Array;
  readonly force_N: Float32Array;
  readonly force_sd_N: Float32Array;
  readonly location_sd_mm: Float32Array;
  readonly slip_mm: Float32Array;
  readonly qx_N: Float32Array;
  readonly qy_N: Float32Array;
  readonly q_sd_N: Float32Array;
  readonly p0_Pa: Float32Array;
  readonly sigma_mm: Float32Array;
  /** Row i's, where they are kept. */
  readingsAt?(i: number): ShownReadings | null;
}

/** Level: how much it matters, and so its colour. */
export type Level = 'plain' | 'good' | 'warning' | 'bad';

/** A line of the health panel. */
export interface Fact {
  readonly name: string;
  readonly value: string;
  readonly level?: Level;
}

export interface FactGroup {
  readonly title: string;
  readonly facts: readonly Fact[];
}

/** A fingertip that is there, was there, is simulated or replayed. */
export interface ShownFingertip {
  /** Stays the same when it comes back. */
  readonly key: string;
  /** Short. */
  readonly name: string;
  /** 0..7: which of the colours. */
  readonly finger: number;
  readonly source: 'port' | 'simulated' | 'recording';
  /** "live", "stalled for 1.2 s". */
  readonly state: { readonly words: string; readonly level: Level };
  /** Whether what the newest frame told is still so. */
  readonly current: boolean;
  readonly recording: boolean;
  /** Null before its info came. */
  readonly layout: ShownLayout | null;
  readonly slip_threshold_mm: number;
  readonly location_limit_mm: number;
  /** Its firmware tells tangential load and knows the pad. */
  readonly tangential: boolean;
  readonly frames_per_s: number;
  readonly contact: ShownContact | null;
  /** Of the last frame that was not held. */
  readonly readings: ShownReadings | null;
  readonly history: ShownHistory;
  readonly health: readonly FactGroup[];
  /** Of a simulated one: what can press on it. */
  readonly hand: Hand | null;
}

/** SimulatedFingertip of src/simulated offers this. */
export interface Hand {
  readonly objects: readonly { readonly name: string; readonly title: string }[];
  readonly truth: {
    readonly contact: boolean;
    readonly x_mm: number;
    readonly y_mm: number;
    readonly force_N: number;
  };
  choose(name: string): void;
  press(hand: { x_mm: number; y_mm: number; force_N: number } | null): void;
  drop(x_mm: number, y_mm: number): void;
  hold(
    grip: { x_mm: number; y_mm: number; force_N: number; load_N: number; angle_deg: number } | null,
  ): void;
  setFriction(friction: number): void;
}
