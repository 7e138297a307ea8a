/** The colours of styles/tokens.css, for what is drawn. */

/** Red, green, blue, 0 to 1. */
export type Colour = readonly [number, number, number];

export interface Palette {
  /** The value of a name in tokens.css, without its dashes in front. */
  css(name: string): string;
  of(name: string): Colour;
  readonly heat: readonly Colour[];
}

/** Pressure of the strongest colour. The scale is the square root, so that a light touch shows. */
export const FULL_SCALE_Pa = 100_000;
export const HEAT_STOPS = 8;
export const FINGERS = 8;

export function heatPart(pressure_Pa: number): number {
  return Math.min(1, Math.sqrt(Math.max(0, pressure_Pa) / FULL_SCALE_Pa));
}

/** declared: the value of a name as in tokens.css. */
export function paletteOf(declared: (name: string) => string, dark: boolean): Palette {
  const css = (name: string) => {
    const both = /light-dark\(\s*(#[0-9a-f]{6})\s*,\s*(#[0-9a-f]{6})\s*\)/i.exec(declared(name));
    if (!both) {
      throw new Error(`tokens.css has no colour --${name}`);
    }
    return (dark ? both[2] : both[1]) ?? '';
  };
  const of = (name: string) => parsed(css(name));
  return { css, of, heat: Array.from({ length: HEAT_STOPS }, (_, i) => of(`heat-${i}`)) };
}

/** part: of heatPart. */
export function heatOf(palette: Palette, part: number): Colour {
  const at = part * (HEAT_STOPS - 1);
  const below = Math.min(Math.floor(at), HEAT_STOPS - 2);
  return mix(palette.heat[below], palette.heat[below + 1], at - below);
}

export function mix(a: Colour, b: Colour, part: number): Colour {
  return [a[0] + (b[0] - a[0]) * part, a[1] + (b[1] - a[1]) * part, a[2] + (b[2] - a[2]) * part];
}

export function cssOf(colour: Colour): string {
  return `rgb(${colour.map((part) => Math.round(255 * part)).join(' ')})`;
}

export function parsed(hex: string): Colour {
  const at = (i: number) => parseInt(hex.slice(i, i + 2), 16) / 255;
  return [at(1), at(3), at(5)];
}

/** The contrast of WCAG 2.2, 1 to 21. */
export function contrast(a: Colour, b: Colour): number {
  const [light, dark] = [luminance(a), luminance(b)].sort((p, q) => q - p);
  return ((light ?? 0) + 0.05) / ((dark ?? 0) + 0.05);
}

function luminance(colour: Colour): number {
  const linear = (part: number) => (part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4);
  return 0.2126 * linear(colour[0]) + 0.7152 * linear(colour[1]) + 0.0722 * linear(colour[2]);
}
