#!/usr/bin/python3
"""Error of the fit against its run time, beside every alternative: build/report.

    fit.py --build build/host --boards build -o build/report

Measures the error against the reference (errors.py), cycles on the emulated chip (on_chip/bench.mjs), time on this computer, paired, and presses
that are hard, extreme, or none (stiff.py), and merges the results:

    fit.json        the figures by which the fit is judged, with their goals
    fit_table.md    every kernel and variant: cycles, milliseconds at 125 MHz, error
    fit_report.png  the Pareto front
    stability.png   where the fit ends: error and warnings along force, width, gains, border, range and missing sensors

Errors are distances of the location from the reference optimum over the observable presses of the sets A to D.
"""

import csv
import functools
import math
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[2]
sys.path[:0] = [str(ROOT / "host_tools" / part) for part in ("report/shared", "report/measure", "python")]
import errors  # noqa: E402
import stiff  # noqa: E402
import text  # noqa: E402
from boards import fit_cycles_of  # noqa: E402
from presentation import BLUE, FAINT, INK, judge, plt, save  # noqa: E402
from fingertip.command import run_tool  # noqa: E402
from fingertip.files import write_text  # noqa: E402
from measure import Measure  # noqa: E402
from reporting import Steps, built, finish, option_parser, output_folder, positive, run, write_json  # noqa: E402

CLOCK_Hz = 125e6
SETS = errors.SETS
ALL_SETS = "".join(SETS)
USUAL, BUILT = f"iterations={errors.USUAL_ITERATIONS}", f"iterations={errors.BUILT_ITERATIONS}"
BUILT_MASKS = tuple(f"mask={mask} {BUILT}" for mask in errors.MASKS[1:3])


def measure(options, out):
    steps = Steps()
    image = built(fit_cycles_of(options.boards))
    measure = Measure(options.build)
    bench = errors.Bench(measure, options.seed, options.limit, out / "cache")
    steps.report("error against the reference (the first run solves the reference, about eight minutes on two cores)")
    rows = errors.rows(bench)
    steps.report("cycles on the emulated chip")
    write_json(out / "fit_jobs.json", errors.jobs(bench))
    run("node", HERE / "on_chip/bench.mjs", image, out / "fit_jobs.json", out / "fit_cycles.csv", options.budget)
    steps.report("time on this computer")
    host = errors.timed(bench, max(1200, options.limit // 10), options.passes)
    steps.report("presses that are hard, extreme, or none")
    hard = stiff.write(measure, max(200, options.limit // 15), out)
    steps.report("table and picture")
    with open(out / "fit_cycles.csv", newline="", encoding="utf-8") as file:
        return Results(rows, list(csv.DictReader(file)), host, hard)


class Results:
    def __init__(self, rows, cycles, host, hard):
        self.rows = {(row["kernel"], row["variant"], row["set"], row["observable"]): row for row in rows}
        self.cycles = {(row["kernel"], row["variant"]): row for row in cycles}
        self.host, self.stiff = host, hard

    def error(self, kernel, variant, set_, key):
        """Infinite: too many presses without a fit."""
        row = self.rows.get((kernel, variant, set_, True))
        return None if row is None else row[key]

    def per_set(self, kernel, variant, key):
        return {set_: self.error(kernel, variant, set_, key) for set_ in SETS}

    def worst(self, kernel, variant, key, sets=SETS):
        return max(self.error(kernel, variant, set_, key) for set_ in sets)

    def sum(self, kernel, variant, key):
        return sum(self.per_set(kernel, variant, key).values())

    def percent_of_all(self, kernel, variant, set_, key):
        """Of the observable presses of a set and the others together."""
        rows = [self.rows[k] for k in ((kernel, variant, set_, True), (kernel, variant, set_, False)) if k in self.rows]
        return 100 * sum(row[key] * row["presses"] for row in rows) / sum(row["presses"] for row in rows)

    def cycles_max(self, kernel, variants):
        return max(int(self.cycles[kernel, variant]["cycles_max"]) for variant in variants)

    def variants(self):
        return list(dict.fromkeys((kernel, variant) for kernel, variant, _, _ in self.rows))

    def along_iterations(self, kernel):
        """(median cycles, p99.9 um, iterations) of the variants that differ in these alone."""
        for (of, variant), row in self.cycles.items():
            if of == kernel and variant.startswith("iterations="):
                error = self.error(kernel, variant, ALL_SETS, "p999_um")
                yield int(row["cycles_median"]), error, int(variant.removeprefix("iterations="))


# Of fit.json: what to stay below or above, as the fit is meant to be.
GOALS = (
    ("observable_presses", ">=", 100000),
    ("p99_9_um", "<=", 0.5),
    ("above_100um", "<=", 1),
    ("masked_p99_9_um", "<=", 1),
    ("masked_p99_um_d", "<=", 10),
    ("masked_peak_p99_um", "<=", 1),
    ("masked_peak_above_100um_d", "<=", "masked_peak_above_100um_d_double"),
    ("bad_unflagged_percent_worst", "<=", 1.3),
    ("good_flagged_percent_c", "<=", 20),
    ("good_flagged_percent_d", "<=", 50),
    ("cold_cycles", "<=", 31000),
    ("masked_cycles", "<=", 62000),
)


def figures(results, seed):
    """fit.json. Shipped: with the iterations that the firmware makes; else with those that reach the optimum. Masked: one random sensor, or
    the peak sensor, is unusable for the reference too."""
    r = results
    found = {
        "observable_presses": r.sum("fit", USUAL, "presses"),
        "p99_9_um": r.worst("fit", USUAL, "p999_um"),
        "p99_9_um_per_set": r.per_set("fit", USUAL, "p999_um"),
        "above_100um": r.sum("fit", USUAL, "above_100um"),
        "shipped_p99_9_um": r.worst("fit", BUILT, "p999_um"),
        "shipped_p99_9_um_per_set": r.per_set("fit", BUILT, "p999_um"),
        "shipped_above_100um": r.sum("fit", BUILT, "above_100um"),
        "shipped_bad_unflagged_percent_worst": max(r.percent_of_all("fit", BUILT, s, "bad_unflagged") for s in SETS),
        "masked_p99_9_um": r.worst("fit", "mask=random", "p999_um", SETS[:3]),
        "masked_p99_um_d": r.error("fit", "mask=random", "D", "p99_um"),
        "masked_peak_p99_um": r.worst("fit", "mask=peak", "p99_um", SETS[:3]),
        "masked_peak_above_100um_d": r.error("fit", "mask=peak", "D", "above_100um"),
        "masked_peak_above_100um_d_double": r.error("double", "mask=peak guess=firmware", "D", "above_100um"),
        "bad_unflagged_percent_worst": 100 * r.stiff["bad_unflagged_worst"],
        "good_flagged_percent_c": r.percent_of_all("fit", USUAL, "C", "good_flagged"),
        "good_flagged_percent_d": r.percent_of_all("fit", USUAL, "D", "good_flagged"),
        "cold_cycles": r.cycles_max("grid", [BUILT]),
        "masked_cycles": r.cycles_max("masked", BUILT_MASKS),
        "speed_vs_ceres": r.host["ceres_reused"]["ratio"],
        "speed_vs_tinysolver": r.host["tiny_solver"]["ratio"],
        "seed": seed,
        "processor": errors.processor(),
    }
    return judge(found, GOALS)


def number(value, digits=2):
    if value is None:
        return ""
    if not math.isfinite(value):
        return "none"
    return f"{value:.0e}" if value >= 1e6 else f"{value:.{digits}g}" if value < 100 else f"{value:.0f}"


def cells(kernel, variant, cycles, host, of):
    """Of fit_table.md. of(set, key): figure of errors.row_of, or None."""
    return {
        "kernel": kernel,
        "variant": variant,
        "cycles": cycles or "",
        "ms": number(cycles and int(cycles) / CLOCK_Hz * 1e3, 3),
        "host us": number(host and host["us"], 3),
        **{name: number(of(ALL_SETS, key)) for name, key in (("p50", "p50_um"), ("p99", "p99_um"), ("p99.9", "p999_um"))},
        **{f"{s} p99.9": number(of(s, "p999_um")) for s in SETS},
        "above 100 um": f"{of(ALL_SETS, 'above_100um')} of {of(ALL_SETS, 'presses')}",
        "C, D: p99 mm to the truth": ", ".join(number(of(s, "truth_p99_mm")) for s in "CD"),
    }


def table(results):
    """One row for each kernel and variant, and one for each library of the host."""
    rows = []
    for kernel, variant in results.variants():
        cycles = results.cycles.get((kernel, variant), {}).get("cycles_median")
        host = results.host.get(kernel) if variant == USUAL else None
        rows.append(cells(kernel, variant, cycles, host, functools.partial(results.error, kernel, variant)))
    for kernel in errors.LIBRARIES:
        host = results.host[kernel]
        rows.append(cells(kernel, "host library", None, host, lambda set_, key, host=host: host.get(key) if set_ == ALL_SETS else None))
    return rows


def pareto(points):
    """Those of (x, y) that no other beats in both."""
    front = []
    for x, y in sorted(points):
        if not front or y < front[-1][1]:
            front.append((x, y))
    return front


# colour; name on the chip; name on the host, its side of the bar and lift in points
DRAWN = {
    "fit": (BLUE, "firmware, fixed point", ("firmware, fixed point", "left", 0)),
    "general": ("#0e9aa7", "firmware, float32, any layout", ("firmware, float32", "left", 0)),
    "naive_float": ("#e08a1e", "Gauss-Newton, expf", ("Gauss-Newton, expf", "left", -5)),
    "naive_double": ("#b5651d", "Gauss-Newton, exp", ("Gauss-Newton, exp", "right", -6)),
    "lm_float": ("#a05cc5", "Levenberg-Marquardt, float", ("Levenberg-Marquardt, float", "left", 2)),
    "lm_double": ("#6f3d94", "Levenberg-Marquardt, double", ("Levenberg-Marquardt, double", "right", -1)),
    "masked": (INK, None, ("firmware, a sensor masked", "right", 0)),
    "double": (FAINT, None, ("the same steps in double", "right", 0)),
    "tiny_solver": (INK, None, ("TinySolver", "right", 6)),
    "ceres_reused": (INK, None, ("Ceres", "left", 0)),
}
LOW_um, HIGH_um = 1e-3, 1e5  # what is beyond is drawn there


def shown(um):
    return min(max(um, LOW_um), HIGH_um)


def plot_chip(axes, results):
    every = []
    for kernel, (colour, label, _) in DRAWN.items():
        if label is None:
            continue
        line = [(cycles, shown(um), k) for cycles, um, k in results.along_iterations(kernel)]
        every += line
        axes.plot([p[0] for p in line], [p[1] for p in line], "o-", color=colour, ms=4, lw=1.2, label=label, zorder=3)
        for x, y, k in line:
            if k in (0, 4, 7):
                axes.annotate(str(k), (x, y), (0, 5), textcoords="offset points", size=7, ha="center", color=colour)
    for variant, marker, label in (("mask=random", "s", "one random sensor masked"), ("mask=peak", "D", "peak sensor masked")):
        point = int(results.cycles["fit", variant]["cycles_median"]), shown(results.error("fit", variant, ALL_SETS, "p999_um"))
        axes.plot(*point, marker, mfc="white", mec=BLUE, ms=6, label=label, zorder=4)
    front = pareto(point[:2] for point in every)
    axes.step(*zip(*front), where="post", color="#b4bac6", lw=5, alpha=0.6, solid_capstyle="round", label="Pareto front", zorder=1)
    axes.set_xlabel("cycles of one cold fit on the emulated Cortex-M0+, median (numbers: iterations)")
    axes.set_ylabel("p99.9 distance to the least-squares optimum, um")
    axes.set_title("on the chip", loc="left", size=10, color=FAINT)
    axes.legend(loc="lower left", bbox_to_anchor=(0.1, 0), ncol=2, fontsize=7.5)
    top = axes.secondary_xaxis("top", functions=(lambda c: c / CLOCK_Hz * 1e3, lambda ms: ms * CLOCK_Hz / 1e3))
    top.set_xlabel("ms at 125 MHz", size=8, color=FAINT, loc="right")
    top.spines["top"].set_visible(False)


def plot_host(axes, results):
    for kernel, (colour, _, (name, side, up)) in DRAWN.items():
        row = results.host[kernel]
        us, um = row["us"], shown(row["p999_um"])
        spread = [[us - row["us_p10"]], [row["us_p90"] - us]]
        axes.errorbar(us, um, xerr=spread, fmt="o", ms=5, color=colour, elinewidth=0.8, zorder=3)
        at_us, outwards, align = (row["us_p90"], 4, "left") if side == "right" else (row["us_p10"], -4, "right")
        axes.annotate(name, (at_us, um), (outwards, up), textcoords="offset points", size=7.5, va="center", ha=align, color=colour)
    axes.set_xlim(left=0.25 * min(row["us"] for row in results.host.values()))
    axes.set_xlabel("us of one fit on the host, median and 10..90 %, paired")
    axes.set_title("on this host, each from one start", loc="left", size=10, color=FAINT)


def plot(path, results, found):
    figure, both = plt.subplots(1, 2, figsize=(13, 6.6), width_ratios=[1.5, 1], sharey=True)
    figure.subplots_adjust(left=0.06, right=0.985, top=0.8, bottom=0.09, wspace=0.06)
    for axes, draw in zip(both, (plot_chip, plot_host)):
        draw(axes, results)
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_ylim(LOW_um * 0.7, HIGH_um * 1.5)
        axes.grid()
    figure.text(0.06, 0.945, "The fit: error against run time", size=15, weight="bold")
    words = (
        f"{found['observable_presses']} observable presses of sets A to D (simulated), seed {found['seed']}; errors outside the axis are drawn "
        f"on its edge; host: {found['processor']}"
    )
    figure.text(0.06, 0.905, words, size=8.5)
    save(figure, path)


def main(argv):
    parser = option_parser(__doc__, boards=True)
    parser.add_argument("--limit", type=positive, default=120000, help="presses, in all (default: %(default)s)")
    parser.add_argument("--seed", type=positive, default=20221015)
    parser.add_argument("--budget", type=float, default=15.0, help="million emulated cycles for each variant (default: %(default)s)")
    parser.add_argument("--passes", type=positive, default=3, help="of the timing on the host (default: %(default)s)")
    options = parser.parse_args(argv)
    out = output_folder(options)
    results = measure(options, out)
    found = figures(results, options.seed)
    write_json(out / "fit.json", found)
    template = (HERE / "text.md.in").read_text(encoding="utf-8")
    write_text(out / "fit_table.md", text.filled(template, found | {"fits": table(results)}))
    plot(out / "fit_report.png", results, found)
    return finish(found, options, ("fit.json", "fit_table.md", "fit_report.png", "stability.png"))


if __name__ == "__main__":
    sys.exit(run_tool("fit.py", main))
