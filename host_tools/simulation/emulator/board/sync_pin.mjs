/**
 * What is wired to the sync pin of a board: perhaps a source of edges, and an observer.
 *
 *     new SyncPin({ gpio, scope, report, next, onLevel })
 *
 * next(t_ns): the first edge of the source after that time, { at_ns, high }, or null: there is none any more. Without next
 * the wire floats unless the chip drives it. onLevel(high, t_ns): the pin changed, by the chip or the wire.
 */
export class SyncPin {
  constructor({ gpio, scope, report, next = null, onLevel = () => {} }) {
    this.bit = 1 << gpio;
    this.report = report;
    this.next = next;
    this.onLevel = onLevel;
    this.high = false;
    this.edge = null;
    this.alarm = scope.createAlarm(() => this.#edge());
  }

  /** A chip that has just got its power. */
  attachChip(chip) {
    this.chip = chip;
    chip.pins.watched |= this.bit;
    chip.pins.onLevels = (levels, t_ns) => this.onLevel((levels & this.bit) !== 0, t_ns);
    if (!this.next) return;
    chip.pins.setLevels(this.bit, this.high ? -1 : 0);
    if (!this.edge) this.alarm.schedule(1); // the source may not know yet when the power came
  }

  #schedule(t_ns) {
    this.edge = this.next(t_ns);
    if (this.edge) this.alarm.scheduleAt(this.edge.at_ns);
  }

  #edge() {
    if (!this.edge) {
      this.#schedule(this.chip.time.nanos);
      return;
    }
    const { at_ns, high } = this.edge;
    const { pins } = this.chip;
    if ((pins.low | pins.high) & this.bit) this.report.warn('sync', 'the chip drives a wire that another source drives too');
    this.high = high;
    pins.setLevels(this.bit, high ? -1 : 0);
    this.#schedule(at_ns);
  }
}

/** next() of a strobe that is high for high_ns at each multiple of period_ns of a clock that showed zero_ns when the power came. */
export function strobe({ period_ns, high_ns, zero_ns = 0 }) {
  return (t_ns) => {
    const begun = Math.floor((t_ns + zero_ns + 1e-3) / period_ns) * period_ns - zero_ns;
    const ends = begun + high_ns;
    return ends > t_ns + 1e-3 ? { at_ns: ends, high: false } : { at_ns: begun + period_ns, high: true };
  };
}
