// Builds the page's tests, and runs them by node's own runner.
//   node run.mjs FOLDER TOOL CORE    where the built tests go; the tool, whose recordings are compared; core.wasm
import { spawnSync } from 'node:child_process';
import { readdirSync } from 'node:fs';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { built } from '../../support/built_page.mjs';

const here = dirname(fileURLToPath(import.meta.url));
const [folder, tool, core] = process.argv.slice(2).map((path) => resolve(path));
const names = readdirSync(here).filter((name) => name.endsWith('.test.ts'));
const tests = await built(
  folder,
  names.map((name) => join(here, name)),
);
const { status } = spawnSync(process.execPath, ['--test', ...tests], {
  timeout: 240_000,
  stdio: 'inherit',
  env: { ...process.env, FINGERTIP_SOURCE: resolve(here, '../../..'), FINGERTIP_TOOL: tool, FINGERTIP_CORE: core },
});
process.exit(status ?? 1);
