/**
 * A whole bench in emulated time: chip, board with sensors, USB host with CDC client, faults.
 *
 *     const machine = new Machine({ image, Board, scenario, ... });
 *     machine.run(end_ns);            // may be called again with a later time; false when the run is over
 *     machine.result                  // what run.json holds
 */
import { createHash } from 'node:crypto';
import { SyncPin } from './board/sync_pin.mjs';
import { Chip, Stopped } from './chip/chip.mjs';
import { RAM_BASE } from './chip/core.mjs';
import { FlashMemory } from './chip/flash_memory.mjs';
import { SimulatedTime } from './clock.mjs';
import { Faults } from './faults.mjs';
import { Report } from './report.mjs';
import { CdcClient } from './usb/cdc_client.mjs';
import { UsbHost } from './usb/host.mjs';

export const DEFAULT_SERIAL = 'e660583883265a2c';
/** This time after a start the firmware must run at the board's frequency, unless the bus sleeps. */
const CLOCK_CHECK_NS = 200e6;

export class Machine {
  /**
   * @param options image: Uint8Array; Board; scenario; seed; faults: parsed list; flash: 2 MiB of content, beside the
   *   image, from an earlier life; flashSpeed: see BUSY_NS; serial: 16 hex digits; clock_ppm: by how
   *   much the chip's clocks are fast; revision, uptime_us, rosc_hz: of the chip, see Chip; fastEnumeration, companion: of the host, see UsbHost; allowWatchdog: a watchdog reboot is no warning; onBusTransfer, onUsbPacket, onData(bytes);
   *   sync: next, onLevel of the SyncPin; sensor, rise_ns, onLevels: see the boards; makeClient({ host, report, onData }): what uses the USB device, CdcClient by
   *   default
   */
  constructor({
    image,
    Board,
    scenario,
    seed = 1,
    faults = [],
    serial = DEFAULT_SERIAL,
    clock_ppm = 0,
    fastEnumeration = false,
    companion = false,
    allowWatchdog = false,
    revision,
    uptime_us,
    rosc_hz,
    flash = null,
    flashSpeed,
    sync = {},
    sensor,
    rise_ns,
    onLevels,
    onBusTransfer = () => {},
    onUsbPacket = () => {},
    onData = () => {},
    makeClient = (parts) => new CdcClient(parts),
  }) {
    this.image = image;
    this.Board = Board;
    this.seed = seed;
    this.clock_ppm = clock_ppm;
    this.allowWatchdog = allowWatchdog;
    this.serial = Uint8Array.from(serial.match(/../g).map((h) => parseInt(h, 16)));
    this.time = new SimulatedTime();
    this.scope = this.time.scope();
    this.report = new Report(() => this.time.nanos);
    this.endReason = null;
    this.endDetail = {};
    this.reboots = 0;
    this.hasPower = true;
    this.powerCuts = 0;
    this.cyclesBefore = 0;
    this.secondCyclesBefore = 0;

    this.memory = new FlashMemory({ time: this.time, serial: this.serial, seed, speed: flashSpeed });
    if (flash) this.memory.bytes.set(flash);
    this.makeBoard = () =>
      new Board({
        scope: this.boardScope,
        report: this.report,
        seed,
        sensor,
        rise_ns,
        onLevels,
        onTransfer: onBusTransfer,
        stimulus: (index, t_ns) => scenario.at_ns(index, t_ns),
        faults: () => this.faults,
      });
    this.trouble = {}; // outlives a reset and a power cut
    const { memory, trouble } = this;
    this.chipOptions = { serial: this.serial, seed, clock_ppm, revision, uptime_us, rosc_hz, memory, trouble };
    this.boardScope = this.time.scope();
    this.board = this.makeBoard();
    this.sync = new SyncPin({ gpio: Board.syncPin, scope: this.scope, report: this.report, ...sync });
    this.host = new UsbHost({ scope: this.scope, report: this.report, fast: fastEnumeration, companion, onPacket: onUsbPacket });
    this.client = makeClient({ host: this.host, report: this.report, onData });
    const onBoard = (type) => [type, (target, active) => this.board.faultActions[type](target, active)];
    const troubled =
      (name, then = () => {}) =>
      (_, active) => {
        this.trouble[name] = active;
        then();
      };
    this.faults = new Faults(faults, this.scope, {
      ...Object.fromEntries(Object.keys(this.board.faultActions).map(onBoard)),
      power_cut: (_, active) => (active ? this.#powerDown() : this.#guard(() => this.#powerBack())),
      chip_reset: (_, active) => (active ? this.#holdChip() : this.#guard(() => this.#releaseChip())),
      crystal_dead: troubled('crystalDead', () => this.chip.xosc.count()),
      crystal_weak: troubled('crystalWeak'),
      pll_late: troubled('pllLate', () => {
        for (const pll of [this.chip.pllSys, this.chip.pllUsb]) pll.lock();
      }),
      usb_busy_hub: troubled('busyHub'),
      usb_late_resume: troubled('lateResume'),
      usb_deaf: (_, active) => this.#hang('deaf', active),
      usb_dead: (_, active) => this.#hang('dead', active),
      sram_upset: ({ address, bytes }) => this.chip.sram.set(bytes, address - RAM_BASE),
      host_stall: (_, active) => this.client.setStalled(active),
      usb_unplug: (_, active) => (active ? this.host.unplug() : this.host.plug()),
    });
    this.clockAlarm = this.scope.createAlarm(() => this.#checkClock());
    this.#guard(() => this.#powerUp(null));
  }

  #checkClock() {
    const { clkSys, wild, usbCtrl } = this.chip;
    if (!wild && !usbCtrl.isSuspended && clkSys !== this.Board.clkSys_Hz)
      this.report.warn('clocks', `clk_sys is ${clkSys / 1e6} MHz; this board runs at ${this.Board.clkSys_Hz / 1e6} MHz`);
  }

  #powerUp(kept) {
    this.chip = new Chip(this.time, this.report, { ...this.chipOptions, kept });
    this.chip.load(this.image);
    this.board.attachChip(this.chip);
    this.sync.attachChip(this.chip);
    this.host.connect(this.chip.usbCtrl);
    this.chip.boot();
    this.clockAlarm.schedule(CLOCK_CHECK_NS);
  }

  /** Erratum E15 of the USB controller, in its next IN transfer: only a reset of the block ends it. */
  #hang(how, active) {
    if (active && this.hasPower) this.chip.usbCtrl.hangsAtIn = how;
  }

  #stopChip() {
    this.hasPower = false;
    this.#keepCycles(this.chip);
    this.chip.dispose();
    this.host.disconnect();
  }

  #keepCycles({ core0, second }) {
    this.cyclesBefore += core0.cycles;
    this.secondCyclesBefore += second.cycles;
  }

  /** Everything on the board loses its power; the cable is still there. */
  #powerDown() {
    this.#stopChip();
    this.memory.cutPower();
    throw new Stopped('power cut');
  }

  /** Sensors and flash keep what they are doing. */
  #holdChip() {
    this.#stopChip();
    this.memory.deselect();
    throw new Stopped('power cut');
  }

  #releaseChip() {
    this.hasPower = true;
    this.#powerUp(null);
  }

  #powerBack() {
    this.hasPower = true;
    this.powerCuts += 1;
    this.boardScope.dispose();
    this.board = this.makeBoard();
    this.#powerUp(null);
    this.faults.actAnew();
  }

  #guard(action) {
    try {
      action();
      return true;
    } catch (error) {
      if (!(error instanceof Stopped)) throw error;
      if (error.reason === 'power cut') return true;
      if (error.reason === 'watchdog reboot') {
        this.#reboot(error.detail.reason);
        return true;
      }
      this.endReason = error.reason;
      this.endDetail = error.detail;
      return false;
    }
  }

  #reboot(reason) {
    const why = reason === 1 ? 'was not fed in time' : 'was triggered by the firmware';
    if (!this.allowWatchdog) this.report.warn('watchdog', `${why}; the chip rebooted`);
    this.reboots += 1;
    const old = this.chip;
    this.#keepCycles(old);
    const kept = { sram: old.sram, usbDPRAM: old.usbDPRAM, watchdog: { reason, scratch: old.watchdog.scratch } };
    old.dispose();
    this.memory.deselect(); // its pads let go; a command that was under way is what came until then
    this.#guard(() => this.#powerUp(kept));
  }

  /** Run to `end_ns`; false when the run ended before (see `endReason`). */
  run(end_ns) {
    while (!this.endReason && this.time.nanos < end_ns) {
      if (!this.#guard(() => (this.hasPower ? this.chip.runUntil(end_ns) : this.#passTime(end_ns)))) break;
    }
    return this.endReason === null;
  }

  /** Until power is back: what is not on the board goes on. */
  #passTime(end_ns) {
    const { time } = this;
    while (!this.hasPower && time.nanos < end_ns) {
      time.advanceTo(Math.min(time.next_ns, end_ns));
      time.fireDue();
    }
  }

  get busyNs() {
    return ((this.cyclesBefore + this.chip.core.cycles) * 1e9) / this.chip.trueHz(this.Board.clkSys_Hz);
  }

  get result() {
    const { time, host, board, report, chip } = this;
    const cycles = this.cyclesBefore + chip.core.cycles;
    return {
      emulated_s: time.nanos / 1e9,
      cycles,
      cycles_core1: this.secondCyclesBefore + chip.second.cycles,
      busy_fraction: time.nanos ? this.busyNs / time.nanos : 0,
      device_time_zero_s: chip.timer.zero_ns === null ? null : chip.timer.zero_ns / 1e9,
      clock_ppm: this.clock_ppm,
      reboots: this.reboots,
      flash: { erases: this.memory.erases, programs: this.memory.programs, power_cuts: this.powerCuts },
      usb: {
        ...host.statistics,
        configured: host.configured,
        ...(host.device ? { strings: host.device.strings, vendor: host.device.vendor, product: host.device.product } : {}),
      },
      i2c: { ...board.statistics, ...(board.times_ns ? { times_ns: board.times_ns } : {}) },
      warnings: report.list.map((e) => Report.line(e)),
      end_reason: this.endReason ?? 'end of time',
      end_detail: this.endDetail,
      image_sha256: createHash('sha256').update(this.image).digest('hex'),
      seed: this.seed,
    };
  }
}
