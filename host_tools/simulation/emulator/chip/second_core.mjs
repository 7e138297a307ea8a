/**
 * The RP2040's second Cortex-M0+ (RP2040 datasheet 2.2, 2.3.1, 2.8.2), beside a first one that owns the time.
 *
 * After a reset it waits in the boot ROM until core 0 has sent 0, 0, 1, vector table, stack pointer and entry through the FIFO of the SIO.
 * It answers each word with the same word. A 0 begins again. That part of the boot ROM is played here; what it leaves behind is the boot
 * ROM's: a read of the empty FIFO is noted (ROE), a 0 is sent unasked, an event is kept. Bit 16 of PSM FRCE_OFF is its reset.
 *
 * Both cores share memory, peripherals, spin locks and events (SEV). Each has its own registers, MPU, SCR, divider, interpolators, FIFO
 * flags, and FIFO interrupt. No other interrupt and no SysTick of core 1 is modelled: to enable one fails the run.
 *
 * Bounds of the timing. While both run, they take turns of 1 to TURN_CYCLES cycles. `seed` draws the turns, so that it varies who comes
 * first, as it does between two chips. What one does, the other sees at most one turn late or early. Neither waits for the other at the
 * bus: a chip adds a cycle where both want the same bank of SRAM or the same peripheral. The boot ROM answers a word after ANSWER_CYCLES.
 */
import { Prng } from '../prng.mjs';
import { StrictCore } from './core.mjs';

const TURN_CYCLES = 24;
/** From an event to the answer's event: some twenty instructions and the waking. */
const ANSWER_CYCLES = 40;
const SCR_SLEEPDEEP = 4;
const TO_ITS_END = Object.freeze({ earliestChanged: false });

export class SecondCore {
  constructor(chip, seed, returnAddress) {
    this.chip = chip;
    this.returnAddress = returnAddress;
    this.prng = new Prng(seed ^ 0xc02e);
    this.answer = chip.clock.createAlarm(() => this.#answer());
    this.cyclesBefore = 0;
    this.core = new StrictCore(chip, 1);
    /** 'off', 'pen': in the boot ROM, or 'runs'. */
    this.state = 'off';
    this.at_ns = 0;
  }

  /** Out of reset. */
  powerUp() {
    this.cyclesBefore += this.core.cycles;
    this.core = new StrictCore(this.chip, 1);
    this.chip.sio.resetCore(1);
    this.state = 'pen';
    this.got = [];
    this.toSend = 0;
    this.#schedule();
  }

  powerDown() {
    this.state = 'off';
    this.answer.cancel();
  }

  get cycles() {
    return this.cyclesBefore + this.core.cycles;
  }

  get isAwake() {
    return this.state === 'runs' && !this.core.waiting;
  }

  /** It will do something by itself. */
  get isActive() {
    return this.isAwake || this.answer.scheduled;
  }

  /** It does not keep the clocks of SLEEP_EN running. */
  get sleepsDeep() {
    return this.state !== 'runs' || (this.core.waiting && (this.core.scr & SCR_SLEEPDEEP) !== 0);
  }

  turn() {
    return 1 + (this.prng.uint32() % TURN_CYCLES);
  }

  #schedule() {
    if (!this.answer.scheduled) this.answer.schedule(ANSWER_CYCLES * this.chip.time.ns_per_cycle);
  }

  /** SEV, of either. */
  onEvent() {
    if (this.state === 'pen') this.#schedule();
    else if (this.state === 'runs') this.#wakeIf(() => this.core.onEvent());
  }

  setInterrupt(irq, value) {
    if (this.state === 'runs') this.#wakeIf(() => this.core.setInterrupt(irq, value));
  }

  #wakeIf(action) {
    const { time } = this.chip;
    const slept = this.core.waiting;
    action();
    if (slept && !this.core.waiting) {
      this.at_ns = time.nanos;
      time.earliestChanged = true; // core 0 runs on its own no longer
    }
  }

  /** The boot ROM, as far as it comes with what the FIFOs hold. */
  #answer() {
    const { sio } = this.chip;
    while (this.toSend !== null || sio.hasWord(1)) {
      if (this.toSend !== null) {
        if (!sio.hasRoom(1)) return;
        sio.push(1, this.toSend);
        this.toSend = null;
        const launches = this.got.length === 4;
        this.chip.sendEvent();
        if (launches) this.#launch();
        return;
      }
      const word = sio.pop(1);
      this.got.push(word);
      if (word === 0 || (this.got.length === 1 && word !== 1)) {
        while (sio.hasWord(1)) sio.pop(1);
        this.got = [];
        this.toSend = 0;
      } else this.toSend = word;
    }
  }

  #launch() {
    const { core, chip } = this;
    const [, vectors, sp, entry] = this.got;
    this.answer.cancel();
    this.state = 'runs';
    this.at_ns = chip.time.nanos;
    if (!(entry & 1)) chip.fail('core 1', `entry 0x${entry.toString(16)} without the Thumb bit`);
    if (vectors & 0xff) chip.fail('core 1', `vector table at 0x${vectors.toString(16)}, which is not aligned to 256 bytes`);
    core.VTOR = vectors;
    core.registers[13] = sp & ~3;
    core.registers[14] = this.returnAddress | 1;
    core.registers[15] = entry & ~1;
    core.eventRegistered = true; // the boot ROM's own SEV
    chip.sio.updateInterrupt(1);
    chip.time.earliestChanged = true;
  }

  /** Execute up to the time of core 0. */
  catchUp() {
    const { core, chip } = this;
    const { time } = chip;
    const now_ns = time.nanos;
    if (core.waiting && !core.checkForInterrupts()) {
      this.at_ns = now_ns;
      return;
    }
    const cycles = Math.floor((now_ns - this.at_ns) / time.ns_per_cycle + 1e-6);
    if (cycles < 1) return;
    const before = core.cycles;
    chip.takeTurn(core);
    try {
      core.execute(before + cycles, TO_ITS_END);
    } finally {
      chip.takeTurn(chip.core0);
    }
    this.at_ns = core.waiting ? now_ns : this.at_ns + (core.cycles - before) * time.ns_per_cycle;
  }
}
