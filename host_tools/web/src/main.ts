/**
 * Puts the page together: what finds fingertips, what shows them, what can be done with them.
 *
 * Programs in the console, and tests, may read `fingertip`:
 *   fingertips  those of the page (src/model/fingertip.ts): state, why, info, health, contacts, raws,
 *               lost, contact, raw, history, ...
 *   pictures    drawn since the page was loaded
 *   ready_ms    performance.now() when the first was drawn; 0 before
 */
import type { Fingertip } from './model/fingertip';
import { App } from './steps/app';
import { make } from './steps/dialog';
import { fingertipControls, pageControls } from './steps/toolbar';

interface Console {
  readonly fingertips: readonly Fingertip[];
  readonly pictures: number;
  readonly ready_ms: number;
}

declare global {
  var fingertip: Console;
}

const app = new App();
const place = make('main');
const notices = make('div', { role: 'alert' });
document.body.append(pageControls(app), notices, place);
app.notice = (text) => notices.append(make('p', {}, text));
const controls = new Map<Fingertip, HTMLElement>();
app.bench.listen(() => {
  for (const each of app.bench.fingertips) {
    if (!controls.has(each)) {
      controls.set(each, fingertipControls(app, each));
    }
  }
  place.replaceChildren(...app.bench.fingertips.map((each) => controls.get(each) as HTMLElement));
});
globalThis.fingertip = { fingertips: app.bench.fingertips, pictures: 0, ready_ms: performance.now() };
app.start();
