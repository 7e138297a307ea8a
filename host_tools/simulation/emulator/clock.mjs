/**
 * Emulated time in nanoseconds since power-on, and the alarms on it.
 *
 * `SimulatedTime` owns the time line; a `scope()` of it creates alarms that can all be dropped together
 * (a chip reset drops the chip's alarms and keeps those of the world around it). The interface of a
 * scope (`nanos`, `micros`, `createAlarm`) is the one rp2040js expects of its clock.
 *
 * While the processor executes, time advances instruction by instruction: `cycleSource` supplies the cycles executed since the last
 * synchronisation. Alarms fire between instructions only, in the order of their times; while one fires, `nanos` is the time it was set for,
 * so what it does does not depend on the length of the instruction before.
 */
class Alarm {
  constructor(time, callback) {
    this.time = time;
    this.callback = callback;
    this.next = null;
    this.at_ns = 0;
    this.scheduled = false;
  }

  /** Fire `delta_ns` from now (replaces an earlier schedule). */
  schedule(delta_ns) {
    this.scheduleAt(this.time.nanos + delta_ns);
  }

  scheduleAt(at_ns) {
    if (this.scheduled) this.time.unlink(this);
    this.at_ns = at_ns;
    this.scheduled = true;
    this.time.link(this);
  }

  cancel() {
    if (!this.scheduled) return;
    this.scheduled = false;
    this.time.unlink(this);
  }
}

class Scope {
  constructor(time) {
    this.time = time;
    this.alarms = [];
  }

  get nanos() {
    return this.time.nanos;
  }

  get micros() {
    return this.time.nanos / 1000;
  }

  createAlarm(callback) {
    const alarm = new Alarm(this.time, callback);
    this.alarms.push(alarm);
    return alarm;
  }

  dispose() {
    for (const alarm of this.alarms) alarm.cancel();
    this.alarms = [];
  }
}

export class SimulatedTime {
  constructor() {
    this.base_ns = 0;
    this.first = null;
    this.cycleSource = { cycles: 0 };
    this.base_cycles = 0;
    this.ns_per_cycle = 0;
    /** Bumped whenever the earliest alarm may have changed; lets the run loop cut its batch short. */
    this.earliestChanged = false;
    /** While an alarm fires: its time. */
    this.firing_ns = -1;
  }

  get nanos() {
    if (this.firing_ns >= 0) return this.firing_ns;
    return this.base_ns + (this.cycleSource.cycles - this.base_cycles) * this.ns_per_cycle;
  }

  scope() {
    return new Scope(this);
  }

  /** From now on `source.cycles` counts processor cycles of `ns_per_cycle` each. */
  setCycleSource(source, ns_per_cycle) {
    this.base_ns = this.nanos;
    this.cycleSource = source;
    this.base_cycles = source.cycles;
    this.ns_per_cycle = ns_per_cycle;
    this.earliestChanged = true;
  }

  get next_ns() {
    return this.first ? this.first.at_ns : Infinity;
  }

  /** Jump forward while the processor sleeps; never past an alarm. */
  advanceTo(at_ns) {
    this.base_ns = at_ns;
    this.base_cycles = this.cycleSource.cycles;
  }

  /** Fire everything that is due. */
  fireDue() {
    const now_ns = this.nanos;
    try {
      while (this.first && this.first.at_ns <= now_ns) {
        const alarm = this.first;
        this.first = alarm.next;
        alarm.next = null;
        alarm.scheduled = false;
        this.firing_ns = alarm.at_ns;
        alarm.callback();
      }
    } finally {
      this.firing_ns = -1;
    }
  }

  link(alarm) {
    let at = this.first;
    if (!at || alarm.at_ns < at.at_ns) {
      alarm.next = at;
      this.first = alarm;
      this.earliestChanged = true;
      return;
    }
    while (at.next && at.next.at_ns <= alarm.at_ns) at = at.next;
    alarm.next = at.next;
    at.next = alarm;
  }

  unlink(alarm) {
    if (this.first === alarm) {
      this.first = alarm.next;
    } else {
      let at = this.first;
      while (at && at.next !== alarm) at = at.next;
      if (at) at.next = alarm.next;
    }
    alarm.next = null;
  }
}
