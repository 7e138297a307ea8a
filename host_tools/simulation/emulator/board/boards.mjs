/** The boards by name. A board class has static sensors, muxes, lines, probes, clkSys_Hz; see multiplexed_board.mjs for its instances. */
import { InputError } from '../errors.mjs';
import { PicoMux } from './multiplexed_board.mjs';
import { PicoParallel } from './parallel_board.mjs';

const BOARDS = { pico_mux: PicoMux, pico_parallel: PicoParallel };

export function findBoard(name) {
  if (!Object.hasOwn(BOARDS, name)) throw new InputError(`unknown board "${name}"; known: ${Object.keys(BOARDS).join(', ')}`);
  return BOARDS[name];
}
