/** Peripherals whose registers are a table. An offset that is not in it, or that has no reading or no writing, fails the run. */
import { BasePeripheral } from 'rp2040js';

/** A register that stores the writable bits in `key` of its block. */
export const field = (key, mask = 0xffffffff) => ({
  read: (block) => block[key],
  write: (block, value) => {
    block[key] = (value & mask) >>> 0;
  },
});

/** An array of registers from this offset on, each of its index. */
export const arrayAt = (offset, length, registerOf) =>
  Object.fromEntries(Array.from({ length }, (_, i) => [offset + 4 * i, registerOf(i)]));

/** A field of a block that checks first whether it may be written now. */
export const checkedField = (check, key, mask) => ({
  ...field(key, mask),
  write(block, value) {
    check(block);
    field(key, mask).write(block, value);
  },
});

/** One whose bits a write of ones clears. */
export const clearedByOnes = (key) => ({
  read: (block) => block[key],
  write: (block) => {
    block[key] &= ~block.rawWriteValue;
  },
});

/** Registers that read this; a write to them is lost. */
export const constant = (value) => ({ read: () => value, write() {} });

/** static registers = { offset: { read(block), write(block, value) } } */
export class RegisterBlock extends BasePeripheral {
  readUint32(offset) {
    const read = this.constructor.registers[offset]?.read;
    return (read ? read(this) : super.readUint32(offset)) >>> 0;
  }

  writeUint32(offset, value) {
    const write = this.constructor.registers[offset]?.write;
    if (write) write(this, value);
    else super.writeUint32(offset, value);
  }
}

/** A peripheral that only stores. */
export class RegisterFile extends BasePeripheral {
  /** @param registers { offset: [reset, writableMask] } */
  constructor(chip, name, registers) {
    super(chip, name);
    this.registers = new Map(Object.entries(registers).map(([o, [reset, mask]]) => [Number(o), { value: reset >>> 0, mask }]));
  }

  readUint32(offset) {
    const register = this.registers.get(offset);
    return register ? register.value : super.readUint32(offset);
  }

  writeUint32(offset, value) {
    const register = this.registers.get(offset);
    if (!register) super.writeUint32(offset, value);
    else register.value = ((register.value & ~register.mask) | (value & register.mask)) >>> 0;
  }
}
