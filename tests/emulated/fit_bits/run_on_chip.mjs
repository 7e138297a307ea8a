#!/usr/bin/env node
/**
 * usage: run_on_chip.mjs IMAGE.bin KERNEL COUNT [second]: prints the CRC of each of the first COUNT presses as the image
 * fit_bits_rp2040 computes it on the emulated chip, on its second core if that is given.
 */
import { readFileSync } from 'node:fs';
import { Chip, Stopped } from '../../../host_tools/simulation/emulator/chip/chip.mjs';
import { SimulatedTime } from '../../../host_tools/simulation/emulator/clock.mjs';
import { Report } from '../../../host_tools/simulation/emulator/report.mjs';

const NEXT_PRESS = 1;
const A_MINUTE_ns = 60e9;

const [image, kernel, count, core] = process.argv.slice(2);
const time = new SimulatedTime();
const report = new Report(() => time.nanos);
const chip = new Chip(time, report, { serial: new Uint8Array(8) });
chip.load(readFileSync(image));
chip.boot();
const otherBreak = chip.onBreak;
chip.onBreak = (code) => {
  if (code === NEXT_PRESS) throw new Stopped('next press');
  otherBreak(code);
};

function untilNextPress() {
  try {
    chip.runUntil(time.nanos + A_MINUTE_ns);
  } catch (error) {
    if (error instanceof Stopped && error.reason === 'next press') return;
    throw new Error(`the image stopped: ${error.reason ?? error.message}; ${report.list.map((e) => Report.line(e)).join('; ')}`);
  }
  throw new Error('a fit takes longer than a minute');
}

untilNextPress();
const job = new DataView(chip.sram.buffer, chip.sram.byteOffset + chip.core.registers[0] - 0x20000000);
for (let press = 0; press < Number(count); press++) {
  job.setUint32(0, Number(kernel), true);
  job.setUint32(4, press, true);
  if (core === 'second') job.setUint32(12, 1, true);
  untilNextPress();
  if (core === 'second' && !(chip.second.cycles > 1000)) throw new Error('the second core does nothing');
  process.stdout.write(`${job.getUint32(8, true).toString(16).padStart(8, '0')}\n`);
}
