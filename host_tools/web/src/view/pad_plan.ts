/** The pad from above on a plain canvas, for browsers without WebGL: the same quantities, in plan. */
import { seen, type Camera } from './camera';
import { cssOf, heatCss, mix, type Palette } from './palette';
import { padSize, type Scene } from './pad_scene';

const CELL_mm = 0.75;

export class PadPlan {
  private readonly context: CanvasRenderingContext2D;

  constructor(private readonly canvas: HTMLCanvasElement) {
    const context = canvas.getContext('2d');
    if (!context) {
      throw new Error('this browser draws on no canvas');
    }
    this.context = context;
  }

  /** The camera must look from above. */
  draw(scene: Scene, camera: Camera, palette: Palette): void {
    const { context: pen, canvas } = this;
    const at = (x_mm: number, y_mm: number): [number, number] => {
      const { right, up } = seen(camera, [x_mm, y_mm, 0]);
      return [((right + 1) / 2) * canvas.width, ((1 - up) / 2) * canvas.height];
    };
    const mm = at(1, 0)[0] - at(0, 0)[0];
    const ring = (x_mm: number, y_mm: number, radius_mm: number) => {
      pen.beginPath();
      pen.arc(...at(x_mm, y_mm), radius_mm * mm, 0, 2 * Math.PI);
    };
    const size = padSize(scene.layout);
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.clearRect(0, 0, canvas.width, canvas.height);
    pen.fillStyle = palette.css('rubber');
    pen.fillRect(...at(-size.x_mm, size.y_mm), 2 * size.x_mm * mm, 2 * size.y_mm * mm);
    const fit = scene.fit;
    if (fit) {
      const { x_mm, y_mm, p0_Pa, sigma_mm } = fit.contact;
      pen.globalAlpha = fit.doubtful ? 0.45 : 1;
      for (let y = -size.y_mm; y < size.y_mm; y += CELL_mm) {
        for (let x = -size.x_mm; x < size.x_mm; x += CELL_mm) {
          const square = (x + CELL_mm / 2 - x_mm) ** 2 + (y + CELL_mm / 2 - y_mm) ** 2;
          const pressure_Pa = p0_Pa * Math.exp(-square / (2 * sigma_mm ** 2));
          if (pressure_Pa > 150) {
            pen.fillStyle = heatCss(palette, pressure_Pa);
            pen.fillRect(...at(x, y + CELL_mm), CELL_mm * mm + 1, CELL_mm * mm + 1);
          }
        }
      }
      pen.globalAlpha = 1;
    }
    pen.lineWidth = 0.25 * mm;
    for (let k = 0; k < scene.count; k++) {
      const x = scene.layout.x_mm[k] ?? 0;
      const y = scene.layout.y_mm[k] ?? 0;
      const pressure_Pa = scene.saturated[k] ? Infinity : scene.pressure_Pa[k];
      pen.strokeStyle = palette.css(scene.broken[k] ? 'bad' : scene.doubtful[k] ? 'warning' : 'edge');
      pen.setLineDash(scene.doubtful[k] ? [0.8 * mm, 0.5 * mm] : []);
      ring(x, y, 2.2);
      if (pressure_Pa !== null && pressure_Pa !== undefined) {
        pen.fillStyle = heatCss(palette, pressure_Pa);
        pen.fill();
      }
      pen.stroke();
      if (scene.broken[k]) {
        pen.beginPath();
        pen.moveTo(...at(x - 1.5, y - 1.5));
        pen.lineTo(...at(x + 1.5, y + 1.5));
        pen.moveTo(...at(x - 1.5, y + 1.5));
        pen.lineTo(...at(x + 1.5, y - 1.5));
        pen.stroke();
      }
    }
    pen.setLineDash([]);
    for (const past of scene.trail) {
      pen.fillStyle = palette.css('accent');
      ring(past.x_mm, past.y_mm, 0.25);
      pen.fill();
    }
    if (scene.truth) {
      pen.strokeStyle = palette.css('good');
      ring(scene.truth.x_mm, scene.truth.y_mm, 3.4);
      pen.stroke();
    }
    if (fit) {
      this.contact(fit, at, ring, mm, palette);
    }
  }

  private contact(
    fit: NonNullable<Scene['fit']>,
    at: (x_mm: number, y_mm: number) => [number, number],
    ring: (x_mm: number, y_mm: number, radius_mm: number) => void,
    mm: number,
    palette: Palette,
  ): void {
    const pen = this.context;
    const { x_mm, y_mm } = fit.contact;
    const colour = fit.doubtful ? 'warning' : 'text';
    pen.strokeStyle = pen.fillStyle = palette.css(colour);
    pen.setLineDash(fit.doubtful ? [0.6 * mm, 0.5 * mm] : []);
    if (fit.edge) {
      pen.lineWidth = 0.7 * mm;
      pen.beginPath();
      pen.moveTo(...at(x_mm - fit.edge.x_mm, y_mm - fit.edge.y_mm));
      pen.lineTo(...at(x_mm + fit.edge.x_mm, y_mm + fit.edge.y_mm));
      pen.stroke();
    }
    if (fit.two.length > 0) {
      for (const spot of fit.two) {
        pen.globalAlpha = 0.25;
        ring(spot.x_mm, spot.y_mm, spot.sd_mm);
        pen.fill();
        pen.globalAlpha = 1;
        pen.lineWidth = 0.4 * mm;
        ring(spot.x_mm, spot.y_mm, 1.8);
        pen.stroke();
      }
      pen.setLineDash([]);
      return;
    }
    if (fit.sd_mm > 0) {
      pen.globalAlpha = 0.25;
      ring(x_mm, y_mm, fit.sd_mm);
      pen.fill();
      pen.globalAlpha = 0.6;
      ring(x_mm, y_mm, 2 * fit.sd_mm);
      pen.stroke();
      pen.globalAlpha = 1;
    }
    pen.lineWidth = 0.4 * mm;
    if (fit.doubtful) {
      ring(x_mm, y_mm, 1.8);
    } else {
      pen.beginPath();
      pen.moveTo(...at(x_mm - 2.2, y_mm));
      pen.lineTo(...at(x_mm + 2.2, y_mm));
      pen.moveTo(...at(x_mm, y_mm - 2.2));
      pen.lineTo(...at(x_mm, y_mm + 2.2));
    }
    pen.stroke();
    pen.setLineDash([]);
    const arrow = fit.arrow;
    if (arrow) {
      const to_x = x_mm + arrow.along_x * arrow.length_mm;
      const to_y = y_mm + arrow.along_y * arrow.length_mm;
      const name = fit.doubtful ? 'warning' : arrow.slides ? 'bad' : 'good';
      pen.strokeStyle = pen.fillStyle = palette.css(name);
      pen.lineWidth = 0.7 * mm;
      pen.beginPath();
      pen.moveTo(...at(x_mm, y_mm));
      pen.lineTo(...at(to_x, to_y));
      pen.stroke();
      pen.fillStyle = cssOf(mix(palette.of('rubber'), palette.of(name), 0.5));
      pen.globalAlpha = 0.7;
      ring(to_x, to_y, Math.max(arrow.sd_mm, 0.5));
      pen.fill();
      pen.globalAlpha = 1;
    }
  }
}
