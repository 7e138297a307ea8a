/**
 * The boards by name: each folder of boards/ with a descriptor, board.json, which boards/README.md explains. A board class has static
 * sensors, muxes, lines (a data line for each sensor: there are faults of single lines), probes, syncPin, clkSys_Hz; see its model for its instances.
 */
import { existsSync, readFileSync, readdirSync } from 'node:fs';
import { InputError } from '../errors.mjs';
import { MultiplexedBoard } from './multiplexed_board.mjs';
import { ParallelBoard } from './parallel_board.mjs';

const MODELS = { multiplexed: MultiplexedBoard, parallel: ParallelBoard };
const FOLDER = new URL('../../../../boards/', import.meta.url);
const descriptorOf = (name) => new URL(`${name}/board.json`, FOLDER);

export const BOARDS = readdirSync(FOLDER)
  .filter((name) => existsSync(descriptorOf(name)))
  .sort();

export function findBoard(name) {
  if (!BOARDS.includes(name)) throw new InputError(`unknown board "${name}"; known: ${BOARDS.join(', ')}`);
  const descriptor = JSON.parse(readFileSync(descriptorOf(name), 'utf8'));
  const Model = MODELS[descriptor.bus];
  if (!Model) throw new InputError(`board ${name} has a bus "${descriptor.bus}"; known: ${Object.keys(MODELS).join(', ')}`);
  return class extends Model {
    static {
      Object.assign(this, Model.facts(descriptor), { syncPin: descriptor.wiring.pin_sync, clkSys_Hz: 125e6 });
    }

    constructor(options) {
      super(descriptor, options);
    }
  };
}
