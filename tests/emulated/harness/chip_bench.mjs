/** A chip whose processor never runs: its blocks are used from the test, in cycles of a 125 MHz clk_sys. */
import { Chip } from '../../../host_tools/simulation/emulator/chip/chip.mjs';
import { SimulatedTime } from '../../../host_tools/simulation/emulator/clock.mjs';
import { Report } from '../../../host_tools/simulation/emulator/report.mjs';

export const CYCLE_NS = 8;

export class ChipBench {
  /** @param held bits of RESETS that stay held */
  constructor({ held = 0 } = {}) {
    this.time = new SimulatedTime();
    this.report = new Report(() => this.time.nanos);
    this.chip = new Chip(this.time, this.report, { serial: new Uint8Array(8) });
    this.chip.resets.held = held;
    this.chip.sysClock.retune(125e6);
    this.ram = new DataView(this.chip.sram.buffer);
  }

  write(address, value, bytes = 4) {
    this.chip.busWrite(address, value >>> 0, bytes);
  }

  read(address, bytes = 4) {
    return this.chip.busRead(address, bytes);
  }

  /** Let time pass; alarms fire. */
  run(cycles) {
    this.runTo(this.time.nanos + cycles * CYCLE_NS);
  }

  runTo(end_ns) {
    const { time } = this;
    while (time.next_ns <= end_ns) {
      time.advanceTo(Math.max(time.next_ns, time.nanos));
      time.fireDue();
    }
    time.advanceTo(end_ns);
  }

  /** Function of pins: 5 SIO, 6 PIO0, 7 PIO1. */
  pinFunction(pins, which) {
    for (const pin of pins) this.write(0x40014004 + 8 * pin, which);
  }

  get warnings() {
    return this.report.list.map((e) => e.message);
  }
}
