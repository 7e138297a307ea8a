import { getSystemErrorMap } from 'node:util';

/** A mistake in what the user gave: one line that says what to do; the process exits with 2. */
export class InputError extends Error {}

/** What the operating system says in `error`, e.g. "no such file or directory". */
export function inWords(error) {
  return getSystemErrorMap().get(error.errno)?.[1] ?? error.message;
}
