/** Flags of a contact, as people read them (firmware/common/contact_flags.h). */
import { Flag } from '../line/packets';

export interface FlagMeaning {
  bit: number;
  name: keyof typeof Flag;
  /** The numbers deserve less trust. */
  warning: boolean;
  /** In plain words. */
  meaning: string;
}

const STATE: [keyof typeof Flag, string][] = [
  ['CONTACT', 'something presses'],
  ['FIT_VALID', 'place and force are told'],
  ['UNCERTAINTY_VALID', 'how far they may be off is told'],
  ['SLIP_VALID', 'the slip distance spans its whole window'],
  ['SLIP', 'it slips: the slip distance is above the threshold'],
  ['TARED', 'readings are relative to a measured zero'],
  ['HELD', 'all of the frame before: the sensors measured their temperature'],
  ['WIDTHS_VALID', 'the widths along the axes are told'],
  ['CALIBRATED', 'gains and force scale of a calibration act'],
  ['TANGENTIAL_VALID', 'what pulls along the rubber is told'],
  ['TANGENTIAL_FROM_TOUCH', 'the tangential load is what changed since the first touch'],
  ['VELOCITY_VALID', 'the velocity of the contact is told'],
  ['MOVING', 'the contact moves'],
  ['SLIDING', 'the contact slides, however slowly'],
];

const WARNINGS: [keyof typeof Flag, string][] = [
  ['LOW_SIGNAL', 'it presses so lightly that noise matters'],
  ['FLAT', 'pressure without a peak: there is no place'],
  ['UNCERTAIN', 'the place may be further off than the limit that is set'],
  ['MODEL', 'the pressures are not those of one contact'],
  ['SATURATED', 'a sensor is beyond its range and was left out'],
  ['FORCE_LOWER_BOUND', 'too few sensors are in their range: the force is at least this'],
  ['SENSOR_MASKED', 'a sensor is missing or was left out'],
  ['AT_BOUND', 'the fit stopped at a limit'],
  ['ELONGATED', 'the contact is not round'],
  ['ZERO_DOUBTFUL', 'what is felt may be a zero that has moved, or rubber that has not let go yet'],
  ['SENSOR_DOUBTFUL', 'a sensor in use gives reason to doubt it'],
];

/** Those of state, then the warnings; as the tool orders them. */
export const FLAGS: readonly FlagMeaning[] = [
  ...STATE.map(([name, meaning]) => ({ bit: Flag[name], name, warning: false, meaning })),
  ...WARNINGS.map(([name, meaning]) => ({ bit: Flag[name], name, warning: true, meaning })),
];

/** The bits of all warnings: whoever trusts a contact heeds them. */
export const WARNING_FLAGS = FLAGS.reduce((bits, flag) => bits | (flag.warning ? flag.bit : 0), 0);

/** The warnings that are set. */
export function warningsOf(flags: number): FlagMeaning[] {
  return FLAGS.filter((flag) => flag.warning && flags & flag.bit);
}

/** "CONTACT FIT_VALID", an unknown bit as "bit29". */
export function flagsText(flags: number): string {
  const names: string[] = FLAGS.filter((flag) => flags & flag.bit).map((flag) => flag.name);
  const known = FLAGS.reduce((bits, flag) => bits | flag.bit, 0);
  for (let bit = 0; bit < 32; bit++) {
    if ((flags & ~known) >>> bit & 1) {
      names.push(`bit${bit}`);
    }
  }
  return names.join(' ');
}
