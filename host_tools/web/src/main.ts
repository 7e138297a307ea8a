/**
 * Puts the page together: what finds fingertips, what shows them, what can be done with them.
 *
 * Programs in the console, and tests, may read `fingertip`:
 *   fingertips  those of the page (src/model/fingertip.ts): state, why, info, health, history, ...
 *   pictures    drawn since the page was loaded
 *   ready_ms    performance.now() when the first was drawn; 0 before
 */
import { fetched } from '../wasm/module.mjs';
import { loadCore } from './core';
import type { Fingertip } from './model/fingertip';
import { App } from './steps/app';
import { begin, fingertipControls, pageControls } from './steps/toolbar';
import { element, wordsOf } from './view/elements';
import { keepFocus } from './view/focus';
import { View } from './view/view';

declare global {
  var fingertip: { readonly fingertips: readonly Fingertip[]; readonly pictures: number; ready_ms: number };
}

function start(): void {
  const app = new App();
  const view = new View(document.body, app, {
    page: pageControls(app),
    of: (fingertip) => fingertipControls(app, fingertip),
    begin: begin(app, 'Connect a fingertip', 'Try the simulated one'),
  });
  app.notice = (text, kind) => view.notice(text, kind);
  keepFocus();
  // A recording that is not saved is lost with the page.
  addEventListener('beforeunload', (event) => app.unsaved.size > 0 && event.preventDefault());
  globalThis.fingertip = {
    fingertips: app.fingertips,
    get pictures() {
      return view.pictures;
    },
    ready_ms: 0,
  };
  requestAnimationFrame(() => (fingertip.ready_ms = performance.now()));
  app.start();
}

const problem = await fetched('wasm/core.wasm')
  .then(loadCore)
  .then(() => null, wordsOf);
if (problem === null) {
  start();
} else {
  const text =
    `This page cannot start (${problem}). If loading it again does not help, ` +
    'start it with "fingertip web", or copy all of its files to the server again.';
  document.body.replaceChildren(element('p', { class: 'notice bad', role: 'alert' }, text));
}
