#!/usr/bin/python3
"""How fast the fingertip is and what it takes, in emulated time: images of all boards in the emulator.

    rate.py --build build/host --boards build -o build/report

    rate.json    the figures by which the rate is judged, with their goals; all tables of rate.md
    rate.md      the same to read
    rate.png     the same to look at
    scenes.png   what each scene computes, leaves out, and takes

text.md.in describes what is measured.
"""

import json
import pathlib
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools/report/shared"), str(ROOT / "host_tools/python")]
import grasp_rate  # noqa: E402
import rate_report  # noqa: E402
import scenes  # noqa: E402
from boards import BOARDS, PARALLEL, short  # noqa: E402
from emulated import CONVERSION_us, FROM_s, Measurement, distribution, scenario  # noqa: E402
from fingertip.command import InputError, run_tool  # noqa: E402
from presentation import judge  # noqa: E402
from reporting import Steps, option_parser, output_folder, publish  # noqa: E402

# What the checks of the images allow each scene.
LIMITS = json.loads((ROOT / "tests/checks/scene_limits.json").read_text(encoding="utf-8"))
GOALS = (
    ("parallel_fps_osr256", ">=", 1250),
    ("parallel_fps_osr1024", ">=", 410),
    ("mux_fps_osr256", ">=", 260),
    ("mux_fps_osr1024", ">=", 185),
    ("latency_parallel_us", "<=", 700),
    ("idle_sleep_percent", ">=", 80),
    ("contact_sleep_percent", ">=", 40),
    ("flash_bytes", "<=", LIMITS["slip"]["flash_bytes"]),
    ("ram_bytes", "<=", 32 * 1024),
    ("stack_bytes", "<=", LIMITS["slip"]["stack_bytes"]),
    ("raw_flash_bytes", "<=", "half_flash_bytes"),
    ("dropped", "<=", 0),
    ("unfitted", "<=", 0),
    *grasp_rate.GOALS,
)
QUICK_OSRS = (256, 1024)
SHORT_s = 4


def measure(tools, options, steps):
    """Measurements by board and OSR, and the one without contact."""
    osrs = QUICK_OSRS if options.quick else tuple(CONVERSION_us)
    short_s = min(options.seconds, SHORT_s)
    with tempfile.TemporaryDirectory() as folder:
        wander, rest = (scenario(folder, name, FROM_s + options.seconds + 1) for name in ("wander", "rest"))

        def job(board, osr, path, seconds):
            return (
                f"{board} at OSR {osr}, {seconds:g} s {'in contact' if path is wander else 'at rest'}",
                lambda: Measurement(tools, folder, board, osr, path, seconds),
            )

        jobs = {
            (board, osr): job(board, osr, wander, options.seconds if board == PARALLEL and osr in QUICK_OSRS else short_s)
            for board in BOARDS
            for osr in osrs
        }
        jobs["rest"] = job(PARALLEL, 256, rest, short_s)
        runs = steps.run_all(jobs)
    return runs, runs.pop("rest")


def by_osr(runs):
    return [
        {
            "board": board,
            "osr": osr,
            "frames_per_s": found.frames_per_s,
            "fitted_per_s": found.fitted_per_s,
            "held_per_s": found.held_per_s,
            "sleep_percent": found.sleep_percent,
            **found.stages_us,
            "latency_us": distribution(found.offered_us),
            "delivery_us": distribution(found.delivered_us),
            "dropped": found.dropped,
        }
        for (board, osr), found in runs.items()
    ]


def figures(runs, resting, rows):
    parallel = runs[PARALLEL, 256]

    def worst(name, scene="slip"):
        return max(row[name] for row in rows if row["scene"] == scene)

    found = {f"{short(board)}_fps_osr{osr}": runs[board, osr].fitted_per_s for board in BOARDS for osr in QUICK_OSRS}
    latency_us, delivery_us = distribution(parallel.offered_us), distribution(parallel.delivered_us)
    return {
        **found,
        "latency_parallel_us": latency_us["max"],
        **{f"latency_parallel_{name}_us": value for name, value in latency_us.items()},
        **{f"delivery_parallel_{name}_us": value for name, value in delivery_us.items()},
        "clock_jitter_us": parallel.clock_jitter_us,
        "idle_sleep_percent": resting.sleep_percent,
        "contact_sleep_percent": parallel.sleep_percent,
        "contact_frames_per_s": parallel.frames_per_s,
        **{name: worst(name) for name in ("flash_bytes", "ram_bytes", "code_in_sram_bytes", "stack_bytes")},
        "raw_flash_bytes": worst("flash_bytes", "raw"),
        "half_flash_bytes": min(row["flash_bytes"] for row in rows if row["scene"] == "slip") // 2,
        "dropped": parallel.dropped,
        "sequence_gaps": parallel.sequence_gaps,
        "packets_dropped": parallel.packets_dropped,
        "frames_skipped": parallel.frames_skipped,
        "frames_missing": parallel.frames_missing,
        "unfitted": parallel.unfitted,
        "seconds": parallel.seconds,
        "fit_iterations": parallel.iterations,
    }


def main(argv):
    parser = option_parser(__doc__, boards=True)
    parser.add_argument("--seconds", type=float, default=30, help="emulated, of the longest runs (default: %(default)s)")
    parser.add_argument("--quick", action="store_true", help="OSR 256 and 1024, scenes raw and slip on one board")
    options = parser.parse_args(argv)
    if not 1 <= options.seconds <= 600:
        raise InputError(f"--seconds {options.seconds:g} is out of range; give 1 to 600")
    output_folder(options)
    tools, steps = scenes.SceneTools(options.build, options.boards, "slip"), Steps()
    few = {"scenes": ("raw", "slip"), "boards": BOARDS[:1], "osrs": QUICK_OSRS} if options.quick else {}
    rows = scenes.measure(tools.command_frame, tools.boards / "scenes", steps, **few)
    runs, resting = measure(tools, options, steps)
    with tempfile.TemporaryDirectory() as folder:
        grasp = steps.run_all(
            grasp_rate.jobs(options.build, options.boards, folder, min(options.seconds, SHORT_s), few.get("boards", BOARDS))
        )
        of_grasp = grasp_rate.figures(grasp)
    found = judge(figures(runs, resting, rows) | of_grasp, GOALS)
    found |= {"by_osr": by_osr(runs), "scenes": rows}
    pictures = {"rate.png": lambda path: rate_report.draw(path, found, runs[PARALLEL, 256])}
    return publish(found, options, "rate", pictures | {"scenes.png": lambda path: rate_report.draw_scenes(path, rows)})


if __name__ == "__main__":
    sys.exit(run_tool("rate.py", main))
