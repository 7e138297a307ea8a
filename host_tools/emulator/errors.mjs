/** A mistake in what the user gave: one line that says what to do; the process exits with 2. */
export class InputError extends Error {}
