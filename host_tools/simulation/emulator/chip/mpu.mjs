/**
 * The memory protection unit of the core (ARMv6-M Architecture Reference Manual B3.5): regions without access, which
 * fault for the processor and not for DMA. It is off in the fault handlers.
 */
export class MemoryFault extends Error {}

const CTRL_ENABLE = 1;
const CTRL_HFNMIENA = 2;
const CTRL_PRIVDEFENA = 4;
const ACCESS = 7 << 24;

export class Mpu {
  /** @param chip fails on what is not modelled; onChange: the denied ranges are others */
  constructor(chip, onChange) {
    this.chip = chip;
    this.onChange = onChange;
    this.ctrl = 0;
    this.number = 0;
    this.regions = Array.from({ length: 8 }, () => ({ base: 0, attributes: 0 }));
    /** [first address, bytes] of what the processor may not touch. */
    this.denied = [];
  }

  denies(address) {
    return this.denied.some(([first, bytes]) => address >= first && address - first < bytes);
  }

  read(offset) {
    const region = this.regions[this.number];
    return [0x800, this.ctrl, this.number, (region.base | this.number) >>> 0, region.attributes][(offset - 0xd90) >> 2];
  }

  write(offset, value) {
    if (offset === 0xd94) {
      this.ctrl = value & 7;
      if (this.ctrl & CTRL_ENABLE && (!(this.ctrl & CTRL_PRIVDEFENA) || this.ctrl & CTRL_HFNMIENA)) this.chip.fail('MPU', `CTRL 0x${value.toString(16)}: only PRIVDEFENA without HFNMIENA is modelled`);
    } else if (offset === 0xd98) this.number = value & 7;
    else if (offset === 0xd9c) {
      if (value & 16) this.number = value & 7;
      this.regions[this.number].base = (value & ~0xff) >>> 0;
    } else if (offset === 0xda0) {
      const size = 2 ** (((value >>> 1) & 31) + 1);
      if (value & 1 && (value & (ACCESS | 0xff00) || size < 256)) this.chip.fail('MPU', `RASR 0x${value.toString(16)}: only whole regions of 256 bytes or more without any access are modelled`);
      if (value & 1 && this.regions[this.number].base % size) this.chip.fail('MPU', 'the base of a region is not aligned to its size');
      this.regions[this.number].attributes = value >>> 0;
    }
    this.denied = this.ctrl & CTRL_ENABLE
      ? this.regions.filter((r) => r.attributes & 1).map((r) => [r.base, 2 ** (((r.attributes >>> 1) & 31) + 1)]) : [];
    this.onChange();
  }
}
