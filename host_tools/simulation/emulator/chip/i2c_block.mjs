/**
 * I2C block of the RP2040 (DW_apb_i2c as its datasheet describes it in 4.3), controller mode, 7-bit addresses.
 *
 * Bus time comes from the count registers: SCL low for LCNT + 1 cycles of clk_sys, high for HCNT + SPKLEN + 7, plus the board's rise time.
 * A transfer advances byte by byte; the byte's effect on the bus happens at the end of its ninth clock. The block talks to a bus object:
 * start(), stop(), writeByte(byte) -> acknowledged, readByte(acknowledge) -> byte, sdaLow, sclLow, onReleased, problem(), rise_ns.
 *
 * Modelled is what the firmware uses: fast mode, transfers in one direction up to a STOP, the interrupts TX_ABRT and STOP_DET.
 * Fails the run: everything else, configuration written while enabled, FIFO overflow and underflow, counts below their
 * minimum, bus timing faster than the mode allows, pins not set up.
 */
import { checkedField, RegisterBlock } from './registers.mjs';

const FIFO_DEPTH = 16;
const CMD_READ = 0x100;
const CMD_STOP = 0x200;
const CMD_RESTART = 0x400;

/** MASTER_MODE, SPEED fast, IC_RESTART_EN, IC_SLAVE_DISABLE. */
const CON_MODELLED = 0x65;

const TX_ABRT = 64;
const STOP_DET = 512;

const ABRT_7B_ADDR_NOACK = 1;
const ABRT_TXDATA_NOACK = 8;
const ABRT_ARB_LOST = 1 << 12;

/** Minimum SCL low and high times of fast mode (UM10204, table 10). */
const LOW_MIN_NS = 1300;
const HIGH_MIN_NS = 600;

const configuration = (key, mask, name) => checkedField((block) => block.whileDisabled(name), key, mask);

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
    [this.hcnt, this.lcnt] = [0x06, 0x0d];
    this.spklen = 7;
    this.sdaHold = 1;
    this.mask = 0x8ff;
    this.raw = 0;
    this.enabled = 0;
    this.abortSource = 0;
    this.flushed = false;
    this.tx = [];
    this.rx = [];
    this.state = 'idle';
    this.reading = false;
    this.#update();
  }

  get low_ns() {
    return ((this.lcnt + 1) * 1e9) / this.rp2040.trueHz(this.rp2040.clkSys) + this.bus.rise_ns;
  }

  get high_ns() {
    return ((this.hcnt + this.spklen + 7) * 1e9) / this.rp2040.trueHz(this.rp2040.clkSys);
  }

  get #active() {
    return this.state !== 'idle';
  }

  #update() {
    this.rp2040.setInterrupt(this.irq, (this.raw & this.mask) !== 0);
  }

  #fail(message) {
    this.rp2040.fail(this.name, message);
  }

  #pop() {
    if (!this.rx.length) this.#fail('IC_DATA_CMD read while the receive FIFO is empty');
    return this.rx.shift();
  }

  #writeCon(value) {
    this.whileDisabled('IC_CON');
    if (value !== CON_MODELLED) this.#fail(`IC_CON 0x${value.toString(16)}: only 0x65, a 7-bit controller in fast mode, is modelled`);
  }

  #writeMask(value) {
    if (value & ~(TX_ABRT | STOP_DET)) this.#fail(`IC_INTR_MASK 0x${value.toString(16)}: only TX_ABRT and STOP_DET are modelled`);
    this.mask = value;
  }

  #writeSpklen(value) {
    this.whileDisabled('IC_FS_SPKLEN');
    if (!(value & 0xff)) this.#fail('IC_FS_SPKLEN is 0; the minimum is 1');
    this.spklen = value & 0xff;
  }

  /** Reading clears the bits, and reads whether one was set. */
  #readClear(bits) {
    const was = this.raw & bits ? 1 : 0;
    if (bits & this.raw & TX_ABRT) this.abortSource = 0;
    this.raw &= ~bits;
    this.#update();
    this.#kick();
    return was;
  }

  /** The only reading that ends the flushed state of the transmit FIFO after an abort (4.3.17). */
  #readClearAbort() {
    this.flushed = false;
    return this.#readClear(TX_ABRT);
  }

  static registers = {
    0x00: { read: (b) => b.con, write: (b, value) => b.#writeCon(value) },
    0x04: configuration('tar', 0x7f, 'IC_TAR'),
    0x10: { read: (b) => b.#pop(), write: (b, value) => b.#push(value) },
    0x1c: configuration('hcnt', 0xffff, 'SCL_HCNT'),
    0x20: configuration('lcnt', 0xffff, 'SCL_LCNT'),
    0x30: { read: (b) => b.mask, write: (b, value) => b.#writeMask(value) },
    0x34: { read: (b) => b.raw },
    0x40: { read: (b) => b.#readClear(-1) },
    0x54: { read: (b) => b.#readClearAbort() },
    0x60: { read: (b) => b.#readClear(STOP_DET) },
    0x6c: { read: (b) => b.enabled, write: (b, value) => b.#writeEnable(value) },
    0x70: { read: (b) => (b.#active ? 0x21 : 0) },
    0x74: { read: (b) => b.tx.length },
    0x78: { read: (b) => b.rx.length },
    0x7c: configuration('sdaHold', 0xffffff, 'IC_SDA_HOLD'),
    0x80: { read: (b) => b.abortSource },
    0x9c: { read: (b) => (b.enabled || b.#active ? 1 : 0) },
    0xa0: { read: (b) => b.spklen, write: (b, value) => b.#writeSpklen(value) },
  };

  writeUint32(offset, value) {
    super.writeUint32(offset, value);
    this.#update();
    this.#kick();
  }

  whileDisabled(what) {
    if (this.enabled || this.#active)
      this.#fail(`${what} written while the block is enabled; clear IC_ENABLE and wait for IC_ENABLE_STATUS first`);
  }

  #writeEnable(value) {
    const was = this.enabled;
    if (value > 1) this.#fail(`IC_ENABLE ${value}: only 0 and 1 are modelled`);
    this.enabled = value;
    if (value && !was) this.#checkTiming();
    if (!value && was) {
      this.tx = [];
      this.rx = [];
      if (this.state === 'hold' || this.state === 'bus-busy') this.#next();
    }
  }

  #checkTiming() {
    if (!this.bus) this.#fail('enabled, but no bus is wired to this block on this board');
    const { lcnt: low, hcnt: high } = this;
    if (low <= this.spklen + 7 || high <= this.spklen + 5)
      this.#fail(`SCL counts ${high}/${low} below the minimum for a spike length of ${this.spklen}`);
    if ((this.sdaHold & 0xffff) > low - 2) this.#fail('IC_SDA_HOLD longer than the SCL low time allows');
    if (this.low_ns < LOW_MIN_NS || this.high_ns < HIGH_MIN_NS) {
      const is = `SCL low ${this.low_ns.toFixed(0)} ns, high ${this.high_ns.toFixed(0)} ns`;
      this.#fail(`${is}; fast mode needs ${LOW_MIN_NS} and ${HIGH_MIN_NS} ns`);
    }
  }

  #push(value) {
    if (!this.enabled) this.#fail('IC_DATA_CMD written while the block is disabled');
    if (value & CMD_RESTART) this.#fail('a RESTART is not modelled');
    if (this.flushed) return;
    if (this.tx.length >= FIFO_DEPTH) this.#fail('transmit FIFO overflow');
    this.tx.push(value & 0x3ff);
    if (this.state === 'hold') this.#next();
  }

  #after(delay_ns, then) {
    this.continuation = then;
    this.alarm.schedule(delay_ns);
  }

  #kick() {
    if (this.state !== 'idle' || !this.enabled || this.flushed || !this.tx.length) return;
    const problem = this.bus.problem();
    if (problem) this.#fail(problem);
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
    this.reading = (this.tx[0] & CMD_READ) !== 0;
    this.#after(this.high_ns + 9 * (this.low_ns + this.high_ns), () => this.#addressed());
  }

  /** True (and the transfer is given up) if somebody else pulls SDA. */
  #arbitrationLost() {
    if (!this.bus.sdaLow) return false;
    this.#loseArbitration();
    return true;
  }

  /** Sends a byte; false: the transfer is given up. */
  #send(byte, noAcknowledge) {
    if (this.#arbitrationLost()) return false;
    const acknowledged = this.bus.writeByte(byte);
    // Without a receive hold an acknowledgement right after SCL fell is mistaken for another controller's bit.
    if (this.bus.wasFast && !(this.sdaHold >>> 16)) {
      this.#loseArbitration();
      return false;
    }
    if (acknowledged) return true;
    this.#abort(noAcknowledge);
    this.#stopCondition();
    return false;
  }

  #loseArbitration() {
    this.state = 'idle';
    this.bus.abandon();
    this.#abort(ABRT_ARB_LOST);
  }

  #addressed() {
    if (this.#send(((this.tar & 0x7f) << 1) | (this.reading ? 1 : 0), ABRT_7B_ADDR_NOACK)) this.#next();
  }

  /** Take the next command, or hold SCL low until there is one. */
  #next() {
    if (this.state === 'bus-busy') this.state = 'idle';
    else if (!this.enabled) this.#stopCondition();
    else if (!this.tx.length) this.state = 'hold';
    else {
      this.command = this.tx.shift();
      if (((this.command & CMD_READ) !== 0) !== this.reading) this.#fail('a transfer that turns without a STOP is not modelled');
      this.state = 'data';
      this.#after(9 * (this.low_ns + this.high_ns), () => (this.reading ? this.#receive() : this.#transmitted()));
    }
  }

  #transmitted() {
    if (this.#send(this.command & 0xff, ABRT_TXDATA_NOACK)) this.#finishByte();
  }

  #receive() {
    if (this.#arbitrationLost()) return;
    if (this.rx.length >= FIFO_DEPTH) this.#fail('receive FIFO overflow');
    const byte = this.bus.readByte(!(this.command & CMD_STOP) && this.enabled === 1);
    if (this.enabled) this.rx.push(byte);
    this.#finishByte();
  }

  #finishByte() {
    if (this.command & CMD_STOP) this.#stopCondition();
    else this.#next();
  }

  #stopCondition() {
    this.state = 'stop';
    this.#after(this.low_ns + this.high_ns, () => {
      this.bus.stop();
      this.raw |= STOP_DET;
      this.state = 'free';
      this.#after(this.low_ns, () => {
        this.state = 'idle';
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
    this.raw |= TX_ABRT;
    this.#update();
  }
}
