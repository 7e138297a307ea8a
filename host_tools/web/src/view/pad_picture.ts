/** Draws the pad as the camera sees it, on a plain canvas. Bars are what the sensors measured, the surface is the fitted Gaussian, both
 * as high and in the colour of their pressure, so that a bar ends in the surface where the fit is good. */
import { seen, type Camera, type Point } from './camera';
import { cssOf, heatOf, heatPart, mix, type Colour, type Palette } from './palette';
import { HEIGHT_mm, THICKNESS_mm, padSize, type Scene } from './pad_scene';

const BAR_HALF_mm = 1.35;
const SENSOR_mm = 2.4;
const CELL_mm = 1;
/** Of cells, against seams. */
const OVERLAP_mm = 0.12;
const CORNER_mm = 4;
/** Parts of the scale at which the surface has a contour: 5, 20 and 50 kPa. */
const CONTOURS = [0.2236, 0.4472, 0.7071];
/** Below the first part of the scale there is no surface, from the second on it is whole. */
const FADES = [0.035, 0.11];
/** Brightness of the uncertain, over that of the certain. */
const UNSURE = 0.4;
const DOUBTFUL = 0.5;
const MOST_SD_mm = 30;
const LIGHT: Point = [-0.35, -0.45, 0.82];

type Fit = NonNullable<Scene['fit']>;

function lit(colour: Colour, [x, y, z]: Point): Colour {
  const share = 0.8 + (0.2 * (x * LIGHT[0] + y * LIGHT[1] + z * LIGHT[2])) / Math.hypot(x, y, z);
  return [colour[0] * share, colour[1] * share, colour[2] * share];
}

/** Round the middle, from x towards y. */
function circle(x_mm: number, y_mm: number, z_mm: number, radius_mm: number, corners = 36): Point[] {
  return Array.from({ length: corners }, (_, i) => {
    const angle = (2 * Math.PI * i) / corners;
    return [x_mm + radius_mm * Math.cos(angle), y_mm + radius_mm * Math.sin(angle), z_mm];
  });
}

export class PadPicture {
  private readonly pen: CanvasRenderingContext2D;
  private camera!: Camera;
  private palette!: Palette;
  /** Pixels of a millimetre in the middle of the pad. */
  private px_mm = 1;

  constructor(private readonly canvas: HTMLCanvasElement) {
    this.pen = canvas.getContext('2d')!;
  }

  draw(scene: Scene, camera: Camera, palette: Palette): void {
    this.camera = camera;
    this.palette = palette;
    const [left, right] = [this.at([0, 0, 0]), this.at([camera.right[0], camera.right[1], camera.right[2]])];
    this.px_mm = Math.hypot(right[0] - left[0], right[1] - left[1]);
    this.pen.clearRect(0, 0, this.canvas.width, this.canvas.height);
    this.pen.lineCap = this.pen.lineJoin = 'round';
    const rubber = palette.of('rubber');
    const alarm = palette.of(scene.alarm === 'moves' ? 'warning' : 'bad');
    this.slab(padSize(scene.layout), scene.alarm ? mix(rubber, alarm, 0.55) : rubber);
    this.sensors(scene);
    scene.trail.forEach((past, i) => {
      const share = 0.75 * ((i + 1) / scene.trail.length);
      this.shape(circle(past.x_mm, past.y_mm, 0, 0.4, 12), palette.of('accent'), share);
    });
    this.solids(scene, rubber);
    this.found(scene);
    if (scene.truth) {
      const { x_mm, y_mm } = scene.truth;
      this.outline(circle(x_mm, y_mm, 0, 3.4), palette.of('good'), 0.3);
      this.cross(x_mm, y_mm, 1.1, 0.3, palette.of('good'));
    }
    if (scene.fit) {
      this.contact(scene.fit);
    }
  }

  /** Pixels. */
  private at(point: Point): [number, number] {
    const { right, up } = seen(this.camera, point);
    return [((right + 1) / 2) * this.canvas.width, ((1 - up) / 2) * this.canvas.height];
  }

  private path(points: readonly Point[], closed = true): void {
    this.pen.beginPath();
    points.forEach((point) => this.pen.lineTo(...this.at(point)));
    if (closed) {
      this.pen.closePath();
    }
  }

  private shape(points: readonly Point[], colour: Colour, share = 1): void {
    this.path(points);
    this.pen.globalAlpha = share;
    this.pen.fillStyle = cssOf(colour);
    this.pen.fill();
    this.pen.globalAlpha = 1;
  }

  private stroke(colour: Colour, width_mm: number, share = 1, dash_mm: readonly number[] = []): void {
    this.pen.globalAlpha = share;
    this.pen.setLineDash(dash_mm.map((part) => part * this.px_mm));
    this.pen.strokeStyle = cssOf(colour);
    this.pen.lineWidth = Math.max(width_mm * this.px_mm, 0.8);
    this.pen.stroke();
    this.pen.setLineDash([]);
    this.pen.globalAlpha = 1;
  }

  private outline(points: readonly Point[], colour: Colour, width_mm: number, share = 1, dashed = false): void {
    this.path(points);
    this.stroke(colour, width_mm, share, dashed ? [0.8, 1] : []);
  }

  private line(from: Point, to: Point, colour: Colour, width_mm: number, share = 1): void {
    this.path([from, to], false);
    this.stroke(colour, width_mm, share);
  }

  private cross(x_mm: number, y_mm: number, half_mm: number, width_mm: number, colour: Colour, turned = false): void {
    const [dx, dy] = turned ? [half_mm, half_mm] : [half_mm, 0];
    this.line([x_mm - dx, y_mm - dy, 0], [x_mm + dx, y_mm + dy, 0], colour, width_mm);
    this.line([x_mm + dy, y_mm - dx, 0], [x_mm - dy, y_mm + dx, 0], colour, width_mm);
  }

  /** A place and its standard deviation. */
  private disc(x_mm: number, y_mm: number, radius_mm: number, share: number, colour: Colour, dashed = false): void {
    const around = circle(x_mm, y_mm, 0, Math.min(radius_mm, MOST_SD_mm));
    this.shape(around, colour, 0.25 * share);
    this.outline(around, colour, 0.16, 0.9 * share, dashed);
  }

  /** The tip of an arrow, to whose sides its base reaches. */
  private head(tip: Point, base: Point, side: Point, colour: Colour, share: number): void {
    const corner = (sign: number): Point => [
      base[0] + 1.6 * sign * side[0],
      base[1] + 1.6 * sign * side[1],
      base[2] + 1.6 * sign * side[2],
    ];
    this.shape([tip, corner(1), corner(-1)], colour, share);
  }

  private slab({ x_mm, y_mm }: { x_mm: number; y_mm: number }, colour: Colour): void {
    const ring: Point[] = circle(0, 0, 0, CORNER_mm, 28).map(([x, y], i) => {
      const [right, up] = [i < 7 || i >= 21 ? 1 : -1, i < 14 ? 1 : -1];
      return [x + right * (x_mm - CORNER_mm), y + up * (y_mm - CORNER_mm), 0];
    });
    ring.forEach((here, i) => {
      const next = ring[(i + 1) % ring.length];
      const out: Point = [next[1] - here[1], here[0] - next[0], 0];
      if (out[0] * (this.camera.eye[0] - here[0]) + out[1] * (this.camera.eye[1] - here[1]) > 0) {
        const wall: Point[] = [here, next, [next[0], next[1], -THICKNESS_mm], [here[0], here[1], -THICKNESS_mm]];
        this.shape(wall, lit(colour, out));
        this.outline(wall, lit(colour, out), 0.05);
      }
    });
    this.shape(ring, lit(colour, [0, 0, 1]));
  }

  private sensors(scene: Scene): void {
    const { palette } = this;
    for (let k = 0; k < scene.count; k++) {
      const [x_mm, y_mm] = [scene.layout.x_mm[k], scene.layout.y_mm[k]];
      const around = circle(x_mm, y_mm, 0, SENSOR_mm);
      const colour = palette.of(scene.broken[k] ? 'bad' : scene.doubtful[k] ? 'warning' : 'edge');
      this.shape(around, colour, scene.broken[k] ? 0.12 : 0.06);
      this.outline(around, colour, 0.32, 0.75, scene.doubtful[k]);
      if (scene.broken[k]) {
        this.cross(x_mm, y_mm, 0.7 * SENSOR_mm, 0.5, colour, true);
      }
    }
  }

  /** Placements of a calibration, one that fits no other dashed, and where the next is wanted. */
  private found({ found }: Scene): void {
    const { palette } = this;
    for (const { x_mm, y_mm, kept } of found?.placements ?? []) {
      this.outline(circle(x_mm, y_mm, 0, 1), palette.of(kept ? 'accent' : 'warning'), 0.4, 1, !kept);
    }
    if (found?.wanted) {
      const { x_mm, y_mm } = found.wanted;
      this.outline(circle(x_mm, y_mm, 0, 3.4), palette.of('accent'), 0.5, 1, true);
      this.cross(x_mm, y_mm, 1.6, 0.5, palette.of('accent'));
    }
  }

  /** Bars and surface, from far to near: what is nearer covers what is behind it. */
  private solids(scene: Scene, rubber: Colour): void {
    const parts: { far: number; paint: () => void }[] = [];
    const { eye } = this.camera;
    const far = (x_mm: number, y_mm: number) => Math.hypot(x_mm - eye[0], y_mm - eye[1]);
    for (let k = 0; k < scene.count; k++) {
      const pressure_Pa = scene.saturated[k] ? Infinity : scene.pressure_Pa[k];
      if (pressure_Pa !== null && !scene.broken[k]) {
        const [x_mm, y_mm] = [scene.layout.x_mm[k], scene.layout.y_mm[k]];
        parts.push({ far: far(x_mm, y_mm), paint: () => this.bar(x_mm, y_mm, heatPart(pressure_Pa), scene.doubtful[k], rubber) });
      }
    }
    if (scene.fit) {
      this.surface(scene.fit, padSize(scene.layout), rubber, (x_mm, y_mm, paint) => parts.push({ far: far(x_mm, y_mm), paint }));
    }
    parts.sort((one, other) => other.far - one.far);
    parts.forEach(({ paint }) => paint());
  }

  private bar(x_mm: number, y_mm: number, part: number, doubtful: boolean, rubber: Colour): void {
    const height_mm = Math.max(0.12, part * HEIGHT_mm);
    const colour = (share: number) => mix(rubber, heatOf(this.palette, share * part), doubtful ? DOUBTFUL : 1);
    for (const [dx, dy] of [
      [1, 0],
      [0, 1],
      [-1, 0],
      [0, -1],
    ] as const) {
      if (dx * (this.camera.eye[0] - x_mm) + dy * (this.camera.eye[1] - y_mm) <= BAR_HALF_mm) {
        continue;
      }
      const corner = (side: number, z_mm: number): Point => [
        x_mm + BAR_HALF_mm * (dx - side * dy),
        y_mm + BAR_HALF_mm * (dy + side * dx),
        z_mm,
      ];
      this.path([corner(1, 0), corner(1, height_mm), corner(-1, height_mm), corner(-1, 0)]);
      const shade = this.pen.createLinearGradient(...this.at(corner(0, 0)), ...this.at(corner(0, height_mm)));
      for (let share = 0; share <= 1; share += 0.25) {
        shade.addColorStop(share, cssOf(lit(colour(share), [dx, dy, 0])));
      }
      this.pen.fillStyle = shade;
      this.pen.fill();
    }
    this.shape(
      [
        [-1, -1],
        [1, -1],
        [1, 1],
        [-1, 1],
      ].map(([dx, dy]) => [x_mm + BAR_HALF_mm * dx, y_mm + BAR_HALF_mm * dy, height_mm]),
      lit(colour(1), [0, 0, 1]),
    );
  }

  /** In cells, and its contours in short pieces. */
  private surface(
    fit: Fit,
    size: { x_mm: number; y_mm: number },
    rubber: Colour,
    add: (x_mm: number, y_mm: number, paint: () => void) => void,
  ): void {
    const { x_mm, y_mm, p0_Pa, sigma_mm } = fit.contact;
    const peak = heatPart(p0_Pa);
    const wide_mm2 = Math.max(4 * sigma_mm ** 2, 0.01); // the root of a Gaussian is one, 1.41 times as wide
    const partAt = (x: number, y: number) => peak * Math.exp(-((x - x_mm) ** 2 + (y - y_mm) ** 2) / wide_mm2);
    const corner = (x: number, y: number): Point => [x, y, partAt(x, y) * HEIGHT_mm];
    for (let x = 0.4 - size.x_mm; x < size.x_mm - 0.5; x += CELL_mm) {
      for (let y = 0.4 - size.y_mm; y < size.y_mm - 0.5; y += CELL_mm) {
        const [x_middle, y_middle] = [x + CELL_mm / 2, y + CELL_mm / 2];
        const part = partAt(x_middle, y_middle);
        const share = Math.min((part - FADES[0]) / (FADES[1] - FADES[0]), 1);
        if (share <= 0) {
          continue;
        }
        const slope = (2 * part * HEIGHT_mm) / wide_mm2;
        const heat = lit(heatOf(this.palette, part), [slope * (x_middle - x_mm), slope * (y_middle - y_mm), 1]);
        const colour = fit.doubtful ? mix(heat, rubber, DOUBTFUL) : heat;
        const over = share === 1 ? OVERLAP_mm : 0;
        const [left, right, low, high] = [x - over, x + CELL_mm + over, y - over, y + CELL_mm + over];
        const corners = [corner(left, low), corner(right, low), corner(right, high), corner(left, high)];
        add(x_middle, y_middle, () => this.shape(corners, colour, share));
      }
    }
    for (const part of CONTOURS.filter((part) => part < peak)) {
      const ring = circle(x_mm, y_mm, part * HEIGHT_mm, Math.sqrt(wide_mm2 * Math.log(peak / part)), 72);
      ring.forEach((here, i) => {
        const next = ring[(i + 1) % ring.length];
        if (!fit.doubtful || i % 6 < 3) {
          // As if nearer than the cells that it lies on.
          const towards = 1 - 1.5 / Math.hypot(here[0] - this.camera.eye[0], here[1] - this.camera.eye[1]);
          add(here[0] * towards + this.camera.eye[0] * (1 - towards), here[1] * towards + this.camera.eye[1] * (1 - towards), () =>
            this.line(here, next, this.palette.of('text'), 0.12, 0.45),
          );
        }
      });
    }
  }

  /** The report of the contact lies over all of it. Its marks are on the rubber, as all places are: from aslant a higher point appears elsewhere. */
  private contact(fit: Fit): void {
    const { palette } = this;
    const { x_mm, y_mm, p0_Pa } = fit.contact;
    const [warning, text] = [palette.of('warning'), palette.of('text')];
    const colour = fit.doubtful ? warning : text;
    const share = fit.doubtful ? 0.6 : 1;
    if (fit.edge) {
      const { x_mm: dx, y_mm: dy } = fit.edge;
      this.line([x_mm - dx, y_mm - dy, 0], [x_mm + dx, y_mm + dy, 0], colour, 0.6, share);
    }
    for (const spot of fit.two) {
      this.outline(circle(spot.x_mm, spot.y_mm, 0, 1.8), warning, 0.5, 1, true);
      this.disc(spot.x_mm, spot.y_mm, spot.sd_mm, share, colour);
    }
    if (fit.two.length > 0) {
      return;
    }
    if (fit.sd_mm > 0) {
      this.disc(x_mm, y_mm, fit.sd_mm, share, colour, fit.doubtful);
      this.disc(x_mm, y_mm, 2 * fit.sd_mm, 0.5 * share, colour, fit.doubtful);
    }
    if (fit.doubtful) {
      this.outline(circle(x_mm, y_mm, 0, 1.8), warning, 0.5, 1, true);
    } else {
      this.cross(x_mm, y_mm, 2.2, 0.36, text);
    }
    this.force(fit, heatPart(p0_Pa) * HEIGHT_mm + 0.2, colour, share);
    if (fit.arrow) {
      this.tangential(fit, fit.arrow, share);
    }
  }

  /** Presses from above: solid as far as it is for sure, paler where it may end. */
  private force(
    { contact: { x_mm, y_mm }, doubtful, force_mm, force_low_mm, force_high_mm }: Fit,
    top_mm: number,
    colour: Colour,
    share: number,
  ): void {
    const accent = this.palette.of('accent');
    const force = doubtful ? mix(accent, this.palette.of('rubber'), 0.35) : accent;
    const at = (z_mm: number): Point => [x_mm, y_mm, z_mm];
    this.line(at(0), at(top_mm), colour, 0.24, share);
    if (force_mm <= 0.3) {
      return;
    }
    const head_mm = Math.min(3.2, 0.7 * force_mm);
    const low_mm = Math.max(force_low_mm, head_mm);
    if (force_high_mm > low_mm) {
      this.line(at(top_mm + low_mm), at(top_mm + force_high_mm), force, 0.6, UNSURE * share);
    }
    this.line(at(top_mm + head_mm), at(top_mm + low_mm), force, 1, share);
    this.shape(circle(x_mm, y_mm, top_mm + head_mm, 1.35), force, share);
    this.head(at(top_mm), at(top_mm + head_mm), this.camera.right, force, share);
  }

  private tangential({ contact: { x_mm, y_mm }, doubtful }: Fit, arrow: NonNullable<Fit['arrow']>, share: number): void {
    const { along_x, along_y, length_mm, sd_mm } = arrow;
    const colour = this.palette.of(doubtful ? 'warning' : arrow.slides ? 'bad' : 'good');
    const at = (along_mm: number, aside_mm = 0): Point => [
      x_mm + along_mm * along_x - aside_mm * along_y,
      y_mm + along_mm * along_y + aside_mm * along_x,
      0,
    ];
    if (length_mm > 0) {
      const tip_mm = Math.min(3, 0.6 * length_mm);
      this.line(at(0), at(length_mm - tip_mm), colour, 1, share);
      this.head(at(length_mm), at(length_mm - tip_mm), [-along_y, along_x, 0], colour, share);
      this.shape([at(0), at(length_mm, sd_mm), at(length_mm, -sd_mm)], colour, UNSURE * share);
    }
    const end = circle(...at(length_mm), Math.max(sd_mm, 0.5));
    this.shape(end, colour, 0.5 * UNSURE * share);
    this.outline(end, colour, 0.2, UNSURE * share);
  }
}
