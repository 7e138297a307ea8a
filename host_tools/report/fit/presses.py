"""Simulated presses that the fit is measured on, the same from the same seed, and their reference optimum.

    A  Gaussian inside the array: sigma 3 to 20 mm, peak 0.5 to 100 kPa
    B  the same, centre up to 6 mm outside the array
    C  elastic layer of 12 mm on the sensors, the paper's four contact shapes, 1 to 25 N
    D  elastic layer of 6 mm: stiff, the pressure is hardly wider than the pitch

Noise 2 to 20 Pa rms, every range log-uniform, location uniform over the array (18 x 36 mm, De Clercq et al., RA-L 2022). Presses whose largest reading is
below 20 noise standard deviations would not pass the firmware's gate and are drawn again.

C and D are the twin's elastic layer under its contact shapes (simulation/twin/contact.hpp): a model that differs from the fitted Gaussian, with the width
and tails of a layer, and does not show what hyperelastic rubber does.
"""

import hashlib
import pathlib
import sys
import zipfile
from types import SimpleNamespace

import numpy as np
from measure import Measure, q10

SETS = ("A", "B", "C", "D")
MASKS = ("none", "random", "peak", "random2", "random3")  # which sensors are not usable: one or more of the press, or its peak
GATE_NOISES = 20.0
OUTSIDE_mm = 6.0
LAYER_mm = {"C": 12.0, "D": 6.0}
SENSORS = 15
ALL = np.uint64((1 << SENSORS) - 1)

SHAPES = ("sphere6", "sphere15", "cylinder6", "cube6")
MASK_STREAM = 1000


def layer_pressure_Pa(measure, layer_mm, shapes, x_mm, y_mm, force_N):
    """[press, sensor]"""
    touches = measure.made("twin_touch", len(force_N))
    touches["x_mm"], touches["y_mm"], touches["force_N"] = x_mm, y_mm, force_N
    pressure_Pa = np.zeros((len(force_N), SENSORS))
    for number, shape in enumerate(SHAPES):
        pressure_Pa[shapes == number] = measure.base_pressure(shape, layer_mm, touches[shapes == number])
    return pressure_Pa


def gaussian_Pa(sensor_x, sensor_y, x_mm, y_mm, sigma_mm, p0_Pa):
    """[press, sensor]"""
    square = (sensor_x - x_mm[:, None]) ** 2 + (sensor_y - y_mm[:, None]) ** 2
    return p0_Pa[:, None] * np.exp(-0.5 * square / np.square(sigma_mm)[:, None])


def draw(measure, set_, seed, count):
    """The first presses of a set: x_mm, y_mm, force_N (of a Gaussian 2 pi p0 sigma^2), noise_Pa [press], pressure_Pa [press, sensor] with noise."""
    return redraw(measure, set_, measure.random(seed, SETS.index(set_), np.arange(count)))


def redraw(measure, set_, random):
    """A press for each state of the random numbers."""
    count = len(random.states)
    made = SimpleNamespace(
        **{name: np.zeros(count) for name in ("x_mm", "y_mm", "force_N", "noise_Pa")}, pressure_Pa=np.zeros((count, SENSORS))
    )
    left = np.arange(count)
    while len(left):
        x_mm, y_mm = (random.uniform(-half, half, of=left)[left] for half in (9, 18))
        if set_ == "B":
            inside = np.arange(len(left))
            while len(inside):
                for at, half in ((x_mm, 9 + OUTSIDE_mm), (y_mm, 18 + OUTSIDE_mm)):
                    at[inside] = random.uniform(-half, half, of=left[inside])[left[inside]]
                inside = inside[(np.abs(x_mm[inside]) <= 9) & (np.abs(y_mm[inside]) <= 18)]
        noise_Pa = random.log_uniform(2, 20, of=left)[left]
        if set_ in "AB":
            sigma_mm, p0_Pa = random.log_uniform(3, 20, of=left)[left], random.log_uniform(500, 100000, of=left)[left]
            force_N = 2 * np.pi * p0_Pa * sigma_mm * sigma_mm * 1e-6
            pressure_Pa = gaussian_Pa(*measure.layout()[:2], x_mm, y_mm, sigma_mm, p0_Pa)
        else:
            force_N, shapes = random.log_uniform(1, 25, of=left)[left], random.below(len(SHAPES), of=left)[left]
            pressure_Pa = layer_pressure_Pa(measure, LAYER_mm[set_], shapes, x_mm, y_mm, force_N)
        pressure_Pa += noise_Pa[:, None] * random.normal(SENSORS, of=left)[left]
        for name, values in (("x_mm", x_mm), ("y_mm", y_mm), ("force_N", force_N), ("noise_Pa", noise_Pa), ("pressure_Pa", pressure_Pa)):
            getattr(made, name)[left] = values
        left = left[pressure_Pa.max(axis=1) < GATE_NOISES * noise_Pa]
    return made


def usable_sensors(measure, set_, mask, seed, readings):
    """Bitmap [press]"""
    if mask == "peak":
        return ALL & ~(np.uint64(1) << readings.argmax(axis=1).astype(np.uint64))
    random = measure.random(seed, MASK_STREAM + SETS.index(set_), np.arange(len(readings)))
    return random.some_of(SENSORS, SENSORS - {"none": 0, "random": 1, "random2": 2, "random3": 3}[mask])


class Compared(Measure):
    """The fits that the firmware's are compared with, and the reference (compared.cpp)."""

    def __init__(self, measure):
        super().__init__(measure.build, "compared")
        self.array, (self.x_mm, self.y_mm, self.pitch_mm) = measure.array(), measure.layout()

    def compare(self, kernel, iterations, noise_Pa, readings, usable, firmware_guess=False, threads=2):
        """(compared_fit [press], microseconds for each)"""
        found, us = self.made("compared_fit", len(readings)), np.zeros(1)
        self.call("compare", kernel, threads, iterations, int(firmware_guess), self.array, noise_Pa, readings, usable, found, us)
        return found, float(us[0])

    def optimum(self, readings, usable, noise_Pa, starts=None, all_starts=False):
        """reference_fit [press]; starts: reference_fit [press] whose parameters are a first guess beside the built-in ones."""
        found = self.made("reference_fit", len(readings))
        starts = self.made("reference_fit", 0) if starts is None else starts
        noise_Pa = np.ascontiguousarray(noise_Pa, float)
        self.call("optimum", self.x_mm, self.y_mm, self.pitch_mm, readings / 1024.0, usable, noise_Pa, starts, int(all_starts), found)
        return found


SOURCE = hashlib.sha256((pathlib.Path(__file__).parents[1] / "reference/reference.cpp").read_bytes()).hexdigest()


def load(measure, compared, set_, mask, seed, count, cache):
    """The first presses of a set as draw() has them, with readings [press, sensor] in 1/1024 Pa, usable and best, the reference_fit of what is usable,
    whose `observable` also asks for a largest reading of GATE_NOISES. What was solved is kept in the folder `cache`, for this source of the reference."""
    made = draw(measure, set_, seed, count)
    made.readings = q10(made.pressure_Pa)
    made.usable = usable_sensors(measure, set_, mask, seed, made.readings)
    kept = pathlib.Path(cache) / f"reference_{seed}_{set_}_{mask}.npz"
    made.best, missing = compared.made("reference_fit", count), np.ones(count, bool)
    try:
        with np.load(kept) as old:
            if str(old["source"]) == SOURCE and old["best"].dtype == made.best.dtype:
                least = min(count, len(old["usable"]))
                same = (old["usable"][:least] == made.usable[:least]) & (old["readings"][:least] == made.readings[:least]).all(axis=1)
                made.best[:least][same], missing[:least] = old["best"][:least][same], ~same
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        missing[:] = True  # not there, or damaged
    if missing.any():
        solve(compared, made, np.flatnonzero(missing), f"reference of set {set_}, mask {mask}")
        kept.parent.mkdir(parents=True, exist_ok=True)
        np.savez(kept, source=SOURCE, usable=made.usable, readings=made.readings, best=made.best)
    bits = np.uint64(1) << np.arange(SENSORS, dtype=np.uint64)
    largest = np.where(made.usable[:, None] & bits, made.readings, np.iinfo(np.int32).min).max(axis=1)
    made.observable = made.best["observable"] & (largest >= GATE_NOISES * 1024 * made.noise_Pa)
    made.set = set_
    return made


def solve(compared, presses, missing, what):
    # The truth is a good start where it is a Gaussian, and a fair one where it is not.
    starts = compared.made("reference_fit", len(presses.readings))
    starts["p0_Pa"], starts["x_mm"], starts["y_mm"] = presses.readings.max(axis=1) / 1024.0, presses.x_mm, presses.y_mm
    starts["sigma_mm"] = np.clip(np.sqrt(1e6 * presses.force_N / (2 * np.pi * starts["p0_Pa"])), 2, 40)
    for done, some in enumerate(np.array_split(missing, 1 + len(missing) // 2000), 1):
        presses.best[some] = compared.optimum(presses.readings[some], presses.usable[some], presses.noise_Pa[some], starts[some])
        print(f"\r{what}: {done * len(some)} of {len(missing)} ", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
