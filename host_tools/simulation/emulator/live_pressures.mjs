/** What the sensors of a board feel, set while it runs: one row for the end of each slice of emulated time. */
const AMBIENT_Pa = 101325;
const TEMPERATURE_degC = 25;

export class LivePressures {
  /** @param slice_ns length of a slice; at 0 there is no pressure */
  constructor(sensors, slice_ns) {
    this.slice_ns = slice_ns;
    this.rows = [new Float64Array(sensors)];
  }

  /** Above ambient, Pa, at the end of the slice after the last that was set. */
  add(pressures_Pa) {
    this.rows.push(Float64Array.from(pressures_Pa));
  }

  /** Absolute pressure and temperature at one sensor: linear within a slice, after the last row that row. */
  at_ns(sensor, t_ns) {
    const at = Math.min(t_ns / this.slice_ns, this.rows.length - 1);
    const before = Math.min(Math.floor(at), Math.max(this.rows.length - 2, 0));
    const after = Math.min(before + 1, this.rows.length - 1);
    const [a, b] = [this.rows[before][sensor], this.rows[after][sensor]];
    return { pressure_Pa: AMBIENT_Pa + a + (b - a) * (at - before), temperature_degC: TEMPERATURE_degC };
  }
}
