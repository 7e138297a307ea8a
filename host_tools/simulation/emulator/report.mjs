/**
 * What went wrong during a run.
 *
 * A failure ends the run at once (the chip would have misbehaved, or the firmware broke a rule of the
 * hardware); a warning is recorded and the run goes on. Either makes the process exit with 1. Equal
 * messages are recorded once, with a count.
 */
export class Report {
  constructor(now_ns = () => 0) {
    this.now_ns = now_ns;
    this.entries = new Map();
    this.failed = null;
    this.onFailure = () => {};
  }

  warn(source, message) {
    this.#add('warning', source, message);
  }

  fail(source, message) {
    const entry = this.#add('failure', source, message);
    if (!this.failed) {
      this.failed = entry;
      this.onFailure(entry);
    }
  }

  #add(kind, source, message) {
    const key = `${kind}\0${source}\0${message}`;
    let entry = this.entries.get(key);
    if (entry) entry.count += 1;
    else {
      entry = { kind, source, message, first_s: this.now_ns() / 1e9, count: 1 };
      this.entries.set(key, entry);
    }
    return entry;
  }

  get list() {
    return [...this.entries.values()];
  }

  static line(entry) {
    const times = entry.count > 1 ? ` (${entry.count} times)` : '';
    return `${entry.kind} at ${entry.first_s.toFixed(6)} s: ${entry.source}: ${entry.message}${times}`;
  }
}
