#!/usr/bin/python3
"""Error of the fit against its run time, beside every alternative: build/report.

    fit.py --build build/host --boards build -o build/report

Measures the error against the reference (errors.py), cycles on the emulated chip (on_chip/bench.mjs), time on this computer, paired, and presses
that are hard, extreme, or none (stiff.py), and merges the results:

    fit.json        the figures by which the fit is judged, with their goals
    fit_table.csv   every kernel and variant: cycles, milliseconds at 125 MHz, error; fit_table.md has the same
    fit_report.png  the Pareto front

Errors are distances of the location from the reference optimum over the observable presses of the sets A to D.
"""

import csv
import json
import math
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[2]
sys.path[:0] = [str(ROOT / "host_tools" / part) for part in ("report/shared", "report/measure", "python")]
import errors  # noqa: E402
import stiff  # noqa: E402
from boards import TO_BUILD, fit_cycles_of  # noqa: E402
from presentation import BLUE, FAINT, GOAL, INK, goal_table_md, judge, plt, save, table_md  # noqa: E402
from fingertip.files import InputError, run_tool, write_text  # noqa: E402
from measure import Measure  # noqa: E402
from reporting import Steps, finish, option_parser, output_folder, run, write_json  # noqa: E402

CLOCK_Hz = 125e6
SETS = errors.SETS
ALL_SETS = "".join(SETS)
USUAL, BUILT = f"iterations={errors.USUAL_ITERATIONS}", f"iterations={errors.BUILT_ITERATIONS}"
MASKS = tuple(f"mask={mask}" for mask in errors.MASKS[1:])
BUILT_MASKS = tuple(f"{mask} {BUILT}" for mask in MASKS[:2])


def measure(options, out):
    steps = Steps()
    image = fit_cycles_of(options.boards)
    if not image.exists():
        raise InputError(f"{image} is not there; {TO_BUILD}")
    measure = Measure(options.build)
    bench = errors.Bench(measure, options.seed, options.limit, out / "cache")
    steps.report("error against the reference (the first run solves the reference, about eight minutes on two cores)")
    write_json(out / "fit_error.json", {"seed": options.seed, "presses": options.limit, "rows": errors.rows(bench)})
    steps.report("cycles on the emulated chip")
    write_json(out / "fit_jobs.json", errors.jobs(bench))
    run(
        "node",
        HERE / "on_chip/bench.mjs",
        "--image",
        image,
        "--jobs",
        out / "fit_jobs.json",
        "--out",
        out / "fit_cycles.csv",
        "--budget",
        options.budget,
    )
    steps.report("time on this computer")
    write_json(out / "fit_bench.json", errors.timed(bench, max(1200, options.limit // 10), options.passes))
    steps.report("presses that are hard, extreme, or none")
    write_json(out / "stiff.json", stiff.measure_cases(measure, max(200, options.limit // 15)))
    steps.report("table and picture")


def read_json(path):
    return json.loads(path.read_text(encoding="utf-8"))


class Results:
    def __init__(self, out):
        self.rows = {}
        report = read_json(out / "fit_error.json")
        self.seed = report["seed"]
        for row in report["rows"]:
            self.rows[row["kernel"], row["variant"], row["set"], row["observable"]] = row
        with open(out / "fit_cycles.csv", newline="", encoding="utf-8") as file:
            self.cycles = {(row["kernel"], row["variant"]): row for row in csv.DictReader(file)}
        self.bench = read_json(out / "fit_bench.json")
        self.host = {row["kernel"]: row for row in self.bench["rows"]}
        self.stiff = read_json(out / "stiff.json")

    def error(self, kernel, variant, set_, key):
        """null is infinite: too many presses without a fit."""
        row = self.rows.get((kernel, variant, set_, True))
        if row is None:
            return None
        return math.inf if row[key] is None else row[key]

    def worst(self, kernel, variant, key, sets=SETS):
        return max(self.error(kernel, variant, set_, key) for set_ in sets)

    def per_set(self, kernel, variant, key):
        return {set_: self.error(kernel, variant, set_, key) for set_ in SETS}

    def percent_of_all(self, kernel, variant, set_, key):
        """Of the observable presses of a set and the others together."""
        rows = [self.rows[k] for k in ((kernel, variant, set_, True), (kernel, variant, set_, False)) if k in self.rows]
        return 100 * sum(row[key] * row["presses"] for row in rows) / sum(row["presses"] for row in rows)

    def cycles_max(self, kernel, variants):
        return max(int(self.cycles[kernel, variant]["cycles_max"]) for variant in variants)

    def variants(self):
        seen = {}
        for kernel, variant, _, _ in self.rows:
            seen[kernel, variant] = None
        return list(seen)


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
    ("speed_vs_ceres", ">=", 20),
    ("speed_vs_tinysolver", ">=", 2),
    ("speed_vs_cminpack", ">=", 6),
)


def figures(results):
    """fit.json. Shipped: with the iterations that the firmware makes; else with those that reach the optimum. Masked: one random sensor, or
    the peak sensor, is unusable for the reference too."""
    r = results
    ours = errors.HOST_KERNEL
    libraries = ("ceres_reused", "tiny_solver", "cminpack")
    speed = {name: r.host[name]["ratio"] for name in libraries}
    found = {
        "observable_presses": sum(r.error("fit", USUAL, s, "presses") for s in SETS),
        "p99_9_um": r.worst("fit", USUAL, "p999_um"),
        "p99_9_um_per_set": r.per_set("fit", USUAL, "p999_um"),
        "above_100um": sum(r.error("fit", USUAL, s, "above_100um") for s in SETS),
        "above_100um_per_set": r.per_set("fit", USUAL, "above_100um"),
        "shipped_p99_9_um": r.worst("fit", BUILT, "p999_um"),
        "shipped_p99_9_um_per_set": r.per_set("fit", BUILT, "p999_um"),
        "shipped_above_100um": sum(r.error("fit", BUILT, s, "above_100um") for s in SETS),
        "shipped_bad_unflagged_percent_per_set": {s: r.percent_of_all("fit", BUILT, s, "bad_unflagged") for s in SETS},
        "masked_p99_9_um": r.worst("fit", "mask=random", "p999_um", SETS[:3]),
        "masked_p99_9_um_per_set": r.per_set("fit", "mask=random", "p999_um"),
        "masked_p99_um_d": r.error("fit", "mask=random", "D", "p99_um"),
        "masked_peak_p99_um": r.worst("fit", "mask=peak", "p99_um", SETS[:3]),
        "masked_peak_p99_um_per_set": r.per_set("fit", "mask=peak", "p99_um"),
        "masked_peak_above_100um_d": r.error("fit", "mask=peak", "D", "above_100um"),
        "masked_peak_above_100um_d_double": r.error("double", "mask=peak guess=firmware", "D", "above_100um"),
        "masked_observable_presses": {mask[5:]: sum(r.error("fit", mask, s, "presses") for s in SETS) for mask in MASKS},
        "bad_unflagged_percent_worst": 100 * r.stiff["bad_unflagged_worst"],
        "bad_unflagged_percent_per_set": {s: r.percent_of_all("fit", USUAL, s, "bad_unflagged") for s in SETS},
        "good_flagged_percent_c": r.percent_of_all("fit", USUAL, "C", "good_flagged"),
        "good_flagged_percent_d": r.percent_of_all("fit", USUAL, "D", "good_flagged"),
        "cold_cycles": r.cycles_max("grid", [BUILT]),
        "masked_cycles": r.cycles_max("masked", BUILT_MASKS),
        "with_outlier_search_cycles": r.cycles_max("fit", [BUILT, *BUILT_MASKS]),
        "general_cycles": r.cycles_max("general", [USUAL]),
        "speed_vs_ceres": speed["ceres_reused"],
        "speed_vs_tinysolver": speed["tiny_solver"],
        "speed_vs_cminpack": speed["cminpack"],
        "host_p99_9_um": {name: r.host[name]["p999_um"] for name in (ours, *speed)},
        "seed": r.seed,
        "processor": r.bench["processor"],
    }
    return judge(found, GOALS)


def table(results):
    """One dict for each kernel and variant."""
    rows = []
    for kernel, variant in results.variants():
        cycles = results.cycles.get((kernel, variant), {})
        median = cycles.get("cycles_median")
        row = {
            "kernel": kernel,
            "variant": variant,
            **{f"cycles_{k}": cycles.get(f"cycles_{k}", "") for k in ("min", "median", "max")},
            "ms": "" if median is None else int(median) / CLOCK_Hz * 1e3,
            "host_us": results.host[kernel]["us"] if variant == USUAL and kernel in results.host else "",
            "presses": results.error(kernel, variant, ALL_SETS, "presses"),
            "above_100um": results.error(kernel, variant, ALL_SETS, "above_100um"),
        }
        for key in ("p50_um", "p99_um", "p999_um", "worst_um"):
            row[key] = results.error(kernel, variant, ALL_SETS, key)
            for set_ in SETS:
                row[f"{key}_{set_}"] = results.error(kernel, variant, set_, key)
        for set_ in SETS:
            row[f"truth_p99_mm_{set_}"] = results.error(kernel, variant, set_, "truth_p99_mm")
        rows.append(row)
    for kernel, host in results.host.items():
        if (kernel, USUAL) not in results.variants():
            rows.append(
                {
                    "kernel": kernel,
                    "variant": "host library",
                    "host_us": host["us"],
                    "presses": results.bench["presses"],
                    "above_100um": host["above_100um"],
                    "p50_um": host["p50_um"],
                    "p999_um": math.inf if host["p999_um"] is None else host["p999_um"],
                }
            )
    return rows


def write_table_csv(path, rows):
    names = list(rows[0])
    lines = [",".join(names)]
    lines += [
        ",".join("" if row.get(n) is None else f"{row[n]:.6g}" if isinstance(row.get(n), float) else str(row.get(n, "")) for n in names)
        for row in rows
    ]
    write_text(path, "\n".join(lines) + "\n")


def number(value, digits=2):
    if value is None or value == "":
        return ""
    if not math.isfinite(value):
        return "none"
    if value >= 1e6:
        return f"{value:.0e}"
    return f"{value:.{digits}g}" if value < 100 else f"{value:.0f}"


def write_table_md(path, rows, found):
    lines = [
        "# Error of the fit against run time",
        "",
        "Written by `sh cmake/bootstrap.sh report`. Cycles: emulated Cortex-M0+, median; ms at 125 MHz. um: distance of the location from",
        f"the reference optimum over the observable presses of sets A to D, seed {found['seed']}. host us: {found['processor']}.",
        "",
        f"How far from the optimum, p99.9 in the worst set: {number(found['p99_9_um'])} um with seven iterations (`{USUAL}`), "
        f"{number(found['shipped_p99_9_um'])} um with the firmware's four (`{BUILT}`), where {found['shipped_above_100um']} presses are "
        f"more than 100 um away. At most {max(found['shipped_bad_unflagged_percent_per_set'].values()):.2g} % of a set's presses are then "
        "more than 1 mm from the truth without a warning.",
        "",
        "The presses have no dip, and the fit has none set: these figures are the distance of the arithmetic from the optimum of its own model. The parts",
        "`truth`, `validation` and, on real rubber, `real` have the effect of a dip, and of a fit that knows it, on the distance from the truth.",
        "",
        *goal_table_md(found),
    ]
    cells = [
        [
            row["kernel"],
            row["variant"],
            row.get("cycles_median", ""),
            number(row.get("ms"), 3),
            number(row["host_us"], 3),
            *(number(row.get(key)) for key in ("p50_um", "p99_um", "p999_um", *(f"p999_um_{s}" for s in SETS))),
            f"{row['above_100um']} of {row['presses']}",
            ", ".join(number(row[f"truth_p99_mm_{s}"]) for s in "CD" if f"truth_p99_mm_{s}" in row),
        ]
        for row in rows
    ]
    lines += [
        "",
        *table_md(
            (
                "kernel",
                "variant",
                "cycles",
                "ms",
                "host us",
                "p50",
                "p99",
                "p99.9",
                "A p99.9",
                "B",
                "C",
                "D",
                "above 100 um",
                "C, D: p99 mm to the truth",
            ),
            cells,
        ),
    ]
    write_text(path, "\n".join(lines) + "\n")


def pareto(points):
    """Those of (x, y) that no other beats in both."""
    front = []
    for x, y in sorted(points):
        if not front or y < front[-1][1]:
            front.append((x, y))
    return front


def plot(path, results, found):
    colours = {
        "fit": BLUE,
        "general": "#0e9aa7",
        "naive_float": "#e08a1e",
        "naive_double": "#b5651d",
        "lm_float": "#a05cc5",
        "lm_double": "#6f3d94",
        "double": FAINT,
        "separable": GOAL,
    }
    labels = {
        "fit": "firmware, fixed point",
        "general": "firmware, float32, any layout",
        "naive_float": "Gauss-Newton, expf",
        "naive_double": "Gauss-Newton, exp",
        "lm_float": "Levenberg-Marquardt, float",
        "lm_double": "Levenberg-Marquardt, double",
    }
    # on the host: name, its side of the bar or else above the point, lifted by points
    host_labels = {
        "fit": ("firmware, fixed point", "left", 0),
        "general": ("firmware, float32", "left", 0),
        "masked": ("firmware, a sensor masked", "right", 0),
        "double": ("the same steps in double", "right", 0),
        "separable": ("fixed point's iteration in double", "right", 0),
        "naive_float": ("Gauss-Newton, expf", "left", -5),
        "naive_double": ("Gauss-Newton, exp", "left", 5),
        "lm_float": ("Levenberg-Marquardt, float", "left", -4),
        "lm_double": ("Levenberg-Marquardt, double", "right", -4),
        "tiny_solver": ("TinySolver", "right", 4),
        "tiny_tight": ("TinySolver, tight", "left", -9),
        "gsl": ("GSL", "left", 0),
        "ceres_reused": ("Ceres", "above, left", 9),
        "ceres_tight": ("Ceres, tight", "above, right", 9),
        "cminpack": ("cminpack", "right", 0),
    }
    low_um, high_um = 1e-3, 1e5

    def shown(um):
        return min(max(um, low_um), high_um)

    figure, (chip, host) = plt.subplots(1, 2, figsize=(13, 6.6), width_ratios=[1.5, 1], sharey=True)
    figure.subplots_adjust(left=0.06, right=0.985, top=0.8, bottom=0.09, wspace=0.06)

    every = []
    for kernel, label in labels.items():
        line = []
        for k in range(51):
            cycles, error = results.cycles.get((kernel, f"iterations={k}")), results.error(kernel, f"iterations={k}", ALL_SETS, "p999_um")
            if cycles is not None and error is not None:
                line.append((int(cycles["cycles_median"]), shown(error), k))
        every += [point[:2] for point in line]
        chip.plot([p[0] for p in line], [p[1] for p in line], "o-", color=colours[kernel], ms=4, lw=1.2, label=label, zorder=3)
        labelled = []
        for x, y, k in line:
            apart = all(abs(math.log10(x / other_x)) > 0.05 or abs(math.log10(y / other_y)) > 0.5 for other_x, other_y in labelled)
            if k in (0, 4, 7, 10, 50) and apart and not (kernel.startswith("lm_") and k == 4):
                labelled.append((x, y))
                chip.annotate(str(k), (x, y), (0, 5), textcoords="offset points", size=7, ha="center", color=colours[kernel])
        for n in range(4, 15):
            cycles, error = results.cycles.get((kernel, f"n_largest={n}")), results.error(kernel, f"n_largest={n}", ALL_SETS, "p999_um")
            if cycles is not None and error is not None:
                chip.plot(
                    int(cycles["cycles_median"]),
                    shown(error),
                    "x",
                    color=colours[kernel],
                    ms=5,
                    zorder=3,
                    label="n largest, 4 to 14" if n == 4 else None,
                )
    for variant, marker, label in (("mask=random", "s", "one random sensor masked"), ("mask=peak", "D", "peak sensor masked")):
        if ("fit", variant) in results.cycles:
            chip.plot(
                int(results.cycles["fit", variant]["cycles_median"]),
                shown(results.error("fit", variant, ALL_SETS, "p999_um")),
                marker,
                mfc="white",
                mec=colours["fit"],
                ms=6,
                label=label,
                zorder=4,
            )
    front = pareto(every)
    chip.step(
        [p[0] for p in front],
        [p[1] for p in front],
        where="post",
        color="#b4bac6",
        lw=5,
        alpha=0.6,
        solid_capstyle="round",
        label="Pareto front",
        zorder=1,
    )
    chip.set_xlabel("cycles of one cold fit on the emulated Cortex-M0+, median (numbers: iterations)")
    chip.set_ylabel("p99.9 distance to the least-squares optimum, um")
    chip.set_title("on the chip", loc="left", size=10, color=FAINT)
    chip.legend(loc="lower left", bbox_to_anchor=(0.1, 0), ncol=2, fontsize=7.5)
    top = chip.secondary_xaxis("top", functions=(lambda c: c / CLOCK_Hz * 1e3, lambda ms: ms * CLOCK_Hz / 1e3))
    top.set_xlabel("ms at 125 MHz", size=8, color=FAINT, loc="right")
    top.spines["top"].set_visible(False)

    for kernel, row in results.host.items():
        if kernel in ("grid", "ceres_new"):
            continue  # as fit, and as ceres_reused
        error = math.inf if row["p999_um"] is None else row["p999_um"]
        colour = colours.get(kernel, INK)
        host.errorbar(
            row["us"],
            shown(error),
            xerr=[[row["us"] - row["us_p10"]], [row["us_p90"] - row["us"]]],
            fmt="o",
            ms=5,
            color=colour,
            elinewidth=0.8,
            zorder=3,
        )
        name, side, up = host_labels[kernel]
        at_us, outwards = {"right": (row["us_p90"], 4), "left": (row["us_p10"], -4)}.get(side, (row["us"], 0))
        host.annotate(
            name,
            (at_us, shown(error)),
            (outwards, up),
            textcoords="offset points",
            size=7.5,
            va="center",
            ha="left" if side.endswith("right") else "right",
            color=colour,
        )
    host.set_xlabel("us of one fit on the host, median and 10..90 %, paired")
    host.set_title("on this host, each from one start", loc="left", size=10, color=FAINT)
    for axes in (chip, host):
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_ylim(low_um * 0.7, high_um * 1.5)
        axes.grid()
    figure.text(0.06, 0.945, "The fit: error against run time", size=15, weight="bold")
    figure.text(
        0.06,
        0.905,
        f"{found['observable_presses']} observable presses of sets A to D (simulated), seed {found['seed']}; errors outside the "
        f"axis are drawn on its edge; host: {found['processor']}",
        size=8.5,
    )
    save(figure, path)


def whole(text):
    value = int(text)
    if value <= 0:
        raise ValueError
    return value


def main(argv):
    parser = option_parser(__doc__)
    parser.add_argument("--boards", required=True, metavar="DIR", help="folder of the boards' builds")
    parser.add_argument("--limit", type=whole, default=120000, help="presses, in all (default: %(default)s)")
    parser.add_argument("--seed", type=whole, default=20221015)
    parser.add_argument("--budget", type=float, default=15.0, help="million emulated cycles for each variant (default: %(default)s)")
    parser.add_argument("--passes", type=whole, default=3, help="of the timing on the host (default: %(default)s)")
    parser.add_argument("--only-merge", action="store_true", help="measure nothing, take what is in the folder")
    options = parser.parse_args(argv)
    out = output_folder(options)
    if not options.only_merge:
        measure(options, out)
    try:
        results = Results(out)
        found = figures(results)
    except (KeyError, OSError, TypeError) as error:
        raise InputError(f"{out}: the results there are incomplete ({error!r}); run without --only-merge") from None
    rows = table(results)
    write_json(out / "fit.json", found)
    write_table_csv(out / "fit_table.csv", rows)
    write_table_md(out / "fit_table.md", rows, found)
    plot(out / "fit_report.png", results, found)
    return finish(found, options, ("fit.json", "fit_table.md", "fit_report.png"))


if __name__ == "__main__":
    sys.exit(run_tool("fit.py", main))
