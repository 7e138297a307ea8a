/**
 * SDA and SCL as they look while an I2C block drives a bus whose model knows whole bytes: drawn from the block's counts (`timing`: low_ns,
 * high_ns, hold_ns), each byte when it is over. Between transfers the lines are what GPIO and stuck targets make them.
 */
export const WAVEFORM_SDA = 1;
export const WAVEFORM_SCL = 2;
const BOTH = WAVEFORM_SDA | WAVEFORM_SCL;

export class I2cWaveform {
  /** @param onLevels (levels, t_ns): in the order of time */
  constructor(onLevels) {
    this.onLevels = onLevels;
    this.levels = BOTH;
    this.pending = [];
    this.inTransfer = false;
  }

  #set(bit, high, t_ns) {
    this.pending.push({ bit, high, t_ns });
  }

  /** Nothing before `t_ns` will follow. */
  #flush(t_ns) {
    this.pending.sort((a, b) => a.t_ns - b.t_ns);
    while (this.pending.length && this.pending[0].t_ns <= t_ns) {
      const { bit, high, t_ns: at_ns } = this.pending.shift();
      const levels = high ? this.levels | bit : this.levels & ~bit;
      if (levels === this.levels) continue;
      this.levels = levels;
      this.onLevels(levels, at_ns);
    }
  }

  start({ high_ns }, t_ns) {
    this.inTransfer = true;
    this.#set(WAVEFORM_SDA, false, t_ns);
    this.#set(WAVEFORM_SCL, false, t_ns + high_ns);
    this.#flush(t_ns);
  }

  /** `bits`: nine, the acknowledgement last; the ninth clock ends at `t_ns`. */
  byte(bits, { high_ns, low_ns, hold_ns }, t_ns) {
    const period_ns = high_ns + low_ns;
    for (let i = 0; i < 9; i++) {
      const from_ns = t_ns - (9 - i) * period_ns;
      this.#set(WAVEFORM_SCL, false, from_ns);
      this.#set(WAVEFORM_SDA, ((bits >> (8 - i)) & 1) === 1, from_ns + hold_ns);
      this.#set(WAVEFORM_SCL, true, from_ns + low_ns);
    }
    this.#set(WAVEFORM_SCL, false, t_ns);
    this.#flush(t_ns);
  }

  stop({ high_ns, low_ns, hold_ns }, t_ns) {
    if (this.inTransfer) {
      this.#set(WAVEFORM_SDA, false, t_ns - high_ns - low_ns + hold_ns);
      this.#set(WAVEFORM_SCL, true, t_ns - high_ns);
    }
    this.inTransfer = false;
    this.#set(WAVEFORM_SDA, true, t_ns);
    this.#flush(t_ns);
  }

  /** The block gave up: no one drives. */
  abandon() {
    this.inTransfer = false;
  }

  lines(sdaHigh, sclHigh, t_ns) {
    if (this.inTransfer) return;
    this.#set(WAVEFORM_SDA, sdaHigh, t_ns);
    this.#set(WAVEFORM_SCL, sclHigh, t_ns);
    this.#flush(t_ns);
  }
}
