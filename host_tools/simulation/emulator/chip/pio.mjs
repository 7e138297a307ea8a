/**
 * PIO block of the RP2040 (datasheet chapter 3), in lock-step with emulated time.
 *
 * A state machine runs at the edges of clk_sys that its divider lets through: what it does in a cycle shows at the
 * edge that ends the cycle. Only edges at which something happens are visited: a stalled machine, or one that counts
 * down a delay, costs nothing until data, a pin or a flag that it waits for changes. Inputs pass two flip-flops unless
 * bypassed: an instruction sees a pin as it was two cycles before its edge. Within one edge every machine sees the
 * flags and pins of before it; of two that write one pin the higher-numbered wins.
 *
 * The first cycle of a divider is the one after its restart; with a fraction the cycles are floor(k * divisor).
 * A stalled instruction does its side-set in its first cycle. Autopull refills in cycles of an enabled machine only. An
 * instruction written to INSTR takes the next cycle of clk_sys.
 *
 * Fails the run: encodings and field values that the datasheet reserves, OUT_STICKY and INLINE_OUT_EN (not modelled).
 * Warns: a transmit FIFO written while full, a receive FIFO read while empty.
 */
import { BasePeripheral } from 'rp2040js';
import { FIFO_DEPTH, StateMachine } from './pio_machine.mjs';

const MACHINES = 4;
const PIN_MASK = 0x3fffffff;

const CTRL = 0x00;
const FSTAT = 0x04;
const FDEBUG = 0x08;
const FLEVEL = 0x0c;
const TXF0 = 0x10;
const RXF0 = 0x20;
const IRQ = 0x30;
const IRQ_FORCE = 0x34;
const INPUT_SYNC_BYPASS = 0x38;
const DBG_PADOUT = 0x3c;
const DBG_PADOE = 0x40;
const DBG_CFGINFO = 0x44;
const INSTR_MEM0 = 0x48;
const SM0 = 0xc8;
const SM_STRIDE = 0x18;
const INTR = 0x128;

export class Pio extends BasePeripheral {
  constructor(chip, index) {
    super(chip, `PIO${index}`);
    this.index = index;
    this.clock = chip.sysClock;
    this.memory = new Uint16Array(32);
    this.alarm = chip.clock.createAlarm(() => this.#atEdge());
    this.machines = [];
    this.reset();
  }

  reset() {
    this.alarm.cancel();
    this.dueEdge = Infinity;
    /** Named as rp2040js's pins want them. */
    this.pinValues = 0;
    this.pinDirections = 0;
    this.driven = { values: 0, directions: 0 };
    this.flags = 0;
    this.raised = 0;
    this.lowered = 0;
    this.fdebug = 0;
    this.bypass = 0;
    this.watchedPins = 0;
    this.pending = [true, true];
    this.interrupts = [
      { enable: 0, force: 0 },
      { enable: 0, force: 0 },
    ];
    this.inputsEdge = -1;
    this.memory.fill(0);
    if (this.machines.length) for (const m of this.machines) m.reset();
    else this.machines = Array.from({ length: MACHINES }, (_, i) => new StateMachine(this, i));
    this.#interrupt();
  }

  fail(message) {
    this.rp2040.fail(this.name, message);
  }

  /** clk_sys changed: edges lie elsewhere now. */
  clockChanged() {
    if (this.dueEdge !== Infinity) this.alarm.scheduleAt(this.clock.ns(this.dueEdge));
  }

  // --- what the machines use -----------------------------------------------------------------------------------

  write(toDirections, mask, value) {
    if (toDirections) this.pinDirections = (this.pinDirections & ~mask) | (value & mask);
    else this.pinValues = (this.pinValues & ~mask) | (value & mask);
  }

  inputs(edge) {
    if (edge !== this.inputsEdge) {
      this.inputsEdge = edge;
      const { pins } = this.rp2040;
      this.inputsThen = pins.before(this.clock.ns(edge - 2));
      if (this.bypass) this.inputsThen = (this.inputsThen & ~this.bypass) | (pins.before(this.clock.ns(edge)) & this.bypass);
    }
    return this.inputsThen;
  }

  /** A pin changed, and the change is still in the synchronisers at this edge. */
  inputsUnderWay(edge) {
    const { pins } = this.rp2040;
    return pins.changed_ns[pins.newest] >= this.clock.ns(edge - 2);
  }

  pulled(machine) {
    this.rp2040.dma.request(8 * this.index + machine);
    this.#interrupt();
  }

  pushed(machine) {
    this.rp2040.dma.request(8 * this.index + 4 + machine);
    this.#interrupt();
  }

  /** A machine began or ended waiting for a pin. */
  watch() {
    this.watchedPins = this.machines.reduce((pins, m) => pins | m.watchedPins, 0);
  }

  inputsChanged(changed, t_ns) {
    const passed = this.clock.origin_edge + Math.floor((t_ns - this.clock.origin_ns) / this.clock.period_ns + 1e-6);
    for (const m of this.machines) {
      const pin = m.watchedPins & changed;
      if (pin) m.pinsChanged(changed, passed + (this.bypass & pin ? 1 : 3));
    }
    this.#schedule();
  }

  /** How many transfers DMA request `treq` (0..3: transmit, 4..7: receive) allows now. */
  requests(treq) {
    const m = this.machines[treq & 3];
    return treq & 4 ? m.rx.length : m.txDepth - m.tx.length;
  }

  // --- time ----------------------------------------------------------------------------------------------------

  #schedule() {
    let due = Infinity;
    for (const m of this.machines) {
      const own = m.dueEdge;
      if (own < due) due = own;
    }
    if (due === this.dueEdge) return;
    this.dueEdge = due;
    if (due === Infinity) this.alarm.cancel();
    else this.alarm.scheduleAt(this.clock.ns(due));
  }

  #atEdge() {
    const edge = this.dueEdge;
    this.dueEdge = Infinity;
    for (const m of this.machines) if (m.dueEdge <= edge) m.act(edge);
    this.#settle();
    this.#schedule();
  }

  /** Flags and pins take what the machines did at this edge. */
  #settle() {
    if (this.raised | this.lowered) {
      this.flags = (this.flags & ~this.lowered) | this.raised;
      this.raised = 0;
      this.lowered = 0;
      for (const m of this.machines) m.flagsChanged();
      this.#interrupt();
    }
    if (this.pinValues !== this.driven.values || this.pinDirections !== this.driven.directions) {
      this.driven.values = this.pinValues;
      this.driven.directions = this.pinDirections;
      this.rp2040.pins.drive();
    }
  }

  // --- registers -----------------------------------------------------------------------------------------------

  get #rawInterrupts() {
    let raw = (this.flags & 15) << 8;
    for (const m of this.machines) {
      if (m.rx.length) raw |= 1 << m.index;
      if (m.tx.length < m.txDepth) raw |= 16 << m.index;
    }
    return raw;
  }

  #interrupt() {
    for (let line = 0; line < 2; line++) {
      const { enable, force } = this.interrupts[line];
      const pending = (enable && (this.#rawInterrupts & enable) !== 0) || force !== 0;
      if (pending === this.pending[line]) continue;
      this.pending[line] = pending;
      this.rp2040.setInterrupt(7 + 2 * this.index + line, pending);
    }
  }

  readUint32(offset) {
    if (offset >= TXF0 && offset < RXF0) return 0;
    if (offset >= RXF0 && offset < IRQ) {
      const value = this.machines[(offset - RXF0) >> 2].pop();
      this.#interrupt();
      this.#schedule();
      return value;
    }
    if (offset >= INSTR_MEM0 && offset < SM0) return 0;
    if (offset >= SM0 && offset < INTR) {
      const at = offset - SM0;
      return this.machines[Math.floor(at / SM_STRIDE)].readRegister(at % SM_STRIDE);
    }
    const each = (bits) => this.machines.reduce((all, m) => all | bits(m), 0) >>> 0;
    switch (offset) {
      case CTRL:
        return each((m) => (m.enabled ? 1 << m.index : 0));
      case FSTAT:
        return each(
          (m) =>
            ((m.tx.length ? 0 : 1 << 24) |
              (m.tx.length >= m.txDepth ? 1 << 16 : 0) |
              (m.rx.length ? 0 : 1 << 8) |
              (m.rx.length >= m.rxDepth ? 1 : 0)) <<
            m.index,
        );
      case FDEBUG:
        return this.fdebug >>> 0;
      case FLEVEL:
        return each((m) => (m.tx.length | (m.rx.length << 4)) << (8 * m.index));
      case IRQ:
        return this.flags;
      case IRQ_FORCE:
        return 0;
      case INPUT_SYNC_BYPASS:
        return this.bypass >>> 0;
      case DBG_PADOUT:
        return (this.pinValues & PIN_MASK) >>> 0;
      case DBG_PADOE:
        return (this.pinDirections & PIN_MASK) >>> 0;
      case DBG_CFGINFO:
        return (32 << 16) | (MACHINES << 8) | FIFO_DEPTH;
      case INTR:
        return this.#rawInterrupts;
    }
    const line = offset > INTR && offset <= 0x140 ? Math.floor((offset - 0x12c) / 12) : -1;
    if (line < 0) return super.readUint32(offset);
    const { enable, force } = this.interrupts[line];
    return [enable, force, (this.#rawInterrupts & enable) | force][((offset - 0x12c) % 12) >> 2];
  }

  writeUint32(offset, value) {
    if (offset >= TXF0 && offset < RXF0) this.machines[(offset - TXF0) >> 2].push(value | 0);
    else if (offset >= RXF0 && offset < IRQ) return;
    else if (offset >= INSTR_MEM0 && offset < SM0) this.memory[(offset - INSTR_MEM0) >> 2] = value;
    else if (offset >= SM0 && offset < INTR) {
      const at = offset - SM0;
      const machine = this.machines[Math.floor(at / SM_STRIDE)];
      machine.writeRegister(at % SM_STRIDE, value);
      // A changed depth or flush changes what can be transferred.
      this.rp2040.dma.request(8 * this.index + machine.index);
    } else if (offset === CTRL) {
      for (const m of this.machines) {
        if ((value >>> (4 + m.index)) & 1) m.restart();
        if ((value >>> (8 + m.index)) & 1) m.restartDivider();
        m.setEnabled(((value >>> m.index) & 1) === 1);
      }
    } else if (offset === FDEBUG) this.fdebug &= ~this.rawWriteValue;
    else if (offset === IRQ) this.lowered |= this.rawWriteValue & 0xff;
    else if (offset === IRQ_FORCE) this.raised |= this.rawWriteValue & 0xff;
    else if (offset === INPUT_SYNC_BYPASS) this.bypass = value | 0;
    else if (offset >= 0x12c && offset < 0x144 && (offset - 0x12c) % 12 < 8) {
      const key = (offset - 0x12c) % 12 ? 'force' : 'enable';
      this.interrupts[Math.floor((offset - 0x12c) / 12)][key] = value & 0xfff;
    } else super.writeUint32(offset, value);
    this.#settle();
    this.#interrupt();
    this.#schedule();
  }
}
