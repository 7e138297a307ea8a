/** One fingertip's pad with its name, its state and its force; several are side by side. */
import { Flag } from '../line/line_facts';
import { WARNING_FLAGS } from '../model/flags';
import { button, element, write } from './elements';
import { HandPanel } from './hand_panel';
import { forceText } from './numbers';
import { sceneOf } from './pad_scene';
import { PadView } from './pad_view';
import type { Palette } from './palette';
import type { Hand, Shown, ShownContact } from './shown';

export class PadCard {
  readonly element: HTMLElement;
  hand: HandPanel | null = null;
  contact: ShownContact | null = null;
  private view: PadView | null = null;
  private held: Hand | null = null;
  private places = '';
  private seen = '';
  private readonly nameButton: HTMLButtonElement;
  private readonly name = element('span', { class: 'name' });
  private readonly state = element('span', { class: 'state' });
  private readonly force = element('span', { class: 'force' });
  private readonly alarm = element('span', { class: 'alarm', 'aria-hidden': 'true' });
  private readonly frame = element('div', { class: 'pad-frame' });
  private readonly above: HTMLButtonElement;
  private readonly empty = element('p', { class: 'empty' }, 'No answer yet.');

  constructor(
    readonly shown: Shown,
    /** What can be done with it. */
    readonly doings: HTMLElement,
    select: () => void,
  ) {
    const dot = element('span', { class: 'dot', 'aria-hidden': 'true' });
    this.nameButton = element('button', { type: 'button', class: 'pad-name' }, dot, this.name, this.state, this.force);
    this.nameButton.addEventListener('click', select);
    this.above = button('From above', () => this.view?.setFromAbove(!this.view.fromAbove), {
      class: 'above small',
      'aria-pressed': 'false',
    });
    // At the roots of their pressures: the columns are those of .scale.
    const scale = ['1', '5', '20', '50', '100 kPa'].map((text) => element('span', {}, text));
    this.frame.append(this.empty, this.alarm, element('div', { class: 'scale', 'aria-hidden': 'true' }, ...scale));
    this.element = element('figure', { class: 'pad-card' }, element('figcaption', {}, this.nameButton, this.above), this.frame);
    this.element.dataset['finger'] = String(shown.finger);
  }

  set selected(selected: boolean) {
    this.element.classList.toggle('selected', selected);
    this.nameButton.setAttribute('aria-pressed', String(selected));
  }

  repaint(): void {
    this.view?.repaint();
  }

  /** behind_s: before end_s, of a pause; null: live. True if something was drawn. */
  draw(end_s: number, behind_s: number | null, now_ms: number, palette: Palette): boolean {
    const { shown } = this;
    this.prepare();
    this.hand?.apply(now_ms);
    const { truth, fingertip } = shown;
    const { history, info, found } = fingertip;
    if (!history) {
      return false;
    }
    const seen = `${history.end} ${behind_s} ${shown.isCurrent(performance.now())} ${truth?.contact} ${truth?.x_mm} ${truth?.y_mm} ${!found}`;
    if (seen !== this.seen && info && this.view) {
      this.seen = seen;
      const live = behind_s === null;
      const { contact, readings, trail } = shown.moment(live ? Infinity : end_s - behind_s, performance.now());
      this.contact = contact;
      const place = live && truth?.contact ? { x_mm: truth.x_mm, y_mm: truth.y_mm } : null;
      const scene = sceneOf(info, contact, readings, trail, place, found);
      this.view.show(scene);
      const alarm = { slips: 'SLIPS', slides: 'SLIDES', moves: 'MOVES', none: '' }[scene.alarm ?? 'none'];
      write(this.alarm, alarm);
      this.frame.dataset['alarm'] = scene.alarm ?? '';
    }
    return this.view?.draw(now_ms, palette) ?? false;
  }

  /** Texts, which cannot be read at the rate of pictures. */
  writeTexts(): void {
    const { shown, contact } = this;
    write(this.name, shown.name);
    const { words, level } = shown.state(performance.now());
    write(this.state, words);
    this.state.className = `state ${level}`;
    const fitted = contact !== null && (contact.flags & Flag.FIT_VALID) !== 0;
    const doubt = fitted && contact.flags & WARNING_FLAGS ? ' ?' : '';
    write(this.force, fitted ? `${forceText(contact)} N${doubt}` : '');
  }

  private prepare(): void {
    const { hand } = this.shown;
    const layout = this.shown.fingertip.info;
    const places = layout ? `${layout.x_mm} ${layout.y_mm}` : '';
    if (hand !== this.held) {
      this.held = hand; // of another line, where its simulation has ended and begun again
      this.hand = hand ? new HandPanel(hand) : null;
      this.view?.setTouch(this.hand);
    }
    if (!layout || places === this.places) {
      return;
    }
    this.places = places;
    this.view?.element.remove();
    const view = new PadView(layout, `Pad of ${this.shown.name}.`);
    this.view = view;
    view.setTouch(this.hand);
    view.onLook = () => this.above.setAttribute('aria-pressed', String(view.fromAbove));
    this.empty.remove();
    this.frame.prepend(view.element);
  }
}
