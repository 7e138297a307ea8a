/**
 * Resets, oscillators, PLLs and clock multiplexers of the RP2040 (datasheet 2.14 to 2.18), with the order
 * in which they may be started enforced: a PLL needs a stable crystal, a multiplexer a running source, the
 * auxiliary input of clk_sys may change only while clk_sys runs from clk_ref. A crystal that does not swing in
 * full yet (a fault) counts as stable when its STARTUP has passed, and stops the chip once it drives a clock.
 */
import { BasePeripheral } from 'rp2040js';
import { field, RegisterBlock, RegisterFile } from './registers.mjs';

export const XOSC_HZ = 12e6;
/** Typical frequency of the ring oscillator; that of a part is from 1.8 to 12 MHz (pico-bootrom, bootrom_main.c). */
export const ROSC_HZ = 6.5e6;
/** Modelled time from PLL power-up to lock. */
const PLL_LOCK_NS = 50e3;
/** Time after its power-up for which a PLL that was locked before still reports a lock, unless its block was reset. */
const PLL_STALE_NS = 5e3;

const RESET_BITS = 0x1ffffff;
const TIMER = 21;
/** What the boot ROM has released when it enters the second stage: IO_QSPI, PADS_QSPI, TIMER. */
const RELEASED_BY_BOOT_ROM = (1 << 6) | (1 << 9) | (1 << 21);

/** Name and address of each block, by its bit in RESETS. */
export const RESET_BLOCKS = [
  ['ADC', 0x4004c000],
  ['BUSCTRL', 0x40030000],
  ['DMA', 0x50000000],
  ['I2C0', 0x40044000],
  ['I2C1', 0x40048000],
  ['IO_BANK0', 0x40014000],
  ['IO_QSPI', 0x40018000],
  ['JTAG', 0],
  ['PADS_BANK0', 0x4001c000],
  ['PADS_QSPI', 0x40020000],
  ['PIO0', 0x50200000],
  ['PIO1', 0x50300000],
  ['PLL_SYS', 0x40028000],
  ['PLL_USB', 0x4002c000],
  ['PWM', 0x40050000],
  ['RTC', 0x4005c000],
  ['SPI0', 0x4003c000],
  ['SPI1', 0x40040000],
  ['SYSCFG', 0x40004000],
  ['SYSINFO', 0x40000000],
  ['TBMAN', 0x4006c000],
  ['TIMER', 0x40054000],
  ['UART0', 0x40034000],
  ['UART1', 0x40038000],
  ['USBCTRL', 0x50110000],
];

export class Resets extends RegisterBlock {
  constructor(chip) {
    super(chip, 'RESETS');
    this.held = RESET_BITS & ~RELEASED_BY_BOOT_ROM;
    this.wdsel = 0;
  }

  isHeld(bit) {
    return (this.held >>> bit) & 1;
  }

  #hold(held) {
    const entered = held & ~this.held;
    const left = this.held & ~held;
    this.held = held;
    for (let bit = 0; entered >>> bit; bit++) {
      if ((entered >>> bit) & 1) this.rp2040.resetBlock(bit);
    }
    if ((left >>> TIMER) & 1) this.rp2040.timer.tickChanged(this.rp2040.watchdog.tickHz);
  }

  static registers = {
    0: { read: (b) => b.held, write: (b, value) => b.#hold(value & RESET_BITS) },
    4: field('wdsel', RESET_BITS),
    8: { read: (b) => ~b.held & RESET_BITS },
  };
}

export class Xosc extends RegisterBlock {
  constructor(chip) {
    super(chip, 'XOSC');
    this.ctrl = 0;
    this.startup = 0xc4;
    this.stable = false;
    this.alarm = chip.clock.createAlarm(() => {
      this.stable = true;
    });
  }

  get enabled() {
    return this.ctrl >>> 12 === 0xfab;
  }

  /** The cycles of the crystal are counted up to STARTUP, if there are any. */
  count() {
    if (!this.enabled || this.stable || this.rp2040.trouble.crystalDead) return;
    const cycles = (this.startup & 0x3fff) * 256 * (this.startup & 0x100000 ? 4 : 1);
    this.alarm.schedule((cycles / this.rp2040.trueHz(XOSC_HZ)) * 1e9);
  }

  #writeCtrl(value) {
    const enable = (value >>> 12) & 0xfff;
    const wasEnabled = this.enabled;
    if (enable === 0xfab && (value & 0xfff) !== 0xaa0)
      this.rp2040.fail('XOSC', `enabled with FREQ_RANGE 0x${(value & 0xfff).toString(16)}; 1 to 15 MHz is 0xaa0`);
    if (![0xfab, 0xd1e, 0].includes(enable))
      this.rp2040.fail('XOSC', `CTRL.ENABLE written with 0x${enable.toString(16)}; use 0xfab or 0xd1e`);
    this.ctrl = value & 0xffffff;
    if (this.enabled && !wasEnabled) this.count();
    else if (!this.enabled) {
      this.stable = false;
      this.alarm.cancel();
      this.rp2040.updateClocks();
    }
  }

  #writeStartup(value) {
    if (this.enabled) this.rp2040.fail('XOSC', 'STARTUP written while the oscillator runs; write it before enabling');
    this.startup = value & 0x103fff;
  }

  static registers = {
    0x00: { read: (b) => b.ctrl, write: (b, value) => b.#writeCtrl(value) },
    0x04: { read: (b) => (b.stable ? 1 << 31 : 0) | (b.enabled ? 1 << 12 : 0) },
    0x0c: { read: (b) => b.startup, write: (b, value) => b.#writeStartup(value) },
  };
}

const PLL_PD = 1;
const PLL_POSTDIVPD = 8;
const PLL_VCOPD = 32;

export class Pll extends RegisterBlock {
  constructor(chip, name) {
    super(chip, name);
    this.alarm = chip.clock.createAlarm(() => {
      this.locked = true;
    });
    this.staleAlarm = chip.clock.createAlarm(() => {
      this.reportsLock = false;
    });
    this.reset();
  }

  reset() {
    this.alarm.cancel();
    this.staleAlarm.cancel();
    /** Reports the lock from before the power went. */
    this.reportsLock = false;
    this.cs = 1;
    this.pwr = 0x2d;
    this.fbdiv = 0;
    this.prim = 0x77000;
    this.locked = false;
  }

  /** Powered: on the way to its lock. */
  lock() {
    if (this.locked || this.pwr & (PLL_PD | PLL_VCOPD) || this.rp2040.trouble.pllLate) return;
    this.alarm.schedule(PLL_LOCK_NS);
  }

  get vcoHz() {
    return (XOSC_HZ / (this.cs & 0x3f || 1)) * this.fbdiv;
  }

  /** Output frequency in Hz, 0 while it cannot drive a clock. */
  get outputHz() {
    if (this.cs & 0x100) return XOSC_HZ;
    if (!this.locked || this.pwr & (PLL_PD | PLL_POSTDIVPD | PLL_VCOPD)) return 0;
    return this.vcoHz / (((this.prim >>> 16) & 7) * ((this.prim >>> 12) & 7));
  }

  get #isRunning() {
    return !(this.pwr & (PLL_PD | PLL_VCOPD));
  }

  #writeCs(value) {
    if (this.#isRunning && (value ^ this.cs) & 0x3f) this.rp2040.fail(this.name, 'REFDIV changed while the VCO runs');
    this.cs = value & 0x13f;
  }

  #writeFbdiv(value) {
    if (this.#isRunning && (value & 0xfff) !== this.fbdiv) this.rp2040.fail(this.name, 'FBDIV_INT changed while the VCO runs');
    this.fbdiv = value & 0xfff;
  }

  static registers = {
    0x00: { read: (b) => (b.locked || b.reportsLock ? 1 << 31 : 0) | b.cs, write: (b, value) => b.#writeCs(value) },
    0x04: field('pwr', 0x2d),
    0x08: { read: (b) => b.fbdiv, write: (b, value) => b.#writeFbdiv(value) },
    0x0c: field('prim', 0x77000),
  };

  writeUint32(offset, value) {
    const chip = this.rp2040;
    const wasRunning = this.#isRunning;
    super.writeUint32(offset, value);
    const running = this.#isRunning;
    if (running && !wasRunning) {
      if (!chip.xosc.stable) chip.fail(this.name, 'powered up before the crystal oscillator was stable');
      if (this.vcoHz < 750e6 || this.vcoHz > 1600e6) {
        chip.fail(this.name, `VCO at ${this.vcoHz / 1e6} MHz; it works from 750 to 1600 MHz`);
      }
      this.staleAlarm.schedule(PLL_STALE_NS);
      this.lock();
    } else if (!running) {
      this.reportsLock ||= this.locked;
      this.locked = false;
      this.alarm.cancel();
    }
    if (offset === 0x04 && running && !(this.pwr & PLL_POSTDIVPD)) {
      if (!this.locked) chip.fail(this.name, 'post dividers powered up before the PLL locked');
      if (!(this.prim & 0x70000) || !(this.prim & 0x7000)) chip.fail(this.name, 'a post divider is 0');
    }
    chip.updateClocks();
  }
}

const CTRL_ENABLE = 1 << 11;
/** What the auxiliary multiplexer of each clock chooses from. */
const AUXILIARY = {
  ref: ['pll_usb'],
  sys: ['pll_sys', 'pll_usb', 'rosc', 'xosc'],
  usb: ['pll_usb', 'pll_sys', 'rosc', 'xosc'],
  peri: ['sys', 'pll_sys', 'pll_usb', 'rosc', 'xosc'],
};

export class Clocks extends BasePeripheral {
  constructor(chip) {
    super(chip, 'CLOCKS');
    const generators = ['ref', 'sys', 'peri', 'usb', 'adc', 'rtc'];
    for (const name of generators) this[name] = { ctrl: 0, div: 0x100 };
    this.generators = [null, null, null, null, ...generators.map((name) => this[name])];
    this.others = new RegisterFile(chip, 'CLOCKS', {
      0x78: [0xff, 0x111ff],
      0x7c: [0, 0],
      0xa0: [0xffffffff, 0xffffffff],
      0xa4: [0x7fff, 0x7fff],
      0xa8: [0xffffffff, 0xffffffff],
      0xac: [0x7fff, 0x7fff],
      0xbc: [0, 0],
      0xc0: [0, 1],
      0xc8: [0, 0],
    });
  }

  #hz(source) {
    const { pllSys, pllUsb, roscHz, xosc } = this.rp2040;
    if (source === 'pll_sys') return pllSys.outputHz;
    if (source === 'pll_usb') return pllUsb.outputHz;
    if (source === 'rosc') return roscHz;
    if (source === 'xosc') return xosc.stable ? XOSC_HZ : 0;
    return source === 'sys' ? this.sysHz : 0;
  }

  #auxiliaryHz(name) {
    return this.#hz(AUXILIARY[name][(this[name].ctrl >>> 5) & 7]);
  }

  get refHz() {
    const source = ['rosc', AUXILIARY.ref[(this.ref.ctrl >>> 5) & 3], 'xosc'][this.ref.ctrl & 3];
    return this.#hz(source) / ((this.ref.div >>> 8) & 3 || 4);
  }

  /** clk_ref or clk_sys comes from the crystal. */
  get onCrystal() {
    return (this.ref.ctrl & 3) !== 0 || ((this.sys.ctrl & 1) !== 0 && ((this.sys.ctrl >>> 5) & 7) !== 2);
  }

  get sysHz() {
    return (this.sys.ctrl & 1 ? this.#auxiliaryHz('sys') : this.refHz) / (this.sys.div / 256 || 65536);
  }

  get usbHz() {
    return this.usb.ctrl & CTRL_ENABLE ? this.#auxiliaryHz('usb') / ((this.usb.div >>> 8) & 3 || 4) : 0;
  }

  get periHz() {
    return this.peri.ctrl & CTRL_ENABLE ? this.#auxiliaryHz('peri') : 0;
  }

  readUint32(offset) {
    const generator = offset < 0x78 ? this.generators[Math.floor(offset / 12)] : null;
    if (!generator) return this.others.readUint32(offset);
    const field = offset % 12;
    if (field === 0) return generator.ctrl;
    if (field === 4) return generator.div;
    if (generator === this.ref) return 1 << (this.ref.ctrl & 3);
    if (generator === this.sys) return 1 << (this.sys.ctrl & 1);
    return 1;
  }

  writeUint32(offset, value) {
    const chip = this.rp2040;
    const generator = offset < 0x78 ? this.generators[Math.floor(offset / 12)] : null;
    if (!generator) {
      this.others.writeUint32(offset, value);
      return;
    }
    const field = offset % 12;
    if (field === 8) return;
    if (field === 4) generator.div = value >>> 0;
    else {
      if (generator === this.sys && this.sys.ctrl & 1 && value & 1 && (value ^ this.sys.ctrl) & 0xe0) {
        chip.fail('CLOCKS', 'clk_sys AUXSRC changed while clk_sys runs from it; switch SRC to clk_ref first');
      }
      if (generator !== this.sys && generator !== this.ref && generator.ctrl & CTRL_ENABLE && (value ^ generator.ctrl) & 0xe0) {
        chip.fail('CLOCKS', 'AUXSRC of an enabled clock changed; clear ENABLE first');
      }
      generator.ctrl = value >>> 0;
    }
    if (this.refHz === 0) chip.fail('CLOCKS', 'clk_ref switched to a source that does not run');
    if (this.sysHz === 0) chip.fail('CLOCKS', 'clk_sys switched to a source that does not run');
    chip.updateClocks();
  }
}

export function makeRosc(chip) {
  return new RegisterFile(chip, 'ROSC', {
    0x00: [0xaa0, 0xffffff],
    0x04: [0, 0xffffffff],
    0x08: [0, 0xffffffff],
    0x10: [0, 0xffff],
    0x14: [8, 0x1ff],
    0x18: [0x80001000, 0],
    0x1c: [1, 0],
  });
}
