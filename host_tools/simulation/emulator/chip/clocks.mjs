/**
 * Resets, oscillators, PLLs and clock multiplexers of the RP2040 (datasheet 2.14 to 2.18), with the order
 * in which they may be started enforced: a PLL needs a stable crystal, a multiplexer a running source, the
 * auxiliary input of clk_sys may change only while clk_sys runs from clk_ref. A crystal that does not swing in
 * full yet (a fault) counts as stable when its STARTUP has passed, and stops the chip once it drives a clock.
 */
import { BasePeripheral } from 'rp2040js';
import { RegisterFile } from './registers.mjs';

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

export const RESET_NAMES = [
  'ADC',
  'BUSCTRL',
  'DMA',
  'I2C0',
  'I2C1',
  'IO_BANK0',
  'IO_QSPI',
  'JTAG',
  'PADS_BANK0',
  'PADS_QSPI',
  'PIO0',
  'PIO1',
  'PLL_SYS',
  'PLL_USB',
  'PWM',
  'RTC',
  'SPI0',
  'SPI1',
  'SYSCFG',
  'SYSINFO',
  'TBMAN',
  'TIMER',
  'UART0',
  'UART1',
  'USBCTRL',
];

export class Resets extends BasePeripheral {
  constructor(chip) {
    super(chip, 'RESETS');
    this.held = RESET_BITS & ~RELEASED_BY_BOOT_ROM;
    this.wdsel = 0;
  }

  isHeld(bit) {
    return (this.held >>> bit) & 1;
  }

  readUint32(offset) {
    if (offset === 0) return this.held;
    if (offset === 4) return this.wdsel;
    if (offset === 8) return ~this.held & RESET_BITS;
    return super.readUint32(offset);
  }

  writeUint32(offset, value) {
    if (offset === 4) this.wdsel = value & RESET_BITS;
    else if (offset === 0) {
      const held = value & RESET_BITS;
      const entered = held & ~this.held;
      const left = this.held & ~held;
      this.held = held;
      for (let bit = 0; entered >>> bit; bit++) {
        if ((entered >>> bit) & 1) this.rp2040.resetBlock(bit);
      }
      if ((left >>> TIMER) & 1) this.rp2040.timer.tickChanged(this.rp2040.watchdog.tickHz);
    } else super.writeUint32(offset, value);
  }
}

export class Xosc extends BasePeripheral {
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

  readUint32(offset) {
    if (offset === 0x00) return this.ctrl;
    if (offset === 0x04) return ((this.stable ? 1 << 31 : 0) | (this.enabled ? 1 << 12 : 0)) >>> 0;
    if (offset === 0x0c) return this.startup;
    return super.readUint32(offset);
  }

  writeUint32(offset, value) {
    if (offset === 0x0c) {
      if (this.enabled) this.rp2040.fail('XOSC', 'STARTUP written while the oscillator runs; write it before enabling');
      this.startup = value & 0x103fff;
    } else if (offset === 0x00) {
      const enable = (value >>> 12) & 0xfff;
      const wasEnabled = this.enabled;
      if (enable === 0xfab && (value & 0xfff) !== 0xaa0) {
        this.rp2040.fail('XOSC', `enabled with FREQ_RANGE 0x${(value & 0xfff).toString(16)}; 1 to 15 MHz is 0xaa0`);
      }
      if (enable !== 0xfab && enable !== 0xd1e && enable !== 0) {
        this.rp2040.fail('XOSC', `CTRL.ENABLE written with 0x${enable.toString(16)}; use 0xfab or 0xd1e`);
      }
      this.ctrl = value & 0xffffff;
      if (this.enabled && !wasEnabled) {
        this.count();
      } else if (!this.enabled) {
        this.stable = false;
        this.alarm.cancel();
        this.rp2040.updateClocks();
      }
    } else super.writeUint32(offset, value);
  }
}

const PLL_PD = 1;
const PLL_POSTDIVPD = 8;
const PLL_VCOPD = 32;

export class Pll extends BasePeripheral {
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

  readUint32(offset) {
    if (offset === 0x00) return ((this.locked || this.reportsLock ? 1 << 31 : 0) | this.cs) >>> 0;
    if (offset === 0x04) return this.pwr;
    if (offset === 0x08) return this.fbdiv;
    if (offset === 0x0c) return this.prim;
    return super.readUint32(offset);
  }

  writeUint32(offset, value) {
    const chip = this.rp2040;
    const wasRunning = !(this.pwr & (PLL_PD | PLL_VCOPD));
    switch (offset) {
      case 0x00:
        if (wasRunning && (value & 0x3f) !== (this.cs & 0x3f)) chip.fail(this.name, 'REFDIV changed while the VCO runs');
        this.cs = value & 0x13f;
        break;
      case 0x04:
        this.pwr = value & 0x2d;
        break;
      case 0x08:
        if (wasRunning && (value & 0xfff) !== this.fbdiv) chip.fail(this.name, 'FBDIV_INT changed while the VCO runs');
        this.fbdiv = value & 0xfff;
        break;
      case 0x0c:
        this.prim = value & 0x77000;
        break;
      default:
        super.writeUint32(offset, value);
    }
    const running = !(this.pwr & (PLL_PD | PLL_VCOPD));
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

export class Clocks extends BasePeripheral {
  constructor(chip) {
    super(chip, 'CLOCKS');
    this.ref = { ctrl: 0, div: 0x100 };
    this.sys = { ctrl: 0, div: 0x100 };
    this.peri = { ctrl: 0, div: 0x100 };
    this.usb = { ctrl: 0, div: 0x100 };
    this.adc = { ctrl: 0, div: 0x100 };
    this.rtc = { ctrl: 0, div: 0x100 };
    this.generators = [null, null, null, null, this.ref, this.sys, this.peri, this.usb, this.adc, this.rtc];
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

  get refHz() {
    const source = this.ref.ctrl & 3;
    const auxiliary = (this.ref.ctrl >>> 5) & 3;
    const hz =
      source === 0
        ? this.rp2040.roscHz
        : source === 2
          ? this.rp2040.xosc.stable
            ? XOSC_HZ
            : 0
          : source === 1 && auxiliary === 0
            ? this.rp2040.pllUsb.outputHz
            : 0;
    return hz / ((this.ref.div >>> 8) & 3 || 4);
  }

  /** clk_ref or clk_sys comes from the crystal. */
  get onCrystal() {
    return (this.ref.ctrl & 3) !== 0 || ((this.sys.ctrl & 1) !== 0 && ((this.sys.ctrl >>> 5) & 7) !== 2);
  }

  #auxiliaryHz(generator, sources) {
    return sources[(generator.ctrl >>> 5) & 7]?.() ?? 0;
  }

  get sysHz() {
    const { pllSys, pllUsb, xosc } = this.rp2040;
    const hz =
      this.sys.ctrl & 1
        ? this.#auxiliaryHz(this.sys, [
            () => pllSys.outputHz,
            () => pllUsb.outputHz,
            () => this.rp2040.roscHz,
            () => (xosc.stable ? XOSC_HZ : 0),
          ])
        : this.refHz;
    return hz / (this.sys.div / 256 || 65536);
  }

  get usbHz() {
    if (!(this.usb.ctrl & CTRL_ENABLE)) return 0;
    const { pllSys, pllUsb, xosc } = this.rp2040;
    const hz = this.#auxiliaryHz(this.usb, [
      () => pllUsb.outputHz,
      () => pllSys.outputHz,
      () => this.rp2040.roscHz,
      () => (xosc.stable ? XOSC_HZ : 0),
    ]);
    return hz / ((this.usb.div >>> 8) & 3 || 4);
  }

  get periHz() {
    if (!(this.peri.ctrl & CTRL_ENABLE)) return 0;
    const { pllSys, pllUsb, xosc } = this.rp2040;
    return this.#auxiliaryHz(this.peri, [
      () => this.sysHz,
      () => pllSys.outputHz,
      () => pllUsb.outputHz,
      () => this.rp2040.roscHz,
      () => (xosc.stable ? XOSC_HZ : 0),
    ]);
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
