/**
 * I2C block of the RP2040 (DW_apb_i2c as its datasheet describes it in 4.3), controller mode, 7-bit addresses.
 *
 * Bus time comes from the count registers: SCL low for LCNT + 1 cycles of clk_sys, high for HCNT + SPKLEN + 7,
 * plus the board's rise time. A transfer advances byte by byte; the byte's effect on the bus happens at the
 * end of its ninth clock. The block talks to a bus object: start(), stop(), writeByte(byte) -> acknowledged,
 * readByte(acknowledge) -> byte, sdaLow, sclLow, onReleased, problem(), rise_ns.
 *
 * Fails the run: configuration written while enabled, FIFO overflow and underflow, counts below their minimum,
 * bus timing faster than the mode allows, pins not set up.
 */
import { constant, field, RegisterBlock } from './registers.mjs';

const FIFO_DEPTH = 16;
const CMD_READ = 0x100;
const CMD_STOP = 0x200;
const CMD_RESTART = 0x400;
const FIRST_DATA_BYTE = 0x800;

const CON_RX_FULL_HOLD = 1 << 9;
const CON_TX_EMPTY_CTRL = 1 << 8;
const CON_SLAVE_DISABLE = 1 << 6;
const CON_RESTART_EN = 1 << 5;
const CON_10BIT = 1 << 4;

const RX_UNDER = 1;
const RX_OVER = 2;
const RX_FULL = 4;
const TX_OVER = 8;
const TX_EMPTY = 16;
const TX_ABRT = 64;
const ACTIVITY = 256;
const STOP_DET = 512;
const START_DET = 1024;

const ABRT_7B_ADDR_NOACK = 1;
const ABRT_TXDATA_NOACK = 8;
const ABRT_ARB_LOST = 1 << 12;
const ABRT_USER = 1 << 16;

/** Minimum SCL low and high times of the I2C specification (UM10204, table 10), ns. */
const MINIMUM_NS = { 1: { low: 4700, high: 4000, name: 'standard' }, 2: { low: 1300, high: 600, name: 'fast' } };

const configuration = (key, mask, name) => ({
  ...field(key, mask),
  write(block, value) {
    block.whileDisabled(name);
    field(key, mask).write(block, value);
  },
});
const threshold = (key) => ({
  ...field(key),
  write(block, value) {
    block[key] = Math.min(value & 0xff, FIFO_DEPTH - 1);
  },
});

export class I2cBlock extends RegisterBlock {
  constructor(chip, index) {
    super(chip, `I2C${index}`);
    this.irq = 23 + index;
    this.bus = null;
    this.alarm = chip.clock.createAlarm(() => this.continuation());
    this.continuation = null;
    this.reset();
  }

  reset() {
    this.alarm.cancel();
    this.con = 0x65;
    this.tar = 0x55;
    [this.hcntStandard, this.lcntStandard] = [0x28, 0x2f];
    [this.hcntFast, this.lcntFast] = [0x06, 0x0d];
    this.spklen = 7;
    this.sdaHold = 1;
    this.sdaSetup = 0x64;
    this.rxTl = 0;
    this.txTl = 0;
    this.mask = 0x8ff;
    this.latched = 0;
    this.enable = 0;
    this.abortSource = 0;
    this.flushed = false;
    this.tx = [];
    this.rx = [];
    this.state = 'idle';
    this.reading = false;
    this.firstByte = false;
    this.#update();
  }

  get speed() {
    return (this.con >>> 1) & 3;
  }

  get hcnt() {
    return this.speed === 1 ? this.hcntStandard : this.hcntFast;
  }

  get lcnt() {
    return this.speed === 1 ? this.lcntStandard : this.lcntFast;
  }

  get low_ns() {
    return ((this.lcnt + 1) * 1e9) / this.rp2040.trueHz(this.rp2040.clkSys) + this.bus.rise_ns;
  }

  get high_ns() {
    return ((this.hcnt + this.spklen + 7) * 1e9) / this.rp2040.trueHz(this.rp2040.clkSys);
  }

  get enabled() {
    return (this.enable & 1) === 1;
  }

  get #active() {
    return this.state !== 'idle';
  }

  get raw() {
    let raw = this.latched;
    const shifting = this.#active && this.state !== 'hold';
    if ((this.enabled ? !(this.con & CON_TX_EMPTY_CTRL && shifting) : this.#active) && this.tx.length <= this.txTl) raw |= TX_EMPTY;
    if (this.enabled && this.rx.length > this.rxTl) raw |= RX_FULL;
    return raw;
  }

  #update() {
    this.rp2040.setInterrupt(this.irq, (this.raw & this.mask) !== 0);
  }

  #pop() {
    if (!this.rx.length) this.rp2040.fail(this.name, 'IC_DATA_CMD read while the receive FIFO is empty');
    const value = this.rx.shift();
    if (this.state === 'rx-full') this.#receive();
    this.#update();
    return value;
  }

  get #status() {
    return (
      (this.#active ? 0x21 : 0) |
      (this.tx.length < FIFO_DEPTH ? 2 : 0) |
      (this.tx.length ? 0 : 4) |
      (this.rx.length ? 8 : 0) |
      (this.rx.length >= FIFO_DEPTH ? 16 : 0)
    );
  }

  #writeCon(value) {
    this.whileDisabled('IC_CON');
    this.con = value & 0x3ff;
    if (!(this.con & 1) || !(this.con & CON_SLAVE_DISABLE) || this.con & CON_10BIT)
      this.rp2040.fail(
        this.name,
        `IC_CON 0x${value.toString(16)}: only a 7-bit controller (MASTER_MODE and IC_SLAVE_DISABLE set) is modelled`,
      );
  }

  #writeSpklen(value) {
    this.whileDisabled('IC_FS_SPKLEN');
    if (!(value & 0xff)) this.rp2040.fail(this.name, 'IC_FS_SPKLEN is 0; the minimum is 1');
    this.spklen = value & 0xff;
  }

  /** Reading clears the bits, and reads whether one was set. */
  #readClear(bits, cleared = bits) {
    const was = this.latched & bits ? 1 : 0;
    this.#clear(cleared);
    return was;
  }

  /** The only reading that ends the flushed state of the transmit FIFO after an abort (4.3.17). */
  #readClearAbort() {
    this.flushed = false;
    return this.#readClear(TX_ABRT);
  }

  static registers = {
    0x00: { read: (b) => b.con, write: (b, value) => b.#writeCon(value) },
    0x04: configuration('tar', 0xfff, 'IC_TAR'),
    0x08: { read: () => 0x55 },
    0x10: { read: (b) => b.#pop(), write: (b, value) => b.#push(value) },
    0x14: configuration('hcntStandard', 0xffff, 'SCL_HCNT'),
    0x18: configuration('lcntStandard', 0xffff, 'SCL_LCNT'),
    0x1c: configuration('hcntFast', 0xffff, 'SCL_HCNT'),
    0x20: configuration('lcntFast', 0xffff, 'SCL_LCNT'),
    0x2c: { read: (b) => b.raw & b.mask },
    0x30: field('mask', 0x1fff),
    0x34: { read: (b) => b.raw },
    0x38: threshold('rxTl'),
    0x3c: threshold('txTl'),
    0x40: { read: (b) => b.#readClear(-1, 0x1fff) },
    0x44: { read: (b) => b.#readClear(RX_UNDER) },
    0x48: { read: (b) => b.#readClear(RX_OVER) },
    0x4c: { read: (b) => b.#readClear(TX_OVER) },
    0x50: { read: (b) => b.#readClear(32) },
    0x54: { read: (b) => b.#readClearAbort() },
    0x58: { read: (b) => b.#readClear(128) },
    0x5c: { read: (b) => b.#readClear(ACTIVITY) },
    0x60: { read: (b) => b.#readClear(STOP_DET) },
    0x64: { read: (b) => b.#readClear(START_DET) },
    0x68: { read: (b) => b.#readClear(2048) },
    0x6c: { read: (b) => b.enable, write: (b, value) => b.#writeEnable(value) },
    0x70: { read: (b) => b.#status },
    0x74: { read: (b) => b.tx.length },
    0x78: { read: (b) => b.rx.length },
    0x7c: configuration('sdaHold', 0xffffff, 'IC_SDA_HOLD'),
    0x80: { read: (b) => b.abortSource },
    0x84: constant(0),
    0x88: { read: () => 0, write: (b, value) => value & 3 && b.rp2040.fail(b.name, 'DMA requests are not modelled') },
    0x8c: constant(0),
    0x90: constant(0),
    0x94: configuration('sdaSetup', 0xff, 'IC_SDA_SETUP'),
    0x98: constant(1),
    0x9c: { read: (b) => (b.enabled || b.#active ? 1 : 0) },
    0xa0: { read: (b) => b.spklen, write: (b, value) => b.#writeSpklen(value) },
    0xa8: { read: (b) => b.#readClear(4096) },
    0xf4: { read: () => 0 },
    0xf8: { read: () => 0x3230312a },
    0xfc: { read: () => 0x44570140 },
  };

  writeUint32(offset, value) {
    super.writeUint32(offset, value);
    this.#update();
    this.#kick();
  }

  #clear(bits) {
    if (bits & TX_ABRT && this.latched & TX_ABRT) this.abortSource = 0;
    this.latched &= ~bits;
    if (this.#active) this.latched |= ACTIVITY;
    this.#update();
    this.#kick();
  }

  whileDisabled(what) {
    if (this.enabled || this.#active)
      this.rp2040.fail(this.name, `${what} written while the block is enabled; clear IC_ENABLE and wait for IC_ENABLE_STATUS first`);
  }

  #writeEnable(value) {
    const was = this.enable;
    this.enable = (value & 5) | (was & 2);
    if (value & 2 && was & 1) this.enable |= 2;
    if (value & 1 && !(was & 1)) this.#checkTiming();
    if (!(value & 1) && was & 1) {
      this.tx = [];
      this.rx = [];
      if (!this.#active) this.latched &= ~ACTIVITY;
      else if (this.state === 'hold' || this.state === 'bus-busy') this.#next();
    }
    if (this.enable & 2) {
      if (!this.#active) {
        this.enable &= ~2;
        this.#abort(ABRT_USER);
      } else if (this.state === 'hold' || this.state === 'bus-busy') this.#next();
    }
  }

  #checkTiming() {
    const chip = this.rp2040;
    const limits = MINIMUM_NS[this.speed];
    if (!this.bus) chip.fail(this.name, 'enabled, but no bus is wired to this block on this board');
    if (!limits) chip.fail(this.name, `SPEED ${this.speed} in IC_CON; use standard (1) or fast (2)`);
    const { lcnt: low, hcnt: high } = this;
    if (low <= this.spklen + 7 || high <= this.spklen + 5) {
      chip.fail(this.name, `SCL counts ${high}/${low} below the minimum for a spike length of ${this.spklen}`);
    }
    if ((this.sdaHold & 0xffff) > low - 2) chip.fail(this.name, 'IC_SDA_HOLD longer than the SCL low time allows');
    if (this.low_ns < limits.low || this.high_ns < limits.high) {
      chip.fail(
        this.name,
        `SCL low ${this.low_ns.toFixed(0)} ns, high ${this.high_ns.toFixed(0)} ns; ${limits.name} mode needs ${limits.low} and ${limits.high} ns`,
      );
    }
  }

  #push(value) {
    if (!this.enabled) this.rp2040.fail(this.name, 'IC_DATA_CMD written while the block is disabled');
    if (this.flushed) return;
    if (this.tx.length >= FIFO_DEPTH) this.rp2040.fail(this.name, 'transmit FIFO overflow');
    this.tx.push(value & 0x7ff);
    if (this.state === 'hold') this.#next();
    this.#update();
    this.#kick();
  }

  #after(delay_ns, then) {
    this.continuation = then;
    this.alarm.schedule(delay_ns);
  }

  #kick() {
    if (this.state !== 'idle' || !this.enabled || this.flushed || !this.tx.length || this.enable & 4) return;
    const problem = this.bus.problem();
    if (problem) this.rp2040.fail(this.name, problem);
    this.latched |= ACTIVITY;
    if (this.bus.sdaLow || this.bus.sclLow) {
      this.state = 'bus-busy';
      this.bus.onReleased = () => {
        if (this.state !== 'bus-busy') return;
        this.state = 'idle';
        this.#after(this.low_ns, () => this.#kick());
      };
      return;
    }
    this.#startCondition();
  }

  #startCondition() {
    this.state = 'start';
    this.bus.timing = {
      low_ns: this.low_ns,
      high_ns: this.high_ns,
      hold_ns: ((this.sdaHold & 0xffff) * 1e9) / this.rp2040.trueHz(this.rp2040.clkSys),
    };
    this.bus.start();
    this.latched |= START_DET;
    this.reading = (this.tx[0] & CMD_READ) !== 0;
    this.#update();
    this.#after(this.high_ns + 9 * (this.low_ns + this.high_ns), () => this.#addressed());
  }

  /** True (and the transfer is given up) if somebody else pulls SDA. */
  #arbitrationLost() {
    if (!this.bus.sdaLow) return false;
    this.#loseArbitration();
    return true;
  }

  /** Without a receive hold an acknowledgement right after SCL fell is mistaken for another controller's bit. */
  #confused() {
    if (!this.bus.wasFast || this.sdaHold >>> 16) return false;
    this.#loseArbitration();
    return true;
  }

  #loseArbitration() {
    this.state = 'idle';
    this.bus.abandon();
    this.#abort(ABRT_ARB_LOST);
  }

  #addressed() {
    if (this.#arbitrationLost()) return;
    const acknowledged = this.bus.writeByte(((this.tar & 0x7f) << 1) | (this.reading ? 1 : 0));
    if (this.#confused()) return;
    if (!acknowledged) {
      this.#abort(ABRT_7B_ADDR_NOACK);
      this.#stopCondition();
      return;
    }
    this.firstByte = true;
    this.restarted = true;
    this.#next();
  }

  /** Take the next command, or hold SCL low until there is one. */
  #next() {
    if (this.state === 'bus-busy') {
      this.state = 'idle';
      if (this.enable & 2) {
        this.enable &= ~2;
        this.#abort(ABRT_USER);
      }
      return;
    }
    if (this.enable & 2) {
      this.#abort(ABRT_USER);
      this.#stopCondition();
      return;
    }
    if (!this.enabled) {
      this.#stopCondition();
      return;
    }
    if (!this.tx.length) {
      this.state = 'hold';
      this.#update();
      return;
    }
    const command = this.tx[0];
    const turn = ((command & CMD_READ) !== 0) !== this.reading;
    if (!this.restarted && (turn || command & CMD_RESTART)) {
      if (!(this.con & CON_RESTART_EN)) {
        this.#stopCondition();
        return;
      }
      this.state = 'restart';
      this.#after(this.low_ns + this.high_ns, () => this.#startCondition());
      return;
    }
    this.restarted = false;
    this.tx.shift();
    this.command = command;
    this.state = 'data';
    this.#update();
    this.#after(9 * (this.low_ns + this.high_ns), () => (this.reading ? this.#receive() : this.#transmitted()));
  }

  #transmitted() {
    if (this.#arbitrationLost()) return;
    const acknowledged = this.bus.writeByte(this.command & 0xff);
    if (this.#confused()) return;
    if (!acknowledged) {
      this.#abort(ABRT_TXDATA_NOACK);
      this.#stopCondition();
      return;
    }
    this.#finishByte();
  }

  #receive() {
    if (this.#arbitrationLost()) return;
    if (this.rx.length >= FIFO_DEPTH) {
      if (this.con & CON_RX_FULL_HOLD) {
        this.state = 'rx-full';
        return;
      }
      this.rp2040.fail(this.name, 'receive FIFO overflow');
    }
    this.state = 'data';
    const following = this.tx[0];
    const last =
      (this.command & CMD_STOP) !== 0 ||
      (following !== undefined && (!(following & CMD_READ) || (following & CMD_RESTART) !== 0)) ||
      !this.enabled;
    const byte = this.bus.readByte(!last);
    if (this.enabled) this.rx.push(byte | (this.firstByte ? FIRST_DATA_BYTE : 0));
    this.firstByte = false;
    this.#finishByte();
  }

  #finishByte() {
    if (this.command & CMD_STOP) this.#stopCondition();
    else this.#next();
    this.#update();
  }

  #stopCondition() {
    this.state = 'stop';
    this.#after(this.low_ns + this.high_ns, () => {
      this.bus.stop();
      this.latched |= STOP_DET;
      this.state = 'free';
      this.#after(this.low_ns, () => {
        this.state = 'idle';
        this.enable &= ~2;
        this.#update();
        this.#kick();
      });
      this.#update();
    });
  }

  #abort(source) {
    this.abortSource = (source | (this.tx.length << 23)) >>> 0;
    this.tx = [];
    this.rx = [];
    this.flushed = true;
    this.latched |= TX_ABRT;
    this.#update();
  }
}
