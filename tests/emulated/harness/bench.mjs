/** Builds little test images with arm-none-eabi-gcc and runs them on a Machine. */
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { findBoard } from '../../../host_tools/simulation/emulator/board/boards.mjs';
import { boot2Crc } from '../../../host_tools/simulation/emulator/chip/chip.mjs';
import { parseFaults } from '../../../host_tools/simulation/emulator/faults.mjs';
import { Machine } from '../../../host_tools/simulation/emulator/machine.mjs';
import { parseScenario } from '../../../host_tools/simulation/emulator/scenario.mjs';

const RIG = fileURLToPath(new URL('./rig', import.meta.url));
const CPU = ['-mcpu=cortex-m0plus', '-mthumb'];

/** The second stage with its CRC, the same in all images. */
let stage;

/** @returns the flash image of `source` (C, sees rig.h) */
export function build(source) {
  const folder = mkdtempSync(join(tmpdir(), 'rig-'));
  try {
    const path = (name) => join(folder, name);
    const binary = (name, ...args) => {
      execFileSync('arm-none-eabi-gcc', [...CPU, ...args, '-o', path(`${name}.elf`)], { stdio: 'pipe' });
      execFileSync('arm-none-eabi-objcopy', ['-O', 'binary', path(`${name}.elf`), path(`${name}.bin`)]);
      return readFileSync(path(`${name}.bin`));
    };
    if (!stage) {
      stage = new Uint8Array(256);
      stage.set(binary('boot2', '-c', join(RIG, 'boot2.S')));
      new DataView(stage.buffer).setUint32(252, boot2Crc(stage.subarray(0, 252)), true);
    }
    writeFileSync(path('main.c'), `${/\bvoid isr\(/.test(source) ? '#define HAS_ISR\n' : ''}#include "rig.h"\n${source}\n`);
    const strict = ['-Wall', '-Werror', '--param=min-pagesize=0', '-fno-delete-null-pointer-checks', '-fno-tree-loop-distribute-patterns'];
    const bare = ['-O2', '-ffreestanding', '-nostdlib', ...strict, `-I${RIG}`, `-T${join(RIG, 'rig.ld')}`];
    const main = binary('main', ...bare, path('main.c'), '-lgcc');
    return Uint8Array.from([...stage, ...main]);
  } finally {
    rmSync(folder, { recursive: true });
  }
}

export const HEADER = `t_s,contact,x_mm,y_mm,force_N,p0_Pa,sigma_mm,slip,${Array.from({ length: 15 }, (_, k) => `s${k}_Pa`).join(',')}`;

/** A scenario in which sensor k feels `pressures_Pa[k]` above ambient at all times. */
export function steady(pressures_Pa = new Array(15).fill(0), temperature_degC = 25) {
  return parseScenario(
    `# fingertip-scenario 1\n# ambient_Pa: 100000\n# temperature_degC: ${temperature_degC}\n${HEADER}\n0,0,0,0,0,0,0,0,${pressures_Pa.join(',')}\n`,
    'steady.csv',
  );
}

export function makeMachine(source, options = {}) {
  const Board = findBoard('pico_mux');
  const faults = parseFaults(JSON.stringify(options.faults ?? []), 'faults', Board);
  return new Machine({ image: build(source), Board, scenario: steady(), fastEnumeration: true, ...options, faults });
}

/** Run to the image's `done()` or `seconds`; `results` are its RESULT words. */
export function run(source, { seconds = 1, ...options } = {}) {
  const machine = makeMachine(source, options);
  machine.run(seconds * 1e9);
  const at = 0x30000 / 4;
  const results = [...new Uint32Array(machine.chip.sram.buffer).subarray(at, at + 32)];
  return { machine, results, result: machine.result, finished: machine.endReason === 'entered the USB boot loader' };
}
