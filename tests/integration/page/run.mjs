// Builds the page's tests as the page is built, and runs them by node's own runner: node 18 knows no TypeScript.
//   node run.mjs FOLDER TOOL CORE    where the built tests go; the tool, whose recordings are compared; core.wasm
import { spawnSync } from 'node:child_process';
import { readdirSync } from 'node:fs';
import { createRequire } from 'node:module';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath, pathToFileURL } from 'node:url';

const here = dirname(fileURLToPath(import.meta.url));
const source = resolve(here, '../../..');
const page = join(source, 'host_tools/web');
const vite = createRequire(join(page, 'package.json')).resolve('vite/package.json');
const { build } = await import(pathToFileURL(join(dirname(vite), 'dist/node/index.js')));
const [folder, tool, core] = process.argv.slice(2).map((path) => resolve(path));
const names = readdirSync(here).filter((name) => name.endsWith('.test.ts'));
await build({
  root: here,
  configFile: false,
  logLevel: 'warn',
  resolve: { alias: { fzstd: join(page, 'node_modules/fzstd') } },
  ssr: { noExternal: true },
  build: {
    ssr: true,
    target: 'node18',
    outDir: folder,
    emptyOutDir: true,
    minify: false,
    rollupOptions: {
      input: names.map((name) => join(here, name)),
      output: { entryFileNames: '[name].mjs', chunkFileNames: '[name]-[hash].mjs' },
    },
  },
});
const tests = names.map((name) => join(folder, name.replace(/ts$/, 'mjs')));
const { status } = spawnSync(process.execPath, ['--test', ...tests], {
  timeout: 240_000,
  stdio: 'inherit',
  env: { ...process.env, FINGERTIP_SOURCE: source, FINGERTIP_TOOL: tool, FINGERTIP_CORE: core },
});
process.exit(status ?? 1);
