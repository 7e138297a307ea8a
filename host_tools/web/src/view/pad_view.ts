/** The picture of one fingertip's pad: what draws it, how it is turned, and the hand that presses on
 * a simulated one. Nothing happens here for a frame of data: it draws what is there when asked. */
import { cameraOf, picked, seen, type Camera, type Look, type Point } from './camera';
import { PadPicture } from './pad_picture';
import { HEIGHT_mm, RIM_mm, THICKNESS_mm, padSize, type Scene } from './pad_scene';
import { cssOf, heatPart, mix, type Palette } from './palette';
import { element } from './elements';
import type { ShownLayout } from './shown';

const ABOVE_deg = 90;
const ASLANT_deg = -10;
/** Frames that are wider or higher than this: in the first the pad lies across, in the other it is seen more from above. */
const WIDE = 1.3;
const TURN_STEP_deg = 5;
/** The axes along two edges of the rubber; the middles of the numbers are this far outside it. */
const TICK_STEP_mm = 10;
const TICK_px = 7;
const NUMBER_px = 19;
const NAME_px = 12;
/** Around the rubber, for the numbers. */
const MARGIN_px = 38;
/** Labels are read, not watched. */
const LABEL_INTERVAL_ms = 125;
/** A pressure that a reader should notice. */
const NOTED_Pa = 500;

/** What a pointer or keys on the rubber do; places in mm on its surface. */
export interface Touch {
  down(x_mm: number, y_mm: number): void;
  move(x_mm: number, y_mm: number): void;
  up(): void;
  /** Changes the force by turns of the wheel, up is more. */
  wheel(turns: number): void;
}

export class PadView {
  readonly element: HTMLElement;
  private readonly canvas = element('canvas', { class: 'pad-picture', 'aria-hidden': 'true' });
  private readonly labels = element('canvas', { class: 'pad-labels', 'aria-hidden': 'true' });
  private readonly picture = new PadPicture(this.canvas);
  private look: Look = { turn_deg: ASLANT_deg, tilt_deg: 50 };
  private camera: Camera | null = null;
  /** A user has turned it. */
  private turned = false;
  private readonly size: { x_mm: number; y_mm: number };
  /** What must stay in the picture: rubber and bars. */
  private readonly points: readonly Point[];
  private scene: Scene | null = null;
  private fitDue = false;
  private changed = true;
  private labelsDue = true;
  private labelled_ms = -Infinity;
  private touching: number | null = null;
  private turning: { id: number; x: number; y: number } | null = null;
  private touch: Touch | null = null;
  onLook: (() => void) | null = null;

  constructor(
    layout: ShownLayout,
    private readonly title: string,
  ) {
    this.size = padSize(layout);
    const corners = (out_mm: number, z_mm: number) =>
      [-1, 1].flatMap((x) => [-1, 1].map((y): Point => [x * (this.size.x_mm + out_mm), y * (this.size.y_mm + out_mm), z_mm]));
    this.points = [...corners(0, -THICKNESS_mm), ...corners(0, 0), ...corners(-RIM_mm, HEIGHT_mm * 0.6)];
    const attributes = {
      class: 'pad',
      tabindex: 0,
      role: 'application',
      'aria-roledescription': 'picture of the pad',
    };
    this.element = element('div', attributes, this.canvas, this.labels);
    new ResizeObserver(() => this.fit()).observe(this.element);
    this.listen();
  }

  /** touch: of a fingertip on which a hand may press, else null. */
  setTouch(touch: Touch | null): void {
    this.touch = touch;
    const keys = `${this.title} Arrow keys turn it, Home shows it from above.`;
    this.element.setAttribute('aria-label', touch ? `${keys} Press on it with the pointer.` : keys);
  }

  get fromAbove(): boolean {
    return this.look.tilt_deg === ABOVE_deg;
  }

  setFromAbove(above: boolean): void {
    this.turnTo(this.lookOf(above));
  }

  private lookOf(above: boolean): Look {
    const { clientWidth, clientHeight } = this.element;
    const across = clientWidth > WIDE * clientHeight && this.size.y_mm > this.size.x_mm;
    const turn_deg = above ? 0 : ASLANT_deg;
    return { turn_deg: across ? -90 - turn_deg : turn_deg, tilt_deg: above ? ABOVE_deg : clientHeight > WIDE * clientWidth ? 60 : 50 };
  }

  show(scene: Scene): void {
    this.scene = scene;
    this.changed = true;
  }

  repaint(): void {
    this.changed = this.labelsDue = true;
    this.labelled_ms = -Infinity;
  }

  /** Once a picture; true if there was something to draw. */
  draw(now_ms: number, palette: Palette): boolean {
    if (!this.scene) {
      return false;
    }
    if (this.fitDue) {
      this.resize();
    }
    const { clientWidth: width, clientHeight: height } = this.element;
    this.camera ??= cameraOf(this.look, width / height, this.points, [1 - (2 * MARGIN_px) / width, 1 - (2 * MARGIN_px) / height]);
    if (this.labelsDue && now_ms - this.labelled_ms >= LABEL_INTERVAL_ms) {
      this.labelsDue = false;
      this.labelled_ms = now_ms;
      this.label(this.scene, this.camera, palette);
    }
    if (!this.changed) {
      return false;
    }
    this.changed = false;
    this.labelsDue = true;
    this.picture.draw(this.scene, this.camera, palette);
    return true;
  }

  /** With the next picture: whatever sets a canvas' size empties it. */
  private fit(): void {
    this.fitDue = true;
    this.repaint();
  }

  private resize(): void {
    this.fitDue = false;
    const { clientWidth: width, clientHeight: height } = this.element;
    if (width < 1 || height < 1) {
      return;
    }
    const dense = Math.min(devicePixelRatio, 2);
    for (const canvas of [this.canvas, this.labels]) {
      canvas.width = Math.round(width * dense);
      canvas.height = Math.round(height * dense);
    }
    this.camera = null;
    if (!this.turned || this.fromAbove) {
      this.look = this.lookOf(this.fromAbove);
    }
  }

  private turnTo(look: Look): void {
    this.turned = true;
    this.look = {
      turn_deg: ((look.turn_deg + 540) % 360) - 180,
      tilt_deg: Math.min(ABOVE_deg, Math.max(12, look.tilt_deg)),
    };
    this.camera = null;
    this.repaint();
    this.onLook?.();
  }

  private turnedBy(turn_deg: number, tilt_deg: number): Look {
    return { turn_deg: this.look.turn_deg + turn_deg, tilt_deg: this.look.tilt_deg + tilt_deg };
  }

  private listen(): void {
    const element = this.element;
    const place = (event: PointerEvent) => {
      const box = element.getBoundingClientRect();
      const right = (2 * (event.clientX - box.left)) / box.width - 1;
      const up = 1 - (2 * (event.clientY - box.top)) / box.height;
      return this.camera ? picked(this.camera, right, up) : null;
    };
    element.addEventListener('pointerdown', (event) => {
      if (event.button !== 0 || this.touching !== null || this.turning) {
        return;
      }
      const at = place(event);
      const onPad = at && Math.abs(at.x_mm) <= this.size.x_mm && Math.abs(at.y_mm) <= this.size.y_mm;
      if (this.touch && onPad) {
        this.touching = event.pointerId;
        this.touch.down(at.x_mm, at.y_mm);
      } else {
        this.turning = { id: event.pointerId, x: event.clientX, y: event.clientY };
      }
      element.setPointerCapture(event.pointerId);
      element.classList.toggle('pressing', this.touching !== null);
    });
    element.addEventListener('pointermove', (event) => {
      if (event.pointerId === this.touching) {
        const at = place(event);
        if (at) {
          this.touch?.move(
            Math.max(-this.size.x_mm, Math.min(this.size.x_mm, at.x_mm)),
            Math.max(-this.size.y_mm, Math.min(this.size.y_mm, at.y_mm)),
          );
        }
      } else if (this.turning?.id === event.pointerId) {
        const { x, y } = this.turning;
        this.turning = { id: event.pointerId, x: event.clientX, y: event.clientY };
        this.turnTo(this.turnedBy(-0.4 * (event.clientX - x), 0.4 * (event.clientY - y)));
      }
    });
    const released = (event: PointerEvent) => {
      if (event.pointerId === this.touching) {
        this.touching = null;
        this.touch?.up();
        element.classList.remove('pressing');
      } else if (this.turning?.id === event.pointerId) {
        this.turning = null;
      }
    };
    element.addEventListener('pointerup', released);
    element.addEventListener('pointercancel', released);
    element.addEventListener(
      'wheel',
      (event) => {
        if (this.touching !== null) {
          event.preventDefault();
          this.touch?.wheel(-Math.sign(event.deltaY));
        }
      },
      { passive: false },
    );
    element.addEventListener('keydown', (event) => {
      const steps: Record<string, [number, number]> = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
      const step = steps[event.key];
      if ((step || event.key === 'Home') && !event.ctrlKey && !event.metaKey && !event.altKey) {
        event.preventDefault();
        event.stopPropagation();
        this.turnTo(step ? this.turnedBy(TURN_STEP_deg * step[0], TURN_STEP_deg * step[1]) : this.lookOf(!this.fromAbove));
      }
    });
  }

  /** Each sensor's number, and in kPa what it measured where that is worth reading. */
  private label(scene: Scene, camera: Camera, palette: Palette): void {
    const pen = this.labels.getContext('2d');
    if (!pen) {
      return;
    }
    const dense = this.labels.width / Math.max(1, this.element.clientWidth);
    const width = this.labels.width / dense;
    const height = this.labels.height / dense;
    pen.setTransform(dense, 0, 0, dense, 0, 0);
    pen.clearRect(0, 0, width, height);
    const at = (x_mm: number, y_mm: number, z_mm: number): [number, number] => {
      const { right, up } = seen(camera, [x_mm, y_mm, z_mm]);
      return [((right + 1) / 2) * width, ((1 - up) / 2) * height];
    };
    const pitch = Math.abs(at(0, 0, 0)[0] - at(9, 0, 0)[0]) + Math.abs(at(0, 0, 0)[1] - at(0, 9, 0)[1]);
    const px = Math.max(9, Math.min(15, pitch / 7));
    pen.textAlign = 'center';
    pen.textBaseline = 'middle';
    const flat = this.look.tilt_deg > 70;
    const halo = palette.of('rubber');
    const write = (text: string, x: number, y: number, colour: string, behind: string) => {
      pen.strokeStyle = behind;
      pen.lineWidth = 3;
      pen.lineJoin = 'round';
      pen.strokeText(text, x, y);
      pen.fillStyle = colour;
      pen.fillText(text, x, y);
    };
    const sensors = Array.from({ length: scene.count }, (_, k) => ({ k, x_mm: scene.layout.x_mm[k], y_mm: scene.layout.y_mm[k] }));
    const values: [number, number][] = [];
    pen.font = `600 ${px}px system-ui, sans-serif`;
    for (const { k, x_mm, y_mm } of sensors) {
      const pressure_Pa = scene.saturated[k] ? Infinity : (scene.pressure_Pa[k] ?? 0);
      const gain = scene.found?.gain[k];
      if (pressure_Pa > NOTED_Pa) {
        const [x, y] = at(x_mm, y_mm, heatPart(pressure_Pa) * HEIGHT_mm);
        values.push([x, flat ? y : y - px * 0.8]);
        const behind = scene.fit && flat ? mix(halo, palette.of('surface'), 0.2) : halo;
        const text = scene.saturated[k] ? 'max' : (pressure_Pa / 1000).toFixed(pressure_Pa < 9950 ? 1 : 0);
        write(text, ...values[values.length - 1], palette.css('text'), cssOf(behind));
      } else if (gain !== undefined) {
        const percent = Math.round(100 * (gain - 1));
        write(`${percent < 0 ? '−' : '+'}${Math.abs(percent)} %`, ...at(x_mm, y_mm, 0), palette.css('accent'), cssOf(halo));
      }
    }
    pen.font = `${px * 0.85}px system-ui, sans-serif`;
    for (const { k, x_mm, y_mm } of sensors) {
      const doubt = scene.broken[k] ? ' ×' : scene.doubtful[k] ? '?' : '';
      const [x, y] = at(x_mm, y_mm - 3.6, 0);
      if (doubt || !values.some((value) => Math.abs(value[0] - x) < 2 * px && Math.abs(value[1] - y) < px)) {
        write(`${k}${doubt}`, x, y, palette.css(scene.broken[k] ? 'bad' : doubt ? 'warning' : 'faint'), cssOf(halo));
      }
    }
    this.axes(pen, palette, at);
  }

  /** Millimetres on the edges of the surface that are nearest to the viewer. */
  private axes(pen: CanvasRenderingContext2D, palette: Palette, at: (x_mm: number, y_mm: number, z_mm: number) => [number, number]): void {
    const { x_mm, y_mm } = this.size;
    const turn = (this.look.turn_deg * Math.PI) / 180;
    const front = Math.cos(turn) >= 0 ? -1 : 1;
    // Where the eye is; of none that is nearer, the left one.
    const side = turn > 0 ? 1 : -1;
    pen.font = '11px system-ui, sans-serif';
    pen.textAlign = 'center';
    pen.lineWidth = 1;
    pen.strokeStyle = palette.css('edge');
    pen.fillStyle = palette.css('faint');
    const axis = (name: string, reach_mm: number, place: (along_mm: number, out_mm: number) => [number, number]) => {
      const most = Math.floor(reach_mm / TICK_STEP_mm);
      for (let i = -most; i <= most; i++) {
        const along_mm = i * TICK_STEP_mm;
        const [[x, y], [x_out, y_out]] = [place(along_mm, 0), place(along_mm, 1)];
        const far = 1 / Math.hypot(x_out - x, y_out - y);
        const out = (px: number): [number, number] => [x + px * far * (x_out - x), y + px * far * (y_out - y)];
        pen.beginPath();
        pen.moveTo(x, y);
        pen.lineTo(...out(TICK_px));
        pen.stroke();
        const [x_text, y_text] = out(NUMBER_px);
        pen.fillText(String(along_mm).replace('-', '−'), x_text, y_text);
        if (i === most) {
          const is_below = Math.abs(y_out - y) > Math.abs(x_out - x);
          pen.fillText(`${name} mm`, x_text, y_text + (is_below ? NAME_px : -NAME_px));
        }
      }
    };
    axis('x', x_mm, (along_mm, out_mm) => at(along_mm, front * (y_mm + out_mm), 0));
    axis('y', y_mm, (along_mm, out_mm) => at(side * (x_mm + out_mm), along_mm, 0));
  }
}
