/**
 * The XIP serial interface (DW_apb_ssi, RP2040 datasheet 4.10) with the flash of flash_memory.mjs behind it.
 *
 * Modelled: eight-bit full-duplex transfers through 16-deep FIFOs with bus time, chip select (automatic while the transmit FIFO holds data,
 * or forced through IO_QSPI), and whether execute-in-place works with the present settings and the flash as it is.
 */
import { checkedField, RegisterBlock } from './registers.mjs';

const FIFO_DEPTH = 16;
const TMOD_TX_AND_RX = 0;
const TMOD_EEPROM_READ = 3;

const LOST = { write() {} };
const configuration = (name, key, mask) => checkedField((block) => block.whileDisabled(name), key, mask);

export class Ssi extends RegisterBlock {
  constructor(chip, flash) {
    super(chip, 'SSI');
    this.flash = flash;
    this.tx = [];
    this.rx = [];
    this.shifting = null;
    this.forcedSelect = false;
    this.selected = false;
    this.alarm = chip.clock.createAlarm(() => this.#shifted());
    /** Extra time of the next byte, for a test. */
    this.stall_ns = 0;
    // The state that the boot ROM leaves: single-bit 03h reads.
    this.ctrlr0 = (31 << 16) | (TMOD_EEPROM_READ << 8);
    this.ctrlr1 = 0;
    this.enabled = 1;
    this.ser = 1;
    this.baudr = 4;
    this.spiCtrlr0 = (0x03 << 24) | (2 << 8) | (6 << 2);
    this.sampleDelay = 0;
    this.driveEdge = 0;
    this.#settingsChanged();
  }

  whileDisabled(name) {
    if (this.enabled) this.rp2040.fail('SSI', `configuration register ${name} written while enabled`);
  }

  #settingsChanged() {
    this.rp2040.xipReady = this.xipProblem === null;
  }

  /** Why execute-in-place does not work now, or null. */
  get xipProblem() {
    if (!this.enabled) return 'the SSI is disabled';
    if (((this.ctrlr0 >>> 8) & 3) !== TMOD_EEPROM_READ || ((this.ctrlr0 >>> 16) & 31) !== 31) {
      return 'the SSI is not in 32-bit EEPROM-read mode';
    }
    if (this.baudr < 2 || this.baudr & 1) return `the SSI divider BAUDR is ${this.baudr}`;
    if (this.forcedSelect) return 'chip select is forced';
    if (this.flash.isBusy) return 'the flash is busy';
    if (!((this.spiCtrlr0 >>> 8) & 3)) return 'the SSI sends no command; the continuous-read mode of the flash is not modelled';
    const command = this.spiCtrlr0 >>> 24;
    if (![0x03, 0x0b, 0x3b, 0x6b, 0xbb, 0xeb].includes(command)) {
      return `0x${command.toString(16)} is not a read command`;
    }
    return null;
  }

  forceSelect(low) {
    if (low === this.forcedSelect) return;
    this.forcedSelect = low;
    this.#updateSelect();
    this.#settingsChanged();
  }

  #updateSelect() {
    const selected = this.forcedSelect || this.shifting !== null;
    if (selected === this.selected) return;
    this.selected = selected;
    if (selected) this.flash.select();
    else this.flash.deselect();
  }

  get #serialMode() {
    return ((this.ctrlr0 >>> 8) & 3) === TMOD_TX_AND_RX && ((this.ctrlr0 >>> 16) & 31) === 7 && ((this.ctrlr0 >>> 21) & 3) === 0;
  }

  #start() {
    if (this.shifting !== null || !this.tx.length || !this.enabled || !this.ser) return;
    this.shifting = this.tx.shift();
    this.#updateSelect();
    this.#scheduleShift();
  }

  #scheduleShift() {
    this.alarm.schedule((8 * this.baudr * 1e9) / this.rp2040.trueHz(this.rp2040.clkSys) + this.stall_ns);
    this.stall_ns = 0;
  }

  #shifted() {
    const answer = this.flash.exchange(this.shifting & 0xff);
    if (this.rx.length >= FIFO_DEPTH) this.rp2040.fail('SSI', 'receive FIFO overflow');
    this.rx.push(answer);
    if (this.tx.length) {
      this.shifting = this.tx.shift();
      this.#scheduleShift();
    } else {
      this.shifting = null;
      this.#updateSelect();
      this.#settingsChanged();
    }
  }

  #pop() {
    if (!this.rx.length) this.rp2040.fail('SSI', 'data register read while the receive FIFO is empty');
    return this.rx.shift();
  }

  get #status() {
    return (
      (this.shifting !== null ? 1 : 0) |
      (this.tx.length < FIFO_DEPTH ? 2 : 0) |
      (this.tx.length === 0 ? 4 : 0) |
      (this.rx.length ? 8 : 0) |
      (this.rx.length >= FIFO_DEPTH ? 16 : 0)
    );
  }

  static registers = {
    0x00: configuration('CTRLR0', 'ctrlr0'),
    0x04: configuration('CTRLR1', 'ctrlr1', 0xffff),
    0x08: { read: (b) => b.enabled, write: (b, value) => b.#enable(value & 1) },
    0x10: { read: (b) => b.ser, write: (b, value) => b.#choose(value & 1) },
    0x14: configuration('BAUDR', 'baudr', 0xfffe),
    0x18: LOST,
    0x1c: LOST,
    0x20: { read: (b) => b.tx.length },
    0x24: { read: (b) => b.rx.length },
    0x28: { read: (b) => b.#status },
    0x2c: LOST,
    0x48: { read: () => 0 },
    0x4c: LOST,
    0x58: { read: () => 0x51535049 },
    0x5c: { read: () => 0x3430312a },
    0x60: { read: (b) => b.#pop(), write: (b, value) => b.#push(value) },
    0xf0: configuration('RX_SAMPLE_DLY', 'sampleDelay', 0xff),
    0xf4: configuration('SPI_CTRLR0', 'spiCtrlr0'),
    0xf8: configuration('TXD_DRIVE_EDGE', 'driveEdge', 0xff),
  };

  writeUint32(offset, value) {
    super.writeUint32(offset, value);
    this.#settingsChanged();
  }

  #enable(enabled) {
    if (!enabled) {
      // By its maker's datasheet the transfer ends at once.
      if (this.shifting !== null && !this.forcedSelect) this.rp2040.fail('SSI', 'disabled in mid-transfer');
      this.shifting = null;
      this.alarm.cancel();
      this.tx = [];
      this.rx = [];
    }
    this.enabled = enabled;
  }

  #choose(ser) {
    this.ser = ser;
    this.#start();
  }

  #push(value) {
    if (!this.enabled) this.rp2040.fail('SSI', 'data register written while disabled');
    if (!this.#serialMode) this.rp2040.fail('SSI', 'only 8-bit single-lane transmit-and-receive transfers are modelled');
    if (this.tx.length >= FIFO_DEPTH) this.rp2040.fail('SSI', 'transmit FIFO overflow');
    this.tx.push(value & 0xff);
    this.#start();
  }
}
