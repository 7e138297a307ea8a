/** A release image whose memory and code a test meddles with, and what the device tells of its last crash. */
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { ImageBench } from './image_bench.mjs';

const [TYPE_HEALTH, TYPE_CRASH] = [0x04, 0x06];

export class CrashBench extends ImageBench {
  constructor(images, tools, name, options) {
    super(images, tools, name, options);
    const listed = execFileSync('arm-none-eabi-nm', ['-S', this.elf], { encoding: 'utf8' }).trim().split('\n');
    const lines = listed.map((l) => l.split(' '));
    this.symbols = new Map(lines.map((words) => [words.at(-1), parseInt(words[0], 16) & ~1]));
    this.functions = lines
      .filter((words) => /^[tT]$/.test(words.at(-2)) && !words.at(-1).startsWith('$'))
      .map((words) => [parseInt(words[0], 16) & ~1, words.at(-1)])
      .sort((a, b) => a[0] - b[0]);
  }

  address(name) {
    assert.ok(this.symbols.has(name), `${this.elf} has ${name}`);
    return this.symbols.get(name);
  }

  /** The function of an address. */
  place(address) {
    return this.functions.findLast(([start]) => start <= address)?.[1];
  }

  patch(name, hex) {
    this.machine.chip.sram.set(Buffer.from(hex, 'hex'), this.address(name) - 0x20000000);
  }

  /** Runs into the reset; how long it took, ms. */
  untilReset(limit_ms = 2000) {
    const [from_ms, before] = [this.now_ms, this.machine.reboots];
    return this.until(() => this.machine.reboots > before, limit_ms, 'reset') - from_ms;
  }

  /** The body of the answer to a command. */
  answer(command, type) {
    this.until(() => this.machine.host.configured, 500, 'enumeration');
    this.run(10);
    this.received = [];
    this.machine.client.write(this.encoded(command));
    this.run(20);
    const packet = split(Buffer.concat(this.received)).find((p) => p[1] === type);
    assert.ok(packet, `no answer to ${command}`);
    return packet.subarray(12);
  }

  crash() {
    return decoded(this.answer('crash', TYPE_CRASH));
  }

  resets() {
    return this.answer('health', TYPE_HEALTH).readUInt32LE(4 * 16);
  }
}

/** CRC-32/ISO-HDLC. */
function crc32(bytes) {
  let crc = ~0;
  for (const byte of bytes) {
    crc ^= byte;
    for (let bit = 0; bit < 8; bit++) crc = (crc >>> 1) ^ (crc & 1 ? 0xedb88320 : 0);
  }
  return ~crc >>> 0;
}

/** The whole packets on a line (PROTOCOL.md), header first. One that a suspend or a reset has cut has a wrong CRC, and is left out. */
export function split(bytes) {
  const packets = [];
  for (let from = 0, at; (at = bytes.indexOf(0, from)) >= 0; from = at + 1) {
    const out = [];
    for (let i = from; i < at; ) {
      const code = bytes[i];
      out.push(...bytes.subarray(i + 1, i + code));
      i += code;
      if (code < 255 && i < at) out.push(0);
    }
    const packet = Buffer.from(out);
    if (packet.length > 4 && crc32(packet.subarray(0, -4)) === packet.readUInt32LE(packet.length - 4)) packets.push(packet);
  }
  return packets;
}

function decoded(body) {
  const [kind, exception, vector, activity, stuck] = body;
  const words = Array.from({ length: 9 + 8 }, (_, i) => body.readUInt32LE(21 + 4 * i));
  const [r0, r1, r2, r3, r12, lr, pc, xpsr, sp] = words;
  const events = Array.from({ length: 8 }, (_, i) => [body[5 + i], body[13 + i], words[9 + i] * 1.024]).filter(([code]) => code);
  const registers = { r0, r1, r2, r3, r12, lr, pc, xpsr, sp };
  return { kind, exception, vector, activity, stuck, ...registers, events, t_us: Number(body.readBigUInt64LE(89)) };
}
