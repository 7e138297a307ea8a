/**
 * One I2C bus: wired-AND lines, the targets on it, and a log of its transfers.
 *
 * A controller block drives whole bytes (start, writeByte, readByte, stop). GPIO may pull the lines as well (`drive`), which is how
 * firmware frees a stuck bus: clocks, START and STOP made by hand reach the targets, data bits made by hand do not.
 *
 * A target implements start(), write(byte) -> acknowledged, read() -> byte or null when it does not drive,
 * readAcknowledged(bool), stop(), clock() for a bare SCL pulse, and holdsSda.
 */
export class I2cTarget {
  constructor(address) {
    this.address = address;
    this.phase = 'idle';
  }

  get holdsSda() {
    return false;
  }

  start() {
    this.phase = 'address';
  }

  write(byte) {
    if (this.phase === 'address') {
      const mine = byte >> 1 === this.address && this.acknowledgesAddress();
      this.phase = !mine ? 'ignored' : byte & 1 ? 'read' : 'write';
      return mine;
    }
    return this.phase === 'write' ? this.receive(byte) : false;
  }

  read() {
    return this.phase === 'read' ? this.transmit() : null;
  }

  readAcknowledged(acknowledged) {
    if (!acknowledged && this.phase === 'read') this.phase = 'ignored';
  }

  stop() {
    this.phase = 'idle';
  }

  clock() {}

  acknowledgesAddress() {
    return true;
  }
}

/** A transfer in the log of a bus; muxes: their control bytes, or the data line. */
export class Transfer {
  address = -1;
  read = false;
  bytes = [];
  acknowledged = true;

  constructor(start_ns, muxes) {
    this.start_ns = start_ns;
    this.end_ns = start_ns;
    this.muxes = muxes;
  }

  /** The controller has sent a byte, of which the first is the address. */
  sent(byte, acknowledged, statistics) {
    if (this.address < 0) {
      this.address = byte >> 1;
      this.read = (byte & 1) === 1;
    } else this.bytes.push(byte);
    if (acknowledged) return;
    this.acknowledged = false;
    statistics.nacks += 1;
  }
}

export class I2cBus {
  /**
   * @param options now_ns: () => time; rise_ns: SCL rise time; report: Report;
   *   onTransfer(transfer): called at the end of each
   */
  constructor({ now_ns, rise_ns, report, onTransfer = () => {} }) {
    this.now_ns = now_ns;
    this.rise_ns = rise_ns;
    this.report = report;
    this.onTransfer = onTransfer;
    this.targets = [];
    this.onReleased = null;
    /** An I2cWaveform, and the bit times of the block that drives the bus. */
    this.waveform = null;
    this.timing = null;
    this.onLines = () => {};
    this.problem = () => null;
    this.muxState = () => '';
    /** The last byte was acknowledged as soon as SCL fell. */
    this.wasFast = false;
    this.gpio = { sda: false, scl: false };
    this.current = null;
    this.statistics = { transactions: 0, nacks: 0 };
  }

  get sdaLow() {
    return this.gpio.sda || this.targets.some((t) => t.holdsSda);
  }

  get sclLow() {
    return this.gpio.scl;
  }

  /** A target let go of (or grabbed) SDA: update the pins and a waiting controller. */
  linesChanged() {
    this.onLines();
    this.waveform?.lines(!this.sdaLow, !this.sclLow, this.now_ns());
    if (!this.sdaLow && !this.sclLow && this.onReleased) {
      const released = this.onReleased;
      this.onReleased = null;
      released();
    }
  }

  start() {
    this.#finish();
    this.waveform?.start(this.timing, this.now_ns());
    this.current = new Transfer(this.now_ns(), this.muxState());
    for (const t of this.targets) t.start();
  }

  writeByte(byte) {
    let acknowledged = false;
    this.wasFast = false;
    for (const t of this.targets) acknowledged = t.write(byte) || acknowledged;
    this.waveform?.byte((byte << 1) | (acknowledged ? 0 : 1), this.timing, this.now_ns());
    this.current.sent(byte, acknowledged, this.statistics);
    return acknowledged;
  }

  readByte(acknowledge) {
    let byte = 0xff;
    let drivers = 0;
    for (const t of this.targets) {
      const answer = t.read();
      if (answer === null) continue;
      byte &= answer.byte ?? answer;
      drivers += answer.drivers ?? 1;
    }
    if (drivers > 1)
      this.report.warn(
        'i2c',
        `${drivers} sensors answered one read of 0x${this.current.address.toString(16)} at once; their data was ANDed`,
      );
    for (const t of this.targets) t.readAcknowledged(acknowledge);
    this.waveform?.byte((byte << 1) | (acknowledge ? 0 : 1), this.timing, this.now_ns());
    this.current.bytes.push(byte);
    return byte;
  }

  stop() {
    this.#finish();
    this.waveform?.stop(this.timing, this.now_ns());
    for (const t of this.targets) t.stop();
    this.linesChanged();
  }

  /** The controller lost arbitration: no STOP of its own. */
  abandon() {
    if (this.current) this.current.acknowledged = false;
    this.#finish();
    this.waveform?.abandon();
  }

  #finish() {
    const transfer = this.current;
    if (!transfer) return;
    this.current = null;
    if (transfer.address < 0) return;
    this.statistics.transactions += 1;
    transfer.end_ns = this.now_ns();
    this.onTransfer(transfer);
  }

  /** GPIO pulls (true) or releases (false) the lines. */
  drive(sda, scl) {
    const sdaWas = this.sdaLow;
    const sclWas = this.gpio.scl;
    if (sclWas !== scl) {
      this.gpio.scl = scl;
      if (!scl) for (const t of this.targets) t.clock();
    }
    this.gpio.sda = sda;
    const sdaIs = this.sdaLow;
    if (!scl && !sclWas && sdaWas !== sdaIs) {
      if (sdaIs) for (const t of this.targets) t.start();
      else for (const t of this.targets) t.stop();
    }
    this.linesChanged();
  }
}
