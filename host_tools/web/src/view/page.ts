/** The page: who is there, their pads, numbers, traces and health; what can be done; the time that is
 * looked at. It reads the fingertips when it draws, and changes nothing of them by itself. */
import 'uplot/dist/uPlot.min.css';
import '../styles/tokens.css';
import '../styles/page.css';
import '../styles/steps.css';
import { button, element, write } from './elements';
import { HealthPanel } from './health';
import { Numbers } from './numbers';
import { PadCard } from './pad_card';
import type { ShownFingertip } from './shown';
import { Speech } from './speech';
import { onPalette, palette, restoreTheme, setTheme, theme, type Theme } from './theme';
import { Timeline } from './timeline';
import { Traces } from './traces';

/** What people ask for; the page leaves it to others. key: that of a fingertip. */
export interface Actions {
  connect(): void;
  simulate(): void;
  replay(): void;
  tare(key: string): void;
  set(key: string): void;
  calibrate(key: string): void;
  record(key: string): void;
  stopRecording(key: string): void;
  doctor(key: string): void;
  flash(key: string): void;
  disconnect(key: string): void;
}

const TRACES_INTERVAL_ms = 33;
const TEXT_INTERVAL_ms = 125;
const HEALTH_INTERVAL_ms = 500;

export class Page {
  /** Pictures drawn so far. */
  pictures = 0;
  private fingertips: readonly ShownFingertip[] = [];
  private selected: string | null = null;
  private readonly cards = new Map<string, PadCard>();
  private readonly numbers = new Numbers();
  private readonly traces = new Traces();
  private readonly health = new HealthPanel();
  private readonly timeline = new Timeline();
  private readonly speech = new Speech();
  private readonly pads = element('div', { class: 'pads' });
  private readonly handPlace = element('div', { class: 'hand-place' });
  private readonly heading = element('h2');
  private readonly doings = element('div', { class: 'doings', role: 'group' });
  private readonly recordButton: HTMLButtonElement;
  private readonly live = element('p', { class: 'spoken', role: 'status', 'aria-live': 'polite' });
  private readonly notices = element('div', { class: 'notices', role: 'alert' });
  private readonly welcome: HTMLElement;
  private readonly work: HTMLElement;
  private tracesAt_ms = 0;
  private textAt_ms = 0;
  private healthAt_ms = 0;
  private tracesDue = true;
  private tracedEnd = -1;
  /** Of each fingertip when the pause began. */
  private readonly ends = new Map<string, number>();

  constructor(
    private readonly root: HTMLElement,
    private readonly actions: Actions,
  ) {
    restoreTheme();
    this.recordButton = this.doing('Record', (key) =>
      this.shownOf(key)?.recording ? this.actions.stopRecording(key) : this.actions.record(key),
    );
    this.doings.append(
      this.doing('Tare', (key) => this.actions.tare(key)),
      this.recordButton,
      this.doing('Set', (key) => this.actions.set(key)),
      this.doing('Calibrate', (key) => this.actions.calibrate(key)),
      this.doing('Doctor', (key) => this.actions.doctor(key)),
      this.doing('Flash', (key) => this.actions.flash(key)),
      this.doing('Disconnect', (key) => this.actions.disconnect(key)),
    );
    this.welcome = this.welcomeOf();
    this.work = element(
      'div',
      { class: 'work', hidden: true },
      element('section', { class: 'pads-place', 'aria-label': 'Pads' }, this.pads),
      element(
        'section',
        { class: 'side', 'aria-label': 'Numbers' },
        element('div', { class: 'who' }, this.heading, this.doings),
        this.numbers.element,
        this.handPlace,
      ),
      element('section', { class: 'over-time', 'aria-label': 'Over time' }, this.traces.element, this.timeline.element),
      element('section', { class: 'behind', 'aria-label': 'Health' }, this.health.element),
    );
    this.root.append(
      element('a', { class: 'skip', href: '#main' }, 'To the fingertip'),
      this.header(),
      this.notices,
      element('main', { id: 'main', tabindex: -1 }, this.welcome, this.work),
      this.live,
    );
    this.traces.setPalette(palette());
    onPalette((changed) => {
      this.traces.setPalette(changed);
      this.tracesDue = true;
      for (const card of this.cards.values()) {
        card.repaint();
      }
    });
    this.timeline.onChange = () => this.timeChanged();
    this.root.addEventListener('keydown', (event) => this.key(event));
    requestAnimationFrame((now_ms) => this.draw(now_ms));
  }

  get selectedKey(): string | null {
    return this.selected;
  }

  /** All that are there, in their order; called when one came or went, or became another object. */
  show(fingertips: readonly ShownFingertip[]): void {
    this.fingertips = fingertips;
    for (const [key, card] of this.cards) {
      if (!fingertips.some((shown) => shown.key === key)) {
        card.element.remove();
        this.cards.delete(key);
        this.ends.delete(key);
      }
    }
    for (const shown of fingertips) {
      if (!this.cards.has(shown.key)) {
        const card = new PadCard(shown, () => this.select(shown.key));
        this.cards.set(shown.key, card);
        this.pads.append(card.element);
      }
    }
    this.pads.dataset['count'] = String(fingertips.length);
    this.welcome.hidden = fingertips.length > 0;
    this.work.hidden = fingertips.length === 0;
    if (!fingertips.some((shown) => shown.key === this.selected)) {
      this.select(fingertips[0]?.key ?? null);
    }
  }

  select(key: string | null): void {
    this.selected = key;
    for (const [of, card] of this.cards) {
      card.selected = of === key;
    }
    this.tracesDue = true;
    this.textAt_ms = this.healthAt_ms = 0;
    this.handPlace.replaceChildren();
  }

  /** A sentence that stays until it is closed. */
  notice(text: string, level: 'plain' | 'bad' = 'plain'): void {
    const told = element('div', { class: `notice ${level}` }, element('p', {}, text));
    told.append(button('Close', () => told.remove(), { class: 'small' }));
    this.notices.append(told);
  }

  private doing(label: string, act: (key: string) => void): HTMLButtonElement {
    return button(label, () => this.selected !== null && act(this.selected));
  }

  private shownOf(key: string | null): ShownFingertip | null {
    return this.fingertips.find((shown) => shown.key === key) ?? null;
  }

  private header(): HTMLElement {
    const themes = element(
      'select',
      { 'aria-label': 'Colours' },
      ...(['system', 'light', 'dark'] as const).map((name) =>
        element('option', { value: name, selected: name === theme() }, { system: 'Auto', light: 'Light', dark: 'Dark' }[name]),
      ),
    );
    themes.addEventListener('change', () => setTheme(themes.value as Theme));
    return element(
      'header',
      { class: 'top' },
      element('h1', {}, 'Fingertip'),
      element(
        'div',
        { class: 'top-actions' },
        button('Connect', () => this.actions.connect()),
        button('Simulate', () => this.actions.simulate()),
        button('Replay a file', () => this.actions.replay()),
        themes,
      ),
    );
  }

  private welcomeOf(): HTMLElement {
    return element(
      'section',
      { class: 'welcome', 'aria-label': 'Begin' },
      element('h2', {}, 'Touch, in numbers'),
      element(
        'p',
        {},
        'This page shows where a soft fingertip with fifteen pressure sensors is touched, how hard, and whether ' +
          'the thing slips. Plug one in, or try it without: a simulated one runs the same firmware in this page.',
      ),
      element(
        'div',
        { class: 'begin' },
        button('Connect a fingertip', () => this.actions.connect(), { class: 'main' }),
        button('Try the simulated one', () => this.actions.simulate()),
      ),
      element('p', { class: 'hint' }, 'Or drop a recording here. Nothing leaves this computer.'),
    );
  }

  private timeChanged(): void {
    this.tracesDue = true;
    if (this.timeline.behind_s === null) {
      this.ends.clear();
      return;
    }
    for (const shown of this.fingertips) {
      if (!this.ends.has(shown.key)) {
        this.ends.set(shown.key, newest_s(shown));
      }
    }
  }

  private key(event: KeyboardEvent): void {
    const target = event.target as HTMLElement;
    const busy =
      target.closest('input, select, textarea, button, summary, dialog, a') !== null ||
      event.ctrlKey || event.metaKey || event.altKey;
    if (busy || this.fingertips.length === 0) {
      return;
    }
    if (event.key === ' ') {
      this.timeline.toggle();
    } else if (event.key === 'ArrowLeft') {
      this.timeline.step(event.shiftKey ? 5 : 0.5);
    } else if (event.key === 'ArrowRight') {
      this.timeline.step(event.shiftKey ? -5 : -0.5);
    } else {
      return;
    }
    event.preventDefault();
  }

  private draw(now_ms: number): void {
    requestAnimationFrame((next_ms) => this.draw(next_ms));
    const { behind_s } = this.timeline;
    const colours = palette();
    let drawn = false;
    for (const shown of this.fingertips) {
      const end_s = this.ends.get(shown.key) ?? newest_s(shown);
      drawn = (this.cards.get(shown.key)?.draw(shown, end_s, behind_s, now_ms, colours) ?? false) || drawn;
    }
    const shown = this.shownOf(this.selected);
    if (shown) {
      drawn = this.drawSelected(shown, behind_s, now_ms) || drawn;
    }
    if (drawn) {
      this.pictures++;
    }
  }

  private drawSelected(shown: ShownFingertip, behind_s: number | null, now_ms: number): boolean {
    const card = this.cards.get(shown.key);
    const end_s = this.ends.get(shown.key) ?? newest_s(shown);
    const fresh = behind_s === null && shown.history.end !== this.tracedEnd;
    let drawn = false;
    if ((this.tracesDue || fresh) && now_ms - this.tracesAt_ms >= TRACES_INTERVAL_ms) {
      this.tracesAt_ms = now_ms;
      this.tracesDue = false;
      this.tracedEnd = shown.history.end;
      const to_s = end_s - (behind_s ?? 0);
      this.traces.draw(shown, { from_s: to_s - this.timeline.window_s, to_s });
      drawn = true;
    }
    if (now_ms - this.textAt_ms >= TEXT_INTERVAL_ms) {
      this.textAt_ms = now_ms;
      this.tell(shown, card, now_ms);
    }
    if (now_ms - this.healthAt_ms >= HEALTH_INTERVAL_ms) {
      this.healthAt_ms = now_ms;
      this.health.show(shown.health);
      const { history } = shown;
      const oldest_s = history.end > history.first ? (history.t_s[history.first % history.capacity] ?? 0) : 0;
      this.timeline.length_s = end_s - oldest_s;
    }
    return drawn;
  }

  private tell(shown: ShownFingertip, card: PadCard | undefined, now_ms: number): void {
    for (const each of this.cards.values()) {
      each.tell();
    }
    const contact = card?.contact ?? null;
    write(this.heading, shown.name);
    this.doings.setAttribute('aria-label', `What to do with ${shown.name}`);
    write(this.recordButton, shown.recording ? 'Stop' : 'Record');
    this.recordButton.classList.toggle('recording', shown.recording);
    for (const doing of this.doings.querySelectorAll('button')) {
      const closes = doing.textContent === 'Disconnect';
      doing.disabled = shown.source === 'recording' && !closes;
    }
    this.numbers.show(contact, shown.tangential, shown.location_limit_mm);
    const hand = card?.hand?.element;
    if (hand && hand.parentElement !== this.handPlace) {
      this.handPlace.replaceChildren(hand);
    }
    if (this.timeline.behind_s === null) {
      const several = this.fingertips.length > 1 ? `${shown.name}: ` : '';
      const sentence = this.speech.say(contact, shown.state.words, now_ms);
      if (sentence) {
        write(this.live, several + sentence);
      }
    }
  }
}

function newest_s({ history }: ShownFingertip): number {
  return history.end > history.first ? (history.t_s[(history.end - 1) % history.capacity] ?? 0) : 0;
}
