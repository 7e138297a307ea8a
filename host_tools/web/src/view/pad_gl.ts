/** The pad in three dimensions, in plain WebGL 2: eight draw calls a picture, whatever happens on
 * it. Bars are what the sensors measured, the surface is the fitted Gaussian, both as high and in
 * the colour of their pressure, so that a bar ends in the surface where the fit is good. */
import type { Camera } from './camera';
import { HEAT_STOPS, heatPart, mix, type Colour, type Palette } from './palette';
import { HEIGHT_mm, THICKNESS_mm, padSize, type Scene } from './pad_scene';

const BAR_HALF_mm = 1.35;
const SENSOR_mm = 2.4;
const GRID = 56;
/** Brightness of the uncertain, over that of the certain. */
const UNSURE = 0.4;
const DOUBTFUL = 0.5;

/** origin + radius (x, y) across, axis along: what a mesh of one unit becomes. */
const SOLID_VERTEX = `#version 300 es
layout(location = 0) in vec3 place;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 origin;
layout(location = 3) in vec3 axis;
layout(location = 4) in vec2 shape; // radius; 1: coloured by its height
layout(location = 5) in vec4 colour;
uniform mat4 camera;
out vec3 v_normal;
out float v_height;
out float v_heated;
out vec4 v_colour;
void main() {
  float size = max(length(axis), 1e-6);
  vec3 along = axis / size;
  vec3 across = normalize(abs(along.z) > 0.9 ? vec3(along.z, 0.0, -along.x) : cross(vec3(0, 0, 1), along));
  vec3 aside = cross(along, across);
  mat3 turn = mat3(across, aside, along);
  vec3 at = origin + turn * vec3(place.xy * shape.x, place.z * size);
  v_normal = turn * normal;
  v_height = at.z;
  v_heated = shape.y;
  v_colour = colour;
  gl_Position = camera * vec4(at, 1);
}`;

const HEAT = `
uniform vec3 heats[${HEAT_STOPS}];
vec3 heat(float part) {
  float at = clamp(part, 0.0, 1.0) * ${HEAT_STOPS - 1}.0;
  int below = min(int(at), ${HEAT_STOPS - 2});
  return mix(heats[below], heats[below + 1], at - float(below));
}
float lit(vec3 n) {
  return 0.80 + 0.20 * dot(normalize(n), normalize(vec3(-0.35, -0.45, 0.82)));
}`;

const SOLID_FRAGMENT = `#version 300 es
precision highp float;
in vec3 v_normal;
in float v_height;
in float v_heated;
in vec4 v_colour;
out vec4 result;
${HEAT}
void main() {
  vec3 base = v_heated > 0.5 ? mix(v_colour.rgb, heat(v_height / ${HEIGHT_mm.toFixed(1)}), v_colour.a) : v_colour.rgb;
  float alpha = v_heated > 0.5 ? 1.0 : v_colour.a;
  result = vec4(base * lit(v_normal), 1) * alpha;
}`;

const SURFACE_VERTEX = `#version 300 es
layout(location = 0) in vec2 place; // -1 to 1
uniform mat4 camera;
uniform vec2 size_mm;
uniform vec4 gauss; // x, y, height, twice sigma squared of the root
out vec2 v_from_mm;
out float v_height;
out vec3 v_normal;
void main() {
  vec2 at = place * size_mm;
  vec2 from = at - gauss.xy;
  float height = gauss.z * exp(-dot(from, from) / gauss.w);
  v_height = height;
  v_from_mm = from;
  v_normal = vec3(height * 2.0 * from / gauss.w, 1);
  gl_Position = camera * vec4(at, height + 0.05, 1);
}`;

/* Contours at 5, 20, 50 and 100 kPa. */
const SURFACE_FRAGMENT = `#version 300 es
precision highp float;
in vec2 v_from_mm;
in float v_height;
in vec3 v_normal;
uniform vec3 rubber;
uniform vec3 ink;
uniform float doubtful;
out vec4 result;
${HEAT}
void main() {
  float part = v_height / ${HEIGHT_mm.toFixed(1)};
  float edge = smoothstep(0.035, 0.11, part);
  if (edge <= 0.0) discard;
  vec3 colour = heat(part) * lit(v_normal);
  colour = mix(colour, rubber, doubtful * ${DOUBTFUL.toFixed(2)});
  float wide = fwidth(part) * 0.9 + 1e-5;
  float line = 0.0;
  line = max(line, 1.0 - smoothstep(0.0, wide, abs(part - 0.2236)));
  line = max(line, 1.0 - smoothstep(0.0, wide, abs(part - 0.4472)));
  line = max(line, 1.0 - smoothstep(0.0, wide, abs(part - 0.7071)));
  float angle = atan(v_from_mm.y, v_from_mm.x);
  float dash = doubtful > 0.5 ? step(0.5, fract(angle * 3.8197)) : 1.0;
  colour = mix(colour, ink, 0.45 * line * dash);
  float alpha = edge * mix(0.86, 0.62, doubtful);
  result = vec4(colour, 1) * alpha;
}`;

/** Marks that lie flat: kind 0 a disc with its rim, 1 a cross, 2 an open ring, 3 a slanted cross,
 * 4 a wedge from the middle to the right. */
const MARK_VERTEX = `#version 300 es
layout(location = 0) in vec2 place;
layout(location = 1) in vec3 centre;
layout(location = 2) in vec4 shape; // half size, kind, line, share of the disc; mm
layout(location = 3) in vec4 colour;
layout(location = 4) in vec3 turn; // cosine, sine, 1: dashed
uniform mat4 camera;
out vec2 v_at;
out vec4 v_shape;
out vec4 v_colour;
out float v_dashed;
void main() {
  v_at = place * (shape.x + shape.z + 0.3);
  v_shape = shape;
  v_colour = colour;
  v_dashed = turn.z;
  vec2 at = mat2(turn.x, turn.y, -turn.y, turn.x) * v_at;
  gl_Position = camera * vec4(centre + vec3(at, 0), 1);
}`;

const MARK_FRAGMENT = `#version 300 es
precision highp float;
in vec2 v_at;
in vec4 v_shape;
in vec4 v_colour;
in float v_dashed;
out vec4 result;
void main() {
  float size = v_shape.x, half_line = 0.5 * v_shape.z;
  float from = length(v_at);
  float soft = fwidth(from) * 0.75 + 1e-4;
  float cover = 0.0;
  int kind = int(v_shape.y + 0.5);
  if (kind == 0 || kind == 2) {
    float rim = 1.0 - smoothstep(half_line - soft, half_line + soft, abs(from - size));
    float angle = atan(v_at.y, v_at.x);
    if (kind == 2) rim *= step(0.32, abs(fract(angle * 0.63662) - 0.5) + 0.14);
    else if (v_dashed > 0.5) rim *= step(0.45, fract(angle * 2.5465));
    cover = max(rim, v_shape.w * (1.0 - smoothstep(size - soft, size + soft, from)));
  } else if (kind == 1 || kind == 3) {
    vec2 at = kind == 1 ? v_at : vec2(v_at.x + v_at.y, v_at.x - v_at.y) * 0.70711;
    vec2 away = abs(at);
    float near = min(away.x, away.y), far = max(away.x, away.y);
    cover = (1.0 - smoothstep(half_line - soft, half_line + soft, near)) *
            (1.0 - smoothstep(size - soft, size + soft, far));
  } else {
    float ahead = v_at.x / size;
    float side = abs(v_at.y) - v_shape.z * ahead;
    cover = step(0.0, ahead) * step(ahead, 1.0) * (1.0 - smoothstep(-soft, soft, side));
  }
  if (cover <= 0.004) discard;
  result = vec4(v_colour.rgb, 1) * v_colour.a * cover;
}`;

interface Mesh {
  array: WebGLVertexArrayObject;
  count: number;
  instances: WebGLBuffer;
  values: number[];
}

const SOLID_FLOATS = 12; // origin, axis, shape, colour
const MARK_FLOATS = 14; // centre, shape, colour, turn

export class PadGl {
  private readonly gl: WebGL2RenderingContext;
  private readonly solid: WebGLProgram;
  private readonly surface: WebGLProgram;
  private readonly mark: WebGLProgram;
  private readonly slab: Mesh;
  private readonly bars: Mesh;
  private readonly shafts: Mesh;
  private readonly heads: Mesh;
  private readonly under: Mesh;
  private readonly over: Mesh;
  private readonly grid: { array: WebGLVertexArrayObject; count: number };
  private readonly locations = new Map<string, WebGLUniformLocation | null>();
  /** Where the processor draws: worth fewer pixels. */
  readonly software: boolean;

  /** Throws where there is no WebGL 2. */
  constructor(canvas: HTMLCanvasElement, size: { x_mm: number; y_mm: number }) {
    const probe = canvas.getContext('webgl2', {
      antialias: !/SwiftShader|llvmpipe|Software/i.test(rendererOf()),
      alpha: true,
      premultipliedAlpha: true,
      powerPreference: 'low-power',
    });
    if (!probe) {
      throw new Error('this browser offers no WebGL 2');
    }
    this.gl = probe;
    this.software = /SwiftShader|llvmpipe|Software/i.test(rendererOf());
    this.solid = this.program(SOLID_VERTEX, SOLID_FRAGMENT);
    this.surface = this.program(SURFACE_VERTEX, SURFACE_FRAGMENT);
    this.mark = this.program(MARK_VERTEX, MARK_FRAGMENT);
    this.slab = this.solidMesh(slabMesh(size.x_mm, size.y_mm));
    this.bars = this.solidMesh(boxMesh());
    this.shafts = this.solidMesh(roundMesh(1));
    this.heads = this.solidMesh(roundMesh(0));
    this.under = this.markMesh();
    this.over = this.markMesh();
    this.grid = this.gridMesh();
  }

  get lost(): boolean {
    return this.gl.isContextLost();
  }

  dispose(): void {
    this.gl.getExtension('WEBGL_lose_context')?.loseContext();
  }

  draw(scene: Scene, camera: Camera, palette: Palette): void {
    const gl = this.gl;
    const rubber = palette.of('rubber');
    const text = palette.of('text');
    this.fill(scene, palette);
    gl.viewport(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    const heats = new Float32Array(palette.heat.flat());

    gl.useProgram(this.solid);
    gl.uniformMatrix4fv(this.at(this.solid, 'camera'), false, camera.matrix);
    gl.uniform3fv(this.at(this.solid, 'heats'), heats);
    this.drawSolid(this.slab);
    this.drawMarks(this.under, camera);
    gl.useProgram(this.solid);
    this.drawSolid(this.bars);

    const fit = scene.fit;
    if (fit) {
      const size = padSize(scene.layout);
      gl.useProgram(this.surface);
      gl.uniformMatrix4fv(this.at(this.surface, 'camera'), false, camera.matrix);
      gl.uniform3fv(this.at(this.surface, 'heats'), heats);
      gl.uniform2f(this.at(this.surface, 'size_mm'), size.x_mm - 0.4, size.y_mm - 0.4);
      /* The root of a Gaussian is one, 1.41 times as wide. */
      gl.uniform4f(
        this.at(this.surface, 'gauss'),
        fit.contact.x_mm,
        fit.contact.y_mm,
        heatPart(fit.contact.p0_Pa) * HEIGHT_mm,
        Math.max(4 * fit.contact.sigma_mm ** 2, 0.01),
      );
      gl.uniform3fv(this.at(this.surface, 'rubber'), rubber);
      gl.uniform3fv(this.at(this.surface, 'ink'), text);
      gl.uniform1f(this.at(this.surface, 'doubtful'), fit.doubtful ? 1 : 0);
      gl.bindVertexArray(this.grid.array);
      gl.drawElements(gl.TRIANGLES, this.grid.count, gl.UNSIGNED_SHORT, 0);
    }

    /* The report of the contact lies over all of it. */
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.disable(gl.DEPTH_TEST);
    this.drawMarks(this.over, camera);
    gl.enable(gl.DEPTH_TEST);
    gl.useProgram(this.solid);
    this.drawSolid(this.shafts);
    this.drawSolid(this.heads);
    gl.bindVertexArray(null);
  }

  private fill(scene: Scene, palette: Palette): void {
    const rubber = palette.of('rubber');
    const bad = palette.of('bad');
    const warning = palette.of('warning');
    const edge = palette.of('edge');
    const good = palette.of('good');
    const text = palette.of('text');
    const alarm = scene.alarm === 'moves' ? warning : bad;
    const side = scene.alarm ? mix(rubber, alarm, 0.55) : rubber;
    put(this.slab, [0, 0, -THICKNESS_mm, 0, 0, THICKNESS_mm, 1, 0, ...side, 1]);
    for (const mesh of [this.bars, this.shafts, this.heads, this.under, this.over]) {
      mesh.values.length = 0;
    }
    for (let k = 0; k < scene.count; k++) {
      const x = scene.layout.x_mm[k] ?? 0;
      const y = scene.layout.y_mm[k] ?? 0;
      const colour = scene.broken[k] ? bad : scene.doubtful[k] ? warning : edge;
      flat(this.under, [x, y, 0.06], SENSOR_mm, 0, 0.32, scene.broken[k] ? 0.12 : 0.06, colour, 0.75, 0, scene.doubtful[k]);
      if (scene.broken[k]) {
        flat(this.under, [x, y, 0.07], SENSOR_mm * 0.8, 3, 0.5, 0, bad, 0.95);
        continue;
      }
      const pressure_Pa = scene.saturated[k] ? Infinity : scene.pressure_Pa[k];
      if (pressure_Pa !== null && pressure_Pa !== undefined) {
        const height = Math.max(0.12, heatPart(pressure_Pa) * HEIGHT_mm);
        put(this.bars, [x, y, 0, 0, 0, height, BAR_HALF_mm, 1, ...rubber, scene.doubtful[k] ? DOUBTFUL : 1], true);
      }
    }
    scene.trail.forEach((past, i) => {
      const part = (i + 1) / scene.trail.length;
      flat(this.under, [past.x_mm, past.y_mm, 0.08], 0.3, 0, 0.2, 1, palette.of('accent'), 0.75 * part);
    });
    if (scene.truth) {
      const { x_mm, y_mm } = scene.truth;
      flat(this.over, [x_mm, y_mm, 0.1], 3.4, 0, 0.3, 0, good, 0.95);
      flat(this.over, [x_mm, y_mm, 0.1], 1.1, 1, 0.3, 0, good, 0.95);
    }
    const fit = scene.fit;
    if (!fit) {
      return;
    }
    const { x_mm, y_mm, p0_Pa } = fit.contact;
    const top = heatPart(p0_Pa) * HEIGHT_mm + 0.2;
    /* On the rubber, as all places are, because from aslant a higher point appears elsewhere. */
    const at = [x_mm, y_mm, 0.1] as const;
    const colour = fit.doubtful ? warning : text;
    const part = fit.doubtful ? 0.6 : 1;
    if (fit.edge) {
      const { x_mm: dx, y_mm: dy } = fit.edge;
      put(this.shafts, [x_mm - dx, y_mm - dy, 0.3, 2 * dx, 2 * dy, 0, 0.3, 0, ...colour, part], true);
    }
    for (const spot of fit.two) {
      flat(this.over, [spot.x_mm, spot.y_mm, 0.1], 1.8, 2, 0.5, 0, warning, 1);
      flat(this.over, [spot.x_mm, spot.y_mm, 0.1], Math.min(spot.sd_mm, 30), 0, 0.16, 0.22, colour, 0.9 * part);
    }
    if (fit.two.length > 0) {
      return;
    }
    if (fit.sd_mm > 0) {
      const sd_mm = Math.min(fit.sd_mm, 30);
      flat(this.over, at, sd_mm, 0, 0.16, 0.22, colour, 0.9 * part, 0, fit.doubtful);
      flat(this.over, at, 2 * sd_mm, 0, 0.12, 0.08, colour, 0.55 * part, 0, fit.doubtful);
    }
    if (fit.doubtful) {
      flat(this.over, at, 1.8, 2, 0.5, 0, warning, 1);
    } else {
      flat(this.over, at, 2.2, 1, 0.36, 0, text, 1);
    }
    /* Presses from above: solid as far as it is for sure, paler where it may end. */
    put(this.shafts, [x_mm, y_mm, 0.1, 0, 0, top - 0.1, 0.12, 0, ...colour, part], true);
    const force = palette.of('accent');
    const head_mm = Math.min(3.2, 0.7 * fit.force_mm);
    const shade = (share: number) => [...(fit.doubtful ? mix(force, rubber, 0.35) : force), share];
    if (fit.force_mm > 0.3) {
      put(this.heads, [x_mm, y_mm, top + head_mm, 0, 0, -head_mm, 1.35, 0, ...shade(part)], true);
      const low = Math.max(fit.force_low_mm, head_mm);
      put(this.shafts, [x_mm, y_mm, top + head_mm, 0, 0, low - head_mm + 0.01, 0.5, 0, ...shade(part)], true);
      if (fit.force_high_mm > low) {
        put(this.shafts, [x_mm, y_mm, top + low, 0, 0, fit.force_high_mm - low, 0.3, 0, ...shade(UNSURE * part)], true);
      }
    }
    const arrow = fit.arrow;
    if (!arrow) {
      return;
    }
    const pull = fit.doubtful ? warning : arrow.slides ? bad : good;
    if (arrow.length_mm > 0) {
      const { along_x, along_y, length_mm, sd_mm } = arrow;
      const tip = Math.min(3, 0.6 * length_mm);
      const body = length_mm - tip;
      put(this.shafts, [x_mm, y_mm, 0.6, along_x * body, along_y * body, 0, 0.5, 0, ...pull, part], true);
      put(this.heads, [x_mm + along_x * body, y_mm + along_y * body, 0.6, along_x * tip, along_y * tip, 0, 1.35, 0, ...pull, part], true);
      if (sd_mm > 0.2) {
        const angle = Math.atan2(along_y, along_x);
        flat(this.over, at, length_mm, 4, sd_mm, 0, pull, UNSURE * part, angle);
      }
    }
    flat(
      this.over,
      [x_mm + arrow.along_x * arrow.length_mm, y_mm + arrow.along_y * arrow.length_mm, 0.1],
      Math.max(arrow.sd_mm, 0.5),
      0,
      0.2,
      0.5,
      pull,
      UNSURE * part,
    );
  }

  private drawSolid(mesh: Mesh): void {
    const count = mesh.values.length / SOLID_FLOATS;
    if (count > 0) {
      const gl = this.gl;
      gl.bindVertexArray(mesh.array);
      gl.bindBuffer(gl.ARRAY_BUFFER, mesh.instances);
      gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(mesh.values), gl.DYNAMIC_DRAW);
      gl.drawArraysInstanced(gl.TRIANGLES, 0, mesh.count, count);
    }
  }

  private drawMarks(mesh: Mesh, camera: Camera): void {
    const count = mesh.values.length / MARK_FLOATS;
    if (count > 0) {
      const gl = this.gl;
      gl.useProgram(this.mark);
      gl.uniformMatrix4fv(this.at(this.mark, 'camera'), false, camera.matrix);
      gl.depthMask(false);
      gl.bindVertexArray(mesh.array);
      gl.bindBuffer(gl.ARRAY_BUFFER, mesh.instances);
      gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(mesh.values), gl.DYNAMIC_DRAW);
      gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, mesh.count, count);
      gl.depthMask(true);
    }
  }

  private at(program: WebGLProgram, name: string): WebGLUniformLocation | null {
    const key = `${program === this.solid ? 's' : program === this.mark ? 'm' : 'g'}.${name}`;
    let location = this.locations.get(key);
    if (location === undefined) {
      location = this.gl.getUniformLocation(program, name);
      this.locations.set(key, location);
    }
    return location;
  }

  private program(vertex: string, fragment: string): WebGLProgram {
    const gl = this.gl;
    const program = gl.createProgram();
    for (const [kind, source] of [
      [gl.VERTEX_SHADER, vertex],
      [gl.FRAGMENT_SHADER, fragment],
    ] as const) {
      const shader = gl.createShader(kind);
      if (!shader) {
        throw new Error('WebGL makes no shader');
      }
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) {
        throw new Error(`WebGL: ${gl.getShaderInfoLog(shader) ?? 'a shader does not compile'}`);
      }
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
      throw new Error(`WebGL: ${gl.getProgramInfoLog(program) ?? 'a program does not link'}`);
    }
    return program;
  }

  private attributes(sizes: readonly number[], first: number, perInstance: boolean): void {
    const gl = this.gl;
    const stride = 4 * sizes.reduce((sum, size) => sum + size, 0);
    let offset = 0;
    sizes.forEach((size, i) => {
      gl.enableVertexAttribArray(first + i);
      gl.vertexAttribPointer(first + i, size, gl.FLOAT, false, stride, offset);
      gl.vertexAttribDivisor(first + i, perInstance ? 1 : 0);
      offset += 4 * size;
    });
  }

  private mesh(vertices: Float32Array, sizes: readonly number[], instanced: readonly number[]): Mesh {
    const gl = this.gl;
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, vertices, gl.STATIC_DRAW);
    this.attributes(sizes, 0, false);
    const instances = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, instances);
    this.attributes(instanced, sizes.length, true);
    gl.bindVertexArray(null);
    const floats = sizes.reduce((sum, size) => sum + size, 0);
    return { array, count: vertices.length / floats, instances, values: [] };
  }

  private solidMesh(vertices: Float32Array): Mesh {
    return this.mesh(vertices, [3, 3], [3, 3, 2, 4]);
  }

  private markMesh(): Mesh {
    return this.mesh(new Float32Array([-1, -1, 1, -1, -1, 1, 1, 1]), [2], [3, 4, 4, 3]);
  }

  private gridMesh(): { array: WebGLVertexArrayObject; count: number } {
    const gl = this.gl;
    const places: number[] = [];
    const indices: number[] = [];
    for (let row = 0; row <= GRID; row++) {
      for (let column = 0; column <= GRID; column++) {
        places.push((2 * column) / GRID - 1, (2 * row) / GRID - 1);
        if (row < GRID && column < GRID) {
          const i = row * (GRID + 1) + column;
          indices.push(i, i + 1, i + GRID + 1, i + 1, i + GRID + 2, i + GRID + 1);
        }
      }
    }
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(places), gl.STATIC_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 2, gl.FLOAT, false, 0, 0);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint16Array(indices), gl.STATIC_DRAW);
    gl.bindVertexArray(null);
    return { array, count: indices.length };
  }
}

let renderer: string | null = null;

/** The renderer of another canvas, because smooth edges must be requested before it is known. */
function rendererOf(): string {
  if (renderer === null) {
    const gl = document.createElement('canvas').getContext('webgl2');
    const names = gl?.getExtension('WEBGL_debug_renderer_info');
    renderer = gl && names ? String(gl.getParameter(names.UNMASKED_RENDERER_WEBGL)) : '';
    gl?.getExtension('WEBGL_lose_context')?.loseContext();
  }
  return renderer;
}

function put(mesh: Mesh, values: readonly number[], more = false): void {
  if (!more) {
    mesh.values.length = 0;
  }
  mesh.values.push(...values);
}

function flat(
  mesh: Mesh,
  at: readonly [number, number, number],
  half_mm: number,
  kind: number,
  line_mm: number,
  disc: number,
  colour: Colour,
  alpha: number,
  angle = 0,
  dashed = false,
): void {
  mesh.values.push(...at, half_mm, kind, line_mm, disc, ...colour, alpha, Math.cos(angle), Math.sin(angle), dashed ? 1 : 0);
}

/** Triangles with a normal each, from lists of corners of convex faces. */
function faces(list: readonly (readonly (readonly number[])[])[]): Float32Array {
  const values: number[] = [];
  for (const corners of list) {
    const [a, b, c] = corners as readonly [number[], number[], number[]];
    const u = b.map((value, i) => value - (a[i] ?? 0)) as [number, number, number];
    const v = c.map((value, i) => value - (a[i] ?? 0)) as [number, number, number];
    const normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    const size = Math.hypot(...normal) || 1;
    for (let i = 1; i + 1 < corners.length; i++) {
      for (const corner of [corners[0], corners[i], corners[i + 1]]) {
        values.push(...(corner ?? []), ...normal.map((part) => part / size));
      }
    }
  }
  return new Float32Array(values);
}

/** -1 to 1 across, 0 to 1 along. */
function boxMesh(): Float32Array {
  return prism([
    [-1, -1],
    [1, -1],
    [1, 1],
    [-1, 1],
  ]);
}

function prism(ring: readonly (readonly [number, number])[]): Float32Array {
  const sides = ring.map((at, i) => {
    const next = ring[(i + 1) % ring.length] ?? at;
    return [
      [...at, 0],
      [...next, 0],
      [...next, 1],
      [...at, 1],
    ];
  });
  return faces([...sides, ring.map((at) => [...at, 1])]);
}

/** A cylinder, or a cone where its end has radius 0. */
function roundMesh(end: number): Float32Array {
  const sides = 14;
  const ring = (radius: number, z: number) =>
    Array.from({ length: sides }, (_, i) => {
      const angle = (2 * Math.PI * i) / sides;
      return [radius * Math.cos(angle), radius * Math.sin(angle), z];
    });
  const low = ring(1, 0);
  const high = ring(end, 1);
  const walls = low.map((at, i) => {
    const j = (i + 1) % sides;
    return [at, low[j] ?? at, ...(end > 0 ? [high[j] ?? at] : []), high[i] ?? at];
  });
  return faces([...walls, [...low].reverse(), ...(end > 0 ? [high] : [])]);
}

/** In mm across, with round corners. */
function slabMesh(x_mm: number, y_mm: number): Float32Array {
  const round_mm = 4;
  const ring: [number, number][] = [];
  for (let corner = 0; corner < 4; corner++) {
    const right = corner === 0 || corner === 3 ? 1 : -1;
    const up = corner < 2 ? 1 : -1;
    for (let i = 0; i <= 6; i++) {
      const angle = ((corner + i / 6) * Math.PI) / 2;
      ring.push([right * (x_mm - round_mm) + round_mm * Math.cos(angle), up * (y_mm - round_mm) + round_mm * Math.sin(angle)]);
    }
  }
  return prism(ring);
}
