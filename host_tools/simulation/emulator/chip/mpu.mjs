/**
 * The memory protection unit of the core (ARMv6-M Architecture Reference Manual B3.5): regions without access, and
 * regions, or subregions of them, that are read-only, from the start of SRAM on without a gap. They fault for the
 * processor and not for DMA. It is off in the fault handlers.
 */
export class MemoryFault extends Error {}

const RAM_BASE = 0x20000000;

const CTRL_ENABLE = 1;
const CTRL_HFNMIENA = 2;
const CTRL_PRIVDEFENA = 4;
const XN = 1 << 28;
const ACCESS = 7 << 24;
const READ_ONLY = 6 << 24;
const CACHEABLE = 1 << 17;
/** What is neither enable, size, subregions, nor the bits above. */
const OTHERS = ~(XN | ACCESS | CACHEABLE | 0xff3f);

const sizeOf = (attributes) => 2 ** (((attributes >>> 1) & 31) + 1);

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
    /** From the start of SRAM. */
    this.readOnlyBytes = 0;
  }

  denies(address) {
    return this.denied.some(([first, bytes]) => address >= first && address - first < bytes);
  }

  /** The parts of a region that are in force. */
  #parts({ base, attributes }) {
    const size = sizeOf(attributes);
    if (!(attributes & 0xff00)) return [[base, size]];
    return Array.from({ length: 8 }, (_, i) => [base + (i * size) / 8, size / 8]).filter((_, i) => !((attributes >>> (8 + i)) & 1));
  }

  #readOnly(regions) {
    let end = RAM_BASE;
    for (const [first, bytes] of regions.flatMap((r) => this.#parts(r)).sort((a, b) => a[0] - b[0])) {
      if (first !== end)
        this.chip.fail('MPU', `read-only memory at 0x${first.toString(16)}: only one range from the start of SRAM on is modelled`);
      end += bytes;
    }
    return end - RAM_BASE;
  }

  read(offset) {
    const region = this.regions[this.number];
    return [0x800, this.ctrl, this.number, (region.base | this.number) >>> 0, region.attributes][(offset - 0xd90) >> 2];
  }

  write(offset, value) {
    if (offset === 0xd94) {
      this.ctrl = value & 7;
      if (this.ctrl & CTRL_ENABLE && (!(this.ctrl & CTRL_PRIVDEFENA) || this.ctrl & CTRL_HFNMIENA))
        this.chip.fail('MPU', `CTRL 0x${value.toString(16)}: only PRIVDEFENA without HFNMIENA is modelled`);
    } else if (offset === 0xd98) this.number = value & 7;
    else if (offset === 0xd9c) {
      if (value & 16) this.number = value & 7;
      this.regions[this.number].base = (value & ~0xff) >>> 0;
    } else if (offset === 0xda0) {
      const size = sizeOf(value);
      const isModelled =
        !(value & OTHERS) && size >= 256 && ((value & ACCESS) === READ_ONLY ? !(value & XN) : value & XN && !(value & (ACCESS | 0xff00)));
      if (value & 1 && !isModelled)
        this.chip.fail(
          'MPU',
          `RASR 0x${(value >>> 0).toString(16)}: only regions of 256 bytes or more are modelled, whole without any access, or read-only with execution`,
        );
      if (value & 1 && !(value & XN) && !(value & CACHEABLE))
        this.chip.fail('MPU', `RASR 0x${(value >>> 0).toString(16)}: nothing executes from strongly ordered memory`);
      if (value & 1 && this.regions[this.number].base % size) this.chip.fail('MPU', 'the base of a region is not aligned to its size');
      this.regions[this.number].attributes = value >>> 0;
    }
    const regions = this.ctrl & CTRL_ENABLE ? this.regions.filter((r) => r.attributes & 1) : [];
    const isReadOnly = (r) => (r.attributes & ACCESS) === READ_ONLY;
    this.denied = regions.filter((r) => !isReadOnly(r)).map((r) => [r.base, sizeOf(r.attributes)]);
    this.readOnlyBytes = this.#readOnly(regions.filter(isReadOnly));
    this.onChange();
  }
}
