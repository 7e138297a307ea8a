/** The boards by name. A board class has static sensors, muxes, lines, probes, clkSys_Hz; see pico_mux.mjs for its instances. */
import { InputError } from '../errors.mjs';
import { PicoMux } from './pico_mux.mjs';
import { PicoParallel } from './pico_parallel.mjs';

const BOARDS = { pico_mux: PicoMux, pico_parallel: PicoParallel };

export function findBoard(name) {
  if (!Object.hasOwn(BOARDS, name)) throw new InputError(`unknown board "${name}"; known: ${Object.keys(BOARDS).join(', ')}`);
  return BOARDS[name];
}
