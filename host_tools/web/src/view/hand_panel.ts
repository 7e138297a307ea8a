/** The hand on a simulated fingertip: with the pointer on its pad, or by these controls. */
import { button, element, slider } from './elements';
import type { Touch } from './pad_view';
import type { Hand } from './shown';

const MOST_N = 20;
/** Held down, a hand presses harder: from FIRST_N to the set force, most of it within RISE_s. */
const FIRST_N = 0.2;
const RISE_s = 0.45;
const WHEEL_PART = 1.15;

type Doing = 'nothing' | 'pointer' | 'press' | 'hold';

export class HandPanel implements Touch {
  readonly element: HTMLElement;
  private readonly force = this.slider('Force', 'N', 0.5, MOST_N, 0.5, 4);
  private readonly x = this.slider('Across', 'mm', -13, 13, 0.5, 0);
  private readonly y = this.slider('Along', 'mm', -22, 22, 0.5, 0);
  private readonly load = this.slider('Load', 'N', 0, MOST_N, 0.1, 1);
  private readonly angle = this.slider('Direction', '°', -180, 180, 5, -90);
  private readonly pressButton: HTMLButtonElement;
  private readonly holdButton: HTMLButtonElement;
  private doing: Doing = 'nothing';
  private since_ms = 0;
  private sent = '';

  constructor(private readonly hand: Hand) {
    this.pressButton = button('Press', () => this.toggle('press'), { 'aria-pressed': 'false' });
    this.holdButton = button('Hold in a grip', () => this.toggle('hold'), { 'aria-pressed': 'false' });
    const drop = button('Drop it', () => {
      this.set('nothing');
      hand.drop?.(this.x.value, this.y.value);
    });
    const lift = button('Lift', () => {
      this.set('nothing');
      hand.lift();
    });
    this.element = element(
      'section',
      { class: 'hand', 'aria-label': 'Simulated hand' },
      element('h3', {}, 'Your hand'),
      element('p', { class: 'hint' }, 'Press on the pad and drag: longer presses harder, the wheel too. All of it is simulated.'),
      ...this.objects(),
      this.force.element,
      element('div', { class: 'choices' }, this.pressButton, ...(hand.drop ? [drop] : []), lift),
      element(
        'details',
        {},
        element('summary', {}, hand.hold ? 'Where, and slip' : 'Where'),
        this.x.element,
        this.y.element,
        ...this.slipping(),
      ),
    );
  }

  private slider(name: string, unit: string, least: number, most: number, step: number, value: number) {
    return slider(name, unit, { least, most, step, value }, () => this.apply(performance.now()));
  }

  down(x_mm: number, y_mm: number): void {
    this.set('pointer');
    this.move(x_mm, y_mm);
  }

  move(x_mm: number, y_mm: number): void {
    this.x.value = x_mm;
    this.y.value = y_mm;
  }

  up(): void {
    if (this.doing === 'pointer') {
      this.set('nothing');
      this.hand.lift();
    }
  }

  wheel(turns: number): void {
    this.force.value = Math.max(0.5, this.force.value * WHEEL_PART ** turns + (turns > 0 ? 0.5 : 0));
  }

  /** Sends the place of the hand, once a picture. */
  apply(now_ms: number): void {
    if (this.doing === 'nothing') {
      return;
    }
    const x_mm = this.x.value;
    const y_mm = this.y.value;
    const most_N = this.force.value;
    const held_s = (now_ms - this.since_ms) / 1000;
    const force_N = this.doing === 'pointer' ? most_N + (FIRST_N - most_N) * Math.exp(-held_s / RISE_s) : most_N;
    const rounded_N = Math.round(100 * force_N) / 100;
    const grip = { load_N: this.load.value, angle_deg: this.angle.value };
    const doing = JSON.stringify([this.doing, x_mm, y_mm, rounded_N, grip]);
    if (doing === this.sent) {
      return;
    }
    this.sent = doing;
    if (this.doing === 'hold') {
      this.hand.hold?.({ x_mm, y_mm, force_N: rounded_N, ...grip });
    } else {
      this.hand.press({ x_mm, y_mm, force_N: rounded_N });
    }
  }

  private objects(): HTMLElement[] {
    const { hand } = this;
    if (!hand.objects) {
      return [];
    }
    const object = element('select', { id: 'object' }, ...hand.objects.map(({ name, title }) => element('option', { value: name }, title)));
    object.addEventListener('change', () => {
      this.set('nothing');
      hand.choose?.(object.value);
    });
    return [element('div', { class: 'field' }, element('label', { for: 'object' }, 'Object'), object)];
  }

  private slipping(): HTMLElement[] {
    const { hand } = this;
    if (!hand.hold) {
      return [];
    }
    const friction = slider('Friction', '', { least: 0.1, most: 1.5, step: 0.05, value: 0.5 }, (value) => hand.setFriction?.(value));
    return [
      friction.element,
      element('p', { class: 'hint' }, 'A grip presses while a load pulls; more than friction holds slips.'),
      this.load.element,
      this.angle.element,
      element('div', { class: 'choices' }, this.holdButton),
    ];
  }

  private toggle(doing: 'press' | 'hold'): void {
    const off = this.doing === doing;
    this.set(off ? 'nothing' : doing);
    if (off) {
      this.hand.lift();
    } else {
      this.apply(this.since_ms);
    }
  }

  private set(doing: Doing): void {
    this.doing = doing;
    this.since_ms = performance.now();
    this.sent = '';
    this.pressButton.setAttribute('aria-pressed', String(this.doing === 'press'));
    this.holdButton.setAttribute('aria-pressed', String(this.doing === 'hold'));
  }
}
