/** Force, place, load and slip over time, and which flags were set: one axis of time for all. */
import { FLAGS, Flag } from '../line/line_facts';
import uPlot from 'uplot';
import { Buckets, intervalOf, roundAbove, type ColumnName } from './buckets';
import { chartOf, clock, spansOf, ticksOf, type Chart, type Span } from './curves';
import { element } from './elements';
import { padSize } from './pad_scene';
import { FINGERS, type Palette } from './palette';
import type { History } from '../model/history';
import type { Shown } from './shown';

/** Room for the names of values; the flags keep it too, so that times are below one another. */
const AXIS_px = 52;
const RIGHT_px = 20;
const MOST_INTERVALS = 1400;
/** A doubtful force above this is none: the pads are made for less. */
const MOST_N = 50;
/** A load below this is hardly more than its standard deviation: no axis is made for it. */
const LEAST_PULL_N = 0.5;
/** Of the strip of flags: a name, below it a bar. */
const ROW_px = 17;
const BAR_px = 4;
const TITLE_px = 20;
const TIMES_px = 22;
/** The least height at which a plot can be read. */
const LEAST_PLOT_px = 44;
/** Of one event of the wheel at most; that of a pinch on a touchpad is less. */
const ZOOM = 1.25;
/** Of two fingers that are above one another. */
const LEAST_APART_px = 40;
/** From one tick to the next. */
const TICK_px = 24;
const MOST_PLOT_px = 240;
/** Longer between frames than this, and a line is broken. */
const BREAK_s = 0.25;

interface Plot {
  readonly title: string;
  readonly unit: string;
  readonly columns: readonly ColumnName[];
  readonly height: number;
  readonly tangential?: boolean;
}

const PLOTS: readonly Plot[] = [
  { title: 'Force', unit: 'N', columns: ['force_N'], height: 1.5 },
  { title: 'Pull', unit: 'N', columns: ['qx_N', 'qy_N'], height: 1, tangential: true },
  { title: 'Place', unit: 'mm', columns: ['x_mm', 'y_mm'], height: 1.2 },
  { title: 'Slip', unit: 'mm', columns: ['slip_mm'], height: 1 },
];

interface Drawn {
  readonly plot: Plot;
  readonly chart: uPlot;
  low: number;
  high: number;
  threshold: number | null;
}

export class Traces {
  readonly element = element('div', { class: 'traces', title: 'Zoom: Ctrl with the wheel, two fingers, + and −, or draw over a part' });
  private readonly buckets = new Buckets(2 * MOST_INTERVALS);
  private readonly strip = element('canvas', { class: 'flags', role: 'img' });
  private drawn: Drawn[] = [];
  private palette: Palette | null = null;
  private tangential = false;
  private finger = 0;
  private width = 0;
  private height = 0;
  private names: string | null = null;
  /** Rows of the strip of flags: the most until now, so that plots do not jump as flags come and go. */
  private rows = 2;
  /** Its size is another: draw it again, in a pause too. */
  onResize: (() => void) | null = null;
  /** A part of it was drawn over. */
  onSelect: ((span: Span) => void) | null = null;
  /** Wheel with Ctrl or ⌘, a pinch too: shows a multiple of the time. */
  onZoom: ((times: number) => void) | null = null;

  constructor() {
    new ResizeObserver(() => {
      const { clientWidth, clientHeight } = this.element;
      if (clientWidth !== this.width || clientHeight !== this.height) {
        this.width = clientWidth;
        this.height = clientHeight;
        this.resize();
        this.onResize?.();
      }
    }).observe(this.element);
    const wheel = (event: WheelEvent) => {
      if ((event.ctrlKey || event.metaKey) && event.deltaY !== 0) {
        event.preventDefault();
        this.onZoom?.(Math.min(Math.max(Math.exp(event.deltaY / 100), 1 / ZOOM), ZOOM));
      }
    };
    this.element.addEventListener('wheel', wheel, { passive: false });
    let apart_px = 0;
    const pinch = ({ touches: [one, other] }: TouchEvent) => {
      const before_px = apart_px;
      apart_px = one && other ? Math.max(Math.abs(one.clientX - other.clientX), LEAST_APART_px) : 0;
      if (before_px && apart_px) {
        this.onZoom?.(before_px / apart_px);
      }
    };
    for (const type of ['touchstart', 'touchmove', 'touchend', 'touchcancel'] as const) {
      this.element.addEventListener(type, pinch, { passive: true });
    }
  }

  setPalette(palette: Palette): void {
    this.palette = palette;
    this.build();
  }

  draw(fingertip: Shown, history: History, span: Span): void {
    if (fingertip.tangential !== this.tangential || fingertip.finger !== this.finger) {
      ({ tangential: this.tangential, finger: this.finger } = fingertip);
      this.build();
    }
    const inner = this.width - AXIS_px - RIGHT_px;
    if (!this.palette || inner < 40 || this.drawn.length === 0) {
      return;
    }
    const least_s = fingertip.frames_per_s > 0 ? 1.5 / fingertip.frames_per_s : 0;
    const width_s = Math.max(intervalOf(span.to_s - span.from_s, Math.min(inner / 1.5, MOST_INTERVALS)), intervalOf(least_s, 1));
    const { first, last } = this.buckets.read(history, width_s, span.from_s, span.to_s);
    const break_s = Math.max(BREAK_s, 3 * width_s);
    const columns = this.drawn.flatMap(({ plot }) => plot.columns);
    const chart = chartOf(this.buckets, columns, first, last, break_s);
    for (const drawn of this.drawn) {
      this.scale(drawn, chart, fingertip);
      const lists = drawn.plot.columns.flatMap((name) => {
        const curves = chart.curves.get(name)!;
        return [curves.sdHigh, curves.sdLow, curves.doubtful, curves.good];
      });
      drawn.chart.batch(() => {
        drawn.chart.setData([chart.t_s, ...lists] as uPlot.AlignedData, false);
        drawn.chart.setScale('x', { min: span.from_s, max: span.to_s });
        drawn.chart.setScale('y', { min: drawn.low, max: drawn.high });
      });
    }
    this.drawStrip(first, last, span, break_s);
  }

  /** Axes that seldom jump: round limits, which shrink only when far too wide. */
  private scale(drawn: Drawn, chart: Chart, { fingertip: { info } }: Shown): void {
    const { plot } = drawn;
    const most = Math.max(0, ...plot.columns.map((name) => chart.most.get(name)!));
    drawn.threshold = null;
    if (plot.columns[0] === 'x_mm') {
      const { x_mm, y_mm } = info ? padSize(info) : { x_mm: 1, y_mm: 1 };
      drawn.high = Math.max(x_mm, y_mm);
    } else if (plot.tangential) {
      drawn.high = steady(drawn.high, Math.max(most, LEAST_PULL_N));
    } else if (plot.columns[0] === 'slip_mm') {
      drawn.threshold = info?.slip_threshold_mm || null;
      drawn.high = steady(drawn.high, Math.max(most, 0.1, 1.2 * (drawn.threshold ?? 0)));
    } else {
      drawn.high = steady(drawn.high, Math.min(Math.max(most * 1.05, 1), MOST_N));
    }
    drawn.low = plot.columns.length > 1 ? -drawn.high : 0;
  }

  private build(): void {
    const palette = this.palette;
    for (const { chart } of this.drawn) {
      chart.destroy();
    }
    this.drawn = [];
    this.element.replaceChildren();
    if (!palette) {
      return;
    }
    const plots = PLOTS.filter((plot) => !plot.tangential || this.tangential);
    for (const plot of plots) {
      const key = (name: string, i: number) => element('span', { class: 'key', 'data-finger': this.colour(i) }, name.replace(/_.*/, ''));
      const title = element('div', { class: 'trace-title' }, `${plot.title}, ${plot.unit}`);
      if (plot.columns.length > 1) {
        title.append(...plot.columns.map(key));
      }
      const box = element('div', { class: 'trace' }, title);
      this.element.append(box);
      const options = this.options(plot, palette, () => drawn);
      const drawn: Drawn = { plot, low: 0, high: 1, threshold: null, chart: new uPlot(options, [[]], box) };
      this.drawn.push(drawn);
    }
    this.element.append(this.strip);
    this.resize();
  }

  /** The colour of a plot's curve: the first has that of the fingertip's pad. */
  private colour(curve: number): number {
    return (this.finger + curve) % FINGERS;
  }

  private options(plot: Plot, palette: Palette, drawn: () => Drawn): uPlot.Options {
    const line = { stroke: palette.css('line'), width: 1 };
    const axis = {
      stroke: palette.css('faint'),
      grid: line,
      ticks: { show: false },
      font: '11px system-ui, sans-serif',
    };
    const last = plot === PLOTS[PLOTS.length - 1];
    const colours = plot.columns.map((_, i) => palette.css(`finger-${this.colour(i)}`));
    return {
      width: 300,
      height: 100,
      padding: [6, RIGHT_px, last ? 0 : 4, 0],
      cursor: {
        sync: { key: 'fingertip' },
        drag: { x: true, y: false, dist: 5, setScale: false },
        bind: { dblclick: () => null },
        points: { show: false },
        y: false,
      },
      legend: { show: false },
      scales: { x: { time: false, auto: false }, y: { auto: false } },
      axes: [
        {
          ...axis,
          show: last,
          size: TIMES_px,
          gap: 2,
          space: 70,
          values: (_chart, times) => times.map((t_s) => (t_s < 0 ? '' : clock(t_s))),
        },
        {
          ...axis,
          size: AXIS_px,
          gap: 4,
          splits: (chart, _axis, low, high) => ticksOf(low, high, chart.bbox.height / devicePixelRatio / TICK_px),
        },
      ],
      series: [
        {},
        ...colours.flatMap((colour): uPlot.Series[] => [
          { stroke: 'transparent', width: 0, points: { show: false } },
          { stroke: 'transparent', width: 0, points: { show: false } },
          { stroke: `${colour}bf`, width: 1, dash: [3, 3], points: { show: false } },
          { stroke: colour, width: 1.4, points: { show: false } },
        ]),
      ],
      bands: colours.map((colour, i) => ({
        series: [1 + 4 * i, 2 + 4 * i] as [number, number],
        fill: `${colour}38`,
      })),
      hooks: {
        setSelect: [
          (chart) => {
            const { left, width } = chart.select;
            if (width > 0) {
              chart.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
              this.onSelect?.({ from_s: chart.posToVal(left, 'x'), to_s: chart.posToVal(left + width, 'x') });
            }
          },
        ],
        drawAxes: [
          (chart) => {
            const threshold = drawn()?.threshold;
            if (threshold) {
              const y = chart.valToPos(threshold, 'y', true);
              const pen = chart.ctx;
              pen.save();
              pen.strokeStyle = palette.css('bad');
              pen.setLineDash([6, 4]);
              pen.beginPath();
              pen.moveTo(chart.bbox.left, y);
              pen.lineTo(chart.bbox.left + chart.bbox.width, y);
              pen.stroke();
              pen.restore();
            }
          },
        ],
      },
    };
  }

  private resize(): void {
    if (this.width < 60 || this.drawn.length === 0) {
      return;
    }
    const flags = this.rows * ROW_px + 4;
    const fixed = TITLE_px * this.drawn.length + TIMES_px + flags;
    const least = LEAST_PLOT_px * this.drawn.length;
    this.element.style.minHeight = `${fixed + least}px`;
    const room = Math.max(this.height - fixed, least);
    const total = this.drawn.reduce((sum, { plot }) => sum + plot.height, 0);
    for (const { chart, plot } of this.drawn) {
      const last = plot === PLOTS[PLOTS.length - 1];
      const height = Math.min(Math.floor((room * plot.height) / total), MOST_PLOT_px) + (last ? TIMES_px : 0);
      chart.setSize({ width: this.width, height });
    }
  }

  /** Contact, slip, each warning that occurs, and what was lost, as spans with their names. */
  private drawStrip(first: number, last: number, span: Span, break_s: number): void {
    const palette = this.palette;
    const pen = this.strip.getContext('2d');
    if (!palette || !pen) {
      return;
    }
    const join_s = Math.max(2 * this.buckets.width_s, break_s / 8);
    const rows = [
      { name: 'contact', bit: Flag.CONTACT as number | 'lost', colour: 'accent', always: true },
      { name: 'slip', bit: Flag.SLIP, colour: 'bad', always: true },
      { name: 'sliding', bit: Flag.SLIDING, colour: 'bad', always: false },
      { name: 'moving', bit: Flag.MOVING, colour: 'warning', always: false },
      ...FLAGS.filter(({ warning }) => warning).map(({ bit, meaning }) => ({ name: meaning, bit, colour: 'warning', always: false })),
      { name: 'lost frames', bit: 'lost' as const, colour: 'bad', always: false },
    ]
      .map((row) => ({ ...row, spans: spansOf(this.buckets, row.bit, first, last, join_s) }))
      .filter((row) => row.always || row.spans.length > 0);
    const dense = Math.min(devicePixelRatio, 2);
    if (rows.length > this.rows) {
      this.rows = rows.length;
      this.resize();
    }
    const height = rows.length * ROW_px + 4;
    if (this.strip.width !== Math.round(this.width * dense) || this.strip.height !== Math.round(height * dense)) {
      this.strip.width = Math.round(this.width * dense);
      this.strip.height = Math.round(height * dense);
      this.strip.style.height = `${height}px`;
    }
    const set = rows.filter((row) => row.spans.length > 0).map((row) => row.name);
    const names = `Flags in this time: ${set.join(', ') || 'none'}`;
    if (names !== this.names) {
      this.names = names;
      this.strip.setAttribute('aria-label', names);
    }
    pen.setTransform(dense, 0, 0, dense, 0, 0);
    pen.clearRect(0, 0, this.width, height);
    const inner = this.width - AXIS_px - RIGHT_px;
    const x = (t_s: number) =>
      AXIS_px + (inner * Math.min(Math.max(t_s - span.from_s, 0), span.to_s - span.from_s)) / (span.to_s - span.from_s);
    pen.font = '11px system-ui, sans-serif';
    pen.textBaseline = 'bottom';
    rows.forEach((row, i) => {
      const y = i * ROW_px + ROW_px - BAR_px;
      pen.fillStyle = palette.css('raised');
      pen.fillRect(AXIS_px, y, inner, BAR_px);
      pen.fillStyle = palette.css(row.colour);
      for (const { from_s, to_s } of row.spans) {
        const left = x(from_s);
        pen.fillRect(left, y, Math.max(x(to_s) - left, 1.5), BAR_px);
      }
      pen.fillStyle = palette.css(row.spans.length > 0 ? 'text' : 'faint');
      pen.fillText(shortened(pen, row.name, inner), AXIS_px, y - 1);
    });
  }
}

/** What of a text has room, its end as an ellipsis. */
function shortened(pen: CanvasRenderingContext2D, text: string, room: number): string {
  let shown = text;
  while (shown.length > 1 && pen.measureText(shown).width > room) {
    shown = `${shown.slice(0, -2).trimEnd()}…`;
  }
  return shown;
}

function steady(limit: number, wanted: number): number {
  const round = roundAbove(wanted);
  return round > limit || wanted < limit / 4 ? round : limit;
}
