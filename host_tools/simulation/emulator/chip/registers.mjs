/** A peripheral that only stores: registers with their reset value and writable bits, everything else fails. */
import { BasePeripheral } from 'rp2040js';

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
