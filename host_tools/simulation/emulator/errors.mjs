import { readFileSync } from 'node:fs';
import { getSystemErrorMap } from 'node:util';

/** A mistake in what the user gave: one line that states what to do; the process exits with 2. */
export class InputError extends Error {}

/** The operating system's text of `error`, e.g. "no such file or directory". */
export function inWords(error) {
  return getSystemErrorMap().get(error.errno)?.[1] ?? error.message;
}

/** The content of a file that the user named, as text where an encoding is given; null for a file that may be missing and is. */
export function readInput(path, what, { advice = 'check the path', encoding, optional = false } = {}) {
  try {
    return readFileSync(path, encoding);
  } catch (error) {
    if (optional && error.code === 'ENOENT') return null;
    throw new InputError(`${path}: cannot read the ${what} (${inWords(error)}); ${advice}`);
  }
}

export const readText = (path, what) => readInput(path, what, { encoding: 'utf8' });
