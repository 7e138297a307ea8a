/**
 * PIO block of the RP2040 (datasheet chapter 3), in lock-step with emulated time: what the boards' programs use.
 *
 * The state machine runs at the edges of clk_sys that its divider lets through: what it does in a cycle shows at the edge that ends the
 * cycle. Only edges at which something happens are visited: a stalled machine, or one that counts down a delay, costs nothing until data or
 * a pin that it waits for changes. Inputs pass two flip-flops: an instruction sees a pin as it was two cycles before its edge.
 *
 * The first cycle of a divider is the one after its restart. Autopull refills in cycles of an enabled machine only. An
 * instruction written to INSTR takes the next cycle of clk_sys.
 *
 * Modelled: state machine 0; JMP always, X--, Y-- and PIN; WAIT PIN; IN PINS and OUT PINDIRS, to the right; PUSH NOBLOCK; MOV PINS, NULL
 * and MOV ISR, !Y; SET X and Y; whole dividers, autopush and autopull of whole words, a joined receive FIFO. Everything else fails the run.
 * Warns: a transmit FIFO written while full, a receive FIFO read while empty.
 */
import { arrayAt, field, RegisterBlock } from './registers.mjs';

const FIFO_DEPTH = 4;
const WORD_BITS = 32;

const CTRL_ENABLE = 1;
const CTRL_RESTART = 1 << 4;
const EXECCTRL_MODELLED = 0x1f01ff80;
const [AUTOPUSH, AUTOPULL, IN_RIGHT, OUT_RIGHT, JOIN_RX] = [1 << 16, 1 << 17, 1 << 18, 1 << 19, 0x80000000];
const SHIFTCTRL_MODELLED = AUTOPUSH | AUTOPULL | IN_RIGHT | OUT_RIGHT | JOIN_RX;
/** OUT_COUNT, IN_BASE and OUT_BASE. */
const PINCTRL_MODELLED = (31 << 20) | (31 << 15) | 31;

/** What a stalled instruction waits for. */
const FOR_TX = 1;
const FOR_RX = 2;
const FOR_PIN = 4;

/** How an instruction ended; below: stalled for that reason. */
const DONE = -1;
const AGAIN = -2;

const maskOf = (bits) => (bits >= WORD_BITS ? -1 : (1 << bits) - 1);
const rotateLeft = (value, by) => (by ? (value << by) | (value >>> (WORD_BITS - by)) : value | 0);

export class Pio extends RegisterBlock {
  constructor(chip, index) {
    super(chip, `PIO${index}`);
    this.index = index;
    this.clock = chip.sysClock;
    this.memory = new Uint16Array(32);
    this.alarm = chip.clock.createAlarm(() => this.#atEdge());
    this.reset();
  }

  reset() {
    this.alarm.cancel();
    this.dueEdge = Infinity;
    this.pinValues = 0;
    this.pinDirections = 0;
    this.driven = { values: 0, directions: 0 };
    this.memory.fill(0);
    this.enabled = false;
    this.x = 0;
    this.y = 0;
    this.pc = 0;
    this.osr = 0;
    this.tx = [];
    this.rx = [];
    /** Divider: cycle k of this machine ends at edge start + k * divisor. */
    this.start = this.clock.edge + 1;
    this.divisor = 1;
    this.execctrl = 0x1f000;
    this.shiftctrl = IN_RIGHT | OUT_RIGHT;
    this.pinctrl = 0;
    this.#restart();
  }

  #notModelled(what) {
    this.rp2040.fail(this.name, `${what} is not modelled`);
  }

  /** What CTRL.SM_RESTART clears (pc, x, y and osr stay). */
  #restart() {
    this.isr = 0;
    this.isrCount = 0;
    this.osrCount = WORD_BITS;
    /** An instruction written to INSTR. */
    this.forced = 0;
    this.forcedEdge = Infinity;
    this.stall = 0;
    this.waitPin = 0;
    this.delayLeft = 0;
    this.refillEdge = Infinity;
    this.nextEdge = this.enabled ? this.#cycleAfter(this.clock.edge) : Infinity;
    this.#scheduleRefill();
  }

  /** clk_sys changed: edges lie elsewhere now. */
  clockChanged() {
    if (this.dueEdge !== Infinity) this.alarm.scheduleAt(this.clock.ns(this.dueEdge));
  }

  // --- clock divider -------------------------------------------------------------------------------------------

  #endOfCycle(k) {
    return this.start + k * this.divisor;
  }

  /** Number of the first cycle that ends after `edge`. */
  #cycleNumberAfter(edge) {
    return edge < this.start ? 0 : Math.floor((edge - this.start) / this.divisor) + 1;
  }

  #cycleAfter(edge) {
    return this.#endOfCycle(this.#cycleNumberAfter(edge));
  }

  #writeClkdiv(value) {
    if (value & 0xff00 || !(value >>> 16)) this.#notModelled(`CLKDIV 0x${(value >>> 0).toString(16)}, a fraction or 65536,`);
    if (this.enabled) this.#notModelled('CLKDIV written while the machine runs');
    this.start = this.#cycleAfter(this.clock.edge);
    this.divisor = value >>> 16;
  }

  #writeCtrl(value) {
    if (value & ~(CTRL_ENABLE | CTRL_RESTART)) this.#notModelled(`CTRL 0x${value.toString(16)}, other machines or a restart of a divider,`);
    if (value & CTRL_RESTART) this.#restart();
    this.#setEnabled((value & CTRL_ENABLE) !== 0);
  }

  #setEnabled(enabled) {
    if (enabled === this.enabled) return;
    const { edge } = this.clock;
    this.enabled = enabled;
    if (enabled) {
      this.nextEdge = this.#endOfCycle(this.#cycleNumberAfter(edge) + this.delayLeft);
      this.delayLeft = 0;
      this.#scheduleRefill();
    } else {
      this.delayLeft = this.nextEdge === Infinity ? 0 : this.#cycleNumberAfter(this.nextEdge - 1) - this.#cycleNumberAfter(edge);
      this.nextEdge = Infinity;
      this.refillEdge = Infinity;
      this.stall = 0;
    }
  }

  // --- configuration -------------------------------------------------------------------------------------------

  #configure(key, value, modelled) {
    if (value & ~modelled) this.#notModelled(`${key} 0x${(value >>> 0).toString(16)}`);
    this[key] = value >>> 0;
  }

  #writeShiftctrl(value) {
    const joins = (value ^ this.shiftctrl) & JOIN_RX;
    this.#configure('shiftctrl', value, SHIFTCTRL_MODELLED);
    if (joins) {
      this.tx = [];
      this.rx = [];
    }
    this.#scheduleRefill();
    // What can be transferred is another.
    this.rp2040.dma.request(8 * this.index);
  }

  get txDepth() {
    return this.shiftctrl & JOIN_RX ? 0 : FIFO_DEPTH;
  }

  get rxDepth() {
    return this.shiftctrl & JOIN_RX ? 2 * FIFO_DEPTH : FIFO_DEPTH;
  }

  // --- FIFOs ---------------------------------------------------------------------------------------------------

  /** How many transfers DMA request `treq` (0: transmit, 4: receive) allows now. */
  requests(treq) {
    return treq & 4 ? this.rx.length : this.txDepth - this.tx.length;
  }

  #put(value) {
    if (this.tx.length >= this.txDepth) {
      this.rp2040.report.warn(this.name, 'TXF0 written while full; the word is lost');
      return;
    }
    this.tx.push(value);
    this.#wake(FOR_TX);
    this.#scheduleRefill();
  }

  #get() {
    if (!this.rx.length) {
      this.rp2040.report.warn(this.name, 'RXF0 read while empty');
      return 0;
    }
    const value = this.rx.shift();
    this.#wake(FOR_RX);
    this.#schedule();
    return value;
  }

  /** Autopull does not wait for the next OUT: it refills in the next cycle. */
  #scheduleRefill() {
    if (this.shiftctrl & AUTOPULL && this.enabled && this.osrCount >= WORD_BITS && this.tx.length && this.refillEdge === Infinity)
      this.refillEdge = this.#cycleAfter(this.clock.edge);
  }

  #refill() {
    if (this.shiftctrl & AUTOPULL && this.osrCount >= WORD_BITS && this.tx.length) this.#pull();
  }

  #pull() {
    this.osr = this.tx.shift();
    this.osrCount = 0;
    this.rp2040.dma.request(8 * this.index);
  }

  #push() {
    this.rx.push(this.isr);
    this.isr = 0;
    this.isrCount = 0;
    this.rp2040.dma.request(8 * this.index + 4);
  }

  #wake(reason) {
    if (this.stall === reason) this.nextEdge = Math.min(this.nextEdge, this.#cycleAfter(this.clock.edge));
  }

  // --- pins ----------------------------------------------------------------------------------------------------

  /** The pin that the machine waits for. */
  get watchedPins() {
    return this.stall === FOR_PIN ? 1 << this.waitPin : 0;
  }

  inputsChanged(_changed, t_ns) {
    const passed = this.clock.origin_edge + Math.floor((t_ns - this.clock.origin_ns) / this.clock.period_ns + 1e-6);
    // The third edge from there on is the first that sees the change.
    this.nextEdge = Math.min(this.nextEdge, this.#cycleAfter(passed + 2));
    this.#schedule();
  }

  #inputs(edge) {
    return this.rp2040.pins.before(this.clock.ns(edge - 2));
  }

  /** A pin changed, and the change is still in the synchronisers at this edge. */
  #inputsUnderWay(edge) {
    const { pins } = this.rp2040;
    return pins.changed_ns[pins.newest] >= this.clock.ns(edge - 2);
  }

  get #inBase() {
    return (this.pinctrl >>> 15) & 31;
  }

  /** The bits of OUT and MOV PINS. */
  get #outMask() {
    return rotateLeft(maskOf((this.pinctrl >>> 20) & 31), this.pinctrl & 31);
  }

  // --- time ----------------------------------------------------------------------------------------------------

  #schedule() {
    const due = Math.min(this.nextEdge, this.refillEdge, this.forcedEdge);
    if (due === this.dueEdge) return;
    this.dueEdge = due;
    if (due === Infinity) this.alarm.cancel();
    else this.alarm.scheduleAt(this.clock.ns(due));
  }

  #atEdge() {
    const edge = this.dueEdge;
    this.dueEdge = Infinity;
    if (this.forcedEdge === edge) {
      this.forcedEdge = Infinity;
      this.#execute(this.forced, edge);
      if (this.jumped >= 0) this.pc = this.jumped;
    } else if (this.nextEdge === edge) this.#act(edge);
    if (this.refillEdge <= edge) {
      this.refillEdge = Infinity;
      this.#refill();
    }
    this.#settle();
    this.#schedule();
  }

  /** The pins take what the machine did at this edge. */
  #settle() {
    if (this.pinValues === this.driven.values && this.pinDirections === this.driven.directions) return;
    this.driven = { values: this.pinValues, directions: this.pinDirections };
    this.rp2040.pins.drive();
  }

  // --- execution -----------------------------------------------------------------------------------------------

  #force(instruction) {
    if (this.enabled) this.#notModelled('INSTR written while the machine runs');
    if (![0, 5, 7].includes(instruction >>> 13)) this.#notModelled('INSTR with anything but JMP, MOV or SET');
    this.forced = instruction;
    this.forcedEdge = this.clock.edge + 1;
  }

  #act(edge) {
    const instruction = this.memory[this.pc];
    const ended = this.#execute(instruction, edge);
    this.stall = Math.max(ended, 0);
    if (ended >= 0) this.nextEdge = Infinity;
    else if (ended === AGAIN) this.nextEdge = this.#cycleAfter(edge);
    else {
      const [top, bottom] = [(this.execctrl >>> 12) & 31, (this.execctrl >>> 7) & 31];
      if (this.jumped >= 0) this.pc = this.jumped;
      else this.pc = this.pc === top ? bottom : (this.pc + 1) & 31;
      this.nextEdge = this.#endOfCycle(this.#cycleNumberAfter(edge) + ((instruction >>> 8) & 31));
    }
  }

  /** Returns DONE, AGAIN (next cycle) or what to wait for; sets `jumped` (address or -1). */
  #execute(instruction, edge) {
    this.jumped = -1;
    const argument = instruction & 31;
    const jumpIf = (condition) => {
      if (condition) this.jumped = argument;
      return DONE;
    };
    switch (instruction & 0xe0e0) {
      case 0x0000: // JMP
        return jumpIf(true);
      case 0x0040: // JMP X--
        this.x = (this.x - 1) | 0;
        return jumpIf(this.x !== -1);
      case 0x0080: // JMP Y--
        this.y = (this.y - 1) | 0;
        return jumpIf(this.y !== -1);
      case 0x00c0: // JMP PIN
        return jumpIf((this.#inputs(edge) >>> ((this.execctrl >>> 24) & 31)) & 1);
      case 0x2020: // WAIT PIN, low and high
      case 0x20a0:
        return this.#wait((instruction >>> 7) & 1, argument, edge);
      case 0x4000: // IN PINS
        return this.#in(argument || WORD_BITS, edge);
      case 0x6080: // OUT PINDIRS
        return this.#out(argument || WORD_BITS);
      case 0xe020: // SET X
        this.x = argument;
        return DONE;
      case 0xe040: // SET Y
        this.y = argument;
        return DONE;
    }
    switch (instruction & 0xe0ff) {
      case 0x8000: // PUSH NOBLOCK
        if (this.rx.length < this.rxDepth) this.#push();
        else this.isr = this.isrCount = 0;
        return DONE;
      case 0xa003: // MOV PINS, NULL
        this.pinValues &= ~this.#outMask;
        return DONE;
      case 0xa0ca: // MOV ISR, !Y
        this.isr = ~this.y;
        this.isrCount = 0;
        return DONE;
    }
    return this.#notModelled(`instruction 0x${instruction.toString(16).padStart(4, '0')} at ${this.pc}`);
  }

  #wait(wanted, argument, edge) {
    this.waitPin = (argument + this.#inBase) & 31;
    if (((this.#inputs(edge) >>> this.waitPin) & 1) === wanted) return DONE;
    return this.#inputsUnderWay(edge) ? AGAIN : FOR_PIN;
  }

  #in(bits, edge) {
    if (!(this.shiftctrl & IN_RIGHT)) this.#notModelled('IN to the left');
    const count = Math.min(WORD_BITS, this.isrCount + bits);
    const full = this.shiftctrl & AUTOPUSH && count >= WORD_BITS;
    if (full && this.rx.length >= this.rxDepth) return FOR_RX;
    const value = rotateLeft(this.#inputs(edge), (WORD_BITS - this.#inBase) & 31);
    this.isr = bits === WORD_BITS ? value : (this.isr >>> bits) | (value << (WORD_BITS - bits));
    this.isrCount = count;
    if (full) this.#push();
    return DONE;
  }

  #out(bits) {
    if (!(this.shiftctrl & OUT_RIGHT)) this.#notModelled('OUT to the left');
    if (this.shiftctrl & AUTOPULL && this.osrCount >= WORD_BITS) {
      if (!this.tx.length) return FOR_TX;
      this.#pull();
      return AGAIN;
    }
    const mask = this.#outMask;
    const value = rotateLeft(this.osr & maskOf(bits), this.pinctrl & 31);
    this.osr = bits === WORD_BITS ? 0 : this.osr >>> bits;
    this.osrCount = Math.min(WORD_BITS, this.osrCount + bits);
    this.pinDirections = (this.pinDirections & ~mask) | (value & mask);
    this.#refill();
    return DONE;
  }

  // --- registers -----------------------------------------------------------------------------------------------

  static registers = {
    0x00: { read: (b) => (b.enabled ? CTRL_ENABLE : 0), write: (b, value) => b.#writeCtrl(value) },
    0x10: { write: (b, value) => b.#put(value | 0) },
    0x20: { read: (b) => b.#get() },
    ...arrayAt(0x48, 32, (i) => ({ write: (b, value) => b.memory.fill(value, i, i + 1) })), // not to be read
    0xc8: { write: (b, value) => b.#writeClkdiv(value) },
    0xcc: { ...field('execctrl'), write: (b, value) => b.#configure('execctrl', value, EXECCTRL_MODELLED) },
    0xd0: { ...field('shiftctrl'), write: (b, value) => b.#writeShiftctrl(value) },
    0xd4: { read: (b) => b.pc },
    0xd8: { write: (b, value) => b.#force(value & 0xffff) },
    0xdc: { ...field('pinctrl'), write: (b, value) => b.#configure('pinctrl', value, PINCTRL_MODELLED) },
  };

  writeUint32(offset, value) {
    super.writeUint32(offset, value);
    this.#settle();
    this.#schedule();
  }
}
