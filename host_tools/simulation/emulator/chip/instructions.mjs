/**
 * The frequent instructions of the Cortex-M0+, for core.mjs: `execute` runs what only computes, branches, or loads and
 * stores in SRAM; it hands everything else to the core. Same results and cycles as rp2040js, except as stated in core.mjs.
 *
 * Cycles, pc and flags are kept in variables meanwhile. The core has them again before it does anything itself: before it
 * takes an exception, reaches what is not SRAM, or faults.
 */
export const RAM_BASE = 0x20000000;
export const RAM_BYTES = 264 * 1024;

/** Cycles in one stretch, so that they fit an integer. */
const STRETCH = 1 << 30;
/** An offset in SRAM, turned right by the bits that must be 0, is below this number if it is aligned and not beyond. */
const WORDS = RAM_BYTES >>> 2;
const HALFWORDS = RAM_BYTES >>> 1;

function bitCount(bits) {
  let count = 0;
  for (let b = bits; b; b &= b - 1) count += 1;
  return count;
}

/** Execute until `stop` cycles, sleep, or `time.earliestChanged`. */
export function execute(core, stop, time) {
  const { signed: r, ram8, ram16, ram32 } = core;
  while (core.cycles < stop && !core.waiting && !time.earliestChanged) {
    if (core.interruptsUpdated && core.checkForInterrupts()) core.waiting = false;
    const { guardFrom, guardBytes, readOnlyBytes, codeBytes } = core;
    const before = core.cycles;
    // With an interrupt to look for: one instruction.
    const most = core.interruptsUpdated ? 1 : Math.min(stop - before, STRETCH) | 0;
    let cycles = 0;
    let pc = r[15];
    let negative = core.N ? -1 : 0; // N: below 0
    let zero = core.Z ? 0 : 1; // Z: is 0
    let carry = core.C ? 1 : 0; // C: 0 or 1
    let overflow = core.V ? -1 : 0; // V: below 0
    let op = 0;
    let isOthers = false;
    do {
      const offset = (pc - RAM_BASE) >>> 0;
      if (offset < codeBytes) op = ram16[offset >>> 1];
      else {
        core.keep(pc, before + cycles, negative, zero, carry, overflow);
        op = core.fetch(pc);
      }
      switch (op >>> 11) {
        case 0: {
          // LSLS immediate
          const shift = (op >>> 6) & 31;
          const value = r[(op >>> 3) & 7];
          if (shift) carry = (value >>> (32 - shift)) & 1;
          negative = value << shift;
          zero = negative;
          r[op & 7] = negative;
          break;
        }
        case 1:
        case 2: {
          // LSRS, ASRS immediate
          const shift = (op >>> 6) & 31;
          const value = r[(op >>> 3) & 7];
          carry = (value >>> (shift ? shift - 1 : 31)) & 1;
          negative = op & 0x1000 ? value >> (shift || 31) : shift ? (value >>> shift) | 0 : 0;
          zero = negative;
          r[op & 7] = negative;
          break;
        }
        case 3: {
          // ADDS, SUBS register or 3-bit immediate
          const operand = (op >>> 6) & 7;
          const a = r[(op >>> 3) & 7];
          const given = op & 0x400 ? operand : r[operand];
          const b = op & 0x200 ? ~given : given;
          const result = (a + b + ((op >>> 9) & 1)) | 0;
          carry = ((a & b) | ((a | b) & ~result)) >>> 31;
          overflow = (a ^ result) & (b ^ result);
          negative = result;
          zero = result;
          r[op & 7] = result;
          break;
        }
        case 4: // MOVS
          negative = op & 0xff;
          zero = negative;
          r[(op >>> 8) & 7] = negative;
          break;
        case 5:
        case 6:
        case 7: {
          // CMP, ADDS, SUBS 8-bit immediate
          const d = (op >>> 8) & 7;
          const a = r[d];
          const b = op & 0x800 ? ~(op & 0xff) : op & 0xff;
          const result = (a + b + ((op >>> 11) & 1)) | 0;
          carry = ((a & b) | ((a | b) & ~result)) >>> 31;
          overflow = (a ^ result) & (b ^ result);
          negative = result;
          zero = result;
          if (op & 0x1000) r[d] = result;
          break;
        }
        case 8: {
          if (op & 0x400) {
            const kind = (op >>> 8) & 3;
            const s = (op >>> 3) & 15;
            const value = s === 15 ? pc + 4 : r[s];
            if (kind === 3) {
              // BX; an exception return and BLX are others'
              isOthers = (op & 0x87) !== 0 || !(value & 1) || value >>> 28 === 15;
              if (isOthers) break;
              pc = value & ~1;
              cycles += 2;
              continue;
            }
            const d = (op & 7) | ((op >>> 4) & 8);
            if (kind === 1) {
              const a = d === 15 ? pc + 4 : r[d];
              const b = ~value;
              const result = (a + b + 1) | 0;
              carry = ((a & b) | ((a | b) & ~result)) >>> 31;
              overflow = (a ^ result) & (b ^ result);
              negative = result;
              zero = result;
            } else if (d === 15) {
              isOthers = kind !== 2;
              if (isOthers) break;
              pc = value & ~1;
              cycles += 2;
              continue;
            } else {
              const result = kind === 2 ? value : (r[d] + value) | 0;
              r[d] = d === 13 ? result & ~3 : result;
            }
            break;
          }
          const d = op & 7;
          const m = r[(op >>> 3) & 7];
          const a = r[d];
          const kind = (op >>> 6) & 15;
          const shift = m & 0xff;
          switch (kind) {
            case 0: // ANDS
            case 8: // TST
              negative = a & m;
              break;
            case 1: // EORS
              negative = a ^ m;
              break;
            case 2: // LSLS register
              if (shift) carry = shift > 32 ? 0 : (shift === 32 ? a : a >>> (32 - shift)) & 1;
              negative = shift > 31 ? 0 : a << shift;
              break;
            case 3: // LSRS register
              if (shift) carry = shift > 32 ? 0 : (a >>> (shift - 1)) & 1;
              negative = shift > 31 ? 0 : (a >>> shift) | 0;
              break;
            case 4: // ASRS register
              if (shift) carry = (a >>> (shift > 32 ? 31 : shift - 1)) & 1;
              negative = a >> (shift > 31 ? 31 : shift);
              break;
            case 7: // RORS
              negative = shift & 31 ? (a >>> (shift & 31)) | (a << (32 - (shift & 31))) : a;
              if (shift) carry = negative >>> 31;
              break;
            case 5: // ADCS
            case 6: // SBCS
            case 9: // RSBS
            case 10: // CMP
            case 11: {
              // CMN
              const first = kind === 9 ? 0 : a;
              const second = kind === 5 || kind === 11 ? m : ~m;
              const result = (first + second + (kind < 9 ? carry : kind < 11 ? 1 : 0)) | 0;
              carry = ((first & second) | ((first | second) & ~result)) >>> 31;
              overflow = (first ^ result) & (second ^ result);
              negative = result;
              break;
            }
            case 12: // ORRS
              negative = a | m;
              break;
            case 13: // MULS
              negative = Math.imul(a, m);
              break;
            case 14: // BICS
              negative = a & ~m;
              break;
            default: // MVNS
              negative = ~m;
          }
          if (kind !== 8 && kind !== 10 && kind !== 11) r[d] = negative;
          zero = negative;
          break;
        }
        case 9: {
          // LDR literal
          const at = ((pc + 4) & ~3) + ((op & 0xff) << 2) - RAM_BASE;
          isOthers = at >>> 0 >= RAM_BYTES || (at - guardFrom) >>> 0 < guardBytes;
          if (isOthers) break;
          r[(op >>> 8) & 7] = ram32[at >>> 2];
          cycles += 1;
          break;
        }
        case 10:
        case 11: {
          // register offset
          const at = (r[(op >>> 3) & 7] + r[(op >>> 6) & 7] - RAM_BASE) >>> 0;
          const t = op & 7;
          const kind = (op >>> 9) & 7;
          isOthers = at >= RAM_BYTES || (at - guardFrom) >>> 0 < guardBytes || (kind < 3 && at < readOnlyBytes);
          if (isOthers) break;
          switch (kind) {
            case 0:
              if (at & 3) isOthers = true;
              else ram32[at >>> 2] = r[t];
              break;
            case 1:
              if (at & 1) isOthers = true;
              else ram16[at >>> 1] = r[t];
              break;
            case 2:
              ram8[at] = r[t];
              break;
            case 3:
              r[t] = (ram8[at] << 24) >> 24;
              break;
            case 4:
              if (at & 3) isOthers = true;
              else r[t] = ram32[at >>> 2];
              break;
            case 5:
              if (at & 1) isOthers = true;
              else r[t] = ram16[at >>> 1];
              break;
            case 6:
              r[t] = ram8[at];
              break;
            default:
              if (at & 1) isOthers = true;
              else r[t] = (ram16[at >>> 1] << 16) >> 16;
          }
          if (!isOthers) cycles += 1;
          break;
        }
        case 12:
        case 13:
        case 18:
        case 19: {
          // STR, LDR immediate, or relative to sp
          const isSp = op >>> 15;
          const isLoad = op & 0x800;
          const at = ((isSp ? r[13] + ((op & 0xff) << 2) : r[(op >>> 3) & 7] + ((op >>> 4) & 0x7c)) - RAM_BASE) | 0;
          isOthers = ((at >>> 2) | (at << 30)) >>> 0 >= WORDS || (at - guardFrom) >>> 0 < guardBytes || (!isLoad && at < readOnlyBytes);
          if (isOthers) break;
          const t = (isSp ? op >>> 8 : op) & 7;
          if (isLoad) r[t] = ram32[at >>> 2];
          else ram32[at >>> 2] = r[t];
          cycles += 1;
          break;
        }
        case 14:
        case 15: {
          // STRB, LDRB immediate
          const isLoad = op & 0x800;
          const at = (r[(op >>> 3) & 7] + ((op >>> 6) & 0x1f) - RAM_BASE) | 0;
          isOthers = at >>> 0 >= RAM_BYTES || (at - guardFrom) >>> 0 < guardBytes || (!isLoad && at < readOnlyBytes);
          if (isOthers) break;
          if (isLoad) r[op & 7] = ram8[at];
          else ram8[at] = r[op & 7];
          cycles += 1;
          break;
        }
        case 16:
        case 17: {
          // STRH, LDRH immediate
          const isLoad = op & 0x800;
          const at = (r[(op >>> 3) & 7] + ((op >>> 5) & 0x3e) - RAM_BASE) | 0;
          isOthers = ((at >>> 1) | (at << 31)) >>> 0 >= HALFWORDS || (at - guardFrom) >>> 0 < guardBytes || (!isLoad && at < readOnlyBytes);
          if (isOthers) break;
          if (isLoad) r[op & 7] = ram16[at >>> 1];
          else ram16[at >>> 1] = r[op & 7];
          cycles += 1;
          break;
        }
        case 20: // ADR
          r[(op >>> 8) & 7] = ((pc + 4) & ~3) + ((op & 0xff) << 2);
          break;
        case 21: // ADD register, sp, immediate
          r[(op >>> 8) & 7] = r[13] + ((op & 0xff) << 2);
          break;
        case 22:
        case 23: {
          const kind = (op >>> 8) & 15;
          if (kind === 0) r[13] += op & 0x80 ? -((op & 0x7f) << 2) : (op & 0x7f) << 2;
          else if (kind === 2) {
            const value = r[(op >>> 3) & 7];
            const which = (op >>> 6) & 3;
            r[op & 7] = which === 0 ? (value << 16) >> 16 : which === 1 ? (value << 24) >> 24 : which === 2 ? value & 0xffff : value & 0xff;
          } else if (kind === 4 || kind === 5) {
            // PUSH
            const count = bitCount(op & 0x1ff);
            const top = (r[13] - 4 * count) | 0;
            const at = (top - RAM_BASE) | 0;
            // All of it in SRAM, above what is not to be written and on one side of the guard.
            const end = at + 4 * count;
            isOthers = (at & 3) !== 0 || at < readOnlyBytes || end > RAM_BYTES || (end > guardFrom && at < guardFrom + guardBytes);
            if (isOthers) break;
            let word = at >>> 2;
            for (let rest = op & 0xff; rest; rest &= rest - 1) ram32[word++] = r[31 - Math.clz32(rest & -rest)];
            if (op & 0x100) ram32[word] = r[14];
            r[13] = top;
            cycles += count;
          } else if (kind === 12 || kind === 13) {
            // POP
            const at = (r[13] - RAM_BASE) | 0;
            const count = bitCount(op & 0x1ff);
            isOthers =
              (at & 3) !== 0 || at < 0 || at + 4 * count > RAM_BYTES || (at + 4 * count > guardFrom && at < guardFrom + guardBytes);
            if (isOthers) break;
            let word = at >>> 2;
            if (op & 0x100) {
              const target = ram32[word + count - 1];
              if (!(target & 1) || target >>> 28 === 15) {
                // an exception return
                isOthers = true;
                break;
              }
              for (let rest = op & 0xff; rest; rest &= rest - 1) r[31 - Math.clz32(rest & -rest)] = ram32[word++];
              r[13] += 4 * count;
              pc = target & ~1;
              cycles += 3 + count;
              continue;
            }
            for (let rest = op & 0xff; rest; rest &= rest - 1) r[31 - Math.clz32(rest & -rest)] = ram32[word++];
            r[13] += 4 * count;
            cycles += count;
          } else isOthers = true;
          break;
        }
        case 24: {
          // STMIA
          const n = (op >>> 8) & 7;
          const count = bitCount(op & 0xff);
          const at = (r[n] - RAM_BASE) | 0;
          const end = at + 4 * count;
          isOthers = (at & 3) !== 0 || at < readOnlyBytes || end > RAM_BYTES || (end > guardFrom && at < guardFrom + guardBytes);
          if (isOthers) break;
          let word = at >>> 2;
          for (let rest = op & 0xff; rest; rest &= rest - 1) ram32[word++] = r[31 - Math.clz32(rest & -rest)];
          r[n] += 4 * count;
          cycles += count;
          break;
        }
        case 25: {
          // LDMIA
          const n = (op >>> 8) & 7;
          const count = bitCount(op & 0xff);
          const at = (r[n] - RAM_BASE) | 0;
          isOthers = (at & 3) !== 0 || at < 0 || at + 4 * count > RAM_BYTES || (at + 4 * count > guardFrom && at < guardFrom + guardBytes);
          if (isOthers) break;
          let word = at >>> 2;
          r[n] += 4 * count;
          for (let rest = op & 0xff; rest; rest &= rest - 1) r[31 - Math.clz32(rest & -rest)] = ram32[word++];
          cycles += count;
          break;
        }
        case 26:
        case 27: {
          // B conditional
          const kind = (op >>> 9) & 7;
          isOthers = kind === 7;
          if (isOthers) break;
          let isTaken = kind === 0 ? zero === 0 : kind === 1 ? carry !== 0 : kind === 2 ? negative < 0 : overflow < 0;
          if (kind === 4) isTaken = carry !== 0 && zero !== 0;
          else if (kind > 4) isTaken = (negative ^ overflow) >= 0 && (kind === 5 || zero !== 0);
          if (isTaken !== ((op & 0x100) !== 0)) {
            pc += 4 + ((op << 24) >> 23);
            cycles += 2;
            continue;
          }
          break;
        }
        case 28: // B
          pc += 4 + ((op << 21) >> 20);
          cycles += 2;
          continue;
        case 30: {
          // BL
          let low;
          if (offset + 2 < codeBytes) low = ram16[(offset + 2) >>> 1];
          else {
            core.keep(pc, before + cycles, negative, zero, carry, overflow);
            low = core.fetch(pc + 2);
          }
          isOthers = (low & 0xd000) !== 0xd000;
          if (isOthers) break;
          const sign = (op << 21) >> 31;
          const i1 = ~((low >>> 13) ^ sign) & 1;
          const i2 = ~((low >>> 11) ^ sign) & 1;
          r[14] = (pc + 4) | 1;
          pc = pc + 4 + ((sign << 24) | (i1 << 23) | (i2 << 22) | ((op & 0x3ff) << 12) | ((low & 0x7ff) << 1));
          cycles += 3;
          continue;
        }
        default:
          isOthers = true;
      }
      if (isOthers) break;
      pc += 2;
      cycles += 1;
    } while (cycles < most);
    core.keep(pc, before + cycles, negative, zero, carry, overflow);
    if (isOthers) core.executeOther(op);
  }
}
