"""Distance of every kernel's location from the reference optimum, and its time on this computer (fit.py).

A row of fit_error: kernel, variant, set (one, or all together), whether the readings determine the location, and of these presses: the errors' quantiles,
and the shares that are bad without a warning or good with one. Bad is 1 mm and more: of A and B from the optimum, of C and D from the truth. A press without a
fit counts as infinitely far.
"""

import dataclasses

import numpy as np
import presses
from fingertip.line import Flag
from presses import MASKS, SETS, load

USUAL_ITERATIONS, BUILT_ITERATIONS = 7, 4  # BUILT: FINGERTIP_FIT_ITERATIONS
BAD_mm = 1.0
WARNINGS = np.uint32(Flag.UNCERTAIN | Flag.MODEL | Flag.FLAT | Flag.AT_BOUND | Flag.LOW_SIGNAL)
VALID = np.uint32(Flag.FIT_VALID)

# What a kernel can do beside fitting every sensor: fit without every sensor, start where the firmware's starts, end early.
SUBSET, FIRMWARE_GUESS, ENDS = "subset", "firmware guess", "ends early"
FIRMWARE = {"fit": {SUBSET}, "grid": set(), "masked": {SUBSET}, "general": {SUBSET}}
KERNELS = FIRMWARE | {
    "double": {SUBSET, FIRMWARE_GUESS},  # the general kernel's steps in double
    "naive_float": {SUBSET},
    "naive_double": {SUBSET},
    "lm_float": {SUBSET, ENDS},
    "lm_double": {SUBSET, ENDS},
}
LIBRARIES = ("tiny_solver", "ceres_reused")
BLOCK = 400


@dataclasses.dataclass
class Variant:
    name: str
    iterations: int = USUAL_ITERATIONS
    mask: str = "none"
    firmware_guess: bool = False
    needs: frozenset = frozenset()


VARIANTS = (
    *(Variant(f"iterations={k}", k) for k in range(11)),
    *(Variant(f"iterations={k}", k, needs={ENDS}) for k in (20, 50)),
    *(Variant(f"mask={mask}", mask=mask, needs={SUBSET}) for mask in MASKS[1:]),
    *(Variant(f"mask={mask} iterations={BUILT_ITERATIONS}", BUILT_ITERATIONS, mask=mask, needs={SUBSET}) for mask in MASKS[1:3]),
    *(Variant(f"mask={mask} guess=firmware", mask=mask, firmware_guess=True, needs={FIRMWARE_GUESS}) for mask in MASKS[1:3]),
)


class Bench:
    """Presses and fits of them; `cache` keeps the reference."""

    def __init__(self, measure, seed, limit, cache):
        self.measure, self.compared, self.array = measure, presses.Compared(measure), measure.array()
        self.seed, self.limit, self.cache, self.loaded = seed, limit, cache, {}

    def presses(self, set_, mask="none", limit=None):
        """limit: in all sets. A and B are a third each, C and D a sixth; with one sensor masked half of that, with two and three a tenth."""
        share = {"none": 1, "random": 2, "peak": 2}.get(mask, 10)
        count = (limit or self.limit) // (3 if set_ in "AB" else 6) // share
        if (set_, mask, count) not in self.loaded:
            self.loaded[set_, mask, count] = load(self.measure, self.compared, set_, mask, self.seed, count, self.cache)
        return self.loaded[set_, mask, count]

    def fit(self, kernel, variant, readings, usable, noise_Pa, threads=2):
        """(results with x_mm, y_mm, flags, microseconds for each)"""
        if kernel in FIRMWARE:
            settings = self.measure.settings(len(readings), gain_sd=0.0, clip_below_sds=0, iterations=variant.iterations)
            settings["noise_Pa_q10"] = (1024 * noise_Pa).astype(np.int32)
            return self.measure.timed_fit(self.array, settings, readings, usable, kernel=kernel, threads=threads)
        return self.compared.compare(kernel, variant.iterations, noise_Pa, readings, usable, variant.firmware_guess, threads)


def quantile(values, share):
    """Of sorted values, without interpolation."""
    return float(values[int(share * (len(values) - 1))]) if len(values) else None


def distance_um(found, best):
    um = 1e3 * np.hypot(found["x_mm"].astype(float) - best["x_mm"], found["y_mm"].astype(float) - best["y_mm"])
    return np.where(np.isfinite(um) & (found["flags"] & VALID != 0), um, np.inf)


def outcomes(bench, kernel, variant):
    """Of the presses of each set: (observable, um from the reference, mm from the truth, mm wrong, flags), each [press]."""
    for set_ in SETS:
        these = bench.presses(set_, variant.mask)
        found, _ = bench.fit(kernel, variant, these.readings, these.usable, these.noise_Pa)
        truth_mm = np.hypot(found["x_mm"].astype(float) - these.x_mm, found["y_mm"].astype(float) - these.y_mm)
        um = distance_um(found, these.best)
        yield these.observable, um, truth_mm, um * 1e-3 if set_ in "AB" else truth_mm, found["flags"]


def row_of(kernel, variant, name, observable, of_sets):
    """of_sets: as outcomes() has them."""
    um, truth_mm, wrong_mm, flags = (np.concatenate([one[i][one[0] == observable] for one in of_sets]) for i in range(1, 5))
    valid, warned = flags & VALID != 0, flags & WARNINGS != 0
    errors, count = np.sort(um), max(len(um), 1)
    return {
        "kernel": kernel,
        "variant": variant,
        "set": name,
        "observable": observable,
        "presses": len(um),
        "above_100um": int((um > 100).sum()),
        **{f"{key}_um": quantile(errors, share) for key, share in (("p50", 0.5), ("p99", 0.99), ("p999", 0.999))},
        "truth_p99_mm": quantile(np.sort(truth_mm[valid]), 0.99),
        "bad_unflagged": float((valid & (wrong_mm > BAD_mm) & ~warned).sum() / count),
        "good_flagged": float((valid & (wrong_mm <= BAD_mm) & warned).sum() / count),
    }


def variants():
    return ((kernel, variant) for kernel, abilities in KERNELS.items() for variant in VARIANTS if variant.needs <= abilities)


def rows(bench):
    found = []
    for kernel, variant in variants():
        of_sets = list(outcomes(bench, kernel, variant))
        for name, some in (*zip(SETS, ([one] for one in of_sets)), ("".join(SETS), of_sets)):
            found += [row_of(kernel, variant.name, name, observable, some) for observable in (True, False)]
    return [row for row in found if row["presses"]]


def jobs(bench):
    """For on_chip/bench.mjs: the variants, and of each mask a thousandth of the presses."""
    return {
        "variants": [
            {"kernel": kernel, "variant": variant.name, "iterations": variant.iterations, "mask": variant.mask}
            for kernel, variant in variants()
        ],
        "presses": {mask: [job for set_ in SETS for job in jobs_of(bench, set_, mask)] for mask in MASKS},
    }


def jobs_of(bench, set_, mask):
    these = bench.presses(set_, mask)
    for i in range(max(1, len(bench.presses(set_).readings) // 1000)):
        yield {
            "observable": bool(these.observable[i]),
            "usable": int(these.usable[i]),
            "noise_Pa_q10": int(these.noise_Pa[i] * 1024),
            "best_x_mm": float(these.best["x_mm"][i]),
            "best_y_mm": float(these.best["y_mm"][i]),
            "readings": these.readings[i].tolist(),
        }


def mixed(bench, limit):
    """Observable presses, each set's share spread evenly over them: (readings, usable, noise_Pa, best)."""
    of_sets = [bench.presses(set_, limit=limit) for set_ in SETS]
    at = np.concatenate([np.arange(these.observable.sum()) / these.observable.sum() for these in of_sets])
    order = np.argsort(at, kind="stable")[: len(at) // BLOCK * BLOCK]
    return tuple(
        np.concatenate([getattr(these, name)[these.observable] for these in of_sets])[order]
        for name in ("readings", "usable", "noise_Pa", "best")
    )


def timed(bench, limit, passes):
    """Time and error of one fit on this computer, our kernels and libraries on the same presses, block after block in an order that rotates. Kernels that
    run a number of iterations run seven. us: median over blocks and passes, and the tenths of them; ratio: median of the same block's time over that of
    the firmware's fit."""
    readings, usable, noise_Pa, best = mixed(bench, limit)
    kernels = [*KERNELS, *LIBRARIES]
    us, um = {kernel: [] for kernel in kernels}, {kernel: np.zeros(len(readings)) for kernel in kernels}
    blocks = [slice(start, start + BLOCK) for start in range(0, len(readings), BLOCK)]
    for turn, block in enumerate(blocks * passes):
        for kernel in kernels[turn % len(kernels) :] + kernels[: turn % len(kernels)]:
            found, one_us = bench.fit(kernel, Variant(""), readings[block], usable[block], noise_Pa[block], threads=1)
            us[kernel].append(one_us)
            um[kernel][block] = distance_um(found, best[block])
    found = {}
    for kernel in kernels:
        times, errors = np.sort(us[kernel]), np.sort(um[kernel])
        found[kernel] = {
            **{key: quantile(times, share) for key, share in (("us", 0.5), ("us_p10", 0.1), ("us_p90", 0.9))},
            "ratio": quantile(np.sort(np.divide(us[kernel], us["fit"])), 0.5),
            "presses": len(errors),
            "p50_um": quantile(errors, 0.5),
            "p999_um": quantile(errors, 0.999),
            "above_100um": int((errors > 100).sum()),
        }
    return found


def processor():
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        return next((line.split(": ", 1)[1].strip() for line in file if line.startswith("model name")), "unknown")
