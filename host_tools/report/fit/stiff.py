#!/usr/bin/python3
"""What the firmware reports about presses that are hard, extreme, or none at all.

    stiff.py --build build/host -o build/report [--limit N] [--check] [--picture host_tools/report/fit/stability.png]

Each case draws presses, turns them into frames of absolute readings and runs them through the firmware's own chain: tare and gate (condition), fit
(fit_gaussian, with the build's number of iterations), flags (contact). Only what the scan adds to a frame is restated here: the mark of a reading beyond
the sensor's range, and saturation to int32.

A warning is UNCERTAIN, MODEL, FLAT, AT_BOUND, LOW_SIGNAL, FORCE_LOWER_BOUND, no contact or no fit. The firmware has the true settings: gains are exact where
the case does not spread them. Bad means more than 1 mm from the truth, and any location where there is none to find; of two contacts the truth is the
centroid of force. stability.png has the error of other kernels beside that of this chain, along one quantity at a time: in presses of sigma 6 mm, or as
its axis is labelled. --check: exit status 1 if a result is not finite, or if more than 1.3 % of a case are bad and carry no warning (6 % where a prior is wrong).
"""

import pathlib
import sys
from types import SimpleNamespace

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools" / part) for part in ("report/shared", "report/measure", "python")]
import presses  # noqa: E402
from errors import BAD_mm, BUILT_ITERATIONS, USUAL_ITERATIONS, VALID, quantile
from errors import WARNINGS as FIT_WARNINGS
from fingertip.command import run_tool  # noqa: E402
from fingertip.line import Flag  # noqa: E402
from measure import Measure, round_half_away, stream_of  # noqa: E402
from presentation import BLUE, GOAL, INK, ORANGE, plt, save, tidy  # noqa: E402
from reporting import option_parser, output_folder, write_json  # noqa: E402

SEED = 20221015
ATMOSPHERE_Pa, NOISE_Pa = 101325.0, 5.0
# A warning means a standard deviation above 0.6 mm, which one touch in fifty exceeds twice over.
BAD_UNFLAGGED_MAX, BAD_UNFLAGGED_MAX_WRONG_PRIOR = 0.013, 0.06
FLAGS = "CONTACT FIT_VALID LOW_SIGNAL FLAT UNCERTAIN MODEL SATURATED FORCE_LOWER_BOUND SENSOR_MASKED AT_BOUND ELONGATED".split()
WARNINGS = FIT_WARNINGS | np.uint32(Flag.FORCE_LOWER_BOUND)
HALF_X_mm, HALF_Y_mm = 9.0, 18.0
USUAL_SIGMA_mm, USUAL_P0_Pa = (3.0, 20.0), (1e3, 9e4)
UNIT_Pa = 1 / 1024


class Presses(SimpleNamespace):
    """One for each state of `random`: pressure_Pa [press, sensor] above the atmosphere, x_mm, y_mm; what a case does not change is as here."""

    located = True  # whether there is a location to find
    dead = np.uint64(0)  # bitmap of sensors without a reading
    limited_range = True  # the sensor's; without it, scale is the only thing that grows
    prior_sigma_mm = 0.0  # of a prior with a standard deviation of 0.5 mm; 0: none
    gain_sd = 0.0  # as the firmware has it
    noise_Pa = NOISE_Pa  # the same

    def with_noise(self, random, rms_Pa=NOISE_Pa):
        self.pressure_Pa = self.pressure_Pa + rms_Pa * random.normal(self.pressure_Pa.shape[1])
        return self

    def but(self, **changed):
        self.__dict__.update(changed)
        return self


def drawn(random, low_high):
    low, high = low_high
    return np.full(len(random.states), low) if low == high else random.log_uniform(low, high)


def gaussian_at(layout, random, x_mm, y_mm, sigma_mm=USUAL_SIGMA_mm, p0_Pa=USUAL_P0_Pa):
    sigma_mm, p0_Pa = drawn(random, sigma_mm), drawn(random, p0_Pa)
    return Presses(x_mm=x_mm, y_mm=y_mm, pressure_Pa=presses.gaussian_Pa(layout.x_mm, layout.y_mm, x_mm, y_mm, sigma_mm, p0_Pa))


def on_array(layout, random):
    return tuple(random.uniform(-half, half) for half in (layout.x_mm.max(), layout.y_mm.max()))


def inside(sigma_mm=USUAL_SIGMA_mm, p0_Pa=USUAL_P0_Pa, noise=True, **changed):
    def case(layout, random):
        made = gaussian_at(layout, random, *on_array(layout, random), sigma_mm, p0_Pa).but(**changed)
        return made.with_noise(random) if noise else made

    return case


def outside(corner, by_mm):
    """Past one edge, or past two (a corner)."""

    def case(layout, random):
        x_mm, y_mm = on_array(layout, random)
        past_x = np.full(len(x_mm), True) if corner else random.below(2) == 1
        past_y = np.full(len(x_mm), True) if corner else ~past_x
        for at, half, past in ((x_mm, HALF_X_mm, past_x), (y_mm, HALF_Y_mm, past_y)):
            at[past] = np.copysign(half + random.uniform(*by_mm, of=past)[past], at[past])
        return gaussian_at(layout, random, x_mm, y_mm).with_noise(random)

    return case


def everywhere(p0_Pa, sign, noise_Pa):
    """Every reading the same, but for noise where the firmware expects 5 Pa."""

    def case(layout, random):
        pressure_Pa = np.repeat(sign * drawn(random, p0_Pa)[:, None], len(layout.x_mm), axis=1)
        return Presses(pressure_Pa=pressure_Pa, located=False).with_noise(random, noise_Pa)

    return case


def suction(layout, random):
    made = inside()(layout, random)
    return made.but(pressure_Pa=-made.pressure_Pa, located=False)


def offset(offset_Pa, one_sensor):
    def case(layout, random):
        made = inside()(layout, random)
        chosen = random.below(presses.SENSORS)
        made.pressure_Pa += np.where(chosen[:, None] == np.arange(presses.SENSORS), offset_Pa, 0.0 if one_sensor else offset_Pa)
        return made

    return case


def gain_spread(spread):
    def case(layout, random):
        made = inside(noise=False)(layout, random).but(gain_sd=layout.measure.constants["default_gain_sd"])
        made.pressure_Pa *= 1 + spread * random.uniform(-1, 1, presses.SENSORS)
        return made.with_noise(random)

    return case


def dead(alive, peak):
    def case(layout, random):
        made = inside()(layout, random)
        if peak:
            return made.but(dead=np.uint64(1) << made.pressure_Pa.argmax(axis=1).astype(np.uint64))
        return made.but(dead=presses.ALL & ~random.some_of(presses.SENSORS, alive))

    return case


def two_contacts(apart_mm):
    def case(layout, random):
        sigma_mm, first_Pa = random.log_uniform(4, 8), random.log_uniform(1e3, 3e4)
        second_Pa = first_Pa * random.log_uniform(0.3, 3)
        at = np.zeros((4, len(sigma_mm)))
        left = np.arange(len(sigma_mm))
        while len(left):
            angle, apart = random.uniform(0, 2 * np.pi, of=left)[left], random.uniform(*apart_mm, of=left)[left]
            x, y = (random.uniform(-half, half, of=left)[left] for half in (HALF_X_mm, HALF_Y_mm))
            at[:, left] = x, y, x + apart * np.cos(angle), y + apart * np.sin(angle)
            left = left[(np.abs(at[2, left]) > HALF_X_mm) | (np.abs(at[3, left]) > HALF_Y_mm)]
        share = second_Pa / (first_Pa + second_Pa)
        both_Pa = (presses.gaussian_Pa(layout.x_mm, layout.y_mm, *of, sigma_mm, Pa) for of, Pa in ((at[:2], first_Pa), (at[2:], second_Pa)))
        middle_mm = (1 - share) * at[:2] + share * at[2:]
        return Presses(x_mm=middle_mm[0], y_mm=middle_mm[1], pressure_Pa=sum(both_Pa)).with_noise(random)

    return case


def of_layer(set_, prior_sigma_mm=0.0):
    def case(layout, random):
        seeds = random.bits()
        made = presses.redraw(layout.measure, set_, layout.measure.random(seeds, presses.SETS.index(set_), np.zeros(len(seeds), int)))
        return Presses(
            limited_range=False,
            prior_sigma_mm=prior_sigma_mm,
            **{name: getattr(made, name) for name in ("x_mm", "y_mm", "noise_Pa", "pressure_Pa")},
        )

    return case


def checkerboard(layout, random):
    odd = round_half_away((layout.x_mm + layout.y_mm) / layout.pitch_mm).astype(int) % 2 != 0
    return Presses(pressure_Pa=np.where(odd, random.log_uniform(1e3, 9e4)[:, None], 0.0), located=False).with_noise(random)


def in_steps(layout, random):
    """The least that the gate passes, in steps far coarser than the noise."""
    made = inside((4, 15), (200, 2000))(layout, random)
    return made.but(pressure_Pa=20.0 * round_half_away(made.pressure_Pa / 20.0))


CASES = {
    "inside": inside(),
    "past an edge by 0..9 mm": outside(False, (0, 9)),
    "past an edge by 9..30 mm": outside(False, (9, 30)),
    "past a corner by 0..6 mm": outside(True, (0, 6)),
    "past a corner by 6..30 mm": outside(True, (6, 30)),
    **{f"sigma {mm:g} mm": inside((mm, mm)) for mm in (0.5, 1, 2, 3)},
    "sigma 2 mm, prior 2": inside((2, 2), prior_sigma_mm=2),
    "sigma 3 mm, prior 3.3": inside((3, 3), prior_sigma_mm=3.3),
    **{f"sigma {low}..{high} mm": inside((low, high)) for low, high in ((15, 30), (30, 50), (50, 200))},
    "all equal": everywhere(USUAL_P0_Pa, 1, 0),
    "all equal and noise": everywhere(USUAL_P0_Pa, 1, NOISE_Pa),
    "suction": everywhere((1e2, 9e4), -1, NOISE_Pa),
    "suction, Gaussian": suction,
    "nothing": everywhere((1, 1), 0, 0),
    "noise only": everywhere((1, 1), 0, NOISE_Pa),
    "noise ten times the expected": everywhere((1, 1), 0, 10 * NOISE_Pa),
    "noise a thousand times the expected": everywhere((1, 1), 0, 1000 * NOISE_Pa),
    "checkerboard": checkerboard,
    "offset +500 Pa on all": offset(500, False),
    "offset -500 Pa on all": offset(-500, False),
    "offset +500 Pa on one": offset(500, True),
    "outlier +10 kPa": offset(1e4, True),
    "outlier -10 kPa": offset(-1e4, True),
    "gains within 10 %": gain_spread(0.1),
    "readings in steps of 20 Pa": in_steps,
    "a few units of 1/1024 Pa": inside(p0_Pa=(20 * UNIT_Pa, 40 * UNIT_Pa), noise=False, noise_Pa=UNIT_Pa),
    "p0 1 Pa": inside(p0_Pa=(1, 1)),
    **{f"p0 {n} noise": inside(p0_Pa=(n * NOISE_Pa, n * NOISE_Pa)) for n in (5, 10, 20, 50)},
    "p0 1.5 MPa, no end of range": inside((4, 12), (1.5e6, 1.5e6), limited_range=False),
    "p0 10 MPa, masked beyond 2 bar": inside((4, 12), (1e7, 1e7)),
    "p0 100..400 kPa, masked beyond 2 bar": inside((4, 12), (1e5, 4e5)),
    "p0 0.4..10 MPa, masked beyond 2 bar": inside((4, 12), (4e5, 1e7)),
    "dead sensor": dead(14, False),
    "dead peak sensor": dead(14, True),
    **{f"{n} sensor{'s' * (n > 1)} left": dead(n, False) for n in (8, 5, 4, 3, 1)},
    "two sensors in each place": inside(),
    **{f"two contacts {low}..{high} mm apart": two_contacts((low, high)) for low, high in ((0, 9), (9, 18), (18, 36))},
    "layer 12 mm": of_layer("C"),
    "layer 6 mm": of_layer("D"),
    "layer 6 mm, prior 3.2": of_layer("D", 3.2),
    "layer 6 mm, prior 3.8": of_layer("D", 3.8),
}
WRONG_PRIOR = {"layer 6 mm, prior 3.8"}
IN_PAIRS = {"two sensors in each place"}  # the first seven places of the array twice


def saturated_q10(pressure_Pa):
    return np.clip(round_half_away(1024.0 * np.asarray(pressure_Pa)), -(2**31), 2**31 - 1).astype(np.int64)


def frames_of(measure, pressure_Pa, made):
    """[press, 1]"""
    frames = measure.made("frame", len(pressure_Pa), 1)
    sensors = pressure_Pa.shape[1]
    bits = np.uint64(1) << np.arange(sensors, dtype=np.uint64)
    alive = (np.broadcast_to(made.dead, len(pressure_Pa))[:, None] & bits) == 0
    absolute = np.where(alive, saturated_q10(ATMOSPHERE_Pa + pressure_Pa), 0)
    frames["sensor_count"], frames["noise_Pa_q10"][:, 0] = sensors, np.maximum(1, saturated_q10(made.noise_Pa))
    frames["valid"][:, 0] = (bits * alive).sum(axis=1)
    frames["saturated"][:, 0] = (
        (bits * (absolute > measure.constants["sensor_max_pressure_Pa"] * 1024)).sum(axis=1) if made.limited_range else 0
    )
    frames["pressure_Pa_q10"][:, 0, :sensors] = absolute
    return frames


def row_of(measure, layout, name, case, limit, others=lambda *_: {}):
    """others(made, settings, frames): more of its figures."""
    random = measure.random(SEED, stream_of(name), np.arange(limit))  # a case of its own draws what it draws among the others
    made = case(layout, random)
    settings = measure.settings(
        limit, gain_sd=made.gain_sd, prior_sigma_mm=made.prior_sigma_mm, prior_width_mm=0.5 if made.prior_sigma_mm else 0.0
    )
    quiet = Presses(pressure_Pa=np.zeros((measure.constants["zero_tare_frames"], len(layout.x_mm))))
    before = frames_of(measure, quiet.pressure_Pa, quiet)[:, 0].copy()
    frames = frames_of(measure, made.pressure_Pa, made)
    _, fits, results = (found[:, 0] for found in measure.chain(layout.array, settings, frames, before=before))
    flags = results["flags"]
    fitted = flags & np.uint32(Flag.FIT_VALID) != 0
    error_mm = np.full(limit, np.inf)
    if made.located:
        error_mm = np.where(fitted, np.hypot(fits["x_mm"].astype(float) - made.x_mm, fits["y_mm"].astype(float) - made.y_mm), np.inf)
    warned, bad = ~fitted | (flags & WARNINGS != 0), fitted & ~(error_mm <= BAD_mm)
    finite = np.all([np.isfinite(fits[field]) for field in fits.dtype.names if fits.dtype[field].kind == "f"], axis=0)
    errors = np.sort(error_mm[np.isfinite(error_mm)])
    return {
        "case": name,
        "presses": limit,
        "fits": int(fitted.sum()),
        "not_finite": int((~finite).sum()),
        **{f"{key}_mm": quantile(errors, share) for key, share in (("p50", 0.5), ("p95", 0.95), ("worst", 1.0))},
        **{flag.lower(): float((flags & np.uint32(Flag[flag]) != 0).mean()) for flag in FLAGS},
        "bad_unflagged": float((bad & ~warned).mean()),
        "good_flagged": float((fitted & ~bad & warned).mean()),
        "warned": float(warned.mean()),
        **others(made, settings, frames[:, 0]),
    }


def layout_of(measure, places=slice(None)):
    x_mm, y_mm, pitch_mm = measure.layout()
    at = x_mm[places], y_mm[places]
    return SimpleNamespace(measure=measure, x_mm=at[0], y_mm=at[1], pitch_mm=pitch_mm, array=measure.array(*at, pitch_mm))


def measure_cases(measure, limit):
    """stiff.json"""
    plain, pairs = layout_of(measure), layout_of(measure, np.repeat(np.arange(7), 2))
    cases = [row_of(measure, pairs if name in IN_PAIRS else plain, name, case, limit) for name, case in CASES.items()]
    return {
        "seed": SEED,
        "bad_unflagged_worst": max([0.0, *(row["bad_unflagged"] for row in cases if row["case"] not in WRONG_PRIOR)]),
        "cases": cases,
    }


def pressed(force_N, sigma_mm=6.0):
    return inside((sigma_mm, sigma_mm), (1e6 * force_N / (2 * np.pi * sigma_mm**2),) * 2)


# Of stability.png. Axis: (whether it is logarithmic, values, the case of each).
SWEEPS = {
    "force, N": (True, (0.003, 0.01, 0.03, 0.1, 0.3, 1, 3, 10, 20), pressed),
    "force, N, beyond the sensors' range": (True, (20, 30, 50, 100, 200, 400, 1000, 4000), pressed),
    "width of the contact (sigma), mm": (True, (0.5, 1, 1.5, 2, 3, 5, 10, 20, 40, 80), lambda mm: inside((mm, mm))),
    "gains apart, +- %, not calibrated": (False, (0, 2, 5, 10, 15, 20, 30, 40), lambda percent: gain_spread(percent / 100)),
    "past the outer sensors, mm": (False, (-9, -6, -3, 0, 2, 4, 6, 9, 12), lambda mm: outside(False, (mm, mm))),
    "sensors missing": (False, (0, 1, 2, 4, 6, 8, 10, 11, 12, 13), lambda missing: dead(presses.SENSORS - missing, False)),
}
# name, line and, where it is not the firmware's, iterations
KERNELS = {
    "fit": ("firmware, fixed point", "o-", BLUE, None),
    "general": ("firmware, float32", "s:", "#0e9aa7", None),
    "naive_double": ("Gauss-Newton, double", "x-", ORANGE, USUAL_ITERATIONS),
    "lm_double": ("Levenberg-Marquardt, double", "+--", "#6f3d94", 50),
}


def measure_sweeps(measure, limit):
    layout, compared = layout_of(measure), presses.Compared(measure)

    def others(made, settings, frames):
        readings = (frames["pressure_Pa_q10"][:, : presses.SENSORS] - int(1024 * ATMOSPHERE_Pa)).astype(np.int32)
        usable, noise_Pa = frames["valid"] & ~frames["saturated"], np.full(limit, float(made.noise_Pa))
        settings["noise_Pa_q10"], settings["iterations"], errors = frames["noise_Pa_q10"], BUILT_ITERATIONS, {}
        for kernel, (*_, iterations) in KERNELS.items():
            if iterations is None:
                fits, _ = measure.timed_fit(layout.array, settings, readings, usable, kernel=kernel)
            else:
                fits, _ = compared.compare(kernel, iterations, noise_Pa, readings, usable)
            error_mm = np.hypot(fits["x_mm"].astype(float) - made.x_mm, fits["y_mm"].astype(float) - made.y_mm)
            errors[f"{kernel}_p95_mm"] = quantile(np.sort(np.nan_to_num(error_mm[fits["flags"] & VALID != 0], nan=np.inf)), 0.95)
        return errors

    rows = ((axis, at, case(at)) for axis, (_, values, case) in SWEEPS.items() for at in values)
    return [{"axis": axis, "at": at} | row_of(measure, layout, axis, case, limit, others) for axis, at, case in rows]


def draw(rows, path):
    figure, places = plt.subplots(4, 3, figsize=(13, 11), layout="constrained", height_ratios=(3, 2, 3, 2))
    for number, (axis, (is_log, values, _)) in enumerate(SWEEPS.items()):
        of = [row for row in rows if row["axis"] == axis]
        above, below = places[2 * (number // 3) : 2 * (number // 3) + 2, number % 3]
        for kernel, (name, style, colour, _) in KERNELS.items():
            off_mm = [row[f"{kernel}_p95_mm"] or np.nan for row in of]
            above.plot(values, np.clip(off_mm, 1e-3, 100), style, color=colour, ms=5, lw=1.3, label=name)
        above.set(yscale="log", ylim=(1e-3, 130))
        for key, name, colour in (("warned", "a warning, or no fit", GOAL), ("bad_unflagged", "off by 1 mm, no warning", INK)):
            below.plot(values, [100 * row[key] for row in of], "o-", color=colour, ms=4, lw=1.3, label=name)
        below.set_ylim(-4, 104)
        for axes, title, label in ((above, axis, "p95 off the truth, mm"), (below, "", "% of the presses")):
            axes.set_xscale("log" if is_log else "linear")
            tidy(axes, title, label)
            if number == 0:
                axes.legend(fontsize=8)
    figure.suptitle(
        "Where the fit ends: simulated Gaussian contacts, what is beyond 100 mm is drawn there", x=0.01, ha="left", size=12, weight="bold"
    )
    save(figure, path)


def write(measure, limit, out):
    """stiff.json and stability.png."""
    found = measure_cases(measure, limit) | {"sweeps": measure_sweeps(measure, max(200, limit // 20))}
    write_json(out / "stiff.json", found)
    draw(found["sweeps"], out / "stability.png")
    return found


def failures(found):
    for row in found["cases"]:
        most = BAD_UNFLAGGED_MAX_WRONG_PRIOR if row["case"] in WRONG_PRIOR else BAD_UNFLAGGED_MAX
        if row["not_finite"]:
            yield f"{row['case']}: {row['not_finite']} results are not finite"
        if row["bad_unflagged"] > most:
            yield f"{row['case']}: {100 * row['bad_unflagged']:.2f} % are bad and carry no warning, at most {100 * most:.1f} % may"


def main(argv):
    parser = option_parser(__doc__)
    parser.add_argument("--limit", type=int, default=8000, help="presses of each case (default: %(default)s)")
    options = parser.parse_args(argv)
    found = write(Measure(options.build), options.limit, output_folder(options))
    if options.picture:
        draw(found["sweeps"], options.picture)
    for row in found["cases"]:
        print(f"{row['case']:38s} p50 {row['p50_mm'] or 0:8.4f} mm  bad without a warning {100 * row['bad_unflagged']:7.3f} %")
    failed = list(failures(found))
    print(*failed, sep="\n")
    return 1 if options.check and failed else 0


if __name__ == "__main__":
    sys.exit(run_tool("stiff.py", main))
