import { getSystemErrorMap } from 'node:util';

/** A mistake in what the user gave: one line that states what to do; the process exits with 2. */
export class InputError extends Error {}

/** The operating system's text of `error`, e.g. "no such file or directory". */
export function inWords(error) {
  return getSystemErrorMap().get(error.errno)?.[1] ?? error.message;
}
