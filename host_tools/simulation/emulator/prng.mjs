/** Small deterministic random numbers (xoshiro128**, seeded by SplitMix32), equal on every machine. */
export class Prng {
  constructor(seed) {
    let s = seed >>> 0;
    const splitmix = () => {
      s = (s + 0x9e3779b9) >>> 0;
      let z = s;
      z = Math.imul(z ^ (z >>> 16), 0x85ebca6b);
      z = Math.imul(z ^ (z >>> 13), 0xc2b2ae35);
      return (z ^ (z >>> 16)) >>> 0;
    };
    this.s = Uint32Array.from([splitmix(), splitmix(), splitmix(), splitmix() | 1]);
    this.spare = null;
  }

  uint32() {
    const s = this.s;
    const x = Math.imul(s[1], 5) >>> 0;
    const result = Math.imul(((x << 7) | (x >>> 25)) >>> 0, 9) >>> 0;
    const t = s[1] << 9;
    s[2] ^= s[0];
    s[3] ^= s[1];
    s[1] ^= s[2];
    s[0] ^= s[3];
    s[2] ^= t;
    s[3] = (s[3] << 11) | (s[3] >>> 21);
    return result;
  }

  /** Uniform in [0, 1). */
  uniform() {
    return this.uint32() / 4294967296;
  }

  /** Uniform in [low, high). */
  range(low, high) {
    return low + (high - low) * this.uniform();
  }

  /** Standard normal (polar method). */
  normal() {
    if (this.spare !== null) {
      const value = this.spare;
      this.spare = null;
      return value;
    }
    for (;;) {
      const u = 2 * this.uniform() - 1;
      const v = 2 * this.uniform() - 1;
      const q = u * u + v * v;
      if (q > 0 && q < 1) {
        const factor = Math.sqrt((-2 * Math.log(q)) / q);
        this.spare = v * factor;
        return u * factor;
      }
    }
  }
}
