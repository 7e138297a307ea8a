/**
 * DMA controller of the RP2040 (datasheet 2.5): twelve channels, paced by the requests of the PIO blocks or by none.
 *
 * Pacing is by credits: a channel may have as many transfers under way as its peripheral has room or data for. One
 * transfer is issued per cycle of clk_sys over all channels, round robin. A read ends two cycles
 * after its issue, the write two after the read; an APB peripheral takes two more. Competition with the processor for
 * one memory bank is not modelled. A channel is complete when its last write ends.
 *
 * Erratum RP2040-E13 is modelled: a transfer under way when its channel is aborted still ends, and then raises the
 * channel's interrupt; CHAN_ABORT reads 0 before that.
 *
 * Fails the run: other requests than those of the PIO, pacing timers, priorities, swapped bytes, the sniffer (not modelled); an address or a
 * count written while the channel is busy, misaligned addresses, two busy channels on one request.
 */
import { FLASH_BASE, RAM_BASE, RAM_BYTES } from './core.mjs';
import { clearedByOnes, RegisterBlock } from './registers.mjs';

const CHANNELS = 12;
const PERMANENT = 0x3f;
const PIO_REQUESTS = 16;

const CTRL_EN = 1;
const CTRL_INCR_READ = 1 << 4;
const CTRL_INCR_WRITE = 1 << 5;
const CTRL_RING_SEL = 1 << 10;
const CTRL_IRQ_QUIET = 1 << 21;
/** HIGH_PRIORITY, BSWAP, SNIFF_EN. */
const CTRL_OTHERS = 2 | (1 << 22) | (1 << 23);
const CTRL_BUSY = 1 << 24;
const CTRL_WRITABLE = 0xffffff;

/** What each word of a channel's four aliases is: read address, write address, number, control; the last of each triggers. */
const ALIASES = ['RWNC', 'CRWN', 'CNRW', 'CWNR'].join('');
const KEYS = { R: 'readAddress', W: 'writeAddress', N: 'reload' };
const NAMES = { R: 'READ_ADDR', W: 'WRITE_ADDR', N: 'TRANS_COUNT' };

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
    bytes: 1,
    treq: 0,
    busy: false,
    toIssue: 0,
    remaining: 0,
    aborted: false,
    /** Issued, but not yet through at the side that paces. */
    credit: 0,
    /** Issued, but not yet written. */
    underWay: 0,
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
    this.paced = new Array(PIO_REQUESTS).fill(null);
    this.reads = [];
    this.writes = [];
    this.dueEdge = Infinity;
    this.issueEdge = Infinity;
    this.lastIssued = CHANNELS - 1;
    this.raw = 0;
    this.enable = [0, 0];
    this.force = [0, 0];
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
    if (!(channel.ctrl & CTRL_EN) || channel.busy) return;
    const { treq } = channel;
    if (treq !== PERMANENT) {
      if (treq >= PIO_REQUESTS) this.#fail(channel, `request ${treq} is not modelled; 0 to 15 (PIO) and 63 (unpaced) are`);
      if (this.paced[treq])
        this.#fail(channel, `paced by request ${treq}, as busy channel ${this.paced[treq].index} is; the credits would be counted twice`);
      this.paced[treq] = channel;
    }
    if ((channel.readAddress | channel.writeAddress) & (channel.bytes - 1)) {
      this.#fail(
        channel,
        `addresses 0x${channel.readAddress.toString(16)}, 0x${channel.writeAddress.toString(16)} are not aligned to ${channel.bytes} bytes`,
      );
    }
    channel.busy = true;
    channel.aborted = false;
    channel.toIssue = channel.reload;
    channel.remaining = channel.reload;
    if (!channel.reload) this.#complete(channel);
    else this.#issueSoon();
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

  #mayIssue(channel) {
    if (!channel.toIssue || !(channel.ctrl & CTRL_EN)) return false;
    const { treq } = channel;
    return treq === PERMANENT || this.rp2040.pio[treq >>> 3].requests(treq & 7) > channel.credit;
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
    const { bytes, ctrl } = chosen;
    const transfer = { channel: chosen, from: chosen.readAddress, to: chosen.writeAddress, bytes, edge: 0, value: 0 };
    chosen.toIssue -= 1;
    chosen.credit += 1;
    chosen.underWay += 1;
    if (ctrl & CTRL_INCR_READ) chosen.readAddress = this.#advanced(chosen.readAddress, chosen, 0);
    if (ctrl & CTRL_INCR_WRITE) chosen.writeAddress = this.#advanced(chosen.writeAddress, chosen, CTRL_RING_SEL);
    const previous = this.reads.at(-1);
    transfer.edge = Math.max(edge + accessCycles(transfer.from), previous ? previous.edge + 1 : 0);
    this.reads.push(transfer);
    if (more || this.#mayIssue(chosen)) this.issueEdge = edge + 1;
  }

  #advanced(address, { ctrl, bytes }, side) {
    const next = (address + bytes) >>> 0;
    const ring = (ctrl >>> 6) & 15;
    if (!ring || (ctrl & CTRL_RING_SEL) !== side) return next;
    const mask = (1 << ring) - 1;
    return ((address & ~mask) | (next & mask)) >>> 0;
  }

  #read(transfer, edge) {
    const { channel, from, bytes } = transfer;
    const at = from - RAM_BASE;
    const { core } = this.rp2040;
    if (at >= 0 && at < RAM_BYTES) transfer.value = bytes === 4 ? core.ram32[at >>> 2] : bytes === 2 ? core.ram16[at >>> 1] : core.ram8[at];
    else {
      this.#checkAddress(channel, from, 'reads');
      transfer.value = this.rp2040.busRead(from, bytes);
    }
    if (channel.treq & 4 || channel.treq === PERMANENT) channel.credit -= 1;
    const previous = this.writes.at(-1);
    transfer.edge = Math.max(edge + accessCycles(transfer.to), previous ? previous.edge + 1 : 0);
    this.writes.push(transfer);
  }

  #write({ channel, to, bytes, value }) {
    const at = to - RAM_BASE;
    const { core } = this.rp2040;
    if (at >= 0 && at < RAM_BYTES) {
      if (bytes === 4) core.ram32[at >>> 2] = value;
      else if (bytes === 2) core.ram16[at >>> 1] = value;
      else core.ram8[at] = value;
    } else {
      this.#checkAddress(channel, to, 'writes');
      this.rp2040.busWrite(to, bytes === 4 ? value >>> 0 : value & (2 ** (8 * bytes) - 1), bytes);
    }
    if (!(channel.treq & 4) && channel.treq !== PERMANENT) channel.credit -= 1;
    channel.underWay -= 1;
    if (channel.remaining) channel.remaining -= 1;
    if (channel.busy && !channel.remaining && !channel.underWay) this.#complete(channel);
    else if (channel.toIssue) this.#issueSoon();
  }

  #checkAddress(channel, address, does) {
    const page = address >>> 28;
    const inFlash = address >>> 26 === FLASH_BASE >>> 26;
    if (page !== 4 && page !== 5 && !inFlash) this.#fail(channel, `${does} 0x${address.toString(16)}, which DMA cannot reach`);
  }

  #complete(channel) {
    channel.busy = false;
    if (channel.treq !== PERMANENT && this.paced[channel.treq] === channel) this.paced[channel.treq] = null;
    if (!(channel.ctrl & CTRL_IRQ_QUIET)) {
      this.raw |= 1 << channel.index;
      this.#interrupt();
    }
    const next = (channel.ctrl >>> 11) & 15;
    if (next !== channel.index && !channel.aborted && next < CHANNELS) this.#start(this.channels[next]);
  }

  #abort(channel) {
    if (!channel.busy) return;
    channel.toIssue = 0;
    channel.remaining = 0;
    channel.aborted = true;
    if (channel.underWay) return;
    channel.busy = false;
    if (channel.treq !== PERMANENT) this.paced[channel.treq] = null;
  }

  // --- registers -----------------------------------------------------------------------------------------------

  #interrupt() {
    for (const line of [0, 1]) this.rp2040.setInterrupt(11 + line, ((this.raw & this.enable[line]) | this.force[line]) !== 0);
  }

  #requests({ treq, credit }) {
    return treq < PIO_REQUESTS ? Math.max(0, this.rp2040.pio[treq >>> 3].requests(treq & 7) - credit) : 0;
  }

  #each(bits, action) {
    for (const channel of this.channels) if ((bits >>> channel.index) & 1) action(channel);
  }

  static #masked = (line, key) => ({
    read: (b) => b[key][line],
    write: (b, value) => {
      b[key][line] = value & (2 ** CHANNELS - 1);
    },
  });

  static #status = (line) => ({ ...clearedByOnes('raw'), read: (b) => (b.raw & b.enable[line]) | b.force[line] });

  static registers = {
    0x400: clearedByOnes('raw'),
    0x404: Dma.#masked(0, 'enable'),
    0x408: Dma.#masked(0, 'force'),
    0x40c: Dma.#status(0),
    0x414: Dma.#masked(1, 'enable'),
    0x418: Dma.#masked(1, 'force'),
    0x41c: Dma.#status(1),
    0x430: { read: () => 0, write: (b, value) => b.#each(value, (channel) => b.#start(channel)) },
    0x444: { read: () => 0, write: (b, value) => b.#each(value, (channel) => b.#abort(channel)) },
    0x448: { read: () => CHANNELS },
  };

  readUint32(offset) {
    const channel = this.channels[(offset & 0x7ff) >>> 6];
    if (offset < 0x300) {
      const what = ALIASES[(offset & 0x3f) >> 2];
      const value = {
        R: channel.readAddress,
        W: channel.writeAddress,
        N: channel.remaining,
        C: channel.ctrl | (channel.busy ? CTRL_BUSY : 0),
      };
      return value[what] >>> 0;
    }
    if (offset >= 0x800 && offset < 0xb00 && (offset & 0x3f) <= 4) return (offset & 4 ? channel.reload : this.#requests(channel)) >>> 0;
    return super.readUint32(offset);
  }

  writeUint32(offset, value) {
    if (offset < 0x300) {
      this.#writeChannel(this.channels[offset >>> 6], (offset & 0x3f) >> 2, value >>> 0);
      return;
    }
    super.writeUint32(offset, value);
    this.#interrupt();
  }

  #writeChannel(channel, word, value) {
    const what = ALIASES[word];
    if (what === 'C') {
      if (((value >>> 2) & 3) === 3) this.#fail(channel, 'DATA_SIZE 3 is reserved');
      if (value & CTRL_OTHERS) this.#fail(channel, 'HIGH_PRIORITY, BSWAP and SNIFF_EN are not modelled');
      if (channel.busy && (value ^ channel.ctrl) & CTRL_WRITABLE & ~CTRL_EN)
        this.#fail(channel, 'CTRL changed while the channel is busy; only EN may');
      channel.ctrl = value & CTRL_WRITABLE;
      channel.bytes = 1 << ((value >>> 2) & 3);
      channel.treq = (value >>> 15) & 63;
      if (channel.busy && channel.toIssue) this.#issueSoon();
    } else {
      if (channel.busy) this.#fail(channel, `${NAMES[what]} written while the channel is busy`);
      channel[KEYS[what]] = value;
    }
    if ((word & 3) !== 3) return;
    if (value) this.#start(channel);
    else if (channel.ctrl & CTRL_IRQ_QUIET) {
      this.raw |= 1 << channel.index;
      this.#interrupt();
    }
  }
}
