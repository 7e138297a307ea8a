/** The flags of a contact, in the words of the terminal's monitor (host_tools/cli/doubt.cpp). */

export const FLAG = {
  CONTACT: 1 << 0,
  FIT_VALID: 1 << 1,
  UNCERTAINTY_VALID: 1 << 2,
  SLIP_VALID: 1 << 3,
  SLIP: 1 << 4,
  TARED: 1 << 5,
  HELD: 1 << 6,
  WIDTHS_VALID: 1 << 7,
  LOW_SIGNAL: 1 << 8,
  FLAT: 1 << 9,
  UNCERTAIN: 1 << 10,
  MODEL: 1 << 11,
  SATURATED: 1 << 12,
  FORCE_LOWER_BOUND: 1 << 13,
  SENSOR_MASKED: 1 << 14,
  AT_BOUND: 1 << 15,
  ELONGATED: 1 << 16,
  ZERO_DOUBTFUL: 1 << 17,
  SENSOR_DOUBTFUL: 1 << 18,
  CALIBRATED: 1 << 19,
  TANGENTIAL_VALID: 1 << 20,
  TANGENTIAL_FROM_TOUCH: 1 << 21,
  VELOCITY_VALID: 1 << 22,
  MOVING: 1 << 23,
  SLIDING: 1 << 24,
} as const;

export interface Warning {
  readonly bit: number;
  readonly name: string;
  readonly words: string;
}

/** Lowest bit first. */
export const WARNINGS: readonly Warning[] = [
  { bit: FLAG.LOW_SIGNAL, name: 'LOW_SIGNAL', words: 'hardly above the noise' },
  { bit: FLAG.FLAT, name: 'FLAT', words: 'no peak, no location' },
  { bit: FLAG.UNCERTAIN, name: 'UNCERTAIN', words: 'may be off by more than the limit' },
  { bit: FLAG.MODEL, name: 'MODEL', words: 'not one round contact' },
  { bit: FLAG.SATURATED, name: 'SATURATED', words: 'a sensor is beyond its range' },
  { bit: FLAG.FORCE_LOWER_BOUND, name: 'FORCE_LOWER_BOUND', words: 'the force is at least this' },
  { bit: FLAG.SENSOR_MASKED, name: 'SENSOR_MASKED', words: 'a sensor is left out' },
  { bit: FLAG.AT_BOUND, name: 'AT_BOUND', words: 'the fit stopped at its limit' },
  { bit: FLAG.ELONGATED, name: 'ELONGATED', words: 'the contact is not round' },
  { bit: FLAG.ZERO_DOUBTFUL, name: 'ZERO_DOUBTFUL', words: 'the zero may have moved' },
  { bit: FLAG.SENSOR_DOUBTFUL, name: 'SENSOR_DOUBTFUL', words: 'a sensor is in doubt' },
];

export const WARNING_BITS = WARNINGS.reduce((bits, warning) => bits | warning.bit, 0);

export function warningsOf(flags: number): readonly Warning[] {
  return flags & WARNING_BITS ? WARNINGS.filter((warning) => flags & warning.bit) : [];
}

/** limit_mm: that of UNCERTAIN, where it is known. */
export function wordsOf(warning: Warning, limit_mm?: number): string {
  return warning.bit === FLAG.UNCERTAIN && limit_mm
    ? `may be off by more than ${limit_mm.toFixed(2)} mm`
    : warning.words;
}
