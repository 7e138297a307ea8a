/**
 * SIO: GPIO through rp2040js, the hardware divider with its eight cycles (a result read earlier fails the run).
 */
import { RP2040 } from 'rp2040js';

const RPSIO = new RP2040().sio.constructor;
const DIVIDER_CYCLES = 8;

export class StrictSio extends RPSIO {
  constructor(chip) {
    super(chip);
    this.dividend = 0;
    this.divisor = 0;
    this.quotient = 0;
    this.remainder = 0;
    this.readyAt = 0;
    this.dirty = 0;
  }

  #divide(signed) {
    const a = signed ? this.dividend | 0 : this.dividend >>> 0;
    const b = signed ? this.divisor | 0 : this.divisor >>> 0;
    if (b === 0) {
      this.quotient = signed && a >= 0 ? -1 : signed ? 1 : -1;
      this.remainder = a;
    } else {
      this.quotient = Math.trunc(a / b);
      this.remainder = a % b;
    }
    this.readyAt = this.rp2040.core.cycles + DIVIDER_CYCLES;
    this.dirty = 2;
  }

  #result(value) {
    if (this.rp2040.core.cycles < this.readyAt) {
      this.rp2040.fail('SIO', 'divider result read before its 8 cycles were over');
    }
    return value >>> 0;
  }

  readUint32(offset) {
    switch (offset) {
      case 0x60:
      case 0x68:
        return this.dividend >>> 0;
      case 0x64:
      case 0x6c:
        return this.divisor >>> 0;
      case 0x70:
        this.dirty = 0;
        return this.#result(this.quotient);
      case 0x74:
        return this.#result(this.remainder);
      case 0x78:
        return (this.rp2040.core.cycles >= this.readyAt ? 1 : 0) | this.dirty;
    }
    if (offset >= 0x50 && offset < 0x5c) return this.rp2040.fail('SIO', 'the inter-core FIFO is not modelled');
    if (offset > 0x17c) return this.rp2040.fail('SIO', `read of 0x${offset.toString(16)}`);
    return super.readUint32(offset);
  }

  writeUint32(offset, value) {
    switch (offset) {
      case 0x60:
      case 0x68:
        this.dividend = value;
        return this.#divide(offset === 0x68);
      case 0x64:
      case 0x6c:
        this.divisor = value;
        return this.#divide(offset === 0x6c);
      case 0x70:
        this.quotient = value;
        this.dirty = 2;
        return undefined;
      case 0x74:
        this.remainder = value;
        this.dirty = 2;
        return undefined;
    }
    if (offset === 0x78 || (offset >= 0x50 && offset < 0x5c)) {
      return this.rp2040.fail('SIO', `write of 0x${offset.toString(16)}`);
    }
    super.writeUint32(offset, value);
    if (offset >= 0x10 && offset < 0x30) this.rp2040.pins.drive();
    return undefined;
  }
}
