#!/usr/bin/python3
"""Draws a grasp in the simulated cell over its truth, and prints what became of its slips.

    grasp.py RECORDING.csv TRUTH.csv -o FILE.png

RECORDING.csv: of fingertip grasp; TRUTH.csv: of fingertip simulate --lift.
"""

import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "python"))
from fingertip.command import Parser, check_output, run_tool  # noqa: E402
from fingertip.files import InputError, read_lines  # noqa: E402
from fingertip.grip_file import read_grip  # noqa: E402
from fingertip.plot import FAINT, INK, MEASURED, SLIPPING, TRUTH, set_style, spans, write_figure  # noqa: E402

SLIP_mm, JOINED_s, MORE_FORCE = 0.3, 0.03, 1.05  # as the cell counts slips, and what is a reaction
HAPPENINGS = ("lift", "pour", "knock", "slick", "push", "vibrate", "carry")


def read_truth(path):
    rows = [line.split(",") for line in read_lines(path) if line and not line.startswith("#")]
    try:
        values = np.array(rows[1:], dtype=float)
        return {name: values[:, i] for i, name in enumerate(rows[0])}
    except (ValueError, IndexError) as error:
        raise InputError(f"{path}: is no truth of fingertip simulate --lift") from error


def remarks(path):
    """The kind of the grasp, "none" if nothing drew it, and [(time_us, what)] of what happened to the object."""
    kind, happened = "none", []
    for line in read_lines(path):
        if line.startswith("# kind: "):
            kind = line.split(": ", 1)[1].strip()
        elif line.startswith("# event: "):
            time_us, _, text = line.removeprefix("# event: ").partition(",")
            what = text.partition(" ")[0]
            if what in HAPPENINGS and time_us.isdigit():
                happened.append((int(time_us), what))
    return kind, happened


def slips_of(truth, t_s):
    """(begin, reaction or None, end, mm) of each: the truth's rows are 2 ms apart."""
    on = truth["slips"] > 0
    joined = []
    for begin, end in spans(t_s, on):
        if joined and begin - joined[-1][1] < JOINED_s:
            joined[-1][1] = end
        else:
            joined.append([begin, end])
    slips = []
    for begin, end in joined:
        first, last = np.searchsorted(t_s, (begin, end))
        way_mm = truth["slid_mm"][last] - truth["slid_mm"][max(first - 1, 0)]
        if way_mm >= SLIP_mm and truth["force_N"][first] > 0.05:
            more = np.flatnonzero((t_s >= begin) & (truth["force_N"] >= MORE_FORCE * truth["force_N"][first]))
            slips.append((begin, t_s[more[0]] if len(more) else None, end, way_mm))
    return slips


def draw(grip, t_s, truth, truth_s, slips, happened):
    set_style()
    figure, (force, load, slid, width) = plt.subplots(4, 1, sharex=True, figsize=(12, 8), height_ratios=[3, 1.6, 1.3, 1.6])
    figure.subplots_adjust(left=0.065, right=0.985, top=0.9, bottom=0.065, hspace=0.14)
    controlled = np.isin(grip["state"], ("squeeze", "ready", "holding", "slipping", "placing", "handing"))
    for panel, name in ((force, "force_N"), (load, "load_N"), (slid, "slid_mm"), (width, "width_mm")):
        panel.plot(truth_s, truth[name], color=TRUTH, lw=3.5, label="true force" if panel is force else "truth", zorder=1)
        panel.set_ylabel(name.replace("_", ", "))
        panel.grid(color="#e6e8ee", lw=0.6)
        for begin, reaction, end, _ in slips:
            panel.axvspan(begin, end, color=SLIPPING, alpha=0.15, lw=0, zorder=0)
            if reaction:
                panel.axvline(reaction, color=SLIPPING, lw=1, ls=":", zorder=1)
    need_N = np.where(truth["least_N"] > 0, truth["least_N"], np.nan)
    force.plot(truth_s, need_N, color=SLIPPING, lw=1, ls="--", label="need: the least that holds it")
    force.plot(t_s, grip["force_N"], color=MEASURED, lw=1.1, label="measured", zorder=2)
    force.plot(t_s, np.where(controlled, grip["wanted_N"], np.nan), color=INK, lw=1.3, drawstyle="steps-post", label="wanted", zorder=3)
    load.plot(t_s, np.where(controlled & (grip["margin"] > 0), grip["load_N"], np.nan), color=MEASURED, lw=1.1)
    width.plot(t_s, grip["width_mm"], color=MEASURED, lw=1.1, label="reported")
    for at_s, what in happened:
        force.axvline(at_s, color=FAINT, lw=0.8, zorder=0)
        above = {"xycoords": ("data", "axes fraction"), "xytext": (0, 1), "textcoords": "offset points", "ha": "center", "va": "bottom"}
        force.annotate(what, (at_s, 1.0), size=8, color=FAINT, **above)
    slid.set_ylim(bottom=min(0, truth["slid_mm"].min()) - 0.05, top=max(1.0, 1.1 * truth["slid_mm"].max()))
    force.legend(loc="upper left", fontsize=8, frameon=False)
    width.legend(loc="upper right", fontsize=8, frameon=False)
    width.set_xlabel("time, s   (red: the object slips; dotted: the grip is 5 % stronger)")
    width.set_xlim(t_s[0], t_s[-1])
    return figure


def main(argv):
    parser = Parser(description=__doc__)
    parser.add_argument("recording", metavar="RECORDING.csv")
    parser.add_argument("truth", metavar="TRUTH.csv")
    parser.add_argument("-o", "--output", required=True, metavar="FILE.png")
    options = parser.parse_args(argv)
    check_output(options.output, options.recording, options.truth)
    grip, truth = read_grip(options.recording), read_truth(options.truth)
    zero = next((line for line in read_lines(options.recording) if line.startswith("# host_zero_us: ")), None)
    if zero is None or not len(grip["time_us"]) or not len(truth["time_us"]):
        raise InputError(f"{options.recording}: is no recording of a grasp, or {options.truth} is empty")
    t_s, truth_s = grip["time_us"] / 1e6, (truth["time_us"] - int(zero.split()[-1])) / 1e6
    slips = slips_of(truth, truth_s)
    kind, events = remarks(options.truth)
    happened = [((time_us - int(zero.split()[-1])) / 1e6, what) for time_us, what in events]
    figure = draw(grip, t_s, truth, truth_s, slips, happened)
    need_N = truth["least_N"].max()
    peak = f"peak force {truth['peak_N'].max():.1f} N" + (f", {truth['peak_N'].max() / need_N:.1f} times the need" if need_N > 0 else "")
    if truth["dropped"].max() > 0:
        result = f"dropped after it slid by {truth['slid_mm'].max():.1f} mm; {peak}"
    elif slips:
        begin, reaction, end, way_mm = max(slips, key=lambda slip: slip[3])
        answered = f", more force after {1e3 * (reaction - begin):.0f} ms" if reaction else ""
        result = f"slid by {way_mm:.1f} mm{answered}, caught after {1e3 * (end - begin):.0f} ms"
        all_mm = truth["slid_mm"].max()
        result += f" ({all_mm:.1f} mm in all); {peak}" if all_mm >= way_mm + SLIP_mm else f"; {peak}"
    else:
        result = f"never slipped; {peak}"
    figure.text(0.065, 0.955, "A grasp in the simulated cell" + (f", of kind {kind}" if kind != "none" else ""), size=15, weight="bold")
    figure.text(0.065, 0.927, f"{result}  ·  simulated rubber, object and gripper; the firmware itself on the host", size=9, color=FAINT)
    write_figure(figure, options.output, 100)
    print(f"the grasp: {result}")
    return 0


if __name__ == "__main__":
    sys.exit(run_tool("grasp.py", main))
