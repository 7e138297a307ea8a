/** The newest contact in numbers, with units and how far they may be off. */
import { Flag } from '../line/line_facts';
import { WARNING_FLAGS, warningsOf } from '../model/flags';
import { element, write } from './elements';
import type { ShownContact, ShownTruth } from './shown';

interface Number_ {
  readonly name: string;
  readonly title: string;
  readonly unit: string;
  readonly valid: number;
  readonly value: (contact: ShownContact) => string;
  readonly sd?: (contact: ShownContact) => string;
  /** The true value of a simulated fingertip. */
  readonly truth?: (truth: ShownTruth) => string;
  readonly tangential?: boolean;
  /** Shown only where it has a value. */
  readonly seldom?: boolean;
}

export const forceText = (contact: ShownContact) => `${contact.flags & Flag.FORCE_LOWER_BOUND ? '≥ ' : ''}${fixed(contact.force_N, 2)}`;
const sdOf = (of: (contact: ShownContact) => number, digits: number) => (contact: ShownContact) =>
  contact.flags & Flag.UNCERTAINTY_VALID ? `± ${fixed(of(contact), digits)}` : '';

const NUMBERS: readonly Number_[] = [
  {
    name: 'force',
    title: 'Force',
    unit: 'N',
    valid: Flag.FIT_VALID,
    value: forceText,
    sd: sdOf((contact) => contact.force_sd_N, 2),
    truth: (truth) => fixed(truth.force_N, 2),
  },
  {
    name: 'place',
    title: 'Place x, y',
    unit: 'mm',
    valid: Flag.FIT_VALID,
    value: (contact) => `${fixed(contact.x_mm, 1)}, ${fixed(contact.y_mm, 1)}`,
    sd: sdOf((contact) => contact.location_sd_mm, 2),
    truth: (truth) => `${fixed(truth.x_mm, 1)}, ${fixed(truth.y_mm, 1)}`,
  },
  {
    name: 'slip',
    title: 'Slip',
    unit: 'mm',
    valid: Flag.SLIP_VALID,
    value: (contact) => fixed(contact.slip_mm, 3),
  },
  {
    name: 'peak',
    title: 'Peak, width σ',
    unit: 'kPa, mm',
    valid: Flag.FIT_VALID,
    value: (contact) => `${fixed(contact.p0_Pa / 1000, 1)}, ${fixed(contact.sigma_mm, 1)}`,
  },
  {
    name: 'pull',
    title: 'Pull x, y',
    unit: 'N',
    valid: Flag.TANGENTIAL_VALID,
    value: (contact) => `${fixed(contact.qx_N, 2)}, ${fixed(contact.qy_N, 2)}`,
    sd: (contact) => `± ${fixed(contact.q_sd_N, 2)}`,
    truth: ({ qx_N, qy_N }) => `${fixed(qx_N, 2)}, ${fixed(qy_N, 2)}`,
    tangential: true,
  },
  {
    name: 'two',
    title: 'Two: x, y; force',
    unit: 'mm, N',
    valid: Flag.TWO_CONTACTS,
    value: (contact) =>
      `${fixed(contact.x1_mm, 1)}, ${fixed(contact.y1_mm, 1)}; ${fixed(contact.force1_N, 1)} · ` +
      `${fixed(contact.x2_mm, 1)}, ${fixed(contact.y2_mm, 1)}; ${fixed(contact.force2_N, 1)}`,
    seldom: true,
  },
  {
    name: 'edge',
    title: 'Edge, length',
    unit: '°, mm',
    valid: Flag.EDGE,
    value: (contact) => `${fixed(contact.edge_angle_deg, 0)}, ${fixed(contact.edge_length_mm, 0)}`,
    sd: (contact) => `± ${fixed(contact.edge_angle_sd_deg, 1)}`,
    seldom: true,
  },
];

/** Never "-0.0"; numbers that no pad can feel as such. */
export function fixed(value: number, digits: number): string {
  if (Math.abs(value) >= 9999.5) {
    return value > 0 ? '> 9999' : '< −9999';
  }
  const text = value.toFixed(digits);
  return Number(text) === 0 ? (0).toFixed(digits) : text.replace('-', '−');
}

export class Numbers {
  readonly element: HTMLElement;
  private readonly rows = NUMBERS.map((number) => {
    const [value, sd, doubt, truth] = ['value', 'sd', 'doubt', 'truth'].map((name) => element('span', { class: name }));
    const unit = element('span', { class: 'unit' }, number.unit);
    const row = element('div', { class: `number ${number.name}` }, element('dt', {}, number.title));
    row.append(element('dd', {}, value, doubt, ' ', unit, ' ', sd, ' ', truth));
    return { number, row, value, sd, doubt, truth };
  });
  private readonly lamps: { bit: number; name: string; lamp: HTMLElement }[] = [];
  private readonly warnings = element('ul', { class: 'warnings' });
  private warned = '';

  constructor() {
    const list = element('dl', { class: 'numbers' }, ...this.rows.map(({ row }) => row));
    const lamps = element('ul', { class: 'lamps', 'aria-label': 'State' });
    for (const [name, bit, level] of [
      ['contact', Flag.CONTACT, 'accent'],
      ['slip', Flag.SLIP, 'bad'],
      ['sliding', Flag.SLIDING, 'bad'],
      ['moving', Flag.MOVING, 'warning'],
    ] as const) {
      const lamp = element('li', { class: `lamp ${level}` }, name);
      this.lamps.push({ bit, name, lamp });
      lamps.append(lamp);
    }
    this.element = element('div', { class: 'telling' }, lamps, list, this.warnings);
  }

  /** contact: null where nothing is known. truth: null of a real fingertip, and in a pause. */
  show(contact: ShownContact | null, tangential: boolean, limit_mm: number, truth: ShownTruth | null): void {
    const flags = contact?.flags ?? 0;
    const doubtful = (flags & WARNING_FLAGS) !== 0;
    for (const { number, ...row } of this.rows) {
      const there = contact !== null && (flags & number.valid) !== 0;
      write(row.value, there ? number.value(contact) : '–');
      write(row.sd, there && number.sd ? number.sd(contact) : '');
      write(row.doubt, there && doubtful ? '?' : '');
      const isTrue = truth?.contact ? number.truth?.(truth) : undefined;
      write(row.truth, isTrue === undefined ? '' : `true ${isTrue}`);
      row.row.classList.toggle('doubtful', there && doubtful);
      row.row.hidden = number.seldom === true ? !there : number.tangential === true && !tangential;
    }
    for (const { bit, name, lamp } of this.lamps) {
      const on = (flags & bit) !== 0;
      lamp.classList.toggle('on', on);
      lamp.hidden = !tangential && (bit === Flag.SLIDING || bit === Flag.MOVING);
      const label = on ? name : `no ${name}`;
      if (lamp.getAttribute('aria-label') !== label) {
        lamp.setAttribute('aria-label', label);
      }
    }
    const words =
      contact && !(flags & Flag.TARED)
        ? ['no zero yet: taring']
        : warningsOf(flags).map(({ bit, meaning }) =>
            bit === Flag.UNCERTAIN && limit_mm > 0 ? `the place may be off by more than ${limit_mm.toFixed(2)} mm` : meaning,
          );
    if (words.join() !== this.warned) {
      this.warned = words.join();
      this.warnings.replaceChildren(...words.map((text) => element('li', {}, text)));
    }
  }
}
