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
