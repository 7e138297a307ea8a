/**
 * The RP2040 as the firmware meets it at power-on, built on rp2040js with everything replaced that a board
 * would punish and rp2040js lets pass.
 *
 *     const chip = new Chip(time, report, { serial, seed });
 *     chip.load(image);            // raw flash image, offset 0
 *     chip.boot();                 // what the boot ROM does, then the second stage
 *     chip.runUntil(at_ns);        // throws Stopped when the run is over before
 *
 * An image is loaded as the boot loader does it: the sectors that it reaches are erased, the rest stays.
 *
 * Boot: the boot ROM's part is played here. The CRC-32 of the 256-byte second stage is checked as the boot ROM
 * checks it, the second stage is copied to 0x20041f00 and entered there with lr = 0, clk_sys on the ring
 * oscillator, and only IO_QSPI, PADS_QSPI and TIMER out of reset. SRAM and the USB controller's memory start filled with seeded noise.
 *
 * `chip.onCall(address, callback)` runs `callback(chip)` each time the instruction at `address` is about to
 * execute; `chip.core.cycles` is the processor cycle count at that moment (sleep does not count).
 */
import { RP2040 } from 'rp2040js';
import { Prng } from '../prng.mjs';
import { Clocks, makeRosc, Pll, RESET_BLOCKS, Resets, ROSC_HZ, Xosc } from './clocks.mjs';
import { FLASH_BASE, FLASH_BYTES, RAM_BASE, StrictCore } from './core.mjs';
import { Dma } from './dma.mjs';
import { FlashMemory } from './flash_memory.mjs';
import { I2cBlock } from './i2c_block.mjs';
import { MemoryFault } from './mpu.mjs';
import { Pins } from './pins.mjs';
import { Pio } from './pio.mjs';
import { RegisterFile } from './registers.mjs';
import { SecondCore } from './second_core.mjs';
import { StrictSio } from './sio.mjs';
import { Ssi } from './ssi.mjs';
import { SysClock } from './sys_clock.mjs';
import { Timer, Watchdog } from './timer_watchdog.mjs';
import { UsbBlock } from './usb_block.mjs';

const BOOT2_BYTES = 256;
const SECTOR_BYTES = 4096;
const SCR = 0xd10;
const SCR_SLEEPDEEP = 4;
const PSM_PROC1 = 1 << 16;
const ISER = 0x100;
const FIFO_IRQ_OF_CORE_1 = 16;
/** Interrupt to what wakes by it in deep sleep: the bits of SLEEP_EN0 and SLEEP_EN1. */
const WAKES = new Map([
  [0, [0, 1 << 5]],
  [1, [0, 1 << 5]],
  [2, [0, 1 << 5]],
  [3, [0, 1 << 5]],
  [5, [0, 3 << 10]],
  [11, [1 << 5, 0]],
  [12, [1 << 5, 0]],
  [23, [1 << 6, 0]],
  [24, [1 << 7, 0]],
]);
const BOOT2_RAM = 0x20041f00;
const DPRAM_BASE = 0x50100000;
/** Cycles of the ring oscillator in which the boot ROM tries to load the second stage, 128 times (pico-bootrom, bootrom_main.c), which waits for a flash that is still erasing: 255 ms at 12 MHz. */
const BOOT_TRIES_CYCLES = 3.06e6;
/** A longer sleep without one wake-up means that the firmware hung. */
const HUNG_AFTER_NS = 2e9;

/** Page (address >> 14) to bit in RESETS; JTAG has no registers. */
const RESET_BIT_OF_PAGE = new Map([...RESET_BLOCKS.map(([, address], bit) => [address >>> 14, bit]), [DPRAM_BASE >>> 14, 24]]);
RESET_BIT_OF_PAGE.delete(0);

/** Ends the run; `reason` is what the report calls it. */
export class Stopped extends Error {
  constructor(reason, detail = {}) {
    super(reason);
    this.reason = reason;
    this.detail = detail;
  }
}

class StrictLogger {
  constructor(chip) {
    this.chip = chip;
  }
  debug() {}
  info() {}
  warn(source, message) {
    this.chip.fail(source, message);
  }
  error(source, message) {
    this.chip.fail(source, message);
  }
}

/** CRC-32 with polynomial 0x04c11db7, start 0xffffffff, no reflection, no final xor. */
export function boot2Crc(bytes) {
  let crc = 0xffffffff;
  for (const byte of bytes) {
    crc ^= byte << 24;
    for (let i = 0; i < 8; i++) crc = crc & 0x80000000 ? (crc << 1) ^ 0x04c11db7 : crc << 1;
  }
  return crc >>> 0;
}

export class Chip extends RP2040 {
  /**
   * @param time SimulatedTime
   * @param report Report
   * @param options serial: 8-byte flash unique id; seed: of the power-on noise in SRAM; clock_ppm: by how much all of
   *   the chip's clocks are fast, in this time; revision: 0, 1 or 2 for B0, B1 or B2; rosc_hz: of the ring oscillator; uptime_us: what the timer begins with; memory: the FlashMemory, a new one by default; trouble: what goes wrong
   *   in the chip, by the faults in force: crystalDead, crystalWeak, pllLate, busyHub, lateResume; kept: { sram, usbDPRAM, watchdog }
   *   of the life before a watchdog reboot
   */
  constructor(
    time,
    report,
    {
      serial,
      seed = 1,
      clock_ppm = 0,
      revision = 2,
      rosc_hz = ROSC_HZ,
      uptime_us = 0,
      memory = new FlashMemory({ time, serial, seed }),
      trouble = {},
      kept = null,
    },
  ) {
    super(time.scope());
    this.memory = memory;
    memory.fail = (source, message) => this.fail(source, message);
    this.flash = memory.bytes;
    this.flash16 = new Uint16Array(this.flash.buffer);
    this.flashView = new DataView(this.flash.buffer);
    this.time = time;
    this.report = report;
    this.options = { serial, seed, revision };
    this.trouble = trouble;
    this.logger = new StrictLogger(this);
    this.core0 = new StrictCore(this, 0);
    /** That executes: outside of a turn of core 1, core 0. */
    this.core = this.core0;
    this.sio = new StrictSio(this);
    /** Frequencies are nominal here, as the firmware believes them; what passes in time is this many times as fast. */
    this.clockRate = 1 + clock_ppm * 1e-6;
    this.roscHz = rosc_hz;
    this.clkSys = rosc_hz;
    this.clkUsbHz = 0;
    this.hooks = new Map();
    this.slept_since_ns = -1;
    /** Time in which only what SLEEP_EN names had a clock. */
    this.deepSleep_ns = 0;
    /** Executes nothing that makes sense until it is reset: its clock is none. */
    this.wild = false;
    this.onWatchdog = null;
    this.sysClock = new SysClock(time, this.trueHz(rosc_hz));
    this.pio = [];

    this.resets = new Resets(this);
    this.xosc = new Xosc(this);
    this.pllSys = new Pll(this, 'PLL_SYS');
    this.pllUsb = new Pll(this, 'PLL_USB');
    this.clocks = new Clocks(this);
    this.timer = new Timer(this, uptime_us);
    this.watchdog = new Watchdog(this, kept?.watchdog);
    this.ssi = new Ssi(this, memory);
    this.i2c = [new I2cBlock(this, 0), new I2cBlock(this, 1)];
    this.usbCtrl = new UsbBlock(this);
    this.dma = new Dma(this);
    this.pio = [new Pio(this, 0), new Pio(this, 1)];
    this.pins = new Pins(this);
    const ioQspi = new RegisterFile(
      this,
      'IO_QSPI',
      Object.fromEntries(
        [0, 1, 2, 3, 4, 5].flatMap((i) => [
          [8 * i, [0, 0]],
          [8 * i + 4, [0x1f, 0x3003331f]],
        ]),
      ),
    );
    const writeIoQspi = ioQspi.writeUint32.bind(ioQspi);
    ioQspi.writeUint32 = (offset, value) => {
      writeIoQspi(offset, value);
      if (offset === 0x0c) this.ssi.forceSelect(((value >>> 8) & 3) === 2);
    };
    Object.assign(this.peripherals, {
      0x40000: new RegisterFile(this, 'SYSINFO', { 0: [((revision << 28) | 0x2927) >>> 0, 0], 4: [2, 0] }),
      0x14000: new RegisterFile(this, 'XIP_CTRL', { 0: [3, 0xb], 4: [0, 0], 8: [2, 0], 12: [0, 0], 16: [0, 0] }),
      0x18000: this.ssi,
      0x40008: this.clocks,
      0x4000c: this.resets,
      0x40018: ioQspi,
      0x40024: this.xosc,
      0x40028: this.pllSys,
      0x4002c: this.pllUsb,
      0x40044: this.i2c[0],
      0x40048: this.i2c[1],
      0x40054: this.timer,
      0x40058: this.watchdog,
      0x40060: makeRosc(this),
      0x40064: new RegisterFile(this, 'VREG_AND_CHIP_RESET', { 0: [0xb1, 0xf3], 4: [9, 0x1f], 8: [1 << 8, 1 << 24] }),
      0x50000: this.dma,
      0x50110: this.usbCtrl,
      0x50200: this.pio[0],
      0x50300: this.pio[1],
    });
    for (const pin of this.qspi) pin.padValue = 0x56;
    const noise = new Prng(seed ^ 0x5eed);
    for (const [memory, before] of [
      [this.sram, kept?.sram],
      [this.usbDPRAM, kept?.usbDPRAM],
    ]) {
      const words = new Uint32Array(memory.buffer);
      if (before) memory.set(before);
      else for (let i = 0; i < words.length; i++) words[i] = noise.uint32();
    }
    this.second = new SecondCore(this, seed, this.#makeBootRom());
    this.onBreak = (code) => {
      if (code === 0x42) {
        const [r0, r1] = this.core.registers;
        throw new Stopped('entered the USB boot loader', { r0, r1 });
      }
      this.fail('core', `breakpoint or undefined instruction ${code} at 0x${(this.core.PC - 2).toString(16)}`);
    };
  }

  trueHz(nominalHz) {
    return nominalHz * this.clockRate;
  }

  /** Record a failure and end the run. */
  fail(source, message) {
    const pc = (this.core?.at ?? this.core?.registers?.[15]) >>> 0;
    this.report.fail(source, `${message} (pc 0x${pc.toString(16)})`);
    throw new Stopped('failure');
  }

  #makeBootRom() {
    const rom = new DataView(this.bootrom.buffer);
    const [table, lookup, usbBoot, dead] = [0x40, 0x60, 0x80, 0xa0];
    const code = (at, ...ops) => ops.forEach((op, i) => rom.setUint16(at + 2 * i, op, true));
    rom.setUint32(0x00, BOOT2_RAM, true);
    rom.setUint32(0x04, usbBoot | 1, true);
    rom.setUint32(0x10, 0x0301754d, true);
    rom.setUint16(0x14, table, true);
    rom.setUint16(0x16, table + 4, true);
    rom.setUint16(0x18, lookup | 1, true);
    code(table, 0x4255, usbBoot | 1, 0, 0);
    // ldrh r2,[r0]; cmp r2,#0; beq none; cmp r2,r1; beq found; adds r0,#4; b .; found: ldrh r0,[r0,#2]; bx lr; none: movs r0,#0; bx lr
    code(lookup, 0x8802, 0x2a00, 0xd005, 0x428a, 0xd001, 0x3004, 0xe7f8, 0x8840, 0x4770, 0x2000, 0x4770);
    code(usbBoot, 0xbe42, 0xe7fe);
    code(dead, 0xbf30, 0xe7fd);
    return dead;
  }

  load(image) {
    if (image.length < BOOT2_BYTES + 8 || image.length > FLASH_BYTES) {
      throw new Error(`image of ${image.length} bytes; expected 264 bytes to 2 MiB of raw flash content`);
    }
    this.flash.fill(0xff, 0, Math.ceil(image.length / SECTOR_BYTES) * SECTOR_BYTES);
    this.flash.set(image);
    this.image = image;
  }

  boot() {
    const stored = this.flashView.getUint32(BOOT2_BYTES - 4, true);
    const computed = boot2Crc(this.flash.subarray(0, BOOT2_BYTES - 4));
    const { core } = this;
    core.VTOR = 0;
    core.registers.fill(0);
    core.registers[13] = BOOT2_RAM;
    core.registers[15] = BOOT2_RAM;
    this.time.setCycleSource(core, 1e9 / this.trueHz(this.clkSys));
    if (stored !== computed) {
      this.fail(
        'boot ROM',
        `second stage CRC is 0x${stored.toString(16)}, computed 0x${computed.toString(16)}: the chip would not start this image`,
      );
    }
    const magic = this.watchdog.scratch[4];
    if (this.watchdog.reason && magic === 0xb007c0d3) {
      this.fail('boot ROM', 'watchdog reboot to a vector (scratch 4 magic) is not modelled');
    }
    this.sram.set(this.flash.subarray(0, BOOT2_BYTES), BOOT2_RAM - RAM_BASE);
    this.second.powerUp();
    this.starts_ns = this.memory.isBusy ? this.memory.busyUntil_ns : 0;
    const tries_ns = (BOOT_TRIES_CYCLES / this.trueHz(this.roscHz)) * 1e9;
    if (this.starts_ns > this.time.nanos + tries_ns) {
      this.fail('boot ROM', `the flash is busy for longer than ${Math.round(tries_ns / 1e6)} ms: the chip enters its USB boot loader`);
    }
  }

  /** Stop existing: no alarm of this chip fires any more. */
  dispose() {
    this.clock.dispose();
  }

  updateClocks() {
    const hz = this.clocks.sysHz;
    if (hz > 133e6) this.fail('CLOCKS', `clk_sys at ${hz / 1e6} MHz; the rated maximum is 133 MHz`);
    if (hz && hz !== this.clkSys) {
      this.clkSys = hz;
      this.time.setCycleSource(this.core0, 1e9 / this.trueHz(hz));
      this.sysClock.retune(this.trueHz(hz));
      for (const block of [this.dma, ...this.pio]) block.clockChanged();
      this.ppb.systickTimer.frequency = this.trueHz(hz);
    } else if (!hz) this.fail('CLOCKS', 'clk_sys stopped');
    if (this.trouble.crystalWeak && this.clocks.onCrystal) this.wild = true;
    this.watchdog.tickChanged();
    this.clkUsbHz = this.clocks.usbHz;
    this.clkPeri = this.clocks.periHz || this.clkPeri;
  }

  resetBlock(bit) {
    const [i2c0, i2c1] = this.i2c;
    const [pio0, pio1] = this.pio;
    const { dma, pllSys, pllUsb, timer, usbCtrl } = this;
    ({ 2: dma, 3: i2c0, 4: i2c1, 10: pio0, 11: pio1, 12: pllSys, 13: pllUsb, 21: timer, 24: usbCtrl })[bit]?.reset();
    if (bit === 12 || bit === 13) this.updateClocks();
    else if (bit === 10 || bit === 11) this.pins.drive();
    else if (bit === 5 || bit === 8) {
      for (const pin of this.gpio) {
        if (bit === 5) pin.ctrl = 0x1f;
        else pin.padValue = 0x56;
      }
      this.pins.reconfigure();
    }
  }

  /** From now on this core executes. */
  takeTurn(core) {
    this.core = core;
    this.sio.use(core.id);
  }

  /** SEV. */
  sendEvent() {
    this.core0.onEvent();
    this.second.onEvent();
  }

  setInterrupt(irq, value) {
    this.core0.setInterrupt(irq, value);
  }

  setFifoInterrupt(id, irq, value) {
    (id ? this.second : this.core0).setInterrupt(irq, value);
  }

  #followPower({ frceOn, frceOff }) {
    if (frceOn || frceOff & ~PSM_PROC1)
      this.fail('PSM', `FRCE_ON 0x${frceOn.toString(16)}, FRCE_OFF 0x${frceOff.toString(16)}: only the reset of core 1 is modelled`);
    if (frceOff && this.core.id === 1) this.fail('PSM', 'core 1 resets itself');
    if (frceOff) this.second.powerDown();
    else if (this.second.state === 'off') this.second.powerUp();
  }

  get gpioValues() {
    return this.pins.inputs;
  }

  watchdogFired(reason) {
    const wdsel = this.peripherals[0x40010].wdsel;
    if ((wdsel & 0x1fffc) !== 0x1fffc) {
      this.fail(
        'WATCHDOG',
        `fired with PSM_WDSEL 0x${wdsel.toString(16)}; select everything but the oscillators (0x1fffc), or the reboot is partial`,
      );
    }
    this.watchdog.reason = reason;
    this.onWatchdog?.(reason);
    throw new Stopped('watchdog reboot', { reason });
  }

  #checkPage(address, what) {
    const bit = RESET_BIT_OF_PAGE.get(address >>> 14);
    if (bit !== undefined && this.resets.isHeld(bit)) {
      this.fail('RESETS', `${what} 0x${address.toString(16)} while ${RESET_BLOCKS[bit][0]} is held in reset`);
    }
  }

  /** A load that did not hit SRAM. */
  busRead(address, bytes) {
    if (this.core.isGuarded && this.core.mpu.denies(address)) throw new MemoryFault();
    if (address & (bytes - 1)) this.fail('core', `unaligned ${8 * bytes}-bit read of 0x${address.toString(16)}`);
    const word = (address & ~3) >>> 0;
    let value;
    if (address < 0x4000) value = this.bootrom[address >>> 2];
    else if (address >= FLASH_BASE && address < 0x14000000) {
      const problem = this.ssi.xipProblem;
      if (problem) this.fail('XIP', `read of flash at 0x${address.toString(16)} while ${problem}`);
      const offset = word & 0xffffff;
      if (offset >= FLASH_BYTES) this.fail('XIP', `read of 0x${address.toString(16)}, beyond the 2 MiB flash`);
      value = this.flashView.getUint32(offset, true);
    } else if (address >>> 28 === 0xd) {
      value = this.sio.readUint32(word - 0xd0000000);
    } else if (address >>> 12 === 0xe000e) {
      const offset = word & 0xfff;
      value =
        offset === SCR ? this.core.scr : offset >= 0xd90 && offset <= 0xda0 ? this.core.mpu.read(offset) : this.ppb.readUint32(offset);
    } else if (address >>> 12 === DPRAM_BASE >>> 12) {
      this.#checkPage(address, 'read of');
      value = this.usbDPRAMView.getUint32(word - DPRAM_BASE, true);
    } else {
      const peripheral = this.findPeripheral(address);
      if (!peripheral) this.fail('core', `read of 0x${address.toString(16)}, where nothing is`);
      this.#checkPage(address, 'read of');
      value = peripheral.readUint32(word & 0xfff);
    }
    if (bytes === 4) return value >>> 0;
    return bytes === 2 ? (value >>> (8 * (address & 2))) & 0xffff : (value >>> (8 * (address & 3))) & 0xff;
  }

  /** A store that did not hit SRAM. Narrow stores to peripherals replicate the value, as the bus does. */
  busWrite(address, value, bytes) {
    if (this.core.isGuarded && this.core.mpu.denies(address)) throw new MemoryFault();
    if (address & (bytes - 1)) this.fail('core', `unaligned ${8 * bytes}-bit write of 0x${address.toString(16)}`);
    if (address < 0x4000) this.fail('core', `write to 0x${address.toString(16)} in the boot ROM (null pointer?)`);
    if (address >>> 26 === FLASH_BASE >>> 26) this.fail('core', `write to 0x${address.toString(16)} in flash`);
    if (address >>> 12 === DPRAM_BASE >>> 12) {
      this.#checkPage(address, 'write of');
      this.usbCtrl.writeDpram(address - DPRAM_BASE, value, bytes);
      return;
    }
    const wide = bytes === 4 ? value : bytes === 2 ? (value | (value << 16)) >>> 0 : Math.imul(value, 0x01010101) >>> 0;
    if (address >>> 28 === 0xd) {
      if (bytes !== 4) this.fail('SIO', `${8 * bytes}-bit write of 0x${address.toString(16)}`);
      this.sio.writeUint32(address - 0xd0000000, value);
    } else if (address >>> 12 === 0xe000e) {
      if (bytes !== 4) this.fail('core', `${8 * bytes}-bit write of system register 0x${address.toString(16)}`);
      const offset = address & 0xfff;
      if (offset === SCR) this.#writeScr(value);
      else if (offset >= 0xd90 && offset <= 0xda0) this.core.mpu.write(offset, value);
      else {
        this.#checkPrivate(offset, value);
        this.ppb.writeUint32(offset, value);
      }
    } else {
      const peripheral = this.findPeripheral(address);
      if (!peripheral) this.fail('core', `write to 0x${address.toString(16)}, where nothing is`);
      this.#checkPage(address, 'write of');
      peripheral.writeUint32Atomic(address & 0xffc, wide, (address >>> 12) & 3);
      if (peripheral === this.peripherals[0x40014] || peripheral === this.peripherals[0x4001c]) this.pins.reconfigure();
      if (peripheral === this.peripherals[0x40010]) this.#followPower(peripheral);
    }
  }

  #checkPrivate(offset, value) {
    if (this.core.id === 0) return;
    if (offset >= 0x10 && offset < 0x20) this.fail('core 1', 'its SysTick is not modelled');
    if (offset === ISER && value & ~(1 << FIFO_IRQ_OF_CORE_1))
      this.fail('core 1', `interrupts 0x${value.toString(16)}: only that of its FIFO is modelled`);
  }

  #writeScr(value) {
    if (value & ~SCR_SLEEPDEEP) this.fail('core', `SCR 0x${value.toString(16)}: only SLEEPDEEP is modelled`);
    this.core.scr = value;
  }

  #checkWake() {
    const { core, clocks } = this;
    const pending = core.pendingInterrupts & core.enabledInterrupts;
    const [en0, en1] = [clocks.readUint32(0xa8), clocks.readUint32(0xac)];
    for (const [irq, [in0, in1]] of WAKES) {
      if ((pending >>> irq) & 1 && (in0 & ~en0 || in1 & ~en1))
        this.fail('CLOCKS', `woken from deep sleep by interrupt ${irq}, but SLEEP_EN leaves its block without a clock`);
    }
  }

  onCall(address, callback) {
    this.hooks.set(address & ~1, callback);
  }

  /** Run until emulated time `end_ns`, firing alarms on the way. */
  runUntil(end_ns) {
    const { time, core0: core, second } = this;
    for (;;) {
      time.fireDue();
      if (core.waiting) core.checkForInterrupts();
      if (this.slept_since_ns >= 0 && !core.waiting && core.scr & SCR_SLEEPDEEP && second.sleepsDeep) this.#checkWake();
      const now = time.nanos;
      if (now >= end_ns) return;
      const next = Math.min(time.next_ns, end_ns);
      if (now < this.starts_ns) {
        time.advanceTo(Math.min(next, this.starts_ns));
        continue;
      }
      if (this.wild) {
        time.advanceTo(next);
        time.earliestChanged = false;
        continue;
      }
      if (core.waiting) {
        if (this.slept_since_ns < 0) this.slept_since_ns = now;
        if (!core.wakeable && !(core.waitsForEvent && second.isActive)) this.fail('core', 'firmware hung: WFI with no interrupt enabled');
        if (now - this.slept_since_ns >= HUNG_AFTER_NS) {
          this.fail('core', `firmware hung: asleep for ${HUNG_AFTER_NS / 1e9} s without an interrupt`);
        }
        const turn_ns = second.isAwake ? second.turn() * time.ns_per_cycle : Infinity;
        time.advanceTo(Math.min(next, this.slept_since_ns + HUNG_AFTER_NS, now + turn_ns));
        if (core.scr & SCR_SLEEPDEEP && second.sleepsDeep) this.deepSleep_ns += time.nanos - now;
        if (second.state === 'runs') second.catchUp();
        continue;
      }
      this.slept_since_ns = -1;
      const cycles = Math.max(1, Math.ceil((next - now) / time.ns_per_cycle - 1e-9));
      const stop = core.cycles + (second.isAwake ? Math.min(cycles, second.turn()) : cycles);
      time.earliestChanged = false;
      if (this.hooks.size) {
        do {
          this.hooks.get(core.registers[15] & ~1)?.(this);
          core.executeInstruction();
        } while (core.cycles < stop && !core.waiting && !time.earliestChanged);
      } else core.execute(stop, time);
      if (second.state === 'runs') second.catchUp();
    }
  }
}
