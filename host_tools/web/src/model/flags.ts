/** Flags of a contact, as people read them. */
import { FLAGS } from '../line/line_facts';

export { FLAGS };

export type FlagMeaning = (typeof FLAGS)[number];

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
