"""Recordings of real barometric strips: four MPL3115A2 in a line, 6 mm apart, under moulded rubber, pressed at known locations along the line.

Imperial College London, 2023, JiannnH/MTL-BaroTactileSensor, Data_collection. They are not part of this project. A row holds the sensors' absolute
pressures, the stage's location along the strip and its depth in steps, and the time; there are about 17 rows a second. There is no force: the depth
shows a touch.
"""

import pathlib
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from fingertip.files import InputError
from fingertip.line import Flag
from measure import q10, round_half_away

SENSORS, PITCH_mm, STEPS_PER_mm = 4, 6.0, 1000.0
PRESSURE_Pa = (30e3, 400e3)
NOISE_Pa = 6.0  # of the recordings themselves
RATES = ((57.0, 2.0), (315.0, 4.0), (1308.0, 11.0))  # frames per second and noise of OSR 8192, 1024 and 256
# What a touch is. Depths are shares of the recording's deepest, or of the hold's.
DEEPEST, FREE_DEPTH, OUT_DEPTH, RETURN_DEPTH = 0.98, 0.45, 0.3, 0.5
HOLD_LEAST_s, ZERO_s, AFTER_LEAVING_s, ABOVE_TOUCH = 0.2, 1.0, 0.3, 0.97
ZERO_ROWS, PEAK_ROWS, PEAK_LEAST_Pa, TOUCHED = 5, 3, 3000.0, 0.03
JUDGED_FROM_s, GAP_MAX_s = 4.0, 0.3
LOCATED_LEAST_Pa = 500.0
RESPONDS_Pa = 3000.0  # somewhere in the recording, or the sensor counts as dead
RESPONSE_FROM = 0.3  # of a sensor's largest reading: lower ones show lobes and zeros rather than its response
AHEAD_mm = 1.0  # a sensor up to this far past the last press was pressed from both sides
WIDTHS_mm = (0.1, 0.25, 0.35, 0.5, 1.0, 2.0)  # of the prior on sigma
WORST = ("phantom_percent", "phantom_longest_s", "held_missed", "held_doubted_percent")


class Strip:
    """One recording. free [row]: nothing touches for certain; a row that is neither free nor in a hold may be either. holds: (first, last) row."""

    def __init__(self, path):
        self.name = path.name
        rows = []
        for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
            try:
                rows.append([float(cell) for cell in line.split(",")])
            except ValueError:
                continue  # the header, or damage
        table = np.array([row for row in rows if len(row) == SENSORS + 3 and np.isfinite(row).all()]).reshape(-1, SENSORS + 3)
        table = table[((table[:, :SENSORS] > PRESSURE_Pa[0]) & (table[:, :SENSORS] < PRESSURE_Pa[1])).all(axis=1)]
        if len(table) < 2:
            raise InputError(f"{path} has no rows of four pressures, x, z and time")
        self.pressure_Pa, self.x_mm, self.depth, self.t_s = table[:, :SENSORS], table[:, 4] / STEPS_PER_mm, table[:, 5], table[:, 6]
        self.full = self.depth >= DEEPEST * self.depth.max()
        self.free = self.depth < FREE_DEPTH * self.depth.max()
        self.holds = [hold for hold in self.plateaus() if self.is_hold(*hold)]
        for first, last in self.holds:
            self.free[first : last + 1] = False

    def plateaus(self):
        """Rows of one depth near the deepest, for long enough."""
        if self.depth.max() <= 0.0:
            return
        begins = np.concatenate([[0], np.flatnonzero(np.diff(self.depth)) + 1, [len(self.depth)]])
        for first, last in zip(begins[:-1], begins[1:] - 1):
            if self.full[first] and self.t_s[last] - self.t_s[first] >= HOLD_LEAST_s:
                yield first, last

    def is_hold(self, first, last):
        """Whether a sensor responds to the plateau. If so, the rows after it are free from when the stage has gone up past where the strongest sensor
        first responded."""
        depth = self.depth[first]
        above, out = np.flatnonzero(self.depth[:first] < OUT_DEPTH * depth), np.flatnonzero(self.depth[last:] < OUT_DEPTH * depth)
        if not len(above) or not len(out):
            return False
        down, out = above[-1], last + out[0]
        returns = np.flatnonzero(self.depth[out + 1 :] >= RETURN_DEPTH * depth)
        again = out + returns[0] if len(returns) else len(self.depth) - 1
        quiet = (self.t_s > self.t_s[down] - ZERO_s) & (self.t_s <= self.t_s[down])
        if np.count_nonzero(quiet) < ZERO_ROWS:
            return False
        above_zero_Pa = self.pressure_Pa - np.median(self.pressure_Pa[quiet], axis=0)
        peaks_Pa = above_zero_Pa[max(first - PEAK_ROWS, 0) : first + PEAK_ROWS + 1].max(axis=0)
        strongest = peaks_Pa.argmax()
        touched = np.flatnonzero(above_zero_Pa[down : first + 1, strongest] > TOUCHED * peaks_Pa[strongest])
        if peaks_Pa[strongest] < PEAK_LEAST_Pa or not len(touched):
            return False
        touch_depth = self.depth[down + touched[0]]
        left = np.flatnonzero(self.depth[last:] <= touch_depth)
        if not len(left):
            return False
        between = (self.t_s >= self.t_s[last + left[0]] + AFTER_LEAVING_s) & (self.t_s < self.t_s[again])
        self.free |= between & (self.depth < ABOVE_TOUCH * touch_depth)
        return True

    def gate(self, firmware, frames_per_s, noise_Pa):
        """The strip at another rate, frames between the rows and with noise, through the firmware's gate."""
        late_s = np.maximum.accumulate(self.t_s)
        t_s = np.arange(self.t_s[0], late_s[-1] + 1e-9, 1.0 / frames_per_s)
        row = np.maximum(np.searchsorted(late_s, t_s), 1)
        before, gap_s = self.t_s[row - 1], self.t_s[row] - self.t_s[row - 1]
        share = np.clip(np.divide(t_s - before, gap_s, out=np.zeros(len(t_s)), where=gap_s > 0.0), 0.0, 1.0)[:, None]
        pressure_Pa = self.pressure_Pa[row - 1] + share * (self.pressure_Pa[row] - self.pressure_Pa[row - 1])
        pressure_Pa += noise_Pa * firmware.random(1, int(frames_per_s), [0]).normal(pressure_Pa.size).reshape(pressure_Pa.shape)
        contact, doubtful, *_ = conditioned(firmware, t_s - t_s[0], pressure_Pa, noise_Pa)
        last = np.searchsorted(t_s, late_s[1:], side="right") - 1  # frame at each row from the second on
        contact, doubtful = contact[last], doubtful[last]
        certain, step_s = contact & ~doubtful, np.clip(np.diff(self.t_s), 0.0, GAP_MAX_s)
        judged = self.free[1:] & (self.t_s[1:] > JUDGED_FROM_s)
        phantom_s = np.cumsum(np.where(certain, step_s, 0.0)[judged])
        run_s = phantom_s - np.maximum.accumulate(np.where(certain[judged], 0.0, phantom_s))
        held = [slice(max(first, 1) - 1, last) for first, last in self.holds]
        held_s = sum(step_s[hold].sum() for hold in held)
        free_s = step_s[judged].sum()
        share_of = lambda part_s, whole_s: 100.0 * part_s / whole_s if whole_s > 0.0 else 0.0
        return {
            "name": self.name,
            "frames_per_s": frames_per_s,
            "free_rows": int(np.count_nonzero(self.free)),
            "free_s": float(free_s),
            "holds": len(self.holds),
            "phantom_percent": share_of(step_s[judged & certain].sum(), free_s),
            "phantom_longest_s": float(run_s.max(initial=0.0)),
            "doubted_percent": share_of(step_s[judged & doubtful].sum(), free_s),
            "held_doubted_percent": share_of(sum(step_s[hold][(contact & doubtful)[hold]].sum() for hold in held), held_s),
            "held_missed": int(sum(step_s[hold][certain[hold]].sum() < 0.5 * step_s[hold].sum() for hold in held)),
        }


def conditioned(firmware, t_s, pressure_Pa, noise_Pa):
    """What the firmware's condition makes of frames: contact, doubtful, usable [frame], and pressures [frame][sensor] above the zeros, 1/1024 Pa."""
    readings = q10(pressure_Pa)
    flags, usable, above = np.zeros(len(t_s), np.uint8), np.zeros(len(t_s), np.uint64), np.zeros_like(readings)
    firmware.call("gate_series", noise_Pa, (1e6 * (1.0 + t_s)).astype(np.uint64), readings, flags, usable, above, np.zeros(0, np.int32))
    return flags & 1 > 0, flags & 2 > 0, usable, above


def response_of(x_mm, full, pressure):
    """(location, sigma) of one sensor: the logarithm of its readings of presses that move along the strip is a parabola. None if there is none."""
    if pressure.max(initial=0) < 1024 * RESPONDS_Pa:
        return None
    used = full & (pressure >= RESPONSE_FROM * pressure.max())
    x_mm = x_mm[used]
    if len(np.unique(x_mm)) < 3:
        return None
    square, slope, _ = np.polyfit(x_mm, np.log(pressure[used]), 2)
    at_mm = -0.5 * slope / square
    if not (square < 0.0 and x_mm.min() - AHEAD_mm <= at_mm <= x_mm.max() + AHEAD_mm):
        return None
    return at_mm, np.sqrt(-0.5 / square)


class Presses:
    """Contacts without a doubt above 500 Pa and between two neighbours that respond; their error along the line.

    One constant of the recording is subtracted: the strip's location under the stage. The prior on sigma is the width of the strip's response to other
    presses of it, those of every other millimetre, as a calibration would find it. Strips differ (1.9 to 2.5 mm).
    """

    def __init__(self, firmware, strip):
        self.firmware = firmware
        contact, doubtful, usable, pressure = conditioned(firmware, strip.t_s - strip.t_s[0], strip.pressure_Pa, NOISE_Pa)
        bits = np.uint64(1) << np.arange(SENSORS, dtype=np.uint64)
        strong = np.where(usable[:, None] & bits, pressure, 0).max(axis=1) >= 1024 * LOCATED_LEAST_Pa
        used = contact & ~doubtful & strong
        x_mm, full, pressure = strip.x_mm[used], strip.full[used], pressure[used]
        odd = round_half_away(x_mm).astype(int) % 2 != 0
        responses = lambda which: [response_of(x_mm[which], full[which], pressure[which, k]) for k in range(SENSORS)]
        sigma_of = lambda found: np.median([one[1] for one in found if one] or [np.nan])
        of_all = responses(np.ones(len(x_mm), bool))
        self.sigma_mm = sigma_of(of_all)
        # The prior of each press is from the presses of the other kind.
        of_even_mm, of_odd_mm = sigma_of(responses(~odd)), sigma_of(responses(odd))
        between = np.zeros(len(x_mm), bool)
        for low, high in zip(of_all[:-1], of_all[1:]):
            if low and high:
                between |= (x_mm >= low[0]) & (x_mm <= high[0])
        self.x_mm, self.pressure, self.usable = x_mm[between], pressure[between], usable[used][between]
        self.own_prior_mm = np.where(odd, of_even_mm, of_odd_mm)[between]

    def median_error_mm(self, prior_mm, width_mm):
        settings = self.firmware.settings(len(self.x_mm), noise_Pa=NOISE_Pa, gain_sd=0.0, model_sd=0.0)
        settings["prior_sigma_mm"], settings["prior_width_mm"] = prior_mm, width_mm
        array = self.firmware.array(PITCH_mm * np.arange(SENSORS), np.zeros(SENSORS), PITCH_mm)
        found = self.firmware.fit(array, settings, self.pressure, self.usable)
        valid = found["flags"] & Flag.FIT_VALID > 0
        if not valid.any():
            return np.nan
        error_mm = found["x_mm"][valid].astype(float) - self.x_mm[valid]
        return float(np.median(np.abs(error_mm - np.median(error_mm))))


def locations(firmware, strips):
    """Where the sigma is that of other strips the location is worse (median_by_others_mm). The other recordings choose how wide the prior is."""
    presses = [Presses(firmware, strip) for strip in strips]
    by_width = np.array(
        [[one.median_error_mm(one.own_prior_mm, width) if len(one.x_mm) else np.nan for width in WIDTHS_mm] for one in presses]
    )
    sigmas_mm = np.array([one.sigma_mm for one in presses])
    for i, (strip, one) in enumerate(zip(strips, presses)):
        row = {"name": strip.name, "fits": len(one.x_mm)}
        if row["fits"]:
            others = np.arange(len(strips)) != i
            width = int(np.nansum(by_width[others], axis=0).argmin())
            sigma_mm = float(np.mean(sigmas_mm[others & np.isfinite(sigmas_mm)])) if np.isfinite(sigmas_mm[others]).any() else np.nan
            row |= {
                "sigma_mm": float(one.sigma_mm),
                "prior_width_mm": WIDTHS_mm[width],
                "median_mm": float(by_width[i, width]),
                "others_sigma_mm": sigma_mm,
                "median_by_others_mm": one.median_error_mm(sigma_mm, WIDTHS_mm[width]),
                "median_without_prior_mm": one.median_error_mm(0.0, 0.0),
            }
        yield row


def read(folder):
    if not pathlib.Path(folder).is_dir():
        raise InputError(f"{folder} is no folder")
    return [Strip(path) for path in sorted(pathlib.Path(folder).glob("*.csv"))]


def judge(firmware, folder):
    """Figures of the recordings in a folder, None where there are none."""
    keys = [f"real_{name}" + ("_worst" if name.endswith("percent") else "") for name in WORST]
    found = dict.fromkeys([*keys, "real_median_mm_worst_test", "real_median_mm_worst_other"])
    strips = read(folder) if folder else []
    if not strips:
        return found
    with ThreadPoolExecutor(2) as pool:
        rows = list(pool.map(lambda job: job[0].gate(firmware, *job[1]), [(strip, rate) for strip in strips for rate in RATES]))
    for key, name in zip(keys, WORST):
        found[key] = (sum if name == "held_missed" else max)(row[name] for row in rows)
    located = list(locations(firmware, strips))
    for kind in ("test", "other"):
        medians = [row["median_mm"] for row in located if row["fits"] and row["name"].startswith("test_") == (kind == "test")]
        found[f"real_median_mm_worst_{kind}"] = max(medians, default=None)
    return found | {"strips": rows, "locations": located}
