/** Flags of a contact, as people read them. */
import { FLAGS } from '../line/line_facts';

/** The bits of all warnings: trust a contact only without them. */
export const WARNING_FLAGS = FLAGS.reduce((bits, flag) => bits | (flag.warning ? flag.bit : 0), 0);

/** The warnings that are set. */
export function warningsOf(flags: number): (typeof FLAGS)[number][] {
  return FLAGS.filter((flag) => flag.warning && flags & flag.bit);
}
