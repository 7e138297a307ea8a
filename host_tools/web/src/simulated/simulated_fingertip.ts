/**
 * A fingertip without hardware: the firmware's own code on simulated sensors under simulated
 * rubber, in a worker, in real time. Simulated figures, all of them.
 *
 * The pad: 12 mm of silicone without ends (host_tools/twin), x across, y along, origin in the
 * middle, sensors within 9 and 18 mm. An object is chosen, then a hand presses and drags it, drops
 * it as a weight, or a grip holds it while a load pulls. Friction is Coulomb's with the rubber's
 * give before it: what is dragged sticks, gives, then slips.
 */
import type { Line } from '../line/line';

/** What may press. mass_g: what it weighs when it is dropped. */
export interface SimulatedObject {
  readonly name: string; // "ball15", "tip6", "weight", "cube", "edge", "lime"
  readonly title: string; // "a ball of 15 mm"
  readonly mass_g: number;
}

/** A hand that holds the object. Where it is beyond the pad, nothing is touched. */
export interface Hand {
  x_mm: number;
  y_mm: number;
  /** Down, 0..50. */
  force_N: number;
}

/** A grip that presses the object on the pad while a load, its weight, pulls it along. */
export interface Grip extends Hand {
  load_N: number;
  /** From x towards y. */
  angle_deg: number;
}

/** What really happens, at the time of the newest bytes. */
export interface Truth {
  /** Device time. */
  t_us: number;
  contact: boolean;
  x_mm: number;
  y_mm: number;
  force_N: number;
  /** Of the object on the rubber. */
  qx_N: number;
  qy_N: number;
  /** All of the contact slides. */
  slips: boolean;
}

export interface SimulatedOptions {
  /** Sixteen hexadecimal digits tell several apart. */
  serial?: string;
  seed?: number;
  /** Times the data sheet's noise; 1. */
  noise?: number;
  /** Standard deviation of the sensors' gains, percent; 10, as cast; 0 for a perfect pad. */
  gain_percent?: number;
  /** Which board's bus: it sets the highest rate. "pico_parallel". */
  bus?: 'pico_parallel' | 'pico_mux';
}

export declare class SimulatedFingertip implements Line {
  constructor(options?: SimulatedOptions);
  readonly label: string;
  /** To choose from, known at once. */
  readonly objects: readonly SimulatedObject[];
  /** Newest truth; a listener is called with each, some 60 a second. */
  readonly truth: Truth;
  onTruth: ((truth: Truth) => void) | null;

  open(
    receive: (bytes: Uint8Array, at_ms: number) => void,
    closed: (why: string) => void,
  ): Promise<void>;
  send(bytes: Uint8Array): Promise<void>;
  /** The line only: the fingertip goes on, and can be opened again. */
  close(): Promise<void>;

  /** By name; lifts what was there. */
  choose(object: string): void;
  /** Presses, and drags along as x_mm and y_mm change; null lifts. */
  press(hand: Hand | null): void;
  /** Lets the object fall from some millimetres above; it lies there until press or lift. */
  drop(x_mm: number, y_mm: number): void;
  /** Holds, and lets it slip where the load is more than friction holds; null lets go. */
  hold(grip: Grip | null): void;
  /** Static friction, 0.1..1.5; 0.5. Kinetic is 0.8 of it. */
  setFriction(friction: number): void;
  /** Pulls the plug; with the next open it starts anew, with what it had kept. */
  unplug(): void;
  /** Ends the worker. */
  dispose(): void;
}
