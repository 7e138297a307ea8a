/**
 * The pads of GPIO0 to GPIO29 together, as bitmaps (RP2040 datasheet 2.19): what the chip drives, what the world
 * makes of it, what the chip's blocks read.
 *
 *     chip.pins.onDriven = (low, high) => {}       // pins that the chip pulls low, drives high; the rest floats
 *     chip.pins.setLevels(mask, levels)            // the levels of these pins; from then on they are the world's
 *
 * A pin that the world never set reads what the chip drives, or else what its pull resistors make of it.
 * onLevels(levels, t_ns) hears of changes of the pins in `watched`.
 * `before(t_ns)` is what the blocks read just before a time of the last few clock cycles, for synchronisers.
 */
import { GPIOPin } from 'rp2040js';

const COUNT = 30;
const ALL = 2 ** COUNT - 1;
const HISTORY = 64;

const FUNCTION_PWM = 4;
const FUNCTION_SIO = 5;
const FUNCTION_PIO0 = 6;
const FUNCTION_PIO1 = 7;
const PAD_PULL_DOWN = 4;
const PAD_PULL_UP = 8;
const PAD_INPUT_ENABLE = 0x40;
const PAD_OUTPUT_DISABLE = 0x80;
const EDGE_HIGH_LEVEL_HIGH = 0xa;
const LEVEL_LOW = 1;
const EDGE_LOW_LEVEL_LOW = 5;
const LEVEL_HIGH = 2;

class Pin extends GPIOPin {
  constructor(chip, index) {
    super(chip, index);
    this.padValue = 0x56;
  }

  setInputValue(high) {
    this.rp2040.pins.setLevels(1 << this.index, high ? -1 : 0);
  }

  refreshInput() {
    this.noteLevel();
  }

  /** Sets what the interrupt logic of IO_BANK0 remembers of the level. */
  noteLevel() {
    if (this.rawInputValue && this.padValue & PAD_INPUT_ENABLE) this.irqStatus = (this.irqStatus | EDGE_HIGH_LEVEL_HIGH) & ~LEVEL_LOW;
    else this.irqStatus = (this.irqStatus | EDGE_LOW_LEVEL_LOW) & ~LEVEL_HIGH;
    if (this.irqEnableMask) this.rp2040.updateIOInterrupt();
  }
}

export class Pins {
  constructor(chip) {
    this.chip = chip;
    chip.gpio = Array.from({ length: COUNT }, (_, i) => new Pin(chip, i));
    this.onDriven = () => {};
    this.watched = 0;
    this.onLevels = () => {};
    this.low = 0;
    this.high = 0;
    this.levels = 0;
    this.inputs = 0;
    this.worlds = 0;
    this.changed_ns = new Float64Array(HISTORY).fill(-Infinity);
    this.inputsBefore = new Int32Array(HISTORY);
    this.newest = 0;
    this.#readConfiguration();
  }

  /** Function or pad of a pin was written. */
  reconfigure() {
    this.#readConfiguration();
    this.drive();
    this.#resolve();
  }

  #readConfiguration() {
    this.of = { sio: 0, pio0: 0, pio1: 0, special: 0 };
    this.pullUp = 0;
    this.pullDown = 0;
    this.readable = 0;
    this.inverted = 0;
    this.readHigh = 0;
    this.chip.gpio.forEach((pin, i) => {
      const bit = 1 << i;
      const disabled = (pin.padValue & PAD_OUTPUT_DISABLE) !== 0;
      if (pin.outputOverride || pin.outputEnableOverride || pin.functionSelect === FUNCTION_PWM) this.of.special |= disabled ? 0 : bit;
      else if (!disabled) {
        if (pin.functionSelect === FUNCTION_SIO) this.of.sio |= bit;
        else if (pin.functionSelect === FUNCTION_PIO0) this.of.pio0 |= bit;
        else if (pin.functionSelect === FUNCTION_PIO1) this.of.pio1 |= bit;
      }
      if (pin.padValue & PAD_PULL_UP) this.pullUp |= bit;
      if (pin.padValue & PAD_PULL_DOWN) this.pullDown |= bit;
      const override = pin.inputOverride;
      if (override < 2 && pin.padValue & PAD_INPUT_ENABLE) this.readable |= bit;
      if (override === 1) this.inverted |= bit;
      if (override === 3) this.readHigh |= bit;
    });
  }

  /** An output or an output enable changed. */
  drive() {
    const { chip, of } = this;
    const { sio } = chip;
    const [pio0, pio1] = chip.pio;
    let enabled = (sio.gpioOutputEnable & of.sio) | (pio0.pinDirections & of.pio0) | (pio1.pinDirections & of.pio1);
    let value = (sio.gpioValue & of.sio) | (pio0.pinValues & of.pio0) | (pio1.pinValues & of.pio1);
    for (let rest = of.special; rest; rest &= rest - 1) {
      const pin = chip.gpio[31 - Math.clz32(rest & -rest)];
      if (pin.outputEnable) enabled |= 1 << pin.index;
      if (pin.outputValue) value |= 1 << pin.index;
    }
    const low = enabled & ~value;
    const high = enabled & value;
    const changed = (low ^ this.low) | (high ^ this.high);
    if (!changed) return;
    this.low = low;
    this.high = high;
    for (let rest = changed; rest; rest &= rest - 1) {
      const pin = chip.gpio[31 - Math.clz32(rest & -rest)];
      if (pin.listeners.size) pin.checkForUpdates();
    }
    this.onDriven(low, high);
    if (changed & ~this.worlds) this.#resolve();
  }

  setLevels(mask, levels) {
    this.worlds |= mask;
    this.#become((this.levels & ~mask) | (levels & mask));
  }

  /** What the pins read that no other part sets. */
  #resolve() {
    const { low, high } = this;
    const held = this.pullUp & this.pullDown & this.levels;
    const floating = (this.pullUp & ~this.pullDown) | held | (this.levels & ~this.pullUp & ~this.pullDown);
    const own = high | (floating & ~low);
    this.#become((this.levels & this.worlds) | (own & ~this.worlds & ALL));
  }

  #become(levels) {
    const { chip } = this;
    const changed = levels ^ this.levels;
    this.levels = levels;
    for (let rest = changed; rest; rest &= rest - 1) {
      const pin = chip.gpio[31 - Math.clz32(rest & -rest)];
      pin.rawInputValue = ((levels >>> pin.index) & 1) === 1;
      pin.noteLevel();
    }
    if (changed & this.watched) this.onLevels(levels, chip.time.nanos);
    const inputs = ((levels & this.readable) ^ this.inverted) | this.readHigh;
    const different = inputs ^ this.inputs;
    if (!different) return;
    const now_ns = chip.time.nanos;
    this.newest = (this.newest + 1) % HISTORY;
    this.changed_ns[this.newest] = now_ns;
    this.inputsBefore[this.newest] = this.inputs;
    this.inputs = inputs;
    for (const pio of chip.pio) if (different & pio.watchedPins) pio.inputsChanged(different, now_ns);
  }

  before(t_ns) {
    let inputs = this.inputs;
    for (let i = 0, at = this.newest; i < HISTORY && this.changed_ns[at] >= t_ns; i++, at = (at + HISTORY - 1) % HISTORY)
      inputs = this.inputsBefore[at];
    return inputs;
  }
}
