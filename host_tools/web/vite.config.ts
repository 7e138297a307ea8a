import { defineConfig } from 'vite';

// Relative addresses: the page works from any folder. Nothing is inlined: the policy that it is served under allows
// files of its own alone.
export default defineConfig({
  base: './',
  build: { target: 'es2022', outDir: '../../build/page', emptyOutDir: true, assetsInlineLimit: 0, modulePreload: { polyfill: false } },
  worker: { format: 'es' },
});
