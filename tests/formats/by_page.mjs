// Builds by_page.ts as the page is built and runs it: node 18 knows no TypeScript. usage: node by_page.mjs FOLDER CORE.wasm JOBS.json > answers.json
import { createRequire } from 'node:module';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath, pathToFileURL } from 'node:url';

const here = dirname(fileURLToPath(import.meta.url));
const page = resolve(here, '../../host_tools/web');
const vite = createRequire(join(page, 'package.json')).resolve('vite/package.json');
const { build } = await import(pathToFileURL(join(dirname(vite), 'dist/node/index.js')));
const [folder, core, jobs] = process.argv.slice(2).map((path) => resolve(path));
await build({
  root: here,
  configFile: false,
  logLevel: 'error',
  resolve: { alias: [{ find: 'fzstd', replacement: join(page, 'node_modules/fzstd') }] },
  ssr: { noExternal: true },
  build: {
    ssr: join(here, 'by_page.ts'),
    target: 'node18',
    outDir: folder,
    emptyOutDir: true,
    minify: false,
    rollupOptions: { output: { entryFileNames: 'by_page.mjs' } },
  },
});
process.env.FINGERTIP_CORE = core;
process.argv = [process.argv[0], join(folder, 'by_page.mjs'), jobs];
await import(pathToFileURL(join(folder, 'by_page.mjs')));
