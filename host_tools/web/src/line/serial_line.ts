/** A fingertip on a port of this computer, by Web Serial. */
import type { Line } from './line';

/** USB ids of a fingertip (firmware/usb/descriptors.c). 1209:0001 is a test id that others use too. */
export const FINGERTIP_PORTS: SerialPortFilter[] = [{ usbVendorId: 0x1209, usbProductId: 0x0001 }];

/** What waits while the page is busy: ten seconds at 1308 contact and raw packets a second. The
 * fingertip drops whole packets, and counts them, where it is full. */
const BUFFER_bytes = 1 << 22;

export function hasWebSerial(): boolean {
  return 'serial' in navigator;
}

/** Why there is no Web Serial, and what to do. */
export function whyNoWebSerial(): string {
  return globalThis.isSecureContext
    ? 'This browser cannot reach serial ports: open this page in Chrome, Edge or Opera on a desktop computer. ' +
        'Simulated fingertips and replays work here too.'
    : 'Browsers let a page reach serial ports only over https or from localhost: start "fingertip web" on this ' +
        'computer and open the address that it prints.';
}

function nameOf(port: SerialPort): string {
  const { usbVendorId, usbProductId } = port.getInfo();
  const hex = (id: number): string => id.toString(16).padStart(4, '0');
  return usbVendorId === undefined ? 'serial port' : `USB port ${hex(usbVendorId)}:${hex(usbProductId ?? 0)}`;
}

export class SerialLine implements Line {
  readonly label: string;
  private reader: ReadableStreamDefaultReader<Uint8Array> | null = null;
  private writer: WritableStreamDefaultWriter<Uint8Array> | null = null;
  private sending: Promise<unknown> = Promise.resolve();
  private closing = false;

  constructor(readonly port: SerialPort) {
    this.label = nameOf(port);
  }

  async open(receive: (bytes: Uint8Array, at_ms: number) => void, closed: (why: string) => void): Promise<void> {
    this.closing = false;
    try {
      await this.port.open({ baudRate: 115200, bufferSize: BUFFER_bytes });
    } catch (error) {
      throw new Error(this.whyNotOpened(error));
    }
    // Streams end where DTR is low; opening raises it, so it is no loss if this fails.
    await this.port.setSignals({ dataTerminalReady: true }).catch(() => undefined);
    void this.read(receive, closed);
  }

  /** One after the other: a port has one writer. */
  send(bytes: Uint8Array): Promise<void> {
    const sent = this.sending.then(() => this.write(bytes));
    this.sending = sent.catch(() => undefined);
    return sent;
  }

  private async write(bytes: Uint8Array): Promise<void> {
    const writable = this.port.writable;
    if (!writable) {
      throw new Error('the port is closed; press "Connect"');
    }
    const writer = writable.getWriter();
    this.writer = writer;
    try {
      await writer.write(bytes);
    } catch {
      throw new Error('the port takes no more commands: plug the fingertip in again');
    } finally {
      writer.releaseLock();
      this.writer = null;
    }
  }

  async close(): Promise<void> {
    this.closing = true;
    await this.writer?.abort().catch(() => undefined);
    await this.reader?.cancel().catch(() => undefined);
    await this.port.close().catch(() => undefined);
  }

  private async read(receive: (bytes: Uint8Array, at_ms: number) => void, closed: (why: string) => void): Promise<void> {
    let why = 'the port was closed; press "Connect"';
    // An overrun or a line error ends a stream, and the port has another; a lost device has none.
    while (this.port.readable && !this.closing) {
      const reader = this.port.readable.getReader();
      this.reader = reader;
      try {
        for (let piece = await reader.read(); !piece.done; piece = await reader.read()) {
          receive(piece.value, performance.now());
        }
      } catch (error) {
        why =
          error instanceof DOMException && error.name === 'NetworkError'
            ? 'unplugged, or switched off: plug it in again and it comes back by itself'
            : `the port failed (${String(error)}): plug the fingertip in again`;
      } finally {
        reader.releaseLock();
        this.reader = null;
      }
    }
    if (!this.closing) {
      await this.port.close().catch(() => undefined);
      closed(why);
    }
  }

  private whyNotOpened(error: unknown): string {
    const name = error instanceof DOMException ? error.name : '';
    switch (name) {
      case 'InvalidStateError':
        return 'this page has that port open already';
      case 'NetworkError':
        return (
          'the port cannot be opened: close what else uses it (the tool, another tab), or, on Linux, ' +
          'install the rule that "fingertip rule" prints and plug the fingertip in again'
        );
      case 'SecurityError':
        return 'this page may not use serial ports: allow it in the settings of this site, then press "Connect"';
      default:
        return `the port cannot be opened (${String(error)}): plug the fingertip in again`;
    }
  }
}

/** Asks for a port; needs a click. null: nothing was chosen. Throws Error, a sentence. */
export async function requestPort(): Promise<SerialPort | null> {
  try {
    return await navigator.serial.requestPort({ filters: FINGERTIP_PORTS });
  } catch (error) {
    if (error instanceof DOMException && error.name === 'NotFoundError') {
      return null;
    }
    throw new Error(
      error instanceof DOMException && error.name === 'SecurityError'
        ? 'this page may not use serial ports: allow it in the settings of this site, then press "Connect"'
        : `the browser gave no port (${String(error)}): press "Connect" again`,
    );
  }
}

/** Those that the page was allowed before, and that are there now. */
export async function rememberedPorts(): Promise<SerialPort[]> {
  const ports = hasWebSerial() ? await navigator.serial.getPorts().catch(() => []) : [];
  return ports.filter((port) => {
    const { usbVendorId, usbProductId } = port.getInfo();
    return FINGERTIP_PORTS.some((each) => each.usbVendorId === usbVendorId && each.usbProductId === usbProductId);
  });
}
