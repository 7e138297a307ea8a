/**
 * USB controller of the RP2040 in device mode (datasheet 4.1), seen from both sides: registers and DPRAM for the
 * firmware, tokens for a host (`busReset`, `sof`, `setup`, `inToken`, `outData`).
 *
 * Fails the run on what hardware would punish: AVAILABLE set in the same write as other fields of a buffer control register or less than
 * one 48 MHz cycle later, a buffer touched while the controller owns it (unless aborted; before revision B2, where an abort blocks the
 * controller (erratum E2), unless AVAILABLE was cleared alone and no packet is under way), buffers not 64-byte aligned, wrong data PID,
 * pull-up without VBUS, PHY, clock or controller, and tokens or frames while clk_sys is slower than clk_usb.
 */
import { clearedByOnes, field, RegisterBlock } from './registers.mjs';

const IRQ = 5;
const CLK_USB_HZ = 48e6;

const BC_AVAILABLE = 1 << 10;
const BC_STALL = 1 << 11;
const BC_PID = 1 << 13;
const BC_FULL = 1 << 15;
const BC_LENGTH = 0x3ff;

const EP_ENABLE = 0x80000000;
const EP_DOUBLE = 1 << 30;
const EP_INT_PER_BUFFER = 1 << 29;

const SIE_PULLUP_EN = 1 << 16;
const SIE_EP0_INT_1BUF = 1 << 29;

const ST_ACK_REC = 1 << 30;
const ST_STALL_REC = 1 << 29;
const ST_BUS_RESET = 1 << 19;
const ST_TRANS_COMPLETE = 1 << 18;
const ST_SETUP_REC = 1 << 17;
const ST_CONNECTED = 1 << 16;
const ST_RESUME = 1 << 11;
const ST_LINE_J = 1 << 2;
const ST_SUSPENDED = 1 << 4;
const ST_WRITE_CLEAR = 0xff0e0800;
/** From a change of the bus to that of SUSPENDED, in which a RESUME is distinguished from noise. */
const AWAKE_NS = 3e3;
/** The same in the fault usb_late_resume. */
const AWAKE_LATE_NS = 45e6;

const DPRAM_BYTES = 4096;
/** Idle time of the bus after a reset until a controller before revision B2 takes part (erratum E5). */
const IDLE_NS = 800e3;
const MUX_TO_PADS = 0xc;

export class UsbBlock extends RegisterBlock {
  constructor(chip) {
    super(chip, 'USB');
    this.onPortChange = () => {};
    /** (endpoint, isIn): the firmware gave the controller a buffer, or set a stall. */
    this.onArmed = () => {};
    this.idleAlarm = chip.clock.createAlarm(() => {
      this.connected = true;
    });
    this.awakeAlarm = chip.clock.createAlarm(() => this.#setSuspended(false));
    this.reset();
  }

  reset() {
    this.address = 0;
    this.mainCtrl = 0;
    this.sieCtrl = 0;
    this.sieStatus = 0;
    this.suspendChanged = false;
    this.awakeAlarm.cancel();
    this.idleAlarm.cancel();
    this.connected = !this.isOld;
    this.inReset = false;
    /** Set by a fault: 'deaf' answers no token any more, 'dead' does not hear the bus at all. Erratum E15 strikes amid an IN transfer: `hangsAtIn` is how. */
    this.hung = null;
    this.hangsAtIn = null;
    this.buffStatus = 0;
    this.epAbort = 0;
    this.epAbortDone = 0;
    /** The endpoint whose IN packet is on the bus: an abort of it is done when the packet is through. */
    this.inFlight = 0;
    this.stallArm = 0;
    this.stallNak = 0;
    this.muxing = 0;
    this.pwr = 0;
    this.nakPoll = 0x00100010;
    this.inte = 0;
    this.intf = 0;
    this.frame = 0;
    this.sofPending = false;
    this.sof_ns = 0;
    /** The longest from the start of a frame to the reading of SOF_RD. */
    this.slowestSof_ns = 0;
    this.phyDirect = 0;
    this.phyOverride = 0;
    this.phyTrim = 0;
    this.fieldsWritten_ns = new Float64Array(32).fill(-1e9);
    this.quiet = true;
    this.#update();
    this.onPortChange();
  }

  /** Before revision B2. */
  get isOld() {
    return this.rp2040.options.revision < 2;
  }

  /** The controller sees D+ high on GPIO15 instead of the bus, on which the pull-up stays. */
  get feigned() {
    const { ctrl } = this.rp2040.gpio[15];
    return (
      this.muxing === MUX_TO_PADS &&
      (ctrl & 0x1f) === 8 &&
      ((ctrl >>> 16) & 3) === 3 &&
      (this.phyDirect & 2) !== 0 &&
      (this.phyOverride & 4) !== 0
    );
  }

  get vbusDetected() {
    return (this.pwr & 0xc) === 0xc;
  }

  /** The pull-up is visible to the host. */
  get attached() {
    return (this.sieCtrl & SIE_PULLUP_EN) !== 0 && this.attachProblem === null && !this.rp2040.resets.isHeld(24);
  }

  /** Why the pull-up would not make a working device, or null. */
  get attachProblem() {
    if (!(this.mainCtrl & 1)) return 'MAIN_CTRL.CONTROLLER_EN is not set';
    if (!(this.muxing & 1) && !this.feigned) return 'USB_MUXING.TO_PHY is not set';
    if (!(this.muxing & 8)) return 'USB_MUXING.SOFTCON is not set';
    if (!this.vbusDetected) return 'USB_PWR does not report that VBUS is present';
    if (Math.abs(this.rp2040.clkUsbHz - CLK_USB_HZ) > 1) return `clk_usb is ${this.rp2040.clkUsbHz / 1e6} MHz instead of 48 MHz`;
    return null;
  }

  get raw() {
    const s = this.sieStatus;
    return (
      (this.stallNak ? 1 << 19 : 0) |
      (this.epAbortDone ? 1 << 18 : 0) |
      (this.sofPending ? 1 << 17 : 0) |
      (s & ST_SETUP_REC ? 1 << 16 : 0) |
      (s & ST_RESUME ? 1 << 15 : 0) |
      (this.suspendChanged ? 1 << 14 : 0) |
      (this.connected ? 1 << 13 : 0) |
      (s & ST_BUS_RESET ? 1 << 12 : 0) |
      (this.vbusDetected ? 1 << 11 : 0) |
      (s & ST_STALL_REC ? 1 << 10 : 0) |
      (this.buffStatus ? 1 << 4 : 0) |
      (s & ST_TRANS_COMPLETE ? 1 << 3 : 0)
    );
  }

  #update() {
    this.rp2040.setInterrupt(IRQ, ((this.raw & this.inte) | this.intf) !== 0);
  }

  #readFrame() {
    if (this.sofPending) this.slowestSof_ns = Math.max(this.slowestSof_ns, this.rp2040.clock.nanos - this.sof_ns);
    this.sofPending = false;
    this.#update();
    return this.frame;
  }

  get #status() {
    const line = this.inReset && !this.feigned ? 0 : ST_LINE_J;
    return this.sieStatus | (this.vbusDetected ? 1 : 0) | line | (this.connected ? ST_CONNECTED : 0);
  }

  #clearStatus(bits) {
    this.sieStatus &= ~(bits & ST_WRITE_CLEAR);
    if (bits & ST_SUSPENDED) this.suspendChanged = false;
  }

  #writeMainCtrl(value) {
    if (value & 2) this.rp2040.fail('USB', 'host mode is not modelled');
    this.mainCtrl = value & 0x80000003;
  }

  #abort(value) {
    if (this.isOld && value) this.rp2040.fail('USB', 'EP_ABORT before revision B2 blocks the controller for good (erratum E2)');
    this.epAbort = value >>> 0;
    this.epAbortDone |= this.epAbort & ~this.inFlight;
  }

  #armStall(value) {
    this.stallArm = value & 3;
    this.#update();
    if (value & 1) this.onArmed(0, true);
    if (value & 2) this.onArmed(0, false);
  }

  #writeMuxing(value) {
    this.muxing = value & 0xf;
    if (this.feigned) this.#awaitIdle();
    else if (this.rp2040.trouble.busyHub) this.idleAlarm.cancel();
  }

  static registers = {
    0x00: field('address', 0x7f),
    0x40: { read: (b) => b.mainCtrl, write: (b, value) => b.#writeMainCtrl(value) },
    0x48: { read: (b) => b.#readFrame() },
    0x4c: field('sieCtrl'),
    0x50: { read: (b) => b.#status, write: (b) => b.#clearStatus(b.rawWriteValue) },
    0x58: clearedByOnes('buffStatus'),
    0x5c: { read: () => 0 },
    0x60: { read: (b) => b.epAbort, write: (b, value) => b.#abort(value) },
    0x64: clearedByOnes('epAbortDone'),
    0x68: { read: (b) => b.stallArm, write: (b, value) => b.#armStall(value) },
    0x6c: field('nakPoll'),
    0x70: clearedByOnes('stallNak'),
    0x74: { read: (b) => b.muxing, write: (b, value) => b.#writeMuxing(value) },
    0x78: field('pwr', 0x3f),
    0x7c: field('phyDirect'),
    0x80: field('phyOverride'),
    0x84: field('phyTrim'),
    0x8c: { read: (b) => b.raw },
    0x90: field('inte', 0xfffff),
    0x94: field('intf', 0xfffff),
    0x98: { read: (b) => (b.raw & b.inte) | b.intf },
  };

  writeUint32(offset, value) {
    super.writeUint32(offset, value);
    this.#update();
    this.onPortChange();
  }

  writeDpram(offset, value, bytes) {
    const view = this.rp2040.usbDPRAMView;
    if (offset < 0x08 || offset >= 0x100) {
      if (bytes === 4) view.setUint32(offset, value, true);
      else if (bytes === 2) view.setUint16(offset, value, true);
      else view.setUint8(offset, value);
      return;
    }
    const word = offset & ~3;
    const old = view.getUint32(word, true);
    const shift = 8 * (offset & 3);
    const mask = bytes === 4 ? 0xffffffff : bytes === 2 ? 0xffff << shift : 0xff << shift;
    const next = ((old & ~mask) | ((value << shift) & mask)) >>> 0;
    if (word < 0x80) this.#checkEndpointControl(word, next);
    else this.#checkBufferControl(word, old, next);
    view.setUint32(word, next, true);
    if (word >= 0x80 && next & ~old & (BC_AVAILABLE | BC_STALL)) {
      this.onArmed((word - 0x80) >> 3, (word & 4) === 0);
    }
  }

  #checkEndpointControl(word, value) {
    if (!(value & EP_ENABLE)) return;
    if (value & EP_DOUBLE) this.rp2040.fail('USB', 'double buffering is not modelled');
    const name = `EP${word >> 3} ${word & 4 ? 'OUT' : 'IN'}`;
    if (value & 0x3f) this.rp2040.fail('USB', `${name}: buffer address 0x${(value & 0xffff).toString(16)} is not 64-byte aligned`);
    const base = value & 0xffc0;
    if (base < 0x180 || base > DPRAM_BYTES - 64) this.rp2040.fail('USB', `${name}: buffer at 0x${base.toString(16)}, outside 0x180..0xfc0`);
  }

  #checkBufferControl(word, old, next) {
    const chip = this.rp2040;
    const now = chip.clock.nanos;
    const endpoint = (word - 0x80) >> 3;
    const isOut = (word & 4) !== 0;
    const name = `EP${endpoint} ${isOut ? 'OUT' : 'IN'} buffer control`;
    const bit = 2 * endpoint + (isOut ? 1 : 0);
    const underWay = ((this.inFlight >>> bit) & 1) !== 0;
    const aborted = ((this.epAbortDone >>> bit) & 1) !== 0;
    if (next >>> 16) chip.fail('USB', `${name}: double buffering is not modelled`);
    const was = old & 0xffff;
    const fieldsChanged = ((was ^ next) & ~(BC_AVAILABLE | BC_STALL)) !== 0;
    const mayTake = this.quiet || aborted || (this.isOld && !fieldsChanged);
    if (this.isOld && underWay && fieldsChanged) chip.fail('USB', `${name}: written while its packet is on the bus`);
    if (was & BC_AVAILABLE && (fieldsChanged || !(next & BC_AVAILABLE)) && !mayTake)
      chip.fail('USB', `${name}: written while the controller owns the buffer; abort the endpoint (EP_ABORT) first`);
    if (next & BC_AVAILABLE && !(was & BC_AVAILABLE)) {
      if (fieldsChanged) chip.fail('USB', `${name}: AVAILABLE set in the same write as the other fields; write those first`);
      const gap_ns = now - this.fieldsWritten_ns[bit];
      if (gap_ns < 1e9 / chip.trueHz(CLK_USB_HZ)) {
        const wanted = 'wait at least one cycle of clk_usb (21 ns)';
        chip.fail('USB', `${name}: AVAILABLE set ${gap_ns.toFixed(0)} ns after the other fields; ${wanted}`);
      }
      if ((next & BC_LENGTH) > 64) chip.fail('USB', `${name}: length ${next & BC_LENGTH} exceeds the 64-byte packet`);
      if (!isOut && !(next & BC_FULL)) chip.fail('USB', `${name}: an IN buffer was made available without FULL`);
      if (isOut && next & BC_FULL) chip.fail('USB', `${name}: an OUT buffer was made available with FULL set`);
    }
    if (fieldsChanged) this.fieldsWritten_ns[bit] = now;
  }

  #control(endpoint, isIn) {
    return this.rp2040.usbDPRAMView.getUint32(8 * endpoint + (isIn ? 0 : 4), true);
  }

  /** The buffer that answers a token, or null if the endpoint is deaf. */
  #buffer(endpoint, isIn) {
    const word = 0x80 + 8 * endpoint + (isIn ? 0 : 4);
    const bit = 2 * endpoint + (isIn ? 0 : 1);
    let control = EP_INT_PER_BUFFER;
    let address = 0x100;
    if (endpoint !== 0) {
      control = this.#control(endpoint, isIn);
      if (!(control & EP_ENABLE)) return null;
      address = control & 0xffc0;
    }
    return { word, bit, control, address, value: this.rp2040.usbDPRAMView.getUint32(word, true) };
  }

  /** An IN packet lies ready for the next token. */
  offers(endpoint) {
    return ((this.#buffer(endpoint, true)?.value ?? 0) & BC_AVAILABLE) !== 0;
  }

  #complete(buffer, endpoint, status) {
    this.rp2040.usbDPRAMView.setUint32(buffer.word, status, true);
    const everyBuffer = endpoint === 0 ? this.sieCtrl & SIE_EP0_INT_1BUF : buffer.control & EP_INT_PER_BUFFER;
    if (everyBuffer) this.buffStatus |= 1 << buffer.bit;
    this.sieStatus |= ST_TRANS_COMPLETE | ST_ACK_REC;
    this.#update();
  }

  #stalls(buffer, endpoint, isIn) {
    if (!(buffer.value & BC_STALL)) return false;
    if (endpoint === 0 && !((this.stallArm >>> (isIn ? 0 : 1)) & 1)) return false;
    this.stallNak |= 1 << buffer.bit;
    this.sieStatus |= ST_STALL_REC;
    this.#update();
    return true;
  }

  /** The controller moves data on clk_sys too; its behaviour on a slower one than clk_usb is not documented. */
  #checkClock() {
    if (this.attached && this.rp2040.clkSys < CLK_USB_HZ)
      this.rp2040.fail('USB', `traffic while clk_sys is ${this.rp2040.clkSys / 1e6} MHz`);
  }

  #hears(address) {
    this.#checkClock();
    this.quiet = false;
    return this.attached && !this.hung && this.connected && !this.feigned && address === this.address;
  }

  /** The packet on the bus is through, or the line went dead under it. */
  endTransaction() {
    this.epAbortDone |= this.epAbort & this.inFlight;
    this.inFlight = 0;
    this.#update();
  }

  busReset() {
    this.endTransaction();
    this.quiet = true;
    this.inReset = true;
    this.connected = !this.isOld;
    this.idleAlarm.cancel();
    if (this.hung === 'dead') return;
    this.sieStatus |= ST_BUS_RESET;
    this.#setSuspended(false);
  }

  busResetEnded() {
    this.inReset = false;
    if (!this.rp2040.trouble.busyHub) this.#awaitIdle();
  }

  #awaitIdle() {
    if (!this.connected) this.idleAlarm.schedule(IDLE_NS);
  }

  /** SUSPENDED is a level that is never written; DEV_SUSPEND reports that it changed, and is cleared through the same bit. */
  #setSuspended(is) {
    this.awakeAlarm.cancel();
    if (this.hung === 'dead') return;
    if (this.isSuspended !== is) {
      this.sieStatus ^= ST_SUSPENDED;
      this.suspendChanged = true;
    }
    this.#update();
  }

  get isSuspended() {
    return (this.sieStatus & ST_SUSPENDED) !== 0;
  }

  suspend() {
    this.#setSuspended(true);
  }

  resume() {
    if (this.hung === 'dead') return;
    this.sieStatus |= ST_RESUME;
    this.#update();
    this.awakeAlarm.schedule(this.rp2040.trouble.lateResume ? AWAKE_LATE_NS : AWAKE_NS);
  }

  sof(frame) {
    if (this.hung === 'dead' || !this.connected || this.feigned) return;
    this.#checkClock();
    this.frame = frame & 0x7ff;
    if (!this.sofPending) this.sof_ns = this.rp2040.clock.nanos;
    this.sofPending = true;
    if (this.inte & (1 << 17)) this.#update();
  }

  /** @returns true if acknowledged */
  setup(address, packet) {
    if (!this.#hears(address)) return false;
    this.rp2040.usbDPRAM.set(packet, 0);
    this.stallArm = 0;
    this.sieStatus |= ST_SETUP_REC;
    this.#update();
    return true;
  }

  /** @returns { answer: 'none' | 'nak' | 'stall' } or { answer: 'data', pid, data, acknowledged() } */
  inToken(address, endpoint) {
    if (!this.#hears(address)) return { answer: 'none' };
    if (this.hangsAtIn) {
      this.hung = this.hangsAtIn;
      return { answer: 'none' };
    }
    const buffer = this.#buffer(endpoint, true);
    if (!buffer) return { answer: 'none' };
    if (this.#stalls(buffer, endpoint, true)) return { answer: 'stall' };
    if (!(buffer.value & BC_AVAILABLE) || (this.epAbort >>> buffer.bit) & 1) return { answer: 'nak' };
    this.inFlight = 1 << buffer.bit;
    const data = this.rp2040.usbDPRAM.slice(buffer.address, buffer.address + (buffer.value & BC_LENGTH));
    return {
      answer: 'data',
      pid: buffer.value & BC_PID ? 1 : 0,
      data,
      acknowledged: () => {
        this.#complete(buffer, endpoint, buffer.value & ~(BC_AVAILABLE | BC_FULL));
        this.endTransaction();
      },
    };
  }

  /** @returns 'none' | 'nak' | 'stall' | 'ack' */
  outData(address, endpoint, pid, data) {
    if (!this.#hears(address)) return 'none';
    const buffer = this.#buffer(endpoint, false);
    if (!buffer) return 'none';
    if (this.#stalls(buffer, endpoint, false)) return 'stall';
    if (!(buffer.value & BC_AVAILABLE) || (this.epAbort >>> buffer.bit) & 1) return 'nak';
    const expected = buffer.value & BC_PID ? 1 : 0;
    if (expected !== pid) this.rp2040.fail('USB', `EP${endpoint} OUT: host sent DATA${pid}, the firmware expects DATA${expected}`);
    const room = buffer.value & BC_LENGTH;
    if (data.length > room) this.rp2040.fail('USB', `EP${endpoint} OUT: packet of ${data.length} bytes into a buffer of ${room}`);
    this.rp2040.usbDPRAM.set(data, buffer.address);
    this.#complete(buffer, endpoint, (buffer.value & ~(BC_AVAILABLE | BC_LENGTH)) | BC_FULL | data.length);
    return 'ack';
  }
}
