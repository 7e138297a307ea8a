/** Numbers as recordings have them: as C++'s std::to_chars writes them. */

const SCRATCH = new Float32Array(1);

/** The shortest decimal that reads back as the same float; value must be a float. */
export function shortest(value: number): string {
  if (value === 0) {
    return Object.is(value, -0) ? '-0' : '0';
  }
  // Seven digits are enough for many, nine for all.
  let digits = 7;
  if (readsBack(value, 7)) {
    while (digits > 1 && readsBack(value, digits - 1)) {
      digits--;
    }
  } else {
    digits = readsBack(value, 8) ? 8 : 9;
  }
  const [mantissa, exponent] = evenly(value, digits).split('e') as [string, string];
  const sign = mantissa.startsWith('-') ? '-' : '';
  const plain = mantissa.replace(/^-/, '').replace('.', '').replace(/0+$/, '') || '0';
  // Of the last digit; scientific where that is shorter.
  const last = Number(exponent) - (plain.length - 1);
  const single = plain.length === 1 ? 1 : 0;
  if (last >= -(plain.length + 3) + single && last <= 5 - single) {
    if (last >= 0) {
      return value.toFixed(0);
    }
    const whole = plain.length + last;
    return whole > 0
      ? `${sign}${plain.slice(0, whole)}.${plain.slice(whole)}`
      : `${sign}0.${'0'.repeat(-whole)}${plain}`;
  }
  const power = Number(exponent);
  const text = plain.length > 1 ? `${plain[0]}.${plain.slice(1)}` : plain;
  return `${sign}${text}e${power < 0 ? '-' : '+'}${String(Math.abs(power)).padStart(2, '0')}`;
}

/** As toExponential, but half to even, as C++ has it. */
function evenly(value: number, digits: number): string {
  const rounded = value.toExponential(digits - 1);
  const more = value.toExponential(digits);
  const [mantissa, exponent] = more.split('e') as [string, string];
  const is_half =
    mantissa.endsWith('5') &&
    Number(more) === value &&
    /^0*$/.test(value.toExponential(100).split('e')[0].slice(mantissa.length));
  if (!is_half) {
    return rounded;
  }
  const down = mantissa.slice(0, -1);
  return Number(down.at(-1)) % 2 === 0 ? `${down}e${exponent}` : rounded;
}

function readsBack(value: number, digits: number): boolean {
  SCRATCH[0] = Number(value.toPrecision(digits));
  return SCRATCH[0] === value;
}

/** 1/1024 Pa as Pa with four decimals, half to even as printf has it. */
export function pressureText(q10: number): string {
  const sign = q10 < 0 ? '-' : '';
  const size = Math.abs(q10);
  // q10 / 1024 in units of 1e-4 Pa: 10000 / 1024 = 625 / 64
  const scaled = size * 625;
  let units = Math.floor(scaled / 64);
  const rest = scaled - units * 64;
  units += rest > 32 || (rest === 32 && units % 2 === 1) ? 1 : 0;
  const whole = Math.floor(units / 10000);
  return `${sign}${whole}.${String(units - whole * 10000).padStart(4, '0')}`;
}

export function centiText(centi: number): string {
  const size = Math.abs(centi);
  const whole = Math.floor(size / 100);
  return `${centi < 0 ? '-' : ''}${whole}.${String(size - whole * 100).padStart(2, '0')}`;
}

/** Of the computer's clock, to the millisecond. */
export function utcText(ms: number): string {
  return new Date(ms).toISOString();
}

/** A number as std::from_chars reads all of the text: decimal, no blanks, finite. NaN: it is none. */
export function numberOf(text: string): number {
  return /^-?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(text) ? Number(text) : NaN;
}
