/** The boards by name. A board class has static sensors, muxes, clkSys_Hz; see pico_mux.mjs for its instances. */
import { InputError } from '../errors.mjs';
import { PicoMux } from './pico_mux.mjs';

const BOARDS = { pico_mux: PicoMux };

export function findBoard(name) {
  if (!Object.hasOwn(BOARDS, name)) throw new InputError(`unknown board "${name}"; known: ${Object.keys(BOARDS).join(', ')}`);
  return BOARDS[name];
}
