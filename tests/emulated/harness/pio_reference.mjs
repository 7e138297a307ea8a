/**
 * A PIO block cycle by cycle, as plainly as RP2040 datasheet 3.4 and 3.5 say it, to compare the fast one with: its
 * state machine is looked at in every cycle, nothing is scheduled. No INSTR.
 */
const mask = (n) => (n === 32 ? -1 : (1 << n) - 1);
const rotate = (v, n) => (n % 32 === 0 ? v | 0 : (v << (n % 32)) | (v >>> (32 - (n % 32))));

export class ReferencePio {
  constructor(memory, configuration) {
    const registers = { pc: 0, x: 0, y: 0, isr: 0, osr: 0, isrCount: 0, osrCount: 32, tx: [], rx: [] };
    Object.assign(this, { memory, c: configuration, ...registers, delay: 0, due: 0, n: 0 });
    Object.assign(this, { values: 0, directions: 0, seen: 0, history: [0, 0, 0] });
  }

  /** One cycle; `levels(block)` gives the pins after it. */
  cycle(levels) {
    this.seen = this.history.shift();
    this.n += 1;
    if (this.n > this.due) {
      this.due += this.c.divisor;
      this.#step();
    }
    this.history.push(levels(this));
  }

  #step() {
    if (this.delay > 0) {
      this.delay -= 1;
      this.#refill();
      return;
    }
    const op = this.memory[this.pc];
    this.next = this.pc === this.c.wrapTop ? this.c.wrapBottom : (this.pc + 1) % 32;
    const stalled = this.#execute(op);
    if (op >> 13 !== 3) this.#refill();
    if (stalled) return;
    this.pc = this.next;
    this.delay = (op >> 8) & 31;
  }

  #refill() {
    if (!this.c.autopull || this.osrCount < 32 || !this.tx.length) return;
    this.osr = this.tx.shift();
    this.osrCount = 0;
  }

  #push() {
    this.rx.push(this.isr);
    [this.isr, this.isrCount] = [0, 0];
  }

  /** True if the instruction stalls. */
  #execute(op) {
    const { c } = this;
    const [kind, arg, low] = [op >> 13, (op >> 5) & 7, op & 31];
    const bits = low || 32;
    if (kind === 0) {
      const [{ x, y }, pin] = [this, (this.seen >>> c.jumpPin) & 1];
      if ({ 0: true, 2: x !== 0, 4: y !== 0, 6: pin === 1 }[arg]) this.next = low;
      if (arg === 2) this.x = (x - 1) | 0;
      if (arg === 4) this.y = (y - 1) | 0;
    } else if (kind === 1) return ((this.seen >>> ((low + c.inBase) % 32)) & 1) !== arg >> 2;
    else if (kind === 2) {
      const count = Math.min(32, this.isrCount + bits);
      if (c.autopush && count === 32 && this.rx.length >= c.rxDepth) return true;
      const value = rotate(this.seen, 32 - c.inBase) & mask(bits);
      this.isr = bits === 32 ? value : (this.isr >>> bits) | (value << (32 - bits));
      this.isrCount = count;
      if (c.autopush && count === 32) this.#push();
    } else if (kind === 3) {
      if (c.autopull && this.osrCount === 32) {
        this.#refill();
        return true;
      }
      const value = this.osr & mask(bits);
      this.osr = bits === 32 ? 0 : (this.osr >>> bits) | 0;
      this.osrCount = Math.min(32, this.osrCount + bits);
      const where = rotate(mask(c.outCount), c.outBase);
      this.directions = (this.directions & ~where) | (rotate(value, c.outBase) & where);
      this.#refill();
    } else if (kind === 4) {
      if (this.rx.length < c.rxDepth) this.#push();
      else [this.isr, this.isrCount] = [0, 0];
    } else if (kind === 5 && arg === 6) [this.isr, this.isrCount] = [~this.y, 0];
    else if (kind === 5) this.values &= ~rotate(mask(c.outCount), c.outBase);
    else if (arg === 1) this.x = low;
    else this.y = low;
    return false;
  }
}
