/**
 * The Cortex-M0+ of rp2040js, made strict and faster.
 *
 * - Memory: any unaligned access, any store to flash or ROM and any address without a device fails the run.
 * - Frequent instructions execute in an own decoder, instructions.mjs (same results and cycles, checked against the
 *   original by a test); everything else goes to rp2040js.
 * - Cycles follow the Cortex-M0+ Technical Reference Manual where rp2040js is short: PUSH with lr and POP
 *   with pc cost one more, exception entry 15 and exception return 13.
 * - WFI with PRIMASK set wakes without entering the handler, and does not sleep if an enabled interrupt is
 *   already pending (ARMv6-M Architecture Reference Manual, B1.5.18).
 * - SEV sets the event register of both cores, and ends their WFE (B1.5.18).
 */
import { RP2040 } from 'rp2040js';
import { execute, RAM_BASE, RAM_BYTES } from './instructions.mjs';
import { MemoryFault, Mpu } from './mpu.mjs';

export { RAM_BASE, RAM_BYTES, RP2040 };

export const FLASH_BASE = 0x10000000;
export const FLASH_BYTES = 2 * 1024 * 1024;

const CortexM0Core = new RP2040().core.constructor;

const EXCEPTION_ENTRY_CYCLES = 15;
const EXCEPTION_RETURN_CYCLES = 13;
const HARD_FAULT = 3;
const [WFE, WFI, SEV] = [0xbf20, 0xbf30, 0xbf40];

export class StrictCore extends CortexM0Core {
  /** @param id 0 or 1 */
  constructor(chip, id) {
    super(chip);
    this.chip = chip;
    this.id = id;
    this.scr = 0;
    /** Address of the instruction that rp2040js executes. */
    this.at = null;
    /** While `waiting`: by WFE. */
    this.waitsForEvent = false;
    this.ram8 = chip.sram;
    this.ram16 = new Uint16Array(chip.sram.buffer);
    this.ram32 = new Int32Array(chip.sram.buffer);
    this.signed = new Int32Array(this.registers.buffer);
    this.mpu = new Mpu(chip, () => this.guard(this.mpu.denied, this.mpu.readOnlyBytes));
    this.guard([], 0);
  }

  onEvent() {
    if (this.waiting && this.waitsForEvent) this.waiting = false;
    else this.eventRegistered = true;
  }

  /** The ranges of addresses that fault, one of them in SRAM at most, and how many bytes of SRAM are not to be written. */
  guard(ranges, readOnlyBytes) {
    this.readOnlyBytes = readOnlyBytes;
    this.isGuarded = ranges.length > 0;
    const [[first, bytes] = [RAM_BASE, 0], more] = ranges.filter(([at]) => at >>> 28 === RAM_BASE >>> 28);
    if (more) this.chip.fail('MPU', 'more than one region in SRAM is not modelled');
    this.guardFrom = first - RAM_BASE;
    this.guardBytes = bytes;
    /** Bytes of SRAM before any guard. */
    this.codeBytes = bytes ? this.guardFrom : RAM_BYTES;
  }

  #hardFault() {
    if (this.IPSR === HARD_FAULT) this.chip.fail('core', 'a fault in the fault handler: the core locks up');
    this.guard([], 0);
    this.waiting = false;
    this.exceptionEntry(HARD_FAULT);
  }

  reset() {}

  readUint32(address) {
    const offset = (address - RAM_BASE) >>> 0;
    if ((offset - this.guardFrom) >>> 0 < this.guardBytes) throw new MemoryFault();
    if (offset < RAM_BYTES && (offset & 3) === 0) return this.ram32[offset >>> 2];
    return this.chip.busRead(address >>> 0, 4);
  }

  readUint16(address) {
    const offset = (address - RAM_BASE) >>> 0;
    if ((offset - this.guardFrom) >>> 0 < this.guardBytes) throw new MemoryFault();
    if (offset < RAM_BYTES && (offset & 1) === 0) return this.ram16[offset >>> 1];
    return this.chip.busRead(address >>> 0, 2);
  }

  readUint8(address) {
    const offset = (address - RAM_BASE) >>> 0;
    if ((offset - this.guardFrom) >>> 0 < this.guardBytes) throw new MemoryFault();
    if (offset < RAM_BYTES) return this.ram8[offset];
    return this.chip.busRead(address >>> 0, 1);
  }

  writeUint32(address, value) {
    const offset = (address - RAM_BASE) >>> 0;
    if (offset < this.readOnlyBytes || (offset - this.guardFrom) >>> 0 < this.guardBytes) throw new MemoryFault();
    if (offset < RAM_BYTES && (offset & 3) === 0) this.ram32[offset >>> 2] = value;
    else this.chip.busWrite(address >>> 0, value >>> 0, 4);
  }

  writeUint16(address, value) {
    const offset = (address - RAM_BASE) >>> 0;
    if (offset < this.readOnlyBytes || (offset - this.guardFrom) >>> 0 < this.guardBytes) throw new MemoryFault();
    if (offset < RAM_BYTES && (offset & 1) === 0) this.ram16[offset >>> 1] = value;
    else this.chip.busWrite(address >>> 0, value & 0xffff, 2);
  }

  writeUint8(address, value) {
    const offset = (address - RAM_BASE) >>> 0;
    if (offset < this.readOnlyBytes || (offset - this.guardFrom) >>> 0 < this.guardBytes) throw new MemoryFault();
    if (offset < RAM_BYTES) this.ram8[offset] = value;
    else this.chip.busWrite(address >>> 0, value & 0xff, 1);
  }

  exceptionEntry(number) {
    super.exceptionEntry(number);
    const target = this.registers[15];
    if ((target & 1) === 0) {
      this.chip.fail('core', `vector ${number} is 0x${target.toString(16)}, which is not a Thumb address`);
    }
    this.registers[15] = target & ~1;
    this.cycles += EXCEPTION_ENTRY_CYCLES;
  }

  exceptionReturn(value) {
    super.exceptionReturn(value);
    this.cycles += EXCEPTION_RETURN_CYCLES;
  }

  BXWritePC(address) {
    if ((address & 1) === 0 && address >>> 28 !== 15) {
      this.chip.fail('core', `branch to 0x${(address >>> 0).toString(16)} without the Thumb bit`);
    }
    super.BXWritePC(address);
  }

  checkForInterrupts() {
    if (!this.waiting) {
      if (this.PM && !this.pendingNMI) {
        this.interruptsUpdated = false;
        return false;
      }
      return super.checkForInterrupts();
    }
    if (!this.somethingPending()) return false;
    this.waiting = false;
    this.interruptsUpdated = true;
    return true;
  }

  /** True if an exception is pending that ends WFI: enabled, and of higher priority than the running one. */
  somethingPending() {
    if (this.pendingNMI || this.pendingSystick || this.pendingPendSV || this.pendingSVCall) return true;
    const pending = this.pendingInterrupts & this.enabledInterrupts;
    if (pending === 0) return false;
    const active = this.exceptionPriority(this.IPSR);
    for (let priority = 0; priority < active; priority++) {
      if (pending & this.interruptPriorities[priority]) return true;
    }
    return false;
  }

  get wakeable() {
    return this.enabledInterrupts !== 0 || this.rp2040.ppb.systickIntEnable;
  }

  fetch(pc) {
    const offset = (pc - FLASH_BASE) >>> 0;
    const inRam = (pc - RAM_BASE) >>> 0;
    if (inRam < this.codeBytes) return this.ram16[inRam >>> 1];
    if (this.isGuarded && this.mpu.denies(pc >>> 0)) throw new MemoryFault();
    if (inRam < RAM_BYTES) return this.ram16[inRam >>> 1];
    if (offset < FLASH_BYTES && this.chip.xipReady) return this.chip.flash16[offset >>> 1];
    return this.chip.busRead(pc & ~1, 2);
  }

  /** What `execute` kept in variables: N is negative < 0, Z is zero === 0, V is overflow < 0. */
  keep(pc, cycles, negative, zero, carry, overflow) {
    this.signed[15] = pc;
    this.cycles = cycles;
    this.N = negative < 0;
    this.Z = zero === 0;
    this.C = carry !== 0;
    this.V = overflow < 0;
  }

  executeInstruction() {
    const before = this.cycles;
    this.execute(before + 1, NEVER);
    return this.cycles - before;
  }

  /** Execute until `stop` cycles, sleep, a fault, or `time.earliestChanged`. */
  execute(stop, time) {
    try {
      execute(this, stop, time);
    } catch (error) {
      if (!(error instanceof MemoryFault)) throw error;
      this.#hardFault();
    }
  }

  /** An instruction that is not one of `execute`'s, or whose access is not one to SRAM, by rp2040js, whose SEV does nothing. */
  executeOther(op) {
    const r = this.signed;
    if (op >>> 12 === 6) {
      // LDR and STR with an offset, the most frequent: without a second decoding
      const address = (r[(op >>> 3) & 7] + ((op >>> 4) & 0x7c)) >>> 0;
      const cycles = 1 + this.cyclesIO(address, !(op & 0x800));
      if (op & 0x800) r[op & 7] = this.readUint32(address);
      else this.writeUint32(address, r[op & 7]);
      r[15] += 2;
      this.cycles += cycles;
      return;
    }
    this.at = r[15];
    try {
      super.executeInstruction();
    } catch (error) {
      if (error instanceof MemoryFault) r[15] = this.at; // which the fault reports
      throw error;
    } finally {
      this.at = null;
    }
    if ((op & 0xf700) === 0xb500) this.cycles += 1;
    else if (op === SEV) this.chip.sendEvent();
    else if (op === WFE || op === WFI) this.waitsForEvent = op === WFE;
  }
}

const NEVER = Object.freeze({ earliestChanged: false });
