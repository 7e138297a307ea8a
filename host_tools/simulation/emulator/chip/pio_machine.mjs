/**
 * One state machine of the PIO: its program counter, registers, FIFOs, divider and the instructions. pio.mjs lists what is
 * modelled.
 */
export const FIFO_DEPTH = 4;

const FDEBUG_TXSTALL = 24;
const FDEBUG_TXOVER = 16;
const FDEBUG_RXUNDER = 8;
const FDEBUG_RXSTALL = 0;

/** What a stalled instruction waits for. */
const FOR_TX = 1;
const FOR_RX = 2;
const FOR_PIN = 4;
const FOR_FLAG = 8;

/** How an instruction ended; below: stalled for that reason. */
const DONE = -1;
const AGAIN = -2;

/** Where IN and MOV read from, and OUT, MOV and SET write to; undefined is reserved. */
const SOURCES = ['pins', 'x', 'y', 'null', undefined, undefined, 'isr', 'osr'];
const OUT_TO = ['pins', 'x', 'y', 'null', 'pindirs', 'pc', 'isr', 'exec'];
const MOV_TO = ['pins', 'x', 'y', undefined, 'exec', 'pc', 'isr', 'osr'];
const SET_TO = ['pins', 'x', 'y', undefined, 'pindirs'];

const maskOf = (bits) => (bits >= 32 ? -1 : (1 << bits) - 1);
const rotateLeft = (value, by) => (by ? (value << by) | (value >>> (32 - by)) : value | 0);
const reverse = (value) => {
  let v = value;
  v = ((v & 0x55555555) << 1) | ((v >>> 1) & 0x55555555);
  v = ((v & 0x33333333) << 2) | ((v >>> 2) & 0x33333333);
  v = ((v & 0x0f0f0f0f) << 4) | ((v >>> 4) & 0x0f0f0f0f);
  v = ((v & 0x00ff00ff) << 8) | ((v >>> 8) & 0x00ff00ff);
  return (v << 16) | (v >>> 16);
};

export class StateMachine {
  constructor(pio, index) {
    this.pio = pio;
    this.index = index;
    this.reset();
  }

  reset() {
    this.enabled = false;
    this.x = 0;
    this.y = 0;
    this.pc = 0;
    this.isr = 0;
    this.osr = 0;
    this.tx = [];
    this.rx = [];
    /** Divider: cycle k of this machine ends at edge start + floor(k * divisor / 256). */
    this.start = this.pio.clock.edge + 1;
    this.divisor = 256;
    this.clkdiv = 0x10000;
    this.writeExecctrl(0x1f000);
    this.shiftctrl = 0xc0000;
    this.writeShiftctrl(0xc0000);
    this.writePinctrl(0x14000000);
    this.restart();
  }

  /** What CTRL.SM_RESTART clears (pc, x, y and osr stay). */
  restart() {
    this.isr = 0;
    this.isrCount = 0;
    this.osrCount = 32;
    this.raised = false;
    /** Instruction from OUT or MOV EXEC, and one written to INSTR; -1: none. */
    this.executee = -1;
    this.begun = false;
    this.forced = -1;
    this.forcedBegun = false;
    this.forcedEdge = Infinity;
    this.forcedStall = 0;
    this.stall = 0;
    this.waitPin = 0;
    this.delayLeft = 0;
    this.refillEdge = Infinity;
    this.nextEdge = this.enabled ? this.cycleAfter(this.pio.clock.edge) : Infinity;
    this.scheduleRefill(this.pio.clock.edge);
    this.pio.watch();
  }

  // --- clock divider -------------------------------------------------------------------------------------------

  endOfCycle(k) {
    return this.start + (this.divisor === 256 ? k : Math.floor((k * this.divisor) / 256));
  }

  /** Number of the first cycle that ends after `edge`. */
  cycleNumberAfter(edge) {
    if (edge < this.start) return 0;
    if (this.divisor === 256) return edge - this.start + 1;
    let k = Math.floor(((edge - this.start) * 256) / this.divisor);
    while (this.endOfCycle(k) <= edge) k += 1;
    return k;
  }

  cycleAfter(edge) {
    return this.endOfCycle(this.cycleNumberAfter(edge));
  }

  writeClkdiv(value) {
    const edge = this.pio.clock.edge;
    const whole = value >>> 16;
    const fraction = (value >>> 8) & 0xff;
    if (!whole && fraction) this.pio.fail(`SM${this.index}_CLKDIV: INT 0 (65536) with FRAC ${fraction}; FRAC must be 0 then`);
    this.clkdiv = (value & 0xffffff00) >>> 0;
    const start = this.cycleAfter(edge);
    const delay = this.enabled && this.nextEdge !== Infinity ? this.cycleNumberAfter(this.nextEdge - 1) - this.cycleNumberAfter(edge) : 0;
    this.divisor = (whole || 65536) * 256 + fraction;
    this.start = start;
    if (this.enabled && this.nextEdge !== Infinity) this.nextEdge = this.endOfCycle(delay);
  }

  restartDivider() {
    const edge = this.pio.clock.edge;
    const delay = this.enabled && this.nextEdge !== Infinity ? this.cycleNumberAfter(this.nextEdge - 1) - this.cycleNumberAfter(edge) : 0;
    this.start = edge + 1;
    if (this.enabled && this.nextEdge !== Infinity) this.nextEdge = this.endOfCycle(delay);
  }

  setEnabled(enabled) {
    if (enabled === this.enabled) return;
    const edge = this.pio.clock.edge;
    this.enabled = enabled;
    if (enabled) {
      this.nextEdge = this.endOfCycle(this.cycleNumberAfter(edge) + this.delayLeft);
      this.delayLeft = 0;
      this.scheduleRefill(edge);
    } else {
      this.delayLeft = this.nextEdge === Infinity ? 0 : this.cycleNumberAfter(this.nextEdge - 1) - this.cycleNumberAfter(edge);
      this.nextEdge = Infinity;
      this.refillEdge = Infinity;
      this.stall = 0;
      this.pio.watch();
    }
  }

  // --- configuration -------------------------------------------------------------------------------------------

  writeExecctrl(value) {
    if (value & (3 << 17))
      this.pio.fail(`SM${this.index}_EXECCTRL 0x${(value >>> 0).toString(16)}: OUT_STICKY and INLINE_OUT_EN are not modelled`);
    this.execctrl = (value & 0x7fffff9f) >>> 0;
    this.sideEnable = (value >>> 30) & 1;
    this.sideToDirections = ((value >>> 29) & 1) === 1;
    this.jumpPin = (value >>> 24) & 31;
    this.wrapTop = (value >>> 12) & 31;
    this.wrapBottom = (value >>> 7) & 31;
    this.#sideSet();
  }

  writeShiftctrl(value) {
    const joins = (value ^ this.shiftctrl) >>> 30;
    this.shiftctrl = (value & 0xffff0000) >>> 0;
    this.autopush = ((value >>> 16) & 1) === 1;
    this.autopull = ((value >>> 17) & 1) === 1;
    this.inRight = ((value >>> 18) & 1) === 1;
    this.outRight = ((value >>> 19) & 1) === 1;
    this.pushThreshold = (value >>> 20) & 31 || 32;
    this.pullThreshold = (value >>> 25) & 31 || 32;
    const join = value >>> 30;
    if (join === 3) this.pio.fail(`SM${this.index}_SHIFTCTRL: FJOIN_TX and FJOIN_RX both set`);
    this.txDepth = [FIFO_DEPTH, 2 * FIFO_DEPTH, 0][join];
    this.rxDepth = [FIFO_DEPTH, 0, 2 * FIFO_DEPTH][join];
    if (joins) {
      this.tx = [];
      this.rx = [];
    }
  }

  writePinctrl(value) {
    this.pinctrl = value >>> 0;
    this.outBase = value & 31;
    this.setBase = (value >>> 5) & 31;
    this.sideBase = (value >>> 10) & 31;
    this.inBase = (value >>> 15) & 31;
    this.outCount = (value >>> 20) & 63;
    this.setCount = (value >>> 26) & 7;
    this.sideCount = value >>> 29;
    if (this.outCount > 32 || this.setCount > 5 || this.sideCount > 5) {
      this.pio.fail(`SM${this.index}_PINCTRL 0x${(value >>> 0).toString(16)}: at most 32 pins for OUT, 5 for SET, 5 bits for side-set`);
    }
    this.outMask = rotateLeft(maskOf(this.outCount), this.outBase);
    this.setMask = rotateLeft(maskOf(this.setCount), this.setBase);
    this.#sideSet();
  }

  #sideSet() {
    this.delayMask = maskOf(5 - this.sideCount);
    this.sideBits = Math.max(0, this.sideCount - this.sideEnable);
    this.sideMask = rotateLeft(maskOf(this.sideBits), this.sideBase);
  }

  // --- FIFOs, seen from the bus --------------------------------------------------------------------------------

  push(value) {
    if (this.tx.length >= this.txDepth) {
      this.pio.fdebug |= 1 << (FDEBUG_TXOVER + this.index);
      this.pio.rp2040.report.warn(this.pio.name, `TXF${this.index} written while full; the word is lost`);
      return;
    }
    this.tx.push(value);
    this.#wake(FOR_TX);
    this.scheduleRefill(this.pio.clock.edge);
  }

  pop() {
    if (!this.rx.length) {
      this.pio.fdebug |= 1 << (FDEBUG_RXUNDER + this.index);
      this.pio.rp2040.report.warn(this.pio.name, `RXF${this.index} read while empty`);
      return 0;
    }
    const value = this.rx.shift();
    this.#wake(FOR_RX);
    return value >>> 0;
  }

  /** Autopull does not wait for the next OUT: it refills in the next cycle. */
  scheduleRefill(edge) {
    if (this.autopull && this.enabled && this.osrCount >= this.pullThreshold && this.tx.length && this.refillEdge === Infinity) {
      this.refillEdge = this.cycleAfter(edge);
    }
  }

  #wake(reason) {
    const { edge } = this.pio.clock;
    if (this.forcedStall & reason) this.forcedEdge = edge + 1;
    if (this.stall & reason) this.nextEdge = Math.min(this.nextEdge, this.cycleAfter(edge));
  }

  flagsChanged() {
    this.#wake(FOR_FLAG);
  }

  /** `visible`: the first edge that sees the change. */
  pinsChanged(changed, visible) {
    if (!((this.waitPin >= 0 ? 1 << this.waitPin : 0) & changed)) return;
    if (this.forcedStall & FOR_PIN) this.forcedEdge = Math.min(this.forcedEdge, visible);
    if (this.stall & FOR_PIN) this.nextEdge = Math.min(this.nextEdge, this.cycleAfter(visible - 1));
  }

  get watchedPins() {
    return (this.stall | this.forcedStall) & FOR_PIN ? 1 << this.waitPin : 0;
  }

  get dueEdge() {
    const own = this.nextEdge < this.refillEdge ? this.nextEdge : this.refillEdge;
    return own < this.forcedEdge ? own : this.forcedEdge;
  }

  // --- execution -----------------------------------------------------------------------------------------------

  force(instruction) {
    this.forced = instruction;
    this.forcedStall = 0;
    this.forcedBegun = false;
    this.raised = false;
    this.forcedEdge = this.pio.clock.edge + 1;
  }

  /** Everything this machine does at `edge`, which is its dueEdge. */
  act(edge) {
    if (this.forcedEdge === edge) {
      this.forcedEdge = Infinity;
      this.#actForced(edge);
    } else if (this.nextEdge === edge) this.#actNext(edge);
    if (this.refillEdge <= edge) {
      this.refillEdge = Infinity;
      this.#refill();
    }
  }

  #actForced(edge) {
    const ended = this.#execute(this.forced, edge, this.forcedBegun);
    this.forcedBegun = ended !== DONE;
    if (ended >= 0) {
      this.forcedStall = ended;
      this.nextEdge = Infinity;
    } else if (ended === AGAIN) {
      this.forcedEdge = edge + 1;
      if (this.nextEdge <= edge) this.nextEdge = Infinity;
    } else {
      this.forced = -1;
      this.forcedStall = 0;
      if (this.newExecutee >= 0) this.executee = this.newExecutee;
      if (this.jumped >= 0) this.pc = this.jumped;
      if (this.enabled && (this.nextEdge <= edge || this.nextEdge === Infinity)) {
        this.stall = 0;
        this.raised = false;
        this.begun = false;
        this.nextEdge = this.cycleAfter(edge);
      }
    }
    this.pio.watch();
  }

  #actNext(edge) {
    const instruction = this.executee >= 0 ? this.executee : this.pio.memory[this.pc];
    const stalledBefore = this.stall;
    const ended = this.#execute(instruction, edge, this.begun);
    this.begun = ended !== DONE;
    if (ended >= 0) {
      this.stall = ended;
      this.nextEdge = Infinity;
    } else if (ended === AGAIN) {
      this.stall = 0;
      this.nextEdge = this.cycleAfter(edge);
    } else {
      this.stall = 0;
      const wasExecutee = this.executee >= 0;
      this.executee = this.newExecutee;
      if (this.jumped >= 0) this.pc = this.jumped;
      else if (!wasExecutee) this.pc = this.pc === this.wrapTop ? this.wrapBottom : (this.pc + 1) & 31;
      const delay = this.newExecutee >= 0 ? 0 : (instruction >>> 8) & this.delayMask;
      this.nextEdge = delay || this.divisor !== 256 ? this.endOfCycle(this.cycleNumberAfter(edge) + delay) : edge + 1;
    }
    if ((stalledBefore | this.stall) & FOR_PIN) this.pio.watch();
  }

  #refill() {
    if (!this.autopull || this.osrCount < this.pullThreshold || !this.tx.length) return;
    this.#pull();
  }

  #pull() {
    this.osr = this.tx.shift();
    this.osrCount = 0;
    this.pio.pulled(this.index);
  }

  /** Returns DONE, AGAIN (next cycle) or what to wait for; sets `jumped` (address or -1) and `newExecutee`. */
  #execute(instruction, edge, begun) {
    this.jumped = -1;
    this.newExecutee = -1;
    const argument = instruction & 31;
    const which = (instruction >>> 5) & 7;
    let ended = DONE;
    switch (instruction >>> 13) {
      case 0:
        if (this.#condition(which, edge)) this.jumped = argument;
        break;
      case 1:
        ended = this.#wait(which, argument, edge);
        break;
      case 2:
        ended = this.#in(which, argument || 32, edge);
        break;
      case 3:
        ended = this.#out(which, argument || 32);
        break;
      case 4:
        if (argument) this.#reserved(instruction);
        ended = which & 4 ? this.#pullInstruction(which) : this.#pushInstruction(which);
        break;
      case 5:
        this.#mov(instruction, edge);
        break;
      case 6:
        if (which & 4) this.#reserved(instruction);
        ended = this.#irq(which, argument);
        break;
      default:
        this.#put(SET_TO[which] ?? this.#reserved(instruction), argument, this.setMask, this.setBase);
    }
    if (this.sideBits && !begun) this.#sideSetPins(instruction);
    return ended;
  }

  #reserved(instruction) {
    this.pio.fail(`state machine ${this.index} at ${this.pc}: instruction 0x${instruction.toString(16).padStart(4, '0')} is reserved`);
  }

  #sideSetPins(instruction) {
    const field = (instruction >>> 8) & 31;
    if (this.sideEnable && !(field & 16)) return;
    const value = (field >>> (5 - this.sideCount)) & maskOf(this.sideBits);
    this.pio.write(this.sideToDirections, this.sideMask, rotateLeft(value, this.sideBase));
  }

  #condition(which, edge) {
    switch (which) {
      case 0:
        return true;
      case 1:
        return this.x === 0;
      case 2:
        this.x = (this.x - 1) | 0;
        return this.x !== -1;
      case 3:
        return this.y === 0;
      case 4:
        this.y = (this.y - 1) | 0;
        return this.y !== -1;
      case 5:
        return this.x !== this.y;
      case 6:
        return ((this.pio.inputs(edge) >>> this.jumpPin) & 1) === 1;
      default:
        return this.osrCount < this.pullThreshold;
    }
  }

  #flag(argument) {
    return argument & 16 ? (argument & 4) | ((argument + this.index) & 3) : argument & 7;
  }

  #wait(which, argument, edge) {
    const wanted = which >>> 2;
    const source = which & 3;
    if (source === 2) {
      if (argument & 8) this.#reserved(0x2000 | (which << 5) | argument);
      const bit = 1 << this.#flag(argument);
      if (((this.pio.flags & bit) !== 0) !== (wanted === 1)) return FOR_FLAG;
      if (wanted) this.pio.lowered |= bit;
      return DONE;
    }
    if (source === 3) this.#reserved(0x2000 | (which << 5) | argument);
    this.waitPin = source === 0 ? argument : (argument + this.inBase) & 31;
    if (((this.pio.inputs(edge) >>> this.waitPin) & 1) === wanted) return DONE;
    return this.pio.inputsUnderWay(edge) ? AGAIN : FOR_PIN;
  }

  #pins(edge) {
    return rotateLeft(this.pio.inputs(edge), (32 - this.inBase) & 31);
  }

  /** Source of IN and MOV; undefined where it is reserved. */
  #source(source, edge) {
    if (source === 0) return this.#pins(edge);
    return source === 3 ? 0 : this[SOURCES[source]];
  }

  #status() {
    const level = this.execctrl & 16 ? this.rx.length : this.tx.length;
    return level < (this.execctrl & 15) ? -1 : 0;
  }

  #in(source, bits, edge) {
    const count = Math.min(32, this.isrCount + bits);
    const full = this.autopush && count >= this.pushThreshold;
    if (full && this.rx.length >= this.rxDepth) {
      this.pio.fdebug |= 1 << (FDEBUG_RXSTALL + this.index);
      return FOR_RX;
    }
    const value = this.#source(source, edge) ?? this.#reserved(0x4000 | (source << 5) | (bits & 31));
    if (bits === 32) this.isr = value;
    else if (this.inRight) this.isr = (this.isr >>> bits) | (value << (32 - bits));
    else this.isr = (this.isr << bits) | (value & maskOf(bits));
    this.isrCount = count;
    if (full) this.#push();
    return DONE;
  }

  #push() {
    this.rx.push(this.isr);
    this.isr = 0;
    this.isrCount = 0;
    this.pio.pushed(this.index);
  }

  #out(destination, bits) {
    if (this.autopull && this.osrCount >= this.pullThreshold) {
      if (!this.tx.length) {
        this.pio.fdebug |= 1 << (FDEBUG_TXSTALL + this.index);
        return FOR_TX;
      }
      this.#pull();
      return AGAIN;
    }
    let value;
    if (bits === 32) {
      value = this.osr;
      this.osr = 0;
    } else if (this.outRight) {
      value = this.osr & maskOf(bits);
      this.osr >>>= bits;
    } else {
      value = this.osr >>> (32 - bits);
      this.osr <<= bits;
    }
    this.osrCount = Math.min(32, this.osrCount + bits);
    this.#put(OUT_TO[destination], value, this.outMask, this.outBase, bits);
    this.#refill();
    return DONE;
  }

  #pushInstruction(which) {
    if (which & 2 && this.isrCount < this.pushThreshold) return DONE;
    if (this.rx.length >= this.rxDepth) {
      this.pio.fdebug |= 1 << (FDEBUG_RXSTALL + this.index);
      if (which & 1) return FOR_RX;
      this.isr = 0;
      this.isrCount = 0;
      return DONE;
    }
    this.#push();
    return DONE;
  }

  #pullInstruction(which) {
    if ((which & 2 || this.autopull) && this.osrCount < this.pullThreshold) return DONE;
    if (!this.tx.length) {
      if (which & 1) {
        this.pio.fdebug |= 1 << (FDEBUG_TXSTALL + this.index);
        return FOR_TX;
      }
      this.osr = this.x;
      this.osrCount = 0;
      return DONE;
    }
    this.#pull();
    return DONE;
  }

  #mov(instruction, edge) {
    let value = (instruction & 7) === 5 ? this.#status() : (this.#source(instruction & 7, edge) ?? this.#reserved(instruction));
    const how = (instruction >>> 3) & 3;
    if (how === 3) this.#reserved(instruction);
    if (how === 1) value = ~value;
    else if (how === 2) value = reverse(value);
    this.#put(MOV_TO[(instruction >>> 5) & 7] ?? this.#reserved(instruction), value, this.outMask, this.outBase);
  }

  /** What OUT, MOV and SET write; `bits` are then in a shift register. */
  #put(where, value, mask, base, bits = 0) {
    if (where === 'pins' || where === 'pindirs') this.pio.write(where === 'pindirs', mask, rotateLeft(value, base));
    else if (where === 'pc') this.jumped = value & 31;
    else if (where === 'exec') this.newExecutee = value & 0xffff;
    else if (where !== 'null') {
      this[where] = value | 0;
      if (where === 'isr') this.isrCount = bits;
      else if (where === 'osr') this.osrCount = bits;
    }
  }

  #irq(which, argument) {
    if (argument & 8) this.#reserved(0xc000 | (which << 5) | argument);
    const bit = 1 << this.#flag(argument);
    if (which & 2) {
      this.pio.lowered |= bit;
      return DONE;
    }
    if (!this.raised) {
      this.pio.raised |= bit;
      if (!(which & 1)) return DONE;
      this.raised = true;
      return FOR_FLAG;
    }
    if (this.pio.flags & bit) return FOR_FLAG;
    this.raised = false;
    return DONE;
  }

  // --- registers -----------------------------------------------------------------------------------------------

  readRegister(offset) {
    const execctrl = (this.execctrl | (this.forcedStall ? 0x80000000 : 0)) >>> 0;
    return [this.clkdiv, execctrl, this.shiftctrl, this.pc, this.pio.memory[this.pc], this.pinctrl][offset >> 2];
  }

  writeRegister(offset, value) {
    if (offset === 0x00) this.writeClkdiv(value);
    else if (offset === 0x04) this.writeExecctrl(value);
    else if (offset === 0x08) {
      this.writeShiftctrl(value);
      this.scheduleRefill(this.pio.clock.edge);
    } else if (offset === 0x10) this.force(value & 0xffff);
    else if (offset === 0x14) this.writePinctrl(value);
  }
}
