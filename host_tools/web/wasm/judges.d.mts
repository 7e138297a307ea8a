import type { Judges } from '../src/judges/judges';

export function load(bytes: BufferSource): Promise<Judges>;
