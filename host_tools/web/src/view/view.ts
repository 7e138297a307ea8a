/** The page: who is there, their pads, numbers, traces and health, and the time in view. It
 * reads the fingertips when it draws, and changes nothing of them by itself. */
import 'uplot/dist/uPlot.min.css';
import '../styles/tokens.css';
import '../styles/page.css';
import '../styles/steps.css';
import type { Fingertip } from '../model/fingertip';
import type { History } from '../model/history';
import { button, element, write } from './elements';
import { HealthPanel } from './health';
import { factsOf } from './health_facts';
import { leaving } from './notices';
import { Numbers } from './numbers';
import { PadCard } from './pad_card';
import { Shown } from './shown';
import { Speech } from './speech';
import { onPalette, palette, restoreTheme, setTheme, theme, type Theme } from './theme';
import { Timeline } from './timeline';
import { Traces } from './traces';

/** What others make and the view places. */
export interface Controls {
  /** Connect, replay and what else concerns no single fingertip. */
  readonly page: HTMLElement;
  /** What one begins with. */
  readonly begin: readonly HTMLElement[];
  /** Tare, record and so on; asked for once for each. */
  of(fingertip: Fingertip): HTMLElement;
}

/** All fingertips of the page, and who listens to their coming and going. */
interface Bench {
  readonly fingertips: readonly Fingertip[];
  listen(listener: () => void): unknown;
}

const TRACES_INTERVAL_ms = 33;
const TEXT_INTERVAL_ms = 125;
const HEALTH_INTERVAL_ms = 500;
const NOTICE_ms = 20000;

export class View {
  /** Pictures drawn so far. */
  pictures = 0;
  private readonly cards = new Map<Fingertip, PadCard>();
  private selected: Fingertip | null = null;
  private made = 0;
  private readonly numbers = new Numbers();
  private readonly traces = new Traces();
  private readonly health = new HealthPanel();
  private readonly timeline = new Timeline();
  private readonly speech = new Speech();
  /** Of index.html, by its class. */
  private readonly part = (name: string): HTMLElement => this.root.querySelector(`.${name}`)!;
  private tracesAt_ms = 0;
  private textAt_ms = 0;
  private healthAt_ms = 0;
  private tracesDue = true;
  private tracedEnd = -1;
  /** The end of each fingertip's history when the pause began. */
  private readonly ends = new Map<Fingertip, number>();

  constructor(
    private readonly root: HTMLElement,
    private readonly bench: Bench,
    private readonly controls: Controls,
  ) {
    restoreTheme();
    this.root.append(this.root.querySelector('template')!.content);
    this.part('top-actions').prepend(this.controls.page);
    const themes = this.root.querySelector<HTMLSelectElement>('.themes')!;
    themes.value = theme();
    themes.addEventListener('change', () => setTheme(themes.value as Theme));
    this.part('begin').append(...this.controls.begin);
    this.part('hand-place').before(this.numbers.element);
    this.part('over-time').append(this.traces.element, this.timeline.element);
    this.part('behind').append(this.health.element);
    this.traces.setPalette(palette());
    onPalette((changed) => {
      this.traces.setPalette(changed);
      this.tracesDue = true;
      for (const card of this.cards.values()) {
        card.repaint();
      }
    });
    this.timeline.onChange = () => this.timeChanged();
    this.traces.onResize = () => (this.tracesDue = true);
    this.traces.onZoom = (times) => this.timeline.zoom(times * this.timeline.window_s);
    this.traces.onSelect = ({ from_s, to_s }) => {
      const chosen = this.selected;
      const end_s = (chosen && (this.ends.get(chosen) ?? newest_s(chosen.history))) ?? to_s;
      this.timeline.zoom(to_s - from_s, end_s - to_s);
    };
    this.root.addEventListener('keydown', (event) => this.key(event));
    bench.listen(() => this.gather());
    this.gather();
    requestAnimationFrame((now_ms) => this.draw(now_ms));
  }

  choose(fingertip: Fingertip | null): void {
    this.selected = fingertip;
    for (const [of, card] of this.cards) {
      card.selected = of === fingertip;
    }
    const card = fingertip && this.cards.get(fingertip);
    this.part('doings').replaceChildren(...(card ? [card.doings] : []));
    this.part('hand-place').replaceChildren();
    this.tracesDue = true;
    this.textAt_ms = this.healthAt_ms = -Infinity;
  }

  /** A sentence that stays until it is closed; a plain one leaves by itself. */
  notice(text: string, level: 'plain' | 'bad' = 'plain'): void {
    const notice = element('div', { class: `notice ${level}` }, element('p', {}, text));
    notice.append(button('Close', () => notice.remove(), { class: 'small' }));
    this.part('notices').append(notice);
    const all = [...this.part('notices').children];
    leaving(all.map((each) => ({ text: each.textContent, is_plain: each.matches('.plain') }))).forEach((i) => all[i].remove());
    setTimeout(() => level === 'plain' && notice.remove(), NOTICE_ms);
  }

  private gather(): void {
    const { fingertips } = this.bench;
    for (const [fingertip, card] of this.cards) {
      if (!fingertips.includes(fingertip)) {
        card.element.remove();
        this.cards.delete(fingertip);
        this.ends.delete(fingertip);
      }
    }
    let came: Fingertip | null = null;
    for (const fingertip of fingertips) {
      if (!this.cards.has(fingertip)) {
        const shown = new Shown(fingertip, this.made++);
        const card = new PadCard(shown, this.controls.of(fingertip), () => this.choose(fingertip));
        this.cards.set(fingertip, card);
        this.part('pads').append(card.element);
        came = fingertip;
      }
    }
    this.part('welcome').hidden = fingertips.length > 0;
    this.part('work').hidden = fingertips.length === 0;
    const gone = this.selected === null || !fingertips.includes(this.selected);
    if (came || gone) {
      this.choose(came ?? fingertips[0] ?? null);
    }
  }

  private timeChanged(): void {
    this.tracesDue = true;
    if (this.timeline.behind_s === null) {
      this.ends.clear();
      return;
    }
    for (const fingertip of this.cards.keys()) {
      if (!this.ends.has(fingertip)) {
        this.ends.set(fingertip, newest_s(fingertip.history));
      }
    }
  }

  private key(event: KeyboardEvent): void {
    const target = event.target as HTMLElement;
    const busy =
      target.closest('input, select, textarea, button, summary, dialog, a') !== null || event.ctrlKey || event.metaKey || event.altKey;
    if (busy || this.cards.size === 0) {
      return;
    }
    if (event.key === ' ') {
      this.timeline.toggle();
    } else if (event.key === 'ArrowLeft') {
      this.timeline.step(event.shiftKey ? 5 : 0.5);
    } else if (event.key === 'ArrowRight') {
      this.timeline.step(event.shiftKey ? -5 : -0.5);
    } else if (event.key === '+' || event.key === '-') {
      this.timeline.zoom(this.timeline.window_s * (event.key === '+' ? 0.5 : 2));
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
    for (const [fingertip, card] of this.cards) {
      const end_s = this.ends.get(fingertip) ?? newest_s(fingertip.history);
      drawn = card.draw(end_s, behind_s, now_ms, colours) || drawn;
    }
    const card = this.selected && this.cards.get(this.selected);
    if (card) {
      drawn = this.drawChosen(card, behind_s, now_ms) || drawn;
    }
    if (drawn) {
      this.pictures++;
    }
  }

  private drawChosen(card: PadCard, behind_s: number | null, now_ms: number): boolean {
    const { shown } = card;
    const { fingertip } = shown;
    const { history } = fingertip;
    const end_s = this.ends.get(fingertip) ?? newest_s(history);
    const fresh = behind_s === null && history !== null && history.end !== this.tracedEnd;
    let drawn = false;
    if (history && (this.tracesDue || fresh) && now_ms - this.tracesAt_ms >= TRACES_INTERVAL_ms) {
      this.tracesAt_ms = now_ms;
      this.tracesDue = false;
      this.tracedEnd = history.end;
      const to_s = end_s - (behind_s ?? 0);
      this.traces.draw(shown, history, { from_s: to_s - this.timeline.window_s, to_s });
      drawn = true;
    }
    if (now_ms - this.textAt_ms >= TEXT_INTERVAL_ms) {
      this.textAt_ms = now_ms;
      this.writeTexts(card, now_ms);
    }
    if (now_ms - this.healthAt_ms >= HEALTH_INTERVAL_ms) {
      this.healthAt_ms = now_ms;
      this.health.show(factsOf(shown, performance.now()));
      const kept = history !== null && history.end > history.begin;
      const oldest_s = kept ? (history.t_s[history.slot(history.begin)] ?? 0) : end_s;
      this.timeline.length_s = end_s - oldest_s;
    }
    return drawn;
  }

  private writeTexts({ shown, contact, hand }: PadCard, now_ms: number): void {
    for (const each of this.cards.values()) {
      each.writeTexts();
    }
    write(this.root.querySelector('.who h2')!, shown.name);
    this.timeline.isReplay = shown.fingertip.is_replay;
    this.part('doings').setAttribute('aria-label', `What to do with ${shown.name}`);
    const truth = this.timeline.behind_s === null ? shown.truth : null;
    this.numbers.show(contact, shown.tangential, shown.fingertip.info?.location_limit_mm ?? 0, truth);
    const place = this.part('hand-place');
    if ((hand?.element ?? null) !== place.firstElementChild) {
      place.replaceChildren(...(hand ? [hand.element] : []));
    }
    if (this.timeline.behind_s === null) {
      const several = this.cards.size > 1 ? `${shown.name}: ` : '';
      const state = shown.state(performance.now()).words.replace(/ for \d+ s$/, '');
      const sentence = this.speech.sentence(contact, state, now_ms);
      if (sentence) {
        write(this.part('spoken'), several + sentence);
      }
    }
  }
}

function newest_s(history: History | null): number {
  return history && history.end > history.begin ? (history.t_s[history.slot(history.end - 1)] ?? 0) : 0;
}
