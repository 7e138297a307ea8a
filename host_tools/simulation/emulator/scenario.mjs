/**
 * What the sensors feel over time, from a CSV file.
 *
 *     # fingertip-scenario 1
 *     # key: value                     name, ambient_Pa (101325), temperature_degC (25), sensors (15), ...
 *     t_s,contact,x_mm,y_mm,force_N,p0_Pa,sigma_mm,slip,s0_Pa,...,s14_Pa[,Qx_N,Qy_N][,temperature_degC]
 *     0,0,0,0,0,0,0,0,0,...
 *
 * Rows have strictly increasing t_s >= 0; s<k>_Pa is the pressure on sensor k above ambient, at most 1e7 Pa to either side. The last line
 * ends with a newline: a file without it was cut off and is refused. Between rows everything is linear, before the first and after the last
 * it holds. contact .. slip and Qx_N, Qy_N are the truth to judge the answer by, and are not used here. Time 0 is power-on.
 */
import { InputError, readText } from './errors.mjs';

/** Far above what a sensor takes, far below what its arithmetic cannot hold. */
const PRESSURE_LIMIT_Pa = 1e7;
const TRUTH = ['contact', 'x_mm', 'y_mm', 'force_N', 'p0_Pa', 'sigma_mm', 'slip'];
/** After the sensors, in any order. */
const OPTIONAL = ['Qx_N', 'Qy_N', 'temperature_degC'];

export class Scenario {
  constructor(metadata, times_s, pressures_Pa, temperatures_degC) {
    this.metadata = metadata;
    this.times_s = times_s;
    this.pressures_Pa = pressures_Pa;
    this.temperatures_degC = temperatures_degC;
    this.sensors = pressures_Pa[0].length;
    this.ambient_Pa = Number(metadata.ambient_Pa ?? 101325);
    this.at = 0;
  }

  get end_s() {
    return this.times_s.at(-1);
  }

  /** One more row, above ambient; the temperature stays. */
  add(t_s, pressures_Pa) {
    this.times_s.push(t_s);
    this.pressures_Pa.push(Float64Array.from(pressures_Pa));
    this.temperatures_degC.push(this.temperatures_degC.at(-1));
  }

  /** Absolute pressure and temperature at one sensor. */
  at_ns(sensor, t_ns) {
    const t = t_ns / 1e9;
    const times = this.times_s;
    let i = this.at;
    while (i > 0 && times[i] > t) i -= 1;
    while (i + 1 < times.length && times[i + 1] <= t) i += 1;
    this.at = i;
    const isBetween = i + 1 < times.length && t > times[i];
    const f = isBetween ? (t - times[i]) / (times[i + 1] - times[i]) : 0;
    const j = isBetween ? i + 1 : i;
    const mix = (a, b) => a + (b - a) * f;
    return {
      pressure_Pa: this.ambient_Pa + mix(this.pressures_Pa[i][sensor], this.pressures_Pa[j][sensor]),
      temperature_degC: mix(this.temperatures_degC[i], this.temperatures_degC[j]),
    };
  }
}

/** At rest; its rows come while it is in use. */
export const restOf = (sensors) => new Scenario({}, [0], [new Float64Array(sensors)], [25]);

export function parseScenario(text, file) {
  const fail = (line, message) => {
    throw new InputError(`${file}:${line}: ${message}`);
  };
  const lines = text.split(/\r?\n/);
  const version = /^#\s*fingertip-scenario\s+(\S+)\s*$/.exec(lines[0] ?? '');
  if (!version) fail(1, 'not a scenario; the first line must be "# fingertip-scenario 1"');
  if (version[1] !== '1') fail(1, `scenario version ${version[1]} is unknown; this emulator reads version 1`);

  if (!text.endsWith('\n')) fail(lines.length, 'the file ends within a line, so its end is missing; write it again');

  const metadata = {};
  let header = null;
  const times_s = [];
  const pressures_Pa = [];
  const temperatures_degC = [];
  let sensors = 0;
  let temperatureAt = -1;
  lines.forEach((line, index) => {
    const number = index + 1;
    if (index === 0 || line.trim() === '') return;
    if (line.startsWith('#')) {
      const pair = /^#\s*([A-Za-z0-9_]+)\s*:\s*(.*?)\s*$/.exec(line);
      if (pair && !header) metadata[pair[1]] = pair[2];
      return;
    }
    const cells = line.split(',').map((c) => c.trim());
    if (!header) {
      header = cells;
      sensors = Number(metadata.sensors ?? 15);
      if (!Number.isInteger(sensors) || sensors < 1 || sensors > 36)
        fail(number, `metadata "sensors" is "${metadata.sensors}"; give a whole number from 1 to 36`);
      for (const key of ['ambient_Pa', 'temperature_degC']) {
        if (metadata[key] !== undefined && !Number.isFinite(Number(metadata[key] || NaN)))
          fail(number, `metadata "${key}" is "${metadata[key]}"; give a number`);
      }
      if (Math.abs(metadata.ambient_Pa ?? 0) > PRESSURE_LIMIT_Pa)
        fail(number, `metadata "ambient_Pa" is "${metadata.ambient_Pa}"; give at most 1e7 Pa`);
      const expected = ['t_s', ...TRUTH, ...Array.from({ length: sensors }, (_, k) => `s${k}_Pa`)];
      const wrong = expected.findIndex((name, i) => cells[i] !== name);
      if (wrong >= 0) fail(number, `column ${wrong + 1} is "${cells[wrong] ?? ''}"; expected "${expected[wrong]}"`);
      cells.slice(expected.length).forEach((name, i, more) => {
        if (!OPTIONAL.includes(name) || more.indexOf(name) !== i)
          fail(number, `column ${expected.length + i + 1} is "${name}"; after the sensors there may be, once each: ${OPTIONAL.join(', ')}`);
      });
      temperatureAt = cells.indexOf('temperature_degC');
      return;
    }
    if (cells.length !== header.length) fail(number, `${cells.length} columns; the header has ${header.length}`);
    const values = cells.map((cell, i) => {
      const value = cell === '' ? NaN : Number(cell);
      if (!Number.isFinite(value)) fail(number, `column "${header[i]}" is "${cell}"; give a finite number`);
      return value;
    });
    const [t] = values;
    if (t < 0) fail(number, `t_s is ${t}; time starts at 0`);
    if (times_s.length && t <= times_s.at(-1)) fail(number, `t_s ${t} does not increase (previous row: ${times_s.at(-1)})`);
    values.slice(1 + TRUTH.length, 1 + TRUTH.length + sensors).forEach((value, k) => {
      if (Math.abs(value) > PRESSURE_LIMIT_Pa) fail(number, `column "s${k}_Pa" is ${value}; give at most 1e7 Pa`);
    });
    times_s.push(t);
    pressures_Pa.push(Float64Array.from(values.slice(1 + TRUTH.length, 1 + TRUTH.length + sensors)));
    temperatures_degC.push(temperatureAt >= 0 ? values[temperatureAt] : Number(metadata.temperature_degC ?? 25));
  });
  if (!header) fail(lines.length, 'no header line; add "t_s,contact,x_mm,..."');
  if (!times_s.length) fail(lines.length, 'no rows; add at least one');
  return new Scenario(metadata, times_s, pressures_Pa, temperatures_degC);
}

export const readScenario = (file) => parseScenario(readText(file, 'scenario'), file);
