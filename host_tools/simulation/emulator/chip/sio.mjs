/**
 * SIO: GPIO and spin locks through rp2040js; for each core its hardware divider with its eight cycles (a result read earlier
 * fails the run), its interpolators, and the FIFO that it reads, of eight words (RP2040 datasheet 2.3.1).
 */
import { RP2040 } from 'rp2040js';

const RPSIO = new RP2040().sio.constructor;
const DIVIDER_CYCLES = 8;
const FIFO_WORDS = 8;
const [FIFO_ST, FIFO_WR, FIFO_RD] = [0x50, 0x54, 0x58];
const [VLD, RDY, WOF, ROE] = [1, 2, 4, 8];
/** SIO_IRQ_PROC0; that of core 1 follows. */
const FIFO_IRQ = 15;

const newDivider = () => ({ dividend: 0, divisor: 0, quotient: 0, remainder: 0, readyAt: 0, dirty: 0 });

export class StrictSio extends RPSIO {
  constructor(chip) {
    super(chip);
    const Interpolator = this.interp0.constructor;
    this.own = [0, 1].map(() => ({
      divider: newDivider(),
      interpolators: [new Interpolator(0), new Interpolator(1)],
      words: [],
      overflowed: false,
      underflowed: false,
    }));
    this.use(0);
  }

  /** From now on this core reads and writes. */
  use(id) {
    const own = this.own[id];
    this.id = id;
    this.divider = own.divider;
    [this.interp0, this.interp1] = own.interpolators;
  }

  /** What the boot ROM leaves: it reads its empty FIFO. */
  resetCore(id) {
    const own = this.own[id];
    own.divider = newDivider();
    own.words.length = 0;
    own.overflowed = false;
    own.underflowed = true;
  }

  hasWord(id) {
    return this.own[id].words.length > 0;
  }

  hasRoom(id) {
    return this.own[1 - id].words.length < FIFO_WORDS;
  }

  pop(id) {
    const own = this.own[id];
    if (own.words.length === 0) own.underflowed = true;
    const word = own.words.shift() ?? 0;
    this.updateInterrupt(id);
    return word;
  }

  push(id, word) {
    if (this.hasRoom(id)) this.own[1 - id].words.push(word >>> 0);
    else this.own[id].overflowed = true;
    this.updateInterrupt(0);
    this.updateInterrupt(1);
  }

  updateInterrupt(id) {
    this.rp2040.setFifoInterrupt(id, FIFO_IRQ + id, this.hasWord(id) || this.own[id].overflowed || this.own[id].underflowed);
  }

  #readFifo(offset) {
    const { id } = this;
    if (offset === FIFO_RD) return this.pop(id);
    if (offset !== FIFO_ST) return this.rp2040.fail('SIO', 'read of FIFO_WR');
    const own = this.own[id];
    return (this.hasWord(id) ? VLD : 0) | (this.hasRoom(id) ? RDY : 0) | (own.overflowed ? WOF : 0) | (own.underflowed ? ROE : 0);
  }

  #writeFifo(offset, value) {
    const own = this.own[this.id];
    if (offset === FIFO_WR) this.push(this.id, value);
    else if (offset === FIFO_ST) {
      own.overflowed &&= !(value & WOF);
      own.underflowed &&= !(value & ROE);
      this.updateInterrupt(this.id);
    } else this.rp2040.fail('SIO', 'write of FIFO_RD');
  }

  #divide(signed) {
    const { divider } = this;
    const a = signed ? divider.dividend | 0 : divider.dividend >>> 0;
    const b = signed ? divider.divisor | 0 : divider.divisor >>> 0;
    if (b === 0) {
      divider.quotient = signed && a >= 0 ? -1 : signed ? 1 : -1;
      divider.remainder = a;
    } else {
      divider.quotient = Math.trunc(a / b);
      divider.remainder = a % b;
    }
    divider.readyAt = this.rp2040.core.cycles + DIVIDER_CYCLES;
    divider.dirty = 2;
  }

  #result(value) {
    if (this.rp2040.core.cycles < this.divider.readyAt) {
      this.rp2040.fail('SIO', 'divider result read before its 8 cycles were over');
    }
    return value >>> 0;
  }

  #readDivider(offset) {
    const { divider } = this;
    if (offset === 0x78) return (this.rp2040.core.cycles >= divider.readyAt ? 1 : 0) | divider.dirty;
    if (offset === 0x74) return this.#result(divider.remainder);
    if (offset === 0x70) {
      divider.dirty = 0;
      return this.#result(divider.quotient);
    }
    return (offset & 4 ? divider.divisor : divider.dividend) >>> 0;
  }

  #writeDivider(offset, value) {
    const { divider } = this;
    divider[{ 0x60: 'dividend', 0x64: 'divisor', 0x68: 'dividend', 0x6c: 'divisor', 0x70: 'quotient', 0x74: 'remainder' }[offset]] = value;
    if (offset < 0x70) this.#divide(offset >= 0x68);
    else divider.dirty = 2;
  }

  readUint32(offset) {
    if (offset >= 0x60 && offset <= 0x78) return this.#readDivider(offset);
    if (offset >= FIFO_ST && offset <= FIFO_RD) return this.#readFifo(offset);
    if (offset === 0) return this.id;
    if (offset > 0x17c) return this.rp2040.fail('SIO', `read of 0x${offset.toString(16)}`);
    return super.readUint32(offset);
  }

  writeUint32(offset, value) {
    if (offset >= 0x60 && offset <= 0x74) {
      this.#writeDivider(offset, value);
      return;
    }
    if (offset === 0x78) this.rp2040.fail('SIO', `write of 0x${offset.toString(16)}`);
    if (offset >= FIFO_ST && offset <= FIFO_RD) this.#writeFifo(offset, value);
    else super.writeUint32(offset, value);
    if (offset >= 0x10 && offset < 0x30) this.rp2040.pins.drive();
  }
}
