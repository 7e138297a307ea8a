/** The camera above the pad. Millimetres; x across the pad, y along it, z out of the rubber,
 * its surface at 0. */

export type Point = readonly [number, number, number];

/** turn_deg about z, tilt_deg from the horizon: 90 is from above, with y up. */
export interface Look {
  turn_deg: number;
  tilt_deg: number;
}

/** Half the angle from the lower to the upper edge: narrow, so that lengths compare. */
const HALF_VIEW_rad = 0.21;

const radians = (degrees: number) => (degrees * Math.PI) / 180;

export interface Camera {
  readonly eye: Point;
  readonly right: Point;
  readonly up: Point;
  readonly back: Point;
  readonly aspect: number;
}

/** aspect: width over height. The nearest place from which all of these points are seen, in the middle part of the width and of the height. */
export function cameraOf(look: Look, aspect: number, points: readonly Point[], part: readonly [number, number]): Camera {
  const turn = radians(look.turn_deg);
  const tilt = radians(look.tilt_deg);
  const right: Point = [Math.cos(turn), Math.sin(turn), 0];
  const up: Point = [-Math.sin(turn) * Math.sin(tilt), Math.cos(turn) * Math.sin(tilt), Math.cos(tilt)];
  const back: Point = [Math.sin(turn) * Math.cos(tilt), -Math.cos(turn) * Math.cos(tilt), Math.sin(tilt)];
  const high = Math.tan(HALF_VIEW_rad);
  /** Between two opposite edges of the picture: how far aside, and how far back at least. */
  const between = (along: Point, slope: number): [number, number] => {
    const [most, least] = [1, -1].map((sign) => Math.max(...points.map((each) => sign * dot(each, along) + slope * dot(each, back))));
    return [(most - least) / 2, (most + least) / (2 * slope)];
  };
  const [x, back_x] = between(right, high * aspect * part[0]);
  const [y, back_y] = between(up, high * part[1]);
  const z = Math.max(back_x, back_y);
  const [eye_x, eye_y, eye_z] = [0, 1, 2].map((i) => x * right[i] + y * up[i] + z * back[i]);
  return { eye: [eye_x, eye_y, eye_z], right, up, back, aspect };
}

/** Where a point is seen: -1 to 1, to the right and up. */
export function seen({ eye, right, up, back, aspect }: Camera, point: Point): { right: number; up: number } {
  const from: Point = [point[0] - eye[0], point[1] - eye[1], point[2] - eye[2]];
  const high = -dot(from, back) * Math.tan(HALF_VIEW_rad);
  return { right: dot(from, right) / (high * aspect), up: dot(from, up) / high };
}

/** The point of the rubber's surface, or of a plane at another height, that is seen there; null
 * where none is: at the horizon and above. */
export function picked(camera: Camera, right: number, up: number, height_mm = 0): { x_mm: number; y_mm: number } | null {
  const high = Math.tan(HALF_VIEW_rad);
  const [dx, dy, dz] = [0, 1, 2].map((i) => camera.right[i] * right * high * camera.aspect + camera.up[i] * up * high - camera.back[i]);
  const along = (height_mm - camera.eye[2]) / dz;
  if (!(dz < -1e-6) || !(along > 0)) {
    return null;
  }
  return { x_mm: camera.eye[0] + along * dx, y_mm: camera.eye[1] + along * dy };
}

function dot(a: Point, b: Point): number {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
