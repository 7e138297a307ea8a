/**
 * A PIO block cycle by cycle, as plainly as RP2040 datasheet 3.4 and 3.5 say it, to compare the fast one with: every
 * state machine is looked at in every cycle, nothing is scheduled. No EXEC, no INSTR, no reserved encodings.
 */
const mask = (n) => (n === 32 ? -1 : (1 << n) - 1);
const rotate = (v, n) => (n % 32 === 0 ? v | 0 : (v << (n % 32)) | (v >>> (32 - (n % 32))));

class Machine {
  constructor(block, index, c) {
    const registers = { pc: 0, x: 0, y: 0, isr: 0, osr: 0, isrCount: 0, osrCount: 32, tx: [], rx: [] };
    Object.assign(this, { block, index, c, ...registers, delay: 0, due: 0, raised: false });
  }

  cycle(n) {
    if (256 * (n + 1) <= this.due) return;
    this.due += this.c.divisor;
    if (this.delay > 0) {
      this.delay -= 1;
      this.refill();
      return;
    }
    const op = this.block.memory[this.pc];
    this.next = this.pc === this.c.wrapTop ? this.c.wrapBottom : (this.pc + 1) % 32;
    const stalled = this.execute(op);
    const field = (op >> 8) & 31;
    const { sideCount, sideEnable } = this.c;
    if (!this.begun && sideCount > 0 && (!sideEnable || field & 16)) {
      const bits = sideCount - (sideEnable ? 1 : 0);
      this.block.pins(this.c.sideToDirections, this.c.sideBase, bits, (field >> (5 - sideCount)) & mask(bits));
    }
    this.begun = stalled;
    if (stalled) {
      if (op >> 13 !== 3) this.refill();
      return;
    }
    this.pc = this.next;
    this.delay = field & mask(5 - sideCount);
    if (op >> 13 !== 3) this.refill();
  }

  refill() {
    if (this.c.autopull && this.osrCount >= this.c.pullThreshold && this.tx.length) {
      this.osr = this.tx.shift();
      this.osrCount = 0;
    }
  }

  flag(index) {
    return index & 16 ? (index & 4) + ((index + this.index) & 3) : index & 7;
  }

  source(which) {
    const level = this.c.statusReceive ? this.rx.length : this.tx.length;
    return [rotate(this.block.seen, 32 - this.c.inBase), this.x, this.y, 0, 0, level < this.c.statusN ? -1 : 0, this.isr, this.osr][which];
  }

  /** True if the instruction stalls. */
  execute(op) {
    const { c, block } = this;
    const [kind, arg, low] = [op >> 13, (op >> 5) & 7, op & 31];
    const bits = low || 32;
    if (kind === 0) {
      const pin = (block.seen >>> c.jumpPin) & 1;
      const [{ x, y }, more] = [this, this.osrCount < c.pullThreshold];
      if ([true, x === 0, x !== 0, y === 0, y !== 0, x !== y, pin === 1, more][arg]) this.next = low;
      if (arg === 2) this.x = (x - 1) | 0;
      if (arg === 4) this.y = (y - 1) | 0;
      return false;
    }
    if (kind === 1) {
      const polarity = arg >> 2;
      if ((arg & 3) === 2) {
        const bit = 1 << this.flag(low);
        if (((block.flags & bit) !== 0) !== (polarity === 1)) return true;
        if (polarity) block.clear |= bit;
        return false;
      }
      const pin = (arg & 3) === 0 ? low : (low + c.inBase) % 32;
      return ((block.seen >>> pin) & 1) !== polarity;
    }
    if (kind === 2) {
      const count = Math.min(32, this.isrCount + bits);
      if (c.autopush && count >= c.pushThreshold && this.rx.length >= c.rxDepth) return true;
      const value = this.source(arg) & mask(bits);
      if (bits === 32) this.isr = value;
      else this.isr = c.inRight ? (this.isr >>> bits) | (value << (32 - bits)) : (this.isr << bits) | value;
      this.isr |= 0;
      this.isrCount = count;
      if (c.autopush && count >= c.pushThreshold) this.push();
      return false;
    }
    if (kind === 3) {
      if (c.autopull && this.osrCount >= c.pullThreshold) {
        this.refill();
        return true;
      }
      let value;
      if (bits === 32) [value, this.osr] = [this.osr, 0];
      else if (c.outRight) [value, this.osr] = [this.osr & mask(bits), this.osr >>> bits];
      else [value, this.osr] = [this.osr >>> (32 - bits), this.osr << bits];
      this.osr |= 0;
      this.osrCount = Math.min(32, this.osrCount + bits);
      if (arg === 0 || arg === 4) block.pins(arg === 4, c.outBase, c.outCount, value);
      if (arg === 1) this.x = value | 0;
      if (arg === 2) this.y = value | 0;
      if (arg === 5) this.next = value & 31;
      if (arg === 6) [this.isr, this.isrCount] = [value | 0, bits];
      this.refill();
      return false;
    }
    if (kind === 4 && !(arg & 4)) {
      if (arg & 2 && this.isrCount < c.pushThreshold) return false;
      if (this.rx.length < c.rxDepth) this.push();
      else if (arg & 1) return true;
      else [this.isr, this.isrCount] = [0, 0];
      return false;
    }
    if (kind === 4) {
      if ((arg & 2 || c.autopull) && this.osrCount < c.pullThreshold) return false;
      if (this.tx.length) this.osr = this.tx.shift();
      else if (arg & 1) return true;
      else this.osr = this.x;
      this.osrCount = 0;
      return false;
    }
    if (kind === 5) {
      let value = this.source(op & 7);
      if (((op >> 3) & 3) === 1) value = ~value;
      if (((op >> 3) & 3) === 2) value = parseInt((value >>> 0).toString(2).padStart(32, '0').split('').reverse().join(''), 2);
      value |= 0;
      if (arg === 0) block.pins(false, c.outBase, c.outCount, value);
      if (arg === 1) this.x = value;
      if (arg === 2) this.y = value;
      if (arg === 5) this.next = value & 31;
      if (arg === 6) [this.isr, this.isrCount] = [value, 0];
      if (arg === 7) [this.osr, this.osrCount] = [value, 0];
      return false;
    }
    if (kind === 6) {
      const bit = 1 << this.flag(low);
      if (arg & 2) {
        block.clear |= bit;
        return false;
      }
      if (!this.raised) {
        block.set |= bit;
        this.raised = (arg & 1) === 1;
        return this.raised;
      }
      if (block.flags & bit) return true;
      this.raised = false;
      return false;
    }
    if (arg === 0 || arg === 4) block.pins(arg === 4, c.setBase, c.setCount, low);
    if (arg === 1) this.x = low;
    if (arg === 2) this.y = low;
    return false;
  }

  push() {
    this.rx.push(this.isr);
    [this.isr, this.isrCount] = [0, 0];
  }
}

export class ReferencePio {
  constructor(memory, configurations) {
    this.memory = memory;
    this.machines = configurations.map((c, i) => new Machine(this, i, c));
    Object.assign(this, { values: 0, directions: 0, flags: 0, set: 0, clear: 0, n: 0, seen: 0, history: [0, 0, 0] });
  }

  pins(toDirections, base, count, value) {
    const where = rotate(mask(count), base);
    const key = toDirections ? 'directions' : 'values';
    this[key] = (this[key] & ~where) | (rotate(value, base) & where);
  }

  /** One cycle; `levels(block)` gives the pins after it. */
  cycle(levels) {
    this.seen = this.history.shift();
    for (const m of this.machines) m.cycle(this.n);
    this.flags = (this.flags & ~this.clear) | this.set;
    [this.set, this.clear] = [0, 0];
    this.n += 1;
    this.history.push(levels(this));
  }
}
