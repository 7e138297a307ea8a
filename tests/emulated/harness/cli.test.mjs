/**
 * The command line as a process: exit codes, one-line errors, files, pseudo-terminal, clean end by signal.
 *
 * real time: pseudo-terminals, and the pace of the wall. Nothing is judged by how long it took; LIMIT_s only ends what hangs.
 */
import assert from 'node:assert/strict';
import { spawn, spawnSync } from 'node:child_process';
import { existsSync, lstatSync, mkdtempSync, readFileSync, readlinkSync, rmSync, symlinkSync, watch, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { OutputFile } from '../../../host_tools/simulation/emulator/output_file.mjs';
import { PtyPort } from '../../../host_tools/simulation/emulator/port/pty_port.mjs';
import { build, HEADER } from './bench.mjs';

const MAIN = fileURLToPath(new URL('../../../host_tools/simulation/emulator/main.mjs', import.meta.url));
const HELPER = fileURLToPath(new URL('../../../host_tools/simulation/emulator/port/pty_port.py', import.meta.url));
const folder = mkdtempSync(join(tmpdir(), 'emulator-cli-'));
const serving = new Set();
after(() => {
  for (const emulator of serving) emulator.kill('SIGKILL');
  rmSync(folder, { recursive: true });
});
const file = (name, content) => {
  writeFileSync(out(name), content);
  return out(name);
};
const out = (name) => join(folder, name);
const script = file('script', '0.1 dtr 1\n0.12 0102ff\n');
const main = 'void main(void) { start_clocks(); usb_start(); for (;;) usb_poll(); }';
const image = file('echo.bin', build(`#include "cdc.h"\n${main}`));
const stream = file('stream.bin', build(`#define STREAM\n#include "cdc.h"\n${main}`));
const broken = file('null.bin', build('void main(void) { start_clocks(); REG(0) = 1; done(); }'));
const scenario = file('s.csv', `# fingertip-scenario 1\n${HEADER}\n0${',0'.repeat(22)}\n0.2${',0'.repeat(22)}\n`);
const base = ['--board', 'pico_mux', '--scenario', scenario, '--fast-enumeration'];
const run = (...args) => spawnSync(process.execPath, [MAIN, ...args], { encoding: 'utf8' });

test('a host script drives the port; capture, logs and report are written; exit 0', () => {
  const logs = ['--usb-log', out('u.csv'), '--bus-log', out('b.csv'), '--report', out('r.json'), '--count-from', '0.13'];
  const { status, stderr } = run('--image', image, ...base, '--host-script', script, '--capture', out('c.bin'), ...logs);
  assert.equal(status, 0, stderr);
  assert.deepEqual([...readFileSync(out('c.bin'))], [1, 2, 255]);
  const report = JSON.parse(readFileSync(out('r.json')));
  assert.equal(report.end_reason, 'end of time');
  assert.ok(Math.abs(report.emulated_s - 0.2) < 1e-6);
  assert.ok(Math.abs(report.counted.emulated_s - 0.07) < 1e-6);
  assert.ok(Math.abs(report.counted.cycles / report.cycles - 0.35) < 0.1); // it never sleeps, and starts on a slower clock
  assert.deepEqual([report.usb.in_bytes, report.usb.out_bytes], [3, 3]);
  assert.match(readFileSync(out('u.csv'), 'utf8'), /^t_ns,endpoint,dir,length,bytes,offered_ns\n.*,2,out,3,0102ff,\n/s);
  assert.match(readFileSync(out('b.csv'), 'utf8'), /^start_ns,end_ns,muxes,address,rw,bytes,ack\n$/);
});

test('a full disk costs the file on it, in one line at once and exit 1; the others are whole', () => {
  const others = ['--capture', out('c2.bin'), '--report', out('r2.json')];
  const { status, stderr } = run('--image', image, ...base, '--host-script', script, '--usb-log', '/dev/full', ...others);
  assert.equal(status, 1);
  assert.equal(stderr, 'error: /dev/full: cannot write (no space left on device); the file is not complete\n');
  assert.deepEqual([...readFileSync(out('c2.bin'))], [1, 2, 255]);
  assert.equal(JSON.parse(readFileSync(out('r2.json'))).end_reason, 'end of time');
  const lost = run('--image', image, ...base, '--report', '/dev/full');
  assert.equal(lost.status, 1);
  assert.match(lost.stderr, /^error: \/dev\/full: .*\n$/);
});

test('what an output file could not take is reported once and needs no memory', () => {
  const lines = [];
  const output = new OutputFile('/dev/full', { onFailure: (line) => lines.push(line) });
  for (let i = 0; i < 100; i++) output.write(new Uint8Array(65537));
  assert.equal(output.pending.length, 0);
  output.close();
  assert.equal(lines.length, 1);
  assert.equal(output.failure, lines[0]);
});

test('a failing image ends with 1 and one line', () => {
  const { status, stderr } = run('--image', broken, ...base);
  assert.equal(status, 1);
  assert.match(stderr, /^failure at 0\.\d+ s: core: write to 0x0 in the boot ROM/);
});

for (const [name, args, message] of [
  ['unknown board', ['--board', 'x'], /^error: unknown board "x"; known: pico_mux, pico_parallel\n$/],
  ['missing image', ['--image', '/nowhere'], /^error: \/nowhere: cannot read the image \(no such file or directory\); build it first\n$/],
  ['folder for an image', ['--image', folder], /^error: .*: cannot read the image \(illegal operation on a directory\)/],
  ['unknown option', ['--frobnicate'], /^error: Unknown option '--frobnicate'/],
  ['bad seed', ['--seed', '-1'], /^error: --seed "-1" is not a whole number from 0 to 4294967295\n$/],
  ['negative time', ['--seconds', '-1'], /^error: --seconds "-1" is not a positive number of seconds\n$/],
  ['option without its value', ['--seconds', '--progress'], /^error: .*--seconds/],
  ['bad clock', ['--clock-ppm', '1001'], /^error: --clock-ppm "1001" is not a number from -1000 to 1000\n$/],
  ['bad pace', ['--pace', 'slow'], /^error: --pace "slow" is neither real nor fast\n$/],
  ['a pace beside steps', ['--stepped', '--pace', 'real'], /^error: --stepped has no --pace/],
  ['two ports', ['--stepped', '--pty', 'x'], /^error: --pty and --stepped exclude each other\n$/],
  ['steps that no program asks for', ['--stepped'], /^error: the program on standard input is gone\n$/],
  ['a reader without a port', ['--wait-reader'], /^error: --wait-reader needs --pty\n$/],
  [
    'report nowhere',
    ['--seconds', '1e6', '--report', '/nowhere/r'],
    /^error: \/nowhere\/r: cannot write \(no such file or directory\); check/,
  ],
  ['bad scenario', ['--scenario', image], /^error: .*:1: not a scenario/],
  ['missing option', null, /^error: --board is missing/],
]) {
  test(`exit 2: ${name}`, () => {
    const { status, stderr } = run('--image', image, ...(args ? [...base, ...args] : []));
    assert.equal(status, 2, stderr);
    assert.match(stderr, message);
    assert.equal(stderr.trim().split('\n').length, 1);
  });
}

const LIMIT_s = 300;
/** Of a client: its terminal, raw, with all that has come already. A client that hangs is ended. */
const OPEN = `import os, signal, sys, tty
signal.alarm(${LIMIT_s})
fd = os.open(sys.argv[1], os.O_RDWR | os.O_NOCTTY)
tty.setraw(fd, tty.TCSANOW)
`;
/** And told on stdin that the board is there. */
const OPEN_EARLY = `${OPEN}sys.stdin.readline()\n`;
const ENUMERATED_s = 0.3;

const CLIENT = `${OPEN_EARLY}
data = bytes(range(256)) * 8
got = b""
sent = 0
while len(got) < len(data):
    if sent == len(got):  # short packets only, each of which ends a read
        sent += os.write(fd, data[sent:sent + 32])
    got += os.read(fd, 4096)
sys.exit(0 if got == data else 1)
`;

/** An emulator that serves `link`: waits for the link; `end()` interrupts it and gives its exit code. */
async function serve(link, ...args) {
  const watcher = watch(folder);
  const emulator = spawn(process.execPath, [MAIN, ...base, '--seconds', '3600', '--pty', link, '--wait-open', ...args], {
    stdio: ['ignore', 'ignore', 'pipe'],
  });
  serving.add(emulator);
  let stderr = '';
  emulator.stderr.on('data', (d) => (stderr += d));
  const ended = new Promise((resolve) => emulator.on('close', resolve)).finally(() => serving.delete(emulator));
  const hasEnded = ended.then(() => assert.fail(stderr));
  while (!existsSync(link)) await Promise.race([hasEnded, new Promise((resolve) => watcher.once('change', resolve))]);
  watcher.close();
  hasEnded.catch(() => {});
  const end = async () => {
    emulator.kill('SIGINT');
    return { code: await ended, stderr };
  };
  /** With --progress: wait for that much emulated time. */
  const reach = async (wanted_s) => {
    const reached_s = () => Number(stderr.trim().split('\n').at(-1).split(' ')[0]);
    while (!(reached_s() >= wanted_s)) await Promise.race([hasEnded, new Promise((resolve) => emulator.stderr.once('data', resolve))]);
  };
  return { end, reach };
}

async function runClient(program, link, go = Promise.resolve()) {
  const client = spawn('/usr/bin/python3', ['-c', program, link], { stdio: ['pipe', 'pipe', 'inherit'] });
  go.then(() => client.stdin.end('\n'));
  let stdout = '';
  client.stdout.on('data', (d) => (stdout += d));
  const code = await new Promise((resolve) => client.on('close', resolve));
  return { code, stdout };
}

test('pseudo-terminal: bytes go both ways, SIGINT ends cleanly and removes the link', async () => {
  const link = out('tty');
  const emulator = await serve(link, '--image', image, '--progress');
  const { code } = await runClient(CLIENT, link, emulator.reach(ENUMERATED_s));
  const ended = await emulator.end();
  assert.equal(ended.code, 0, ended.stderr);
  assert.equal(code, 0, ended.stderr);
  assert.throws(() => lstatSync(link));
});

test('pseudo-terminal: a link in use is refused before any file is opened; a stale link is replaced', async () => {
  const link = out('shared');
  symlinkSync(out('gone'), link);
  const emulator = await serve(link, '--image', image);
  const target = readlinkSync(link);
  const capture = file('kept.bin', 'mine');
  const second = run('--image', image, ...base, '--seconds', '1', '--pty', link, '--capture', capture);
  assert.equal(second.status, 2);
  assert.match(second.stderr, /^error: .*shared is in use: it leads to \/dev\/pts\/[0-9]+; end the other emulator, [^\n]*\n$/);
  assert.equal(readlinkSync(link), target);
  assert.equal(readFileSync(capture, 'utf8'), 'mine');
  const ended = await emulator.end();
  assert.equal(ended.code, 0, ended.stderr);
});

/** Opens, does not read before it is told to on stdin, then takes 100 000 bytes and tells the first that breaks the count. */
const LATE_READER = `${OPEN_EARLY}got = 0
while got < 100000:
    for byte in os.read(fd, 4096):
        if byte != got & 255:
            sys.exit(f"byte {got} is {byte}")
        got += 1
print(got)
`;

test('pseudo-terminal: a client that does not read stops the stream, loses nothing, and is not buffered for', async () => {
  const link = out('late');
  const log = out('late.csv');
  const emulator = await serve(link, '--image', stream, '--usb-log', log, '--progress');
  const { code, stdout } = await runClient(LATE_READER, link, emulator.reach(ENUMERATED_s));
  const ended = await emulator.end();
  assert.equal(ended.code, 0, ended.stderr);
  assert.equal(code, 0);
  assert.ok(Number(stdout) >= 100000, stdout);
  const lines = readFileSync(log, 'utf8').match(/^\d+,2,in,[1-9].*$/gm);
  const packets = lines.map((line) => line.split(',').map(Number));
  const pauses_s = packets.slice(1).map(([t_ns], i) => (t_ns - packets[i][0]) / 1e9);
  const pause_s = Math.max(...pauses_s);
  const paused = 1 + pauses_s.indexOf(pause_s);
  assert.ok(pause_s > 0.05, `the device was read on: longest pause ${pause_s} s`);
  const before = packets.slice(0, paused).reduce((sum, packet) => sum + packet[3], 0);
  // The window of 16 KiB, sixteen reads under way, and what the kernel holds of a terminal's bytes.
  assert.ok(before >= 16384 && before <= 16384 + 16 * 128 + 65536, `${before} bytes were taken for a client that did not read`);
});

test('pseudo-terminal: a client that has not taken what lies ready is waited for, 2 s at most', () => {
  const port = Object.assign(Object.create(PtyPort.prototype), { isOpen: true, outstanding: 16384, full_ms: null });
  const waits = (...all_ms) => all_ms.map((ms) => port.waitsForReader(ms));
  assert.deepEqual(waits(0, 1999, 2000, 9000), [true, true, false, false]);
  port.outstanding--;
  assert.deepEqual(waits(9001), [false]);
  port.outstanding++;
  assert.deepEqual(waits(9002, 11002), [true, false]);
  port.isOpen = false;
  assert.equal(port.waitsForReader(20000), false);
});

test('pseudo-terminal: bytes for a client that left do not reach the next one', async () => {
  const link = out('helper');
  const helper = spawn('/usr/bin/python3', [HELPER, link], { stdio: ['pipe', 'pipe', 'inherit'] });
  serving.add(helper);
  const ended = new Promise((resolve) => helper.on('close', resolve)).finally(() => serving.delete(helper));
  let said = Buffer.alloc(0);
  const hear = async (...frames) => {
    const expected = Buffer.from(frames.flat());
    while (said.length < expected.length) said = Buffer.concat([said, await new Promise((resolve) => helper.stdout.once('data', resolve))]);
    assert.deepEqual([...said.subarray(0, expected.length)], [...expected]);
    said = said.subarray(expected.length);
  };
  const [ready, opened, taken] = [[0x52, 0, 0, 0, 0], [0x4f, 0, 0, 0, 0], (count) => [0x41, 4, 0, 0, 0, count, 0, 0, 0]];
  await hear(ready);
  helper.stdin.write(Buffer.from([0x44, 3, 0, 0, 0, 1, 2, 3]));
  await hear(taken(3));
  const client = runClient(`${OPEN}print(list(os.read(fd, 100)))`, link);
  await hear(opened);
  helper.stdin.write(Buffer.from([0x44, 1, 0, 0, 0, 4])); // for this one
  assert.equal((await client).stdout.trim(), '[4]');
  helper.stdin.end();
  assert.equal(await ended, 0);
});
