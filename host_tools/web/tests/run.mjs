// Bundles the tests, TypeScript as the page's build takes it, and runs them by node's own runner: node 18 knows no
// types. `node tests/run.mjs [FOLDER]`: where the bundles go, build/page_tests of the project unless told.
import { build } from 'esbuild';
import { spawnSync } from 'node:child_process';
import { readdirSync } from 'node:fs';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';

const here = dirname(fileURLToPath(import.meta.url));
const out = resolve(process.argv[2] ?? join(here, '../../../build/page_tests'));
const names = readdirSync(here).filter((name) => name.endsWith('.test.ts'));
await build({
  entryPoints: names.map((name) => join(here, name)),
  outdir: out,
  outExtension: { '.js': '.mjs' },
  bundle: true,
  platform: 'node',
  format: 'esm',
  target: 'node18',
  logLevel: 'warning',
  banner: { js: "import { createRequire } from 'node:module'; const require = createRequire(import.meta.url);" },
});
const bundles = names.map((name) => join(out, name.replace(/ts$/, 'mjs')));
const { status } = spawnSync(process.execPath, ['--test', ...bundles], {
  stdio: 'inherit',
  env: { ...process.env, FINGERTIP_SOURCE: resolve(here, '../../..') },
});
process.exit(status ?? 1);
