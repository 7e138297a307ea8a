/**
 * A dump of digital signals as a logic analyser would make it: Value Change Dump (IEEE 1364), 1 ns, for a waveform
 * viewer such as PulseView or GTKWave.
 *
 * `probes` are [name, bit] pairs, bits of the `levels` given to `change`; times must not decrease. Only what happens
 * from from_ns to to_ns is written.
 */
export class VcdDump {
  constructor({ file, probes, comment, from_ns = 0, to_ns = Infinity }) {
    this.file = file;
    this.probes = probes.map(([name, bit], i) => ({ name, bit, code: String.fromCharCode(33 + i) }));
    this.from_ns = from_ns;
    this.to_ns = to_ns;
    this.levels = -1;
    this.begun = false;
    this.at_ns = -1;
    this.#write(`$comment ${comment} $end\n$timescale 1 ns $end\n`);
    for (const { name, code } of this.probes) this.#write(`$var wire 1 ${code} ${name} $end\n`);
    this.#write('$enddefinitions $end\n');
  }

  #write(text) {
    this.file.write(Buffer.from(text));
  }

  /** The levels from the first time on. */
  #begin(levels, t_ns) {
    this.begun = true;
    this.at_ns = Math.round(t_ns);
    this.#write(`#${this.at_ns}\n$dumpvars\n${this.probes.map(({ bit, code }) => `${levels & bit ? 1 : 0}${code}\n`).join('')}$end\n`);
  }

  change(levels, t_ns) {
    const changed = levels ^ this.levels;
    if (t_ns >= this.from_ns && t_ns <= this.to_ns) {
      if (!this.begun) this.#begin(this.levels, this.from_ns);
      const at_ns = Math.round(t_ns);
      let text = '';
      if (at_ns !== this.at_ns) text = `#${at_ns}\n`;
      this.at_ns = at_ns;
      for (const { bit, code } of this.probes) if (changed & bit) text += `${levels & bit ? 1 : 0}${code}\n`;
      this.#write(text);
    }
    this.levels = levels;
  }

  /** The run ended at `t_ns`. */
  close(t_ns) {
    const end_ns = Math.min(t_ns, this.to_ns);
    if (end_ns < this.from_ns) return;
    if (!this.begun) this.#begin(this.levels, this.from_ns);
    if (Math.round(end_ns) > this.at_ns) this.#write(`#${Math.round(end_ns)}\n`);
  }
}
