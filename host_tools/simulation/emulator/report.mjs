/**
 * What went wrong during a run.
 *
 * A failure ends the run at once (the chip would have misbehaved, or the firmware broke a rule of the hardware); a warning is recorded and
 * the run goes on. Either makes the process exit with 1. Equal messages are recorded once, with a count.
 */
export class Report {
  constructor(now_ns = () => 0) {
    this.now_ns = now_ns;
    this.entries = new Map();
  }

  warn(source, message) {
    this.#add('warning', source, message);
  }

  fail(source, message) {
    this.#add('failure', source, message);
  }

  #add(kind, source, message) {
    const key = `${kind}\0${source}\0${message}`;
    const entry = this.entries.get(key);
    if (entry) entry.count += 1;
    else this.entries.set(key, { kind, source, message, first_s: this.now_ns() / 1e9, count: 1 });
  }

  get list() {
    return [...this.entries.values()];
  }

  static line(entry) {
    const times = entry.count > 1 ? ` (${entry.count} times)` : '';
    return `${entry.kind} at ${entry.first_s.toFixed(6)} s: ${entry.source}: ${entry.message}${times}`;
  }
}
