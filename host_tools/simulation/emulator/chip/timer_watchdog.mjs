/**
 * TIMER and WATCHDOG with the tick generator between them (RP2040 datasheet 4.6 and 4.7).
 *
 * Both count ticks of clk_ref / WATCHDOG_TICK.CYCLES, which must be 1 MHz once the timer is out of reset. The
 * counter reaches a value exactly when the tick does, and an alarm fires at that tick, never earlier. The
 * watchdog counts down twice per tick (erratum RP2040-E1) and reboots what PSM_WDSEL selects.
 */
import { arrayAt, clearedByOnes, constant, field, RegisterBlock } from './registers.mjs';

const WATCHDOG_MAX = 0xffffff;
const TIMER_RESET = 21;

export class Timer extends RegisterBlock {
  /** @param begin_us what it counts from, out of reset: 0 on silicon */
  constructor(chip, begin_us = 0) {
    super(chip, 'TIMER');
    this.begin_us = begin_us;
    this.tick_ns = 1e9 / chip.trueHz(1e6);
    this.alarms = [0, 1, 2, 3].map((i) => ({ armed: false, target: 0, alarm: chip.clock.createAlarm(() => this.#fire(i)) }));
    /** Emulated time at which the counter was 0, or null while no tick runs. */
    this.zero_ns = null;
    this.reset();
  }

  reset() {
    for (const a of this.alarms) {
      a.armed = false;
      a.alarm.cancel();
    }
    this.zero_ns = null;
    this.stopped_us = this.begin_us;
    this.raw = 0;
    this.enable = 0;
    this.force = 0;
    this.#interrupts();
  }

  /** The tick has another rate, or the timer came out of reset. */
  tickChanged(hz) {
    const { rp2040 } = this;
    if (!hz || rp2040.resets.isHeld(TIMER_RESET)) {
      this.#tickStopped();
      return;
    }
    if (Math.abs(hz - 1e6) > 1)
      rp2040.fail('WATCHDOG', `tick of ${(hz / 1e6).toFixed(4)} MHz; clk_ref / CYCLES must be 1 MHz for the timer`);
    this.#tickStarted();
  }

  #tickStarted() {
    if (this.zero_ns === null) this.zero_ns = this.rp2040.clock.nanos - this.stopped_us * this.tick_ns;
    for (const a of this.alarms) if (a.armed) this.#schedule(a);
  }

  #tickStopped() {
    if (this.zero_ns === null) return;
    this.stopped_us = this.count_us;
    this.zero_ns = null;
    for (const a of this.alarms) a.alarm.cancel();
  }

  get count_us() {
    return this.zero_ns === null ? this.stopped_us : Math.floor((this.rp2040.clock.nanos - this.zero_ns) / this.tick_ns + 1e-6);
  }

  #count() {
    if (this.zero_ns === null) {
      this.rp2040.fail('TIMER', 'counter read while no tick runs; set WATCHDOG_TICK (ENABLE, CYCLES) first');
    }
    return this.count_us;
  }

  #arm(a, target) {
    a.target = target >>> 0;
    a.armed = true;
    if (this.zero_ns !== null) this.#schedule(a);
  }

  #disarm(bits) {
    this.alarms.forEach((a, i) => {
      if (!((bits >>> i) & 1)) return;
      a.armed = false;
      a.alarm.cancel();
    });
  }

  static #alarm = (i) => ({ read: (b) => b.alarms[i].target, write: (b, value) => b.#arm(b.alarms[i], value) });

  static registers = {
    ...arrayAt(0x10, 4, Timer.#alarm),
    0x20: {
      read: (b) => b.alarms.reduce((bits, a, i) => bits | (a.armed ? 1 << i : 0), 0),
      write: (b) => b.#disarm(b.rawWriteValue),
    },
    0x24: { read: (b) => Math.floor(b.#count() / 2 ** 32) },
    0x28: { read: (b) => b.#count() },
    0x2c: constant(3),
    0x30: { read: () => 0 },
    0x34: clearedByOnes('raw'),
    0x38: field('enable', 0xf),
    0x3c: field('force', 0xf),
    0x40: { read: (b) => (b.raw & b.enable) | b.force },
  };

  writeUint32(offset, value) {
    super.writeUint32(offset, value);
    this.#interrupts();
  }

  /** The alarm matches when the low word becomes equal to the target: a target equal to now waits a whole turn. */
  #schedule(a) {
    const now_us = this.count_us;
    const delta_us = (a.target - (now_us >>> 0)) >>> 0 || 2 ** 32;
    a.alarm.scheduleAt(this.zero_ns + (now_us + delta_us) * this.tick_ns);
  }

  #fire(index) {
    this.alarms[index].armed = false;
    this.raw |= 1 << index;
    this.#interrupts();
  }

  #interrupts() {
    const status = (this.raw & this.enable) | this.force;
    for (let i = 0; i < 4; i++) this.rp2040.setInterrupt(i, ((status >>> i) & 1) === 1);
  }
}

export class Watchdog extends RegisterBlock {
  /** @param kept what a previous life of the chip left: { reason, scratch } */
  constructor(chip, kept) {
    super(chip, 'WATCHDOG');
    this.reason = kept?.reason ?? 0;
    this.scratch = kept?.scratch ?? new Uint32Array(8);
    this.ctrl = 0x07000000;
    this.tick = 0x200;
    this.tick_ns = Infinity;
    this.expires_ns = Infinity;
    this.remaining = 0;
    this.alarm = chip.clock.createAlarm(() => this.#expired(1));
  }

  get enabled() {
    return (this.ctrl >>> 30) & 1;
  }

  get ticking() {
    return (this.tick & 0x200) !== 0 && (this.tick & 0x1ff) !== 0;
  }

  get tickHz() {
    return this.ticking ? this.rp2040.clocks.refHz / (this.tick & 0x1ff) : 0;
  }

  #left() {
    if (this.expires_ns === Infinity) return this.remaining;
    return Math.max(0, Math.ceil(((this.expires_ns - this.rp2040.clock.nanos) / this.tick_ns) * 2));
  }

  /** clk_ref or the register behind the tick has changed. */
  tickChanged() {
    const tick_ns = this.tickHz ? 1e9 / this.rp2040.trueHz(this.tickHz) : Infinity;
    if (tick_ns === this.tick_ns) return;
    this.remaining = this.#left();
    this.tick_ns = tick_ns;
    this.#rearm();
    this.rp2040.timer.tickChanged(this.tickHz);
  }

  #rearm() {
    this.alarm.cancel();
    this.expires_ns = Infinity;
    if (!this.enabled || this.tick_ns === Infinity) return;
    this.expires_ns = this.rp2040.clock.nanos + (this.remaining / 2) * this.tick_ns;
    this.alarm.scheduleAt(this.expires_ns);
  }

  #writeCtrl(value) {
    const left = this.#left();
    this.ctrl = value & 0x47000000;
    this.remaining = left;
    this.#rearm();
    if (value & 0x80000000) this.#expired(2);
  }

  #feed(value) {
    this.remaining = value & WATCHDOG_MAX;
    this.#rearm();
  }

  #writeTick(value) {
    this.tick = value & 0x3ff;
    this.tickChanged();
  }

  static registers = {
    0x00: { read: (b) => (b.ctrl & 0x47000000) | b.#left(), write: (b, value) => b.#writeCtrl(value) },
    0x04: { write: (b, value) => b.#feed(value) },
    0x08: { read: (b) => b.reason },
    ...arrayAt(0x0c, 8, (i) => ({ read: (b) => b.scratch[i], write: (b, value) => b.scratch.fill(value, i, i + 1) })),
    0x2c: { read: (b) => b.tick | (b.ticking ? 0x400 : 0), write: (b, value) => b.#writeTick(value) },
  };

  #expired(reason) {
    this.expires_ns = Infinity;
    this.remaining = 0;
    this.rp2040.watchdogFired(reason);
  }
}
