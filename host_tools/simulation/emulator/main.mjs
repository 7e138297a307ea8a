#!/usr/bin/env node
/** Command line of the emulator: see USAGE. */
import { createInterface } from 'node:readline';
import { setImmediate as breathe, setTimeout as sleep } from 'node:timers/promises';
import { BOARDS, findBoard } from './board/boards.mjs';
import { findSensor } from './board/ms5840.mjs';
import { strobe } from './board/sync_pin.mjs';
import { FLASH_BYTES } from './chip/flash_memory.mjs';
import { isPositive, isWhole, main, numberOf } from './command_line.mjs';
import { InputError, readInput } from './errors.mjs';
import { readFaults } from './faults.mjs';
import { readImage } from './image.mjs';
import { readHostScript, scheduleHostScript } from './port/host_script.mjs';
import { PtyPort } from './port/pty_port.mjs';
import { SteppedPort } from './port/stepped_port.mjs';
import { DEFAULT_SERIAL, Machine } from './machine.mjs';
import { OutputFile } from './output_file.mjs';
import { readScenario } from './scenario.mjs';
import { UsbRedirServer } from './usb/usbredir.mjs';
import { VcdDump } from './vcd.mjs';

const USAGE = `usage: main.mjs --image FILE.bin --board NAME --scenario FILE.csv [options]

Runs an unmodified firmware image on an emulated board with simulated sensors and a USB host.

  --image FILE         raw flash image (.bin), loaded at flash offset 0
  --board NAME         ${BOARDS.join(' or ')}
  --scenario FILE      what the sensors feel (format: scenario.mjs)
  --sensor NAME        what the board carries: ms5840 or ms5837_30ba; default ms5840
  --seconds N          emulated seconds to run; default: the scenario's last row
  --seed N             noise, sensor tolerances, SRAM content at power-on; default 1
  --serial HEX16       unique id of the flash chip; default ${DEFAULT_SERIAL}
  --clock-ppm P        the chip's clocks are fast by P parts per million of emulated time, -1000 to 1000; default 0
  --faults FILE.json   faults of sensors, multiplexers, clocks, USB, power (format: faults.mjs)
  --flash FILE         what the flash holds beside the image, 2 MiB, from an earlier run; written again at the end of this one
  --slow-flash         the flash takes the longest times of its datasheet instead of the typical ones
  --fast-enumeration   shorten the host's debounce and reset waits

  --pty LINK           serve the CDC port as a pseudo-terminal, LINK is a symbolic link to it
  --wait-open          power on only when the pseudo-terminal was opened
  --wait-reader        while a client of the pseudo-terminal does not take what lies ready, emulated time waits, 2 s at most
  --pace real|fast     real: never faster than the clock on the wall, a lag is dropped (default with --pty and
                       --usbredir); fast: as fast as possible
  --stepped            serve the CDC port on stdin and stdout to a program that has a clock of its own: emulated time
                       passes only as far as that program asks (frames: port/stepped_port.mjs). So a test and its
                       emulators share one time, however slow the machine is: tests/support/emulated_fingertip.py
  --usbredir PATH      give the USB device to a virtual machine instead of the built-in host, by a Unix socket. QEMU:
                       -chardev socket,id=r,path=PATH,reconnect=1 -device qemu-xhci -device usb-redir,chardev=r.
                       Lines on stdin: "unplug", "plug". While a packet lies ready that the machine does not ask for,
                       emulated time waits, 2 s at most
  --sync-strobe MS     drive the sync pin: high for a millisecond at each multiple of MS, 2 to 60000; since power-on, with
                       --stepped on the clock of the program, so that several emulators are on one wire
  --host-script FILE   with the built-in host: lines "TIME_S HEXBYTES", "TIME_S dtr 0|1", "TIME_S baud N", comments "#"
  --capture FILE       every byte received on bulk IN

  --bus-log FILE.csv   I2C transfers: start_ns,end_ns,muxes,address,rw,bytes,ack (muxes: their control bytes, or
                       the data line)
  --vcd FILE           SDA and SCL as a logic analyser sees them, for a waveform viewer
  --vcd-from S         dump from this time on, seconds; default 0
  --vcd-to S           dump up to this time
  --rise-ns N          rise time of the bus lines, 0 to 1000 ns; default: what the board's pull-ups make it
  --usb-log FILE.csv   USB packets: t_ns,endpoint,dir,length,bytes,offered_ns (when the firmware gave an IN packet to the controller)
  --report FILE.json   what happened, in numbers
  --count-from S       the report also has the cycles of core 0 from this time on: counted
  --progress           a line on stderr each second

Runs without --pty and --usbredir are the same bit for bit each time; with --stepped, if what the program asks is. SIGINT ends a run cleanly.
Exit: 0 clean; 1 a warning or failure of firmware or emulation, or an output that could not be written whole,
each printed as a line; 2 wrong usage or input.`;

const DEFAULTS = { sensor: 'ms5840', seed: '1', 'clock-ppm': '0', serial: DEFAULT_SERIAL, 'vcd-from': '0' };

/** Emulated time between two checks of the wall clock and the pseudo-terminal. */
const SLICE_NS = 1e6;
/** A virtual machine waits for each control request. */
const USBREDIR_SLICE_NS = 200e3;
const SLICE_BATCH_NS = 50e6;
const STROBE_HIGH_NS = 1e6;

const isTime = (v) => Number.isFinite(v) && v >= 0;
const NUMBERS = {
  seed: [isWhole(0, 2 ** 32 - 1), 'a whole number from 0 to 4294967295'],
  'clock-ppm': [(v) => Math.abs(v) <= 1000, 'a number from -1000 to 1000'],
  seconds: [isPositive, 'a positive number of seconds'],
  'vcd-from': [isTime, 'a time in seconds, 0 or later'],
  'vcd-to': [isTime, 'a time in seconds, 0 or later'],
  'count-from': [isPositive, 'a positive number of seconds'],
  'sync-strobe': [(v) => v >= 2 && v <= 60000, 'a period from 2 to 60000 ms'],
  'rise-ns': [(v) => v >= 0 && v <= 1000, 'a rise time from 0 to 1000 ns'],
};

function judgeOptions(values) {
  for (const [name, [check, what]] of Object.entries(NUMBERS))
    if (values[name] !== undefined) values[name] = numberOf(name, values[name], check, what);
  if (values['vcd-to'] < values['vcd-from']) throw new InputError('--vcd-to is before --vcd-from');
  if (!/^[0-9a-fA-F]{16}$/.test(values.serial)) throw new InputError(`--serial "${values.serial}" is not 16 hexadecimal digits`);
  values.pace ??= values.pty || values.usbredir ? 'real' : 'fast';
  if (!['real', 'fast'].includes(values.pace)) throw new InputError(`--pace "${values.pace}" is neither real nor fast`);
  const drivers = ['pty', 'stepped', 'usbredir', 'host-script'].filter((name) => values[name] !== undefined);
  if (drivers.length > 1) throw new InputError(`--${drivers[0]} and --${drivers[1]} exclude each other`);
  if (values.stepped && values.pace !== 'fast') throw new InputError('--stepped has no --pace: time passes as its program asks');
  for (const name of ['wait-open', 'wait-reader']) if (values[name] && !values.pty) throw new InputError(`--${name} needs --pty`);
}

/** Null before there is such a file. */
function readFlash(path) {
  const flash = readInput(path, 'flash', { optional: true });
  if (flash !== null && flash.length !== FLASH_BYTES)
    throw new InputError(`${path}: ${flash.length} bytes; the flash has ${FLASH_BYTES}; give the file of an earlier run, or a new name`);
  return flash;
}

/** Runs as far as the program on stdin asks, until the run or that program ends. */
function runStepped(machine, port, end_ns) {
  for (;;) {
    const step = port.next();
    if (!step) {
      machine.endReason = 'interrupted';
      return;
    }
    const until_ns = Math.min(step.until_ns, end_ns);
    let goesOn = true;
    while (goesOn && machine.time.nanos < until_ns && !port.hasSent)
      goesOn = machine.run(Math.min(until_ns, machine.time.nanos + step.margin_ns));
    const hasEnded = !goesOn || machine.time.nanos >= end_ns;
    port.answer(machine.time.nanos, hasEnded);
    if (hasEnded) return;
  }
}

async function run(options) {
  judgeOptions(options);
  const Board = findBoard(options.board);
  findSensor(options.sensor);
  const image = readImage(options.image);
  const scenario = readScenario(options.scenario);
  if (scenario.sensors !== Board.sensors)
    throw new InputError(`${options.scenario}: ${scenario.sensors} sensors, but board ${options.board} has ${Board.sensors}`);
  const flash = options.flash ? readFlash(options.flash) : null;
  const faults = options.faults ? readFaults(options.faults, Board) : [];
  const script = options['host-script'] ? readHostScript(options['host-script']) : [];
  const seconds = options.seconds ?? scenario.end_s;
  if (!(seconds > 0)) throw new InputError(`${options.scenario}: ends at 0 s; give --seconds`);

  const outputs = [];
  const output = (path, header) => {
    const file = new OutputFile(path, { header, onFailure: (line) => process.stderr.write(`error: ${line}\n`) });
    outputs.push(file);
    return file;
  };
  const hex = (bytes) => Buffer.from(bytes).toString('hex');

  let interrupted = false;
  const onInterrupt = () => {
    interrupted = true;
  };
  process.on('SIGINT', onInterrupt);
  process.on('SIGTERM', onInterrupt);

  // Before the outputs: a link that another emulator serves must not cost that one its files.
  const pty = options.pty ? await PtyPort.start(options.pty) : null;
  const usbredir = options.usbredir ? await UsbRedirServer.start(options.usbredir) : null;
  const stepped = options.stepped ? new SteppedPort() : null;
  const cable = usbredir && createInterface({ input: process.stdin });
  let clean;
  try {
    const reportFile = output(options.report);
    const capture = output(options.capture);
    const busLog = output(options['bus-log'], 'start_ns,end_ns,muxes,address,rw,bytes,ack');
    const vcd =
      options.vcd &&
      new VcdDump({
        file: output(options.vcd),
        probes: Board.probes,
        comment: `board ${options.board}; a level is high from 0.7 VDD on`,
        from_ns: options['vcd-from'] * 1e9,
        to_ns: (options['vcd-to'] ?? Infinity) * 1e9,
      });
    const usbLog = output(options['usb-log'], 't_ns,endpoint,dir,length,bytes,offered_ns');

    while (options['wait-open'] && !pty.isOpen && !interrupted && !pty.failure) await sleep(5);

    const machine = new Machine({
      image,
      Board,
      scenario,
      sensor: options.sensor,
      faults,
      flash,
      flashSpeed: options['slow-flash'] ? 'slowest' : 'typical',
      seed: options.seed,
      serial: options.serial,
      clock_ppm: options['clock-ppm'],
      fastEnumeration: options['fast-enumeration'],
      sync: {
        next: options['sync-strobe']
          ? (t_ns) => strobe({ period_ns: options['sync-strobe'] * 1e6, high_ns: STROBE_HIGH_NS, zero_ns: stepped?.zero_ns })(t_ns)
          : null,
      },
      rise_ns: options['rise-ns'],
      onLevels: vcd ? (levels, t_ns) => vcd.change(levels, t_ns) : undefined,
      onBusTransfer: options['bus-log']
        ? (t) =>
            busLog.write(
              Buffer.from(
                `${t.start_ns.toFixed(0)},${t.end_ns.toFixed(0)},${t.muxes},0x${t.address.toString(16)},${t.read ? 'r' : 'w'},${hex(t.bytes)},${t.acknowledged ? 1 : 0}\n`,
              ),
            )
        : undefined,
      onUsbPacket: (p) => {
        if (options['usb-log'])
          usbLog.write(
            Buffer.from(
              `${p.t_ns.toFixed(0)},${p.endpoint},${p.setup ? 'setup' : p.isIn ? 'in' : 'out'},${p.data.length},${hex(p.data)},${p.offered_ns?.toFixed(0) ?? ''}\n`,
            ),
          );
        if (p.isIn && machine.host.isBulkIn(p.endpoint)) capture.write(p.data);
      },
      onData: (bytes) => {
        pty?.send(bytes);
        stepped?.send(bytes, machine.time.nanos);
      },
      ...(usbredir ? { makeClient: (parts) => usbredir.attachTo(parts) } : {}),
    });
    cable?.on('line', (line) => {
      if (line === 'plug' || line === 'unplug') usbredir.setPlugged(line === 'plug');
      else process.stderr.write(`error: "${line}" on stdin is neither plug nor unplug\n`);
    });
    const end_ns = seconds * 1e9;
    const started_ms = performance.now();
    if (pty) pty.connect(machine.client);
    else if (stepped) stepped.connect(machine.scope, machine.client);
    else if (!usbredir) scheduleHostScript(script, machine.scope, machine.client);

    const count_ns = (options['count-from'] ?? 0) * 1e9;
    let counted; // at that time
    let paced_ms = started_ms;
    let paced_ns = 0;
    let shown_ms = started_ms;
    const slice_ns = usbredir ? USBREDIR_SLICE_NS : pty || options.pace === 'real' ? SLICE_NS : SLICE_BATCH_NS;
    if (stepped) runStepped(machine, stepped, end_ns);
    else
      for (;;) {
        const reader = usbredir ?? (options['wait-reader'] ? pty : null);
        while (reader?.waitsForReader(performance.now()) && !interrupted) await sleep(1);
        let target = Math.min(end_ns, machine.time.nanos + slice_ns);
        if (count_ns > machine.time.nanos) target = Math.min(target, count_ns);
        if (!machine.run(target) || target >= end_ns) break;
        if (target === count_ns) counted = machine.result;
        const now_ms = performance.now();
        if (interrupted) {
          machine.endReason = 'interrupted';
          break;
        }
        if (pty?.failure) {
          machine.report.warn('pty', pty.failure);
          machine.endReason = 'pseudo-terminal lost';
          break;
        }
        if (options.progress && now_ms - shown_ms >= 1000) {
          shown_ms = now_ms;
          const emulated_s = machine.time.nanos / 1e9;
          const line = `${emulated_s.toFixed(2)} / ${seconds} s, ${(emulated_s / ((now_ms - started_ms) / 1000)).toFixed(2)} x real time`;
          process.stderr.write(process.stderr.isTTY ? `\r${line}   ` : `${line}\n`);
        }
        if (options.pace === 'real') {
          // A lag is dropped, not caught up: a client that waited must not see a burst.
          const ahead_ms = (machine.time.nanos - paced_ns) / 1e6 - (now_ms - paced_ms);
          if (ahead_ms < -50) {
            paced_ms = now_ms;
            paced_ns = machine.time.nanos;
          }
          if (ahead_ms > 1) await sleep(ahead_ms);
          else await breathe();
        } else await breathe();
      }
    if (options.progress && process.stderr.isTTY) process.stderr.write('\n');
    if (pty) await pty.drain();
    vcd?.close(machine.time.nanos);
    const wall_s = (performance.now() - started_ms) / 1000;
    const { result } = machine;
    const from = counted && { emulated_s: result.emulated_s - counted.emulated_s, cycles: result.cycles - counted.cycles };
    reportFile.write(Buffer.from(`${JSON.stringify({ ...result, ...(from && { counted: from }), wall_s }, null, 2)}\n`));
    if (machine.memory.isBusy) machine.memory.cutPower(); // the end of the run is the end of its power
    if (options.flash) output(options.flash).write(machine.memory.bytes);
    for (const line of result.warnings) process.stderr.write(`${line}\n`);
    if (result.end_reason !== 'end of time') process.stderr.write(`ended after ${result.emulated_s.toFixed(6)} s: ${result.end_reason}\n`);
    clean = result.warnings.length === 0;
  } finally {
    for (const file of outputs) file.close();
    await pty?.stop();
    cable?.close();
    await usbredir?.stop();
    process.off('SIGINT', onInterrupt);
    process.off('SIGTERM', onInterrupt);
  }
  return clean && outputs.every((file) => !file.failure) ? 0 : 1;
}

await main(USAGE, { defaults: DEFAULTS, needed: ['image', 'board', 'scenario'] }, run);
