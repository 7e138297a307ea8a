/**
 * DMA controller of the RP2040 (datasheet 2.5): twelve channels, paced by the requests of the PIO blocks or by none.
 *
 * Pacing is by credits: a channel may have as many transfers under way as its peripheral has room or data for. One transfer is issued per
 * cycle of clk_sys over all channels, round robin. A read ends two cycles after its issue, the write two after the read; an APB peripheral
 * takes two more. Competition with the processor for one memory bank is not modelled. A channel is complete when its last write ends.
 *
 * Modelled is what the firmware uses: whole words, rings of the address written, chains, the first interrupt. Everything
 * else fails the run: other requests than those of state machines 0, registers that abort, trigger or reload in other
 * ways, a channel that is set up while it is busy, misaligned addresses, two busy channels on one request.
 */
import { FLASH_BASE, RAM_BASE, RAM_BYTES } from './core.mjs';
import { clearedByOnes, field, RegisterBlock } from './registers.mjs';

const CHANNELS = 12;
const PERMANENT = 0x3f;
const WORD_BYTES = 4;
const IRQ = 11;

const CTRL_EN = 1;
const CTRL_SIZE = 3 << 2;
const CTRL_WORDS = 2 << 2;
const CTRL_INCR_READ = 1 << 4;
const CTRL_INCR_WRITE = 1 << 5;
const CTRL_RING_SIZE = 15 << 6;
const CTRL_RING_WRITE = 1 << 10;
const CTRL_IRQ_QUIET = 1 << 21;
const CTRL_BUSY = 1 << 24;
/** But for HIGH_PRIORITY, BSWAP, SNIFF_EN. */
const CTRL_WRITABLE = 0x3ffffd;

const ACCESS_CYCLES = 2;
const APB_EXTRA_CYCLES = 2;
const accessCycles = (address) => (address >>> 28 === 4 ? ACCESS_CYCLES + APB_EXTRA_CYCLES : ACCESS_CYCLES);

function makeChannel(index) {
  return {
    index,
    readAddress: 0,
    writeAddress: 0,
    reload: 0,
    ctrl: index << 11,
    treq: 0,
    busy: false,
    toIssue: 0,
    /** Not written yet. */
    remaining: 0,
    /** Issued, but not yet through at the side that paces. */
    credit: 0,
  };
}

export class Dma extends RegisterBlock {
  constructor(chip) {
    super(chip, 'DMA');
    this.clock = chip.sysClock;
    this.alarm = chip.clock.createAlarm(() => this.#atEdge());
    this.reset();
  }

  reset() {
    this.alarm.cancel();
    this.channels = Array.from({ length: CHANNELS }, (_, i) => makeChannel(i));
    /** The busy channel that each request paces. */
    this.paced = new Array(PERMANENT).fill(null);
    this.reads = [];
    this.writes = [];
    this.dueEdge = Infinity;
    this.issueEdge = Infinity;
    this.lastIssued = CHANNELS - 1;
    this.raw = 0;
    this.enable = 0;
    this.#interrupt();
  }

  clockChanged() {
    if (this.dueEdge !== Infinity) this.alarm.scheduleAt(this.clock.afterEdge_ns(this.dueEdge));
  }

  /** Peripherals of rp2040js announce themselves with these; their requests are not modelled. */
  setDREQ() {}

  clearDREQ() {}

  /** A PIO block has one more word, or room for one. */
  request(treq) {
    const channel = this.paced[treq];
    if (channel !== null && channel.toIssue) this.#issueSoon();
  }

  #fail(channel, message) {
    this.rp2040.fail('DMA', `channel ${channel.index}: ${message}`);
  }

  // --- transfers -----------------------------------------------------------------------------------------------

  #start(channel) {
    const { treq, reload } = channel;
    if (!(channel.ctrl & CTRL_EN) || channel.busy) return;
    if ((channel.ctrl & CTRL_SIZE) !== CTRL_WORDS || !reload) this.#fail(channel, 'only words are modelled, and one at least');
    if (treq !== PERMANENT) {
      if (treq & ~0xc) this.#fail(channel, `request ${treq} is not modelled; those of state machines 0 and 63 (unpaced) are`);
      if (this.paced[treq])
        this.#fail(channel, `paced by request ${treq}, as busy channel ${this.paced[treq].index} is; the credits would be counted twice`);
      this.paced[treq] = channel;
    }
    if ((channel.readAddress | channel.writeAddress) & (WORD_BYTES - 1)) {
      const addresses = `0x${channel.readAddress.toString(16)}, 0x${channel.writeAddress.toString(16)}`;
      this.#fail(channel, `addresses ${addresses} are not aligned to ${WORD_BYTES} bytes`);
    }
    channel.busy = true;
    channel.toIssue = reload;
    channel.remaining = reload;
    this.#issueSoon();
  }

  #issueSoon() {
    this.issueEdge = Math.min(this.issueEdge, this.clock.edge + 1);
    this.#schedule();
  }

  #schedule() {
    let due = this.issueEdge;
    if (this.reads.length && this.reads[0].edge < due) due = this.reads[0].edge;
    if (this.writes.length && this.writes[0].edge < due) due = this.writes[0].edge;
    if (due === this.dueEdge) return;
    this.dueEdge = due;
    if (due === Infinity) this.alarm.cancel();
    else this.alarm.scheduleAt(this.clock.afterEdge_ns(due));
  }

  #atEdge() {
    const edge = this.dueEdge;
    this.dueEdge = Infinity;
    if (this.writes.length && this.writes[0].edge <= edge) this.#write(this.writes.shift());
    if (this.reads.length && this.reads[0].edge <= edge) this.#read(this.reads.shift(), edge);
    if (this.issueEdge <= edge) this.#issue(edge);
    this.#schedule();
  }

  #mayIssue({ toIssue, treq, credit }) {
    return toIssue > 0 && (treq === PERMANENT || this.rp2040.pio[treq >>> 3].requests(treq & 7) > credit);
  }

  #issue(edge) {
    this.issueEdge = Infinity;
    let chosen = null;
    let more = false;
    for (let i = 1; i <= CHANNELS; i++) {
      const channel = this.channels[(this.lastIssued + i) % CHANNELS];
      if (!this.#mayIssue(channel)) continue;
      if (!chosen) chosen = channel;
      else more = true;
    }
    if (!chosen) return;
    this.lastIssued = chosen.index;
    const { ctrl } = chosen;
    const transfer = { channel: chosen, from: chosen.readAddress, to: chosen.writeAddress, edge: 0, value: 0 };
    chosen.toIssue -= 1;
    chosen.credit += 1;
    if (ctrl & CTRL_INCR_READ) chosen.readAddress = (chosen.readAddress + WORD_BYTES) >>> 0;
    if (ctrl & CTRL_INCR_WRITE) chosen.writeAddress = this.#advanced(chosen.writeAddress, (ctrl & CTRL_RING_SIZE) >>> 6);
    const previous = this.reads.at(-1);
    transfer.edge = Math.max(edge + accessCycles(transfer.from), previous ? previous.edge + 1 : 0);
    this.reads.push(transfer);
    if (more || this.#mayIssue(chosen)) this.issueEdge = edge + 1;
  }

  #advanced(address, ring) {
    const next = (address + WORD_BYTES) >>> 0;
    const mask = ring ? (1 << ring) - 1 : -1;
    return ((address & ~mask) | (next & mask)) >>> 0;
  }

  #read(transfer, edge) {
    const { channel, from } = transfer;
    const at = from - RAM_BASE;
    if (at >= 0 && at < RAM_BYTES) transfer.value = this.rp2040.core.ram32[at >>> 2];
    else {
      this.#checkAddress(channel, from, 'reads');
      transfer.value = this.rp2040.busRead(from, WORD_BYTES);
    }
    if (channel.treq & 4) channel.credit -= 1; // of the unpaced too
    const previous = this.writes.at(-1);
    transfer.edge = Math.max(edge + accessCycles(transfer.to), previous ? previous.edge + 1 : 0);
    this.writes.push(transfer);
  }

  #write({ channel, to, value }) {
    const at = to - RAM_BASE;
    if (at >= 0 && at < RAM_BYTES) this.rp2040.core.ram32[at >>> 2] = value;
    else {
      this.#checkAddress(channel, to, 'writes');
      this.rp2040.busWrite(to, value >>> 0, WORD_BYTES);
    }
    if (!(channel.treq & 4)) channel.credit -= 1;
    channel.remaining -= 1;
    if (!channel.remaining) this.#complete(channel);
    else if (channel.toIssue) this.#issueSoon();
  }

  #checkAddress(channel, address, does) {
    const page = address >>> 28;
    const inFlash = address >>> 26 === FLASH_BASE >>> 26;
    if (page !== 4 && page !== 5 && !inFlash) this.#fail(channel, `${does} 0x${address.toString(16)}, which DMA cannot reach`);
  }

  #complete(channel) {
    channel.busy = false;
    if (channel.treq !== PERMANENT) this.paced[channel.treq] = null;
    if (!(channel.ctrl & CTRL_IRQ_QUIET)) {
      this.raw |= 1 << channel.index;
      this.#interrupt();
    }
    const next = (channel.ctrl >>> 11) & 15;
    if (next !== channel.index) this.#start(this.channels[next]);
  }

  // --- registers -----------------------------------------------------------------------------------------------

  #interrupt() {
    this.rp2040.setInterrupt(IRQ, (this.raw & this.enable) !== 0);
  }

  #set(channel, key, value) {
    if (channel.busy) this.#fail(channel, `${key} written while the channel is busy`);
    channel[key] = value >>> 0;
  }

  #control(channel, value) {
    if (value & ~CTRL_WRITABLE || (value & CTRL_RING_SIZE && !(value & CTRL_RING_WRITE)))
      this.#fail(channel, 'HIGH_PRIORITY, BSWAP, SNIFF_EN and rings of the address read are not modelled');
    this.#set(channel, 'ctrl', value);
    channel.treq = (value >>> 15) & 63;
  }

  /** Read and write address, number, control with a trigger, and control. */
  static #registersOf = (i) =>
    [
      { read: (b) => b.channels[i].readAddress, write: (b, value) => b.#set(b.channels[i], 'readAddress', value) },
      { read: (b) => b.channels[i].writeAddress, write: (b, value) => b.#set(b.channels[i], 'writeAddress', value) },
      { read: (b) => b.channels[i].remaining, write: (b, value) => b.#set(b.channels[i], 'reload', value) },
      {
        read: (b) => b.channels[i].ctrl | (b.channels[i].busy ? CTRL_BUSY : 0),
        write: (b, value) => {
          b.#control(b.channels[i], value);
          b.#start(b.channels[i]);
        },
      },
      { write: (b, value) => b.#control(b.channels[i], value) },
    ].map((register, at) => [0x40 * i + 4 * at, register]);

  static registers = {
    ...Object.fromEntries(Array.from({ length: CHANNELS }, (_, i) => Dma.#registersOf(i)).flat()),
    0x404: field('enable', 2 ** CHANNELS - 1),
    0x40c: { ...clearedByOnes('raw'), read: (b) => b.raw & b.enable },
  };

  writeUint32(offset, value) {
    super.writeUint32(offset, value);
    this.#interrupt();
  }
}
