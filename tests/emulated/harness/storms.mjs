/**
 * What silicon and odd hosts do to a release image, each as one figure: the tests hold it to what it must be, and
 * figures.mjs prints it for the report.
 */
import { codesFor, compensate } from '../../../host_tools/simulation/emulator/board/ms5840.mjs';
import { setupPacket } from '../../../host_tools/simulation/emulator/usb/host.mjs';
import { CrashBench, split } from './crash_bench.mjs';
import { ImageBench } from './image_bench.mjs';

/** Longer than the firmware waits for the flash interface. */
const SSI_STALL_ns = 400e3;
const RAM_BASE = 0x20000000;
const [FAULT, WATCHDOG] = [1, 3]; // crash.h
const LAST_WORDS_ms = 20; // crash.c
const STORE_SLOTS = 8; // store.h
/** In the guard below the stack. */
const NOWHERE = 0x20040000;
const [TYPE_HEALTH, TYPE_ACK] = [0x04, 0x05];
// Instructions: str, strh and strb r0, [r1]; b . ; bx lr
const [STR, STRH, STRB, STAND_STILL, RETURN] = ['0860', '0880', '0870', 'fee7', '7047'];

export class Storms {
  /** images: the folder with those of all boards; tools: see ImageBench. */
  constructor(images, tools) {
    this.images = images;
    this.tools = tools;
  }

  bench(board, options) {
    return new ImageBench(this.images, this.tools, board, options);
  }

  /** How often the device detaches itself from a host that resets it twice before it asks for anything: at the first connection, after a reboot of the host, and plugged in again. */
  ehciDetaches(board, revision) {
    const bench = this.bench(board, { companion: true, fastEnumeration: false, revision });
    const { host } = bench.machine;
    bench.stream(1000);
    let addressed = false;
    host.resetDevice(() => {
      addressed = true;
    });
    bench.until(() => addressed, 1000, 'address');
    bench.run(1000);
    host.unplug();
    bench.run(300);
    host.plug();
    bench.stream(1000);
    bench.assertStreams(100);
    return bench.end().usb.detaches;
  }

  /** How often the watchdog bites, or the device detaches itself, while the host holds the bus low for so long. */
  se0Bites(board, revision, held_ms) {
    const bench = this.bench(board, { revision });
    bench.stream();
    let addressed = false;
    bench.machine.host.holdReset(held_ms * 1e6, () => {
      addressed = true;
    });
    bench.run(held_ms + 200);
    const { reboots, usb } = bench.end();
    return reboots + usb.detaches + (addressed ? 0 : 1);
  }

  /** A request that the host gives up after this time, and one that it begins in the same frame: whether the answer is to the second. */
  #abandoned(bench, after_ns) {
    const { host, time } = bench.machine;
    const abandoned = host.control(setupPacket(0x80, 6, 2 << 8, 0, 67), null, () => {});
    if (!bench.machine.run(time.nanos + after_ns)) throw new Error(bench.machine.result.warnings.join());
    host.cancel(abandoned);
    let answer = null;
    host.control(setupPacket(0x80, 8, 0, 0, 1), null, (status, data) => {
      answer = `${status} ${Buffer.from(data).toString('hex')}`;
    });
    bench.until(() => answer, 5, 'answer');
    return answer === 'ok 01';
  }

  /** A host that opens and closes the port at so many moments of the stream, and gives requests up: how often it gets a wrong answer, or the stream does not come again. */
  wrongAfterWithdrawal(board, revision, times) {
    const bench = this.bench(board, { revision });
    const { client } = bench.machine;
    let wrong = 0;
    for (let i = 0; i < times; i++) {
      const before = bench.bytes;
      bench.stream();
      bench.run(5 + i * 13e-3);
      wrong += bench.bytes > before ? 0 : 1;
      for (let k = 0; k < 10; k++) wrong += this.#abandoned(bench, 20e3 + (10 * i + k) * 350) ? 0 : 1;
      client.setDtr(false);
      bench.run(5);
      client.setDtr(true);
      bench.run(5);
    }
    bench.end();
    return wrong;
  }

  /** What is stored after the flash interface hung for a moment in the middle of a command: how many of `times` settings are not kept after all. */
  lostAfterStall(board, times) {
    const bench = this.bench(board);
    const { client, chip, memory } = bench.machine;
    bench.stream();
    let lost = 0;
    for (let i = 0; i < times; i++) {
      bench.run(50);
      client.write(bench.encoded('osr', i % 2 ? '256' : '512'));
      client.write(bench.encoded('keep'));
      bench.run(3 + i * 0.37);
      chip.ssi.stall_ns = SSI_STALL_ns;
      bench.run(300);
      client.write(bench.encoded('osr', i % 2 ? '256' : '1024'));
      const { programs } = memory;
      client.write(bench.encoded('keep'));
      bench.run(500);
      lost += memory.programs > programs && chip.ssi.rx.length === 0 ? 0 : 1;
    }
    bench.end();
    return lost;
  }

  /** A word, a halfword and a byte written to the vectors, to code and to constants: how many were tried, and how many changed nothing and ended in a crash record. */
  codeWrites(board) {
    const found = { tried: 0, trapped: 0 };
    for (const place of ['__vectors', 'scan_take', 'rp2040_irq_priorities']) {
      for (const store of [STR, STRH, STRB]) {
        const bench = new CrashBench(this.images, this.tools, board);
        const { chip } = bench.machine;
        bench.stream();
        bench.until(() => chip.core.waiting && chip.core.IPSR === 0, 10, 'sleep');
        const [target, code] = [bench.address(place), bench.address('kept')]; // the record of crashes is not in use yet
        const at = target - RAM_BASE;
        const before = Buffer.from(chip.sram.slice(at, at + 4));
        bench.patch('kept', store + STAND_STILL);
        chip.core.registers.set([~before.readInt32LE(0), target], 0);
        chip.core.registers[15] = code;
        chip.core.waiting = false;
        let changed = true;
        chip.onWatchdog = () => {
          changed = !before.equals(chip.sram.slice(at, at + 4));
        };
        bench.untilReset();
        const { kind, pc } = bench.crash();
        found.tried += 1;
        found.trapped += !changed && kind === FAULT && pc === code ? 1 : 0;
      }
    }
    return found;
  }

  /** The chip resets itself so long after a slow erase has begun, its ring oscillator being so fast: whether it starts again. `how` is 'fault', or 'unfed' for a watchdog whose last food was long before. */
  eraseResetRecovered(board, rosc_hz, after_ms, how) {
    const bench = new CrashBench(this.images, this.tools, board, { rosc_hz, flashSpeed: 'slowest' });
    const { machine } = bench;
    const { chip, memory } = machine;
    bench.stream();
    let erases = false;
    memory.onStep = ({ kind }, step) => {
      erases ||= kind === 'erase' && step === 'begins';
    };
    for (let i = 0; i < 2 * STORE_SLOTS && !erases; i++) {
      machine.client.write(bench.encoded('osr', i % 2 ? '256' : '512'));
      machine.client.write(bench.encoded('keep'));
      for (let ms = 0; ms < 100 && !erases; ms++) bench.run(1);
    }
    if (how === 'unfed') chip.watchdog.writeUint32(0x04, 2 * 1000 * (after_ms + LAST_WORDS_ms));
    if (how === 'unfed') chip.timer.writeUint32(0x18, (chip.timer.count_us + 1000 * after_ms) >>> 0);
    bench.patch('port_watchdog_feed', RETURN);
    bench.run(after_ms);
    if (how === 'fault') {
      bench.until(() => chip.core.waiting && chip.core.IPSR === 0, 10, 'sleep');
      chip.core.registers[15] = NOWHERE;
      chip.core.waiting = false;
    }
    const stillErases = machine.memory.isBusy;
    try {
      bench.untilReset();
      const { kind } = bench.crash();
      bench.stream();
      return erases && stillErases && kind === (how === 'fault' ? FAULT : WATCHDOG);
    } catch {
      return false;
    }
  }

  /**
   * PROMs whose CRC-4 is right by chance, three of each array (sensors k, k + 5 and k + 10): how many make a pressure or a
   * temperature at rest that is further off than this, and how many of those are used without a doubt; and how many
   * other sensors are doubted.
   */
  promCollisions(board, arrays, wrong_Pa = 1200, wrong_degC = 0.7) {
    const found = { planted: 0, wrong: 0, undoubted: 0, innocent_doubted: 0 };
    const [pressure_Pa, temperature_degC] = [100e3, 25];
    for (let i = 0; i < arrays; i++) {
      const planted = [0, 5, 10].map((first) => first + (i % 5));
      const faults = planted.map((sensor) => ({ type: 'sensor_prom_collision', sensor, from_s: 0 }));
      const bench = this.bench(board, { seed: 1 + i, faults });
      bench.stream();
      bench.run(500);
      const column = bench.lastRow();
      bench.machine.board.sensors.forEach(({ prom, collidingProm }, k) => {
        const has = (name) => ((column[name] >>> k) & 1) === 1;
        if (!planted.includes(k)) {
          found.innocent_doubted += has('valid') && !has('doubtful') ? 0 : 1;
          return;
        }
        const { d1, d2 } = codesFor(prom, pressure_Pa, temperature_degC);
        const read = compensate(collidingProm, d1, d2);
        const isWrong =
          Math.abs(read.pressure_Pa - pressure_Pa) > wrong_Pa || Math.abs(read.temperature_cdegC / 100 - temperature_degC) > wrong_degC;
        found.planted += 1;
        found.wrong += isWrong ? 1 : 0;
        found.undoubted += isWrong && has('valid') && !has('saturated') && !has('doubtful') ? 1 : 0;
      });
      bench.end();
    }
    return found;
  }

  /** The bus is suspended so many times between two packets of a frame: how often the first answer after the resume is lost. */
  tornAfterResume(board, times) {
    let cutting = false;
    const onUsbPacket = ({ endpoint, isIn, data }) => {
      if (!cutting || !endpoint || !isIn || data.length < 64 || data.at(-1) === 0) return;
      cutting = false;
      bench.machine.host.suspend();
    };
    const bench = this.bench(board, { onUsbPacket });
    const { machine } = bench;
    let torn = 0;
    for (let i = 0; i < times; i++) {
      bench.stream();
      bench.run(20 + ((i * 1.237) % 5));
      cutting = true;
      bench.until(() => !cutting, 100, 'frame of several packets');
      bench.run(13);
      machine.host.resume();
      bench.run(40);
      machine.client.write(bench.encoded('health'));
      bench.run(20);
      const [first, second] = split(Buffer.concat(bench.received))
        .slice(-2)
        .map((packet) => packet[1]);
      torn += first === TYPE_ACK && second === TYPE_HEALTH ? 0 : 1;
      bench.received = [];
    }
    bench.end();
    return torn;
  }
}
