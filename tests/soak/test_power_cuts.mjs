/**
 * Power cuts in short, and that a value that is wrong, one that does not stay and a start that fails are found.
 *
 * usage: test_power_cuts.mjs IMAGE.bin SOAK COMMAND_FRAME
 */
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { chmodSync, mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { test } from 'node:test';
import { fileURLToPath } from 'node:url';

const [image, soak, command_frame] = process.argv.slice(2);
const PROGRAM = fileURLToPath(new URL('power_cuts.mjs', import.meta.url));
const cuts = (program, kinds, step_us) =>
  JSON.parse(
    execFileSync(
      'node',
      [
        PROGRAM,
        '--image',
        image,
        '--board',
        'pico_mux',
        '--soak',
        program,
        '--command-frame',
        command_frame,
        '--kinds',
        kinds,
        '--step-us',
        `${step_us}`,
      ],
      { encoding: 'utf8' },
    ),
  );

test('whatever is cut it starts again and holds the old or the new', (t) => {
  const found = cuts(soak, 'write,erase,mend,reset', 9700);
  for (const [kind, { cuts: count, not_started, wrong_values, brought, what }] of Object.entries(found)) {
    t.diagnostic(`${kind}: ${count} cuts, ${brought} brought the new`);
    assert.deepEqual([not_started, wrong_values, what], [0, 0, []], kind);
    assert.ok(count >= 1, `${kind}: ${count}`);
  }
});

test('what is wrong is found', () => {
  const folder = mkdtempSync(join(tmpdir(), 'cuts-'));
  const good = { osr: 512, stored: 2, present: 0x7fff, prom_bad: 0, frames: 9, complete: 9 };
  try {
    const seconds = [{ osr: 1024 }, { osr: 2048 }, { stored: 8 }, { present: 0x7ffe }, { complete: 0 }, {}];
    const program = join(folder, 'soak');
    const lines = seconds.flatMap((second) => [good, { ...good, ...second }]).map((life) => JSON.stringify(life));
    writeFileSync(program, `#!/bin/sh\nwhile read -r _; do\n${lines.map((line) => `echo '${line}'`).join('; read -r _\n')}\ndone\n`);
    chmodSync(program, 0o755);
    const { write } = cuts(program, 'write', 1100);
    assert.ok(write.cuts >= seconds.length, `${write.cuts}`);
    const times = (which) => Array.from({ length: write.cuts }, (_, i) => which.includes(i % seconds.length)).filter(Boolean).length;
    assert.deepEqual([write.wrong_values, write.not_started], [times([0, 1, 2]), times([3, 4])]);
    assert.equal(write.what.length, Math.min(10, times([0, 1, 2, 3, 4])));
  } finally {
    rmSync(folder, { recursive: true });
  }
});
