import { defineConfig } from 'vite';
import { version } from './package.json';

// Relative addresses: the page works from any folder. Nothing is inlined: the policy that it is served under allows files of its own alone.
export default defineConfig({
  base: './',
  build: { target: 'es2022', outDir: '../../build/page', emptyOutDir: true, assetsInlineLimit: 0, modulePreload: { polyfill: false } },
  worker: { format: 'es' },
  // The tool that serves the page checks that it is of its own version.
  plugins: [
    {
      name: 'fingertip-version',
      transformIndexHtml: () => [{ tag: 'meta', attrs: { name: 'fingertip-version', content: version }, injectTo: 'head' }],
    },
  ],
});
