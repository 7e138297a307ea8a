// Builds programs of tests as the page is built, since node 18 knows no TypeScript: their paths, in this order.
import { createRequire } from 'node:module';
import { basename, dirname, join, resolve } from 'node:path';
import { fileURLToPath, pathToFileURL } from 'node:url';

const page = resolve(dirname(fileURLToPath(import.meta.url)), '../../host_tools/web');

export async function built(folder, sources) {
  const vite = createRequire(join(page, 'package.json')).resolve('vite/package.json');
  const { build } = await import(pathToFileURL(join(dirname(vite), 'dist/node/index.js')));
  const output = { entryFileNames: '[name].mjs', chunkFileNames: '[name]-[hash].mjs' };
  await build({
    root: dirname(sources[0]),
    configFile: false,
    logLevel: 'error',
    resolve: { alias: { fzstd: join(page, 'node_modules/fzstd') } },
    ssr: { noExternal: true },
    build: { ssr: true, target: 'node18', outDir: folder, emptyOutDir: true, minify: false, rollupOptions: { input: sources, output } },
  });
  return sources.map((source) => join(folder, basename(source).replace(/ts$/, 'mjs')));
}
