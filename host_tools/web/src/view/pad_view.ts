/** The picture of one fingertip's pad: what draws it, how it is turned, and the hand that presses on
 * a simulated one. Nothing happens here for a frame of data: it draws what is there when asked. */
import { cameraOf, picked, seen, type Box, type Camera, type Look } from './camera';
import { PadPicture } from './pad_picture';
import { HEIGHT_mm, THICKNESS_mm, padSize, type Scene } from './pad_scene';
import { cssOf, heatOf, heatPart, mix, type Palette } from './palette';
import { element } from './elements';
import type { ShownLayout } from './shown';

const FROM_ABOVE: Look = { turn_deg: 0, tilt_deg: 90 };
const ASLANT: Look = { turn_deg: -32, tilt_deg: 40 };
/** In a frame that is much wider than high. */
const ASLANT_WIDE: Look = { turn_deg: -62, tilt_deg: 42 };
const WIDE = 1.5;
const TURN_STEP_deg = 5;
/** The axes along two edges of the rubber; the numbers are this far outside it. */
const TICK_STEP_mm = 10;
const TICK_mm = 1.5;
const NUMBER_mm = 4;
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
  private look: Look = { ...ASLANT };
  private camera: Camera | null = null;
  /** A user has turned it. */
  private turned = false;
  private readonly size: { x_mm: number; y_mm: number };
  private readonly box: Box;
  private scene: Scene | null = null;
  private fitDue = false;
  private changed = true;
  private labelsDue = true;
  private labelled_ms = -Infinity;
  private touching: number | null = null;
  private turning: { id: number; x: number; y: number } | null = null;
  /** Set for a fingertip on which a hand may press. */
  touch: Touch | null = null;
  onLook: (() => void) | null = null;

  constructor(layout: ShownLayout, label: string) {
    this.size = padSize(layout);
    this.box = {
      x_mm: this.size.x_mm + NUMBER_mm,
      y_mm: this.size.y_mm + NUMBER_mm,
      low_mm: -THICKNESS_mm,
      high_mm: HEIGHT_mm * 0.6,
    };
    const attributes = {
      class: 'pad',
      tabindex: 0,
      role: 'application',
      'aria-roledescription': 'picture of the pad',
      'aria-label': label,
    };
    this.element = element('div', attributes, this.canvas, this.labels);
    new ResizeObserver(() => this.fit()).observe(this.element);
    this.listen();
  }

  get fromAbove(): boolean {
    return this.look.tilt_deg === 90 && this.look.turn_deg === 0;
  }

  setFromAbove(above: boolean): void {
    this.turnTo(above ? FROM_ABOVE : this.aslant);
  }

  private get aslant(): Look {
    const { clientWidth, clientHeight } = this.element;
    return clientWidth > WIDE * clientHeight ? ASLANT_WIDE : ASLANT;
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
    this.camera ??= cameraOf(this.look, this.canvas.width / this.canvas.height, this.box);
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
    if (!this.turned) {
      this.look = { ...this.aslant };
    }
  }

  private turnTo(look: Look): void {
    this.turned = true;
    this.look = {
      turn_deg: ((look.turn_deg + 540) % 360) - 180,
      tilt_deg: Math.min(90, Math.max(12, look.tilt_deg)),
    };
    this.camera = null;
    this.repaint();
    this.onLook?.();
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
        this.turnTo({
          turn_deg: this.look.turn_deg - 0.4 * (event.clientX - x),
          tilt_deg: this.look.tilt_deg + 0.4 * (event.clientY - y),
        });
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
      const step = TURN_STEP_deg;
      const { turn_deg, tilt_deg } = this.look;
      const turns: Record<string, Look> = {
        ArrowLeft: { turn_deg: turn_deg - step, tilt_deg },
        ArrowRight: { turn_deg: turn_deg + step, tilt_deg },
        ArrowUp: { turn_deg, tilt_deg: tilt_deg + step },
        ArrowDown: { turn_deg, tilt_deg: tilt_deg - step },
        Home: this.fromAbove ? this.aslant : FROM_ABOVE,
      };
      const look = turns[event.key];
      if (look && !event.ctrlKey && !event.metaKey && !event.altKey) {
        event.preventDefault();
        event.stopPropagation();
        this.turnTo(look);
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
    for (let k = 0; k < scene.count; k++) {
      const x_mm = scene.layout.x_mm[k] ?? 0;
      const y_mm = scene.layout.y_mm[k] ?? 0;
      const pressure_Pa = scene.pressure_Pa[k];
      const name = `${k}${scene.broken[k] ? ' ×' : scene.doubtful[k] ? '?' : ''}`;
      const colour = palette.css(scene.broken[k] ? 'bad' : scene.doubtful[k] ? 'warning' : 'faint');
      pen.font = `${px * 0.85}px system-ui, sans-serif`;
      write(name, ...at(x_mm, y_mm - 3.6, 0), colour, cssOf(halo));
      const value = scene.saturated[k]
        ? 'max'
        : typeof pressure_Pa === 'number' && pressure_Pa > NOTED_Pa
          ? (pressure_Pa / 1000).toFixed(pressure_Pa < 9950 ? 1 : 0)
          : null;
      if (value !== null) {
        const part = scene.saturated[k] ? 1 : heatPart(pressure_Pa ?? 0);
        const [x, y] = at(x_mm, y_mm, part * HEIGHT_mm);
        pen.font = `600 ${px}px system-ui, sans-serif`;
        const behind = scene.fit && flat ? mix(halo, palette.of('surface'), 0.2) : halo;
        write(value, x, flat ? y : y - px * 0.8, palette.css('text'), cssOf(behind));
      }
    }
    this.axes(pen, palette, at);
    this.scale(pen, palette, height);
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
        pen.beginPath();
        pen.moveTo(...place(along_mm, 0));
        pen.lineTo(...place(along_mm, TICK_mm));
        pen.stroke();
        pen.fillText(i === most ? `${name} ${along_mm} mm` : String(along_mm).replace('-', '−'), ...place(along_mm, NUMBER_mm));
      }
    };
    axis('x', x_mm, (along_mm, out_mm) => at(along_mm, front * (y_mm + out_mm), 0));
    axis('y', y_mm, (along_mm, out_mm) => at(side * (x_mm + out_mm), along_mm, 0));
  }

  private scale(pen: CanvasRenderingContext2D, palette: Palette, height: number): void {
    const long = Math.min(150, height * 0.4);
    const x = 12;
    const bottom = height - 16;
    for (let i = 0; i < long; i++) {
      pen.fillStyle = cssOf(heatOf(palette, i / long));
      pen.fillRect(x, bottom - i - 1, 8, 1.5);
    }
    pen.font = '11px system-ui, sans-serif';
    pen.textAlign = 'left';
    pen.fillStyle = palette.css('faint');
    for (const tick_kPa of [1, 5, 20, 50, 100]) {
      pen.fillText(String(tick_kPa), x + 13, bottom - long * Math.sqrt(tick_kPa / 100));
    }
    pen.fillText('kPa', x, bottom - long - 14);
  }
}
