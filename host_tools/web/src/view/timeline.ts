/** Pause, and a walk through the last minutes. */
import { button, element, write } from './elements';

const WINDOWS_s = [1, 5, 20, 60, 180];
const LEAST_s = 0.1;
const MOST_s = 180;
const STEP_s = 0.1;

export class Timeline {
  readonly element: HTMLElement;
  /** What the traces span. */
  window_s = 20;
  /** How far before the newest frame, or that of the pause, the view is; null: live. */
  behind_s: number | null = null;
  onChange: (() => void) | null = null;
  private kept_s = 0;
  private replay = false;
  private readonly pauseButton: HTMLButtonElement;
  private readonly slider: HTMLInputElement;
  private readonly output: HTMLOutputElement;
  private readonly zoomed = element('option', { hidden: true });

  constructor() {
    this.pauseButton = button('Pause', () => this.toggle(), {
      class: 'pause',
      'aria-keyshortcuts': 'Space',
    });
    this.slider = element('input', {
      type: 'range',
      min: -60,
      max: 0,
      step: STEP_s,
      value: 0,
      'aria-label': 'Moment shown, seconds before now',
    });
    this.output = element('output', { class: 'moment' });
    this.slider.addEventListener('input', () => this.seek(-Number(this.slider.value)));
    const choice = element(
      'select',
      { 'aria-label': 'Time shown', class: 'window' },
      ...WINDOWS_s.map((seconds) =>
        element('option', { value: seconds, selected: seconds === this.window_s }, seconds < 60 ? `${seconds} s` : `${seconds / 60} min`),
      ),
      this.zoomed,
    );
    choice.addEventListener('change', () => {
      this.window_s = Number(choice.value);
      this.onChange?.();
    });
    this.element = element(
      'div',
      { class: 'timeline', role: 'group', 'aria-label': 'Time' },
      this.pauseButton,
      this.slider,
      this.output,
      choice,
    );
    this.show();
  }

  /** How much is kept, so how far back one can go. */
  set length_s(length_s: number) {
    const kept_s = STEP_s * Math.max(1, Math.ceil(length_s / STEP_s));
    if (kept_s !== this.kept_s) {
      this.kept_s = kept_s;
      this.slider.min = (-kept_s).toFixed(1);
    }
  }

  /** The view is of a replay: nothing in it is live, and it has a pause of its own. */
  set isReplay(is_replay: boolean) {
    if (is_replay !== this.replay) {
      this.replay = is_replay;
      this.show();
    }
  }

  toggle(): void {
    this.seek(this.behind_s === null ? 0 : null);
  }

  seek(behind_s: number | null): void {
    this.behind_s = behind_s === null ? null : Math.min(Math.max(behind_s, 0), this.kept_s);
    this.show();
    this.onChange?.();
  }

  step(by_s: number): void {
    this.seek((this.behind_s ?? 0) + by_s);
  }

  /** Spans that much, up to behind_s. */
  zoom(window_s: number, behind_s = this.behind_s): void {
    this.window_s = Math.min(Math.max(window_s, LEAST_s), MOST_s);
    write(this.zoomed, `${this.window_s.toFixed(this.window_s < 10 ? 1 : 0)} s`);
    this.zoomed.value = String(this.window_s);
    this.zoomed.hidden = false;
    this.zoomed.selected = true;
    this.seek(behind_s);
  }

  private show(): void {
    const newest = this.behind_s === null;
    const [look, leave, now] = this.replay ? ['Look back', 'To the newest', 'newest'] : ['Pause', 'Go live', 'live'];
    write(this.pauseButton, newest ? look : leave);
    this.element.classList.toggle('paused', !newest);
    this.slider.value = String(-(this.behind_s ?? 0));
    const behind_s = (this.behind_s ?? 0).toFixed(1);
    const text = newest ? now : `${behind_s} s before the ${this.replay ? 'newest' : 'pause'}`;
    write(this.output, newest ? now : `−${behind_s} s`);
    this.slider.setAttribute('aria-valuetext', text);
  }
}
