/** The command line as a process: exit codes, one-line errors, files, pseudo-terminal, clean end by signal. */
import assert from 'node:assert/strict';
import { spawn, spawnSync } from 'node:child_process';
import { existsSync, lstatSync, mkdtempSync, readFileSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, test } from 'node:test';
import { rmSync } from 'node:fs';
import { fileURLToPath } from 'node:url';
import { build, HEADER } from './bench.mjs';

const MAIN = fileURLToPath(new URL('../../../host_tools/emulator/main.mjs', import.meta.url));
const folder = mkdtempSync(join(tmpdir(), 'emulator-cli-'));
after(() => rmSync(folder, { recursive: true }));
const file = (name, content) => {
  writeFileSync(join(folder, name), content);
  return join(folder, name);
};
const image = file('echo.bin', build('#include "cdc.h"\nvoid main(void) { start_clocks(); usb_start(); for (;;) usb_poll(); }'));
const broken = file('null.bin', build('void main(void) { start_clocks(); REG(0) = 1; done(); }'));
const scenario = file('s.csv', `# fingertip-scenario 1\n${HEADER}\n0${',0'.repeat(22)}\n0.2${',0'.repeat(22)}\n`);
const base = ['--board', 'pico_mux', '--scenario', scenario, '--fast-enumeration'];
const run = (...args) => spawnSync(process.execPath, [MAIN, ...args], { encoding: 'utf8' });

test('a host script drives the port; capture, logs and report are written; exit 0', () => {
  const script = file('script', '0.1 dtr 1\n0.12 0102ff\n');
  const out = (name) => join(folder, name);
  const { status, stderr } = run('--image', image, ...base, '--host-script', script, '--capture', out('c.bin'), '--usb-log', out('u.csv'), '--bus-log', out('b.csv'), '--report', out('r.json'));
  assert.equal(status, 0, stderr);
  assert.deepEqual([...readFileSync(out('c.bin'))], [1, 2, 255]);
  const report = JSON.parse(readFileSync(out('r.json')));
  assert.equal(report.end_reason, 'end of time');
  assert.ok(Math.abs(report.emulated_s - 0.2) < 1e-6);
  assert.deepEqual([report.usb.in_bytes, report.usb.out_bytes], [3, 3]);
  assert.match(readFileSync(out('u.csv'), 'utf8'), /^t_ns,endpoint,dir,length,bytes\n.*,2,out,3,0102ff\n/s);
  assert.match(readFileSync(out('b.csv'), 'utf8'), /^start_ns,end_ns,muxes,address,rw,bytes,ack\n$/);
});

test('a failing image ends with 1 and one line', () => {
  const { status, stderr } = run('--image', broken, ...base);
  assert.equal(status, 1);
  assert.match(stderr, /^failure at 0\.\d+ s: core: write to 0x0 in the boot ROM/);
});

for (const [name, args, message] of [
  ['unknown board', ['--image', image, '--board', 'x', '--scenario', scenario], /^error: unknown board "x"; known: pico_mux\n$/],
  ['missing image', ['--image', '/nowhere', ...base], /^error: \/nowhere: cannot read the image \(ENOENT\); build it first\n$/],
  ['missing option', ['--image', image], /^error: --board is missing/],
  ['unknown option', ['--frobnicate'], /^error: Unknown option '--frobnicate'/],
  ['bad seed', ['--image', image, ...base, '--seed', '-1'], /^error: .*seed/i],
  ['bad scenario', ['--image', image, '--board', 'pico_mux', '--scenario', image], /^error: .*:1: not a scenario/],
]) {
  test(`exit 2: ${name}`, () => {
    const { status, stderr } = run(...args);
    assert.equal(status, 2, stderr);
    assert.match(stderr, message);
    assert.equal(stderr.trim().split('\n').length, 1);
  });
}

const CLIENT = `
import os, select, sys, termios, time, tty
fd = os.open(sys.argv[1], os.O_RDWR | os.O_NOCTTY)
tty.setraw(fd, termios.TCSANOW)
time.sleep(0.5)
data = bytes(range(256)) * 8
got = b""
end = time.time() + 20
sent = 0
while len(got) < len(data) and time.time() < end:
    if sent < len(data) and sent - len(got) < 64:
        sent += os.write(fd, data[sent:sent + 32])
    if select.select([fd], [], [], 0.02)[0]:
        got += os.read(fd, 4096)
sys.exit(0 if got == data else 1)
`;

test('pseudo-terminal: bytes go both ways, SIGINT ends cleanly and removes the link', async () => {
  const link = join(folder, 'tty');
  const emulator = spawn(process.execPath, [MAIN, '--image', image, ...base, '--seconds', '60', '--pty', link, '--wait-open'], { stdio: ['ignore', 'ignore', 'pipe'] });
  let stderr = '';
  emulator.stderr.on('data', (d) => (stderr += d));
  const ended = new Promise((resolve) => emulator.on('close', resolve));
  for (let i = 0; i < 200 && !existsSync(link); i++) await new Promise((r) => setTimeout(r, 25));
  const client = spawn('/usr/bin/python3', ['-c', CLIENT, link], { stdio: 'inherit' });
  const code = await new Promise((resolve) => client.on('close', resolve));
  emulator.kill('SIGINT');
  assert.equal(await ended, 0, stderr);
  assert.equal(code, 0, stderr);
  assert.throws(() => lstatSync(link));
});
