"""Draws a recording, with the truth behind it if there is one; force along three axes where it has tangential forces.
Of a grasp it draws wanted and measured force, load, width and state, unless --device chooses one of its fingertips.
With --beside it draws what another fingertip of the recording measured of the same scenario, for example before a calibration.

    fingertip-plot RECORDING.csv [--truth SCENARIO.csv] [--run run.json] -o FILE.png [--overwrite]
"""

import argparse
import io
import sys

try:
    import matplotlib
except ImportError:
    sys.exit("fingertip-plot: matplotlib is not installed: pip install matplotlib")

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import FancyBboxPatch

from .command import Parser, check_output
from .evaluate import Comparison, add_recording_options, check_time, load_recording
from .files import FIT_VALID, MOVING, SLIDING, SLIP, STAGES, TANGENTIAL_FROM_TOUCH, TANGENTIAL_VALID, WARNINGS, InputError
from .files import read_run, read_scenario, recorded_devices, restart_rows, write_bytes
from .grip_file import read_grip

INK, FAINT, TRUTH, MEASURED, SLIPPING, DOUBTFUL = "#22252e", "#8a8f9c", "#b4bac6", "#1f6fd6", "#d93a3a", "#d08a00"
ALONG_Y = "#0d9488"
TIME_COLOURS = "winter"  # from blue to green: far from DOUBTFUL and SLIPPING
# A legend that covers no curve.
ABOVE = {"loc": "lower right", "bbox_to_anchor": (1, 1), "borderaxespad": 0.2, "fontsize": 8, "frameon": False}
RIM_mm = 6.0
POINTS = 4000  # that are drawn of a curve, some four for each pixel
STATES = (FIT_VALID, WARNINGS, SLIP, TANGENTIAL_VALID, MOVING, SLIDING)  # that curves break at, or marks show
# All that a picture needs: 250 000 rows of these are 30 MB, of all columns 130.
COLUMNS = ("t_us", "frame", "flags", "x_mm", "y_mm", "force_N", "qx_N", "qy_N", "q_sd_N", "tangential_ratio")
GRASP_COLUMNS = ("t_us", "frame", "flags", "force_N")
COMPARED_COLUMNS = (*COLUMNS, *STAGES, "total_us")


def positions(recording):
    try:
        x, y = (np.array([float(v) for v in recording.metadata[key].split()]) for key in ("x_mm", "y_mm"))
    except (KeyError, ValueError):
        return np.empty(0), np.empty(0)
    return x, y


def gaps_as_nan(t_s, values, fitted):
    """Values with NaN where nothing is fitted or frames are missing, so that lines break there."""
    values = np.where(fitted, values, np.nan)
    if len(t_s) > 2:
        steps_s = np.diff(t_s)
        values[1:][steps_s > 5 * max(np.median(steps_s), np.mean(steps_s))] = np.nan
    return values


def thinned(recording, rows):
    """Of many rows those with the least and the largest force of each bin, and where a state changes: a picture has no room for more."""
    step = len(rows) // POINTS
    if step < 2:
        return rows
    bins = len(rows) // step
    force = np.nan_to_num(recording["force_N"][rows[: bins * step]]).reshape(bins, step)
    first, states = np.arange(bins) * step, [recording.flag(flag)[rows] for flag in STATES]
    change = np.flatnonzero(np.diff(states).any(axis=0))
    return rows[
        np.unique(np.concatenate((first + force.argmin(axis=1), first + force.argmax(axis=1), change, change + 1, [len(rows) - 1])))
    ]


def continuous_time_s(recording, rows):
    """One axis for all runs of a fingertip that restarted, and where each but the first begins. The recorder's clock
    where there is one; else the runs follow one another, for the time between is unknown."""
    t_s, frame = recording["t_us"][rows] / 1e6, recording["frame"][rows]
    restarts = restart_rows(t_s, frame)
    if recording.time_us is not None:
        t_s = recording.time_us[rows] / 1e6
    else:
        interval_s = np.median(np.abs(np.diff(t_s))) if len(t_s) > 1 else 0.0
        for at in restarts:
            t_s[at:] += t_s[at - 1] - t_s[at] + interval_s
    return t_s, t_s[restarts]


def draw_pad(axes, recording, t_s, x, y, good, doubtful, truth):
    sensor_x, sensor_y = positions(recording)
    if len(sensor_x):
        corner = (sensor_x.min() - RIM_mm, sensor_y.min() - RIM_mm)
        size = (np.ptp(sensor_x) + 2 * RIM_mm, np.ptp(sensor_y) + 2 * RIM_mm)
        axes.add_patch(FancyBboxPatch(corner, *size, boxstyle="round,pad=0,rounding_size=2.5", fc="#f3f4f7", ec=TRUTH, zorder=0))
        axes.scatter(sensor_x, sensor_y, s=120, marker="s", fc="white", ec=TRUTH, zorder=1)
        for k, (sx, sy) in enumerate(zip(sensor_x, sensor_y)):
            axes.text(sx, sy, str(k), color=FAINT, size=6.5, ha="center", va="center", zorder=1)
        axes.set_xlim(corner[0] - 1, corner[0] + size[0] + 1)
        axes.set_ylim(corner[1] - 1, corner[1] + size[1] + 1)
    if truth is not None:
        true_x, true_y = (np.where(truth.truth["contact"] > 0.5, truth.truth[name], np.nan) for name in ("x_mm", "y_mm"))
        axes.plot(true_x, true_y, color=TRUTH, lw=5, solid_capstyle="round", zorder=2)
    axes.scatter(x[doubtful], y[doubtful], s=9, fc="none", ec=DOUBTFUL, lw=0.5, zorder=3)
    points = axes.scatter(x[good], y[good], c=t_s[good], s=9, cmap=TIME_COLOURS, lw=0, zorder=3)
    bar = plt.colorbar(points, ax=axes, orientation="horizontal", pad=0.07, fraction=0.03, aspect=40)
    bar.set_label("time, s", size=8)
    bar.outline.set_visible(False)
    axes.set_aspect("equal")
    axes.set_xlabel("x, mm")
    axes.set_ylabel("y, mm")
    axes.set_title("contact on the pad", loc="left", size=10)


def runs(on):
    """(first, last) of consecutive rows that are on."""
    edges = np.diff(np.concatenate(([0], on.astype(int), [0])))
    return list(zip(np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1))


def spans(t_s, on):
    """(start, end) of consecutive rows that are on, each to the next row: of a state that lasts until another is reported."""
    ends = np.append(t_s[1:], t_s[-1])
    return [(t_s[first], ends[last]) for first, last in runs(on)]


def draw_doubtful(panel, t_s, curves, doubtful, scales=False):
    """What carries a warning is shown, but no axis is made for it, unless there is nothing else."""
    low, high = panel.get_ylim()
    for values in curves:
        label = "doubtful" if doubtful.any() and "doubtful" not in panel.get_legend_handles_labels()[1] else None
        panel.scatter(t_s[doubtful], values[doubtful], s=7, fc="none", ec=DOUBTFUL, lw=0.5, label=label, zorder=2)
    if not scales:
        panel.set_ylim(low, high)
    panel.grid(color="#e6e8ee", lw=0.6)


def draw_marks(panel, marks):
    """Below the curves a line for each (t_s, on, colour, label), wherever it is on."""
    low, high = panel.get_ylim()
    step = 0.06 * (high - low)
    for i, (t_s, on, colour, label) in enumerate(marks):
        for j, (first, last) in enumerate(runs(on)):
            reach, height = [t_s[first], max(t_s[last], t_s[first] + 1e-3)], [low - (i + 1) * step] * 2
            panel.plot(reach, height, color=colour, lw=4, solid_capstyle="butt", label=None if j else label)
    panel.set_ylim(low - (len(marks) + 0.7) * step, high)


def draw_pull(axes, recording, rows, t_s, restarts_s, force, good, doubtful, truth):
    """Tangential force along x and y, and its ratio to the normal force."""
    loads, ratios = axes
    there = recording.flag(TANGENTIAL_VALID)[rows]
    good, doubtful = good & there, doubtful & there
    qx, qy, sd, ratio = (recording[name][rows] for name in ("qx_N", "qy_N", "q_sd_N", "tangential_ratio"))
    if truth is not None and truth.has_pull:
        on = truth.truth["contact"] > 0.5
        for i, name in enumerate(("Qx_N", "Qy_N")):
            loads.plot(truth.t_s, np.where(on, truth.truth[name], np.nan), color=TRUTH, lw=4, label="truth" if i == 0 else None, zorder=1)
        true_N = np.where(on & (truth.truth["force_N"] > 0), truth.truth["force_N"], np.nan)
        ratios.plot(truth.t_s, np.hypot(truth.truth["Qx_N"], truth.truth["Qy_N"]) / true_N, color=TRUTH, lw=4, zorder=1)
    for values, colour, label in ((qx, MEASURED, "along x"), (qy, ALONG_Y, "along y")):
        drawn = gaps_as_nan(t_s, values, good)
        loads.plot(t_s, drawn, color=colour, lw=1.1, label=label, zorder=2)
        loads.fill_between(t_s, drawn - sd, drawn + sd, color=colour, alpha=0.15, lw=0, zorder=1.5)
    ratios.plot(t_s, gaps_as_nan(t_s, ratio, good), color=MEASURED, lw=1.1, zorder=2)
    spread = np.divide(sd, force, out=np.full(len(sd), np.nan), where=force > 0)
    drawn = gaps_as_nan(t_s, ratio, good)
    ratios.fill_between(t_s, np.maximum(drawn - spread, 0), drawn + spread, color=MEASURED, alpha=0.15, lw=0, zorder=1.5)
    for panel, curves in ((loads, (qx, qy)), (ratios, (ratio,))):
        draw_doubtful(panel, t_s, curves, doubtful, scales=not good.any() and truth is None)
        for at_s in restarts_s:
            panel.axvline(at_s, color=FAINT, lw=1, ls=":")
    since = " since touch" if recording.flag(TANGENTIAL_FROM_TOUCH)[rows][there].any() else ""
    loads.set_ylabel(f"Q{since}, N")
    ratios.set_ylabel(f"Q/F{since}")
    draw_marks(ratios, [(t_s, recording.flag(MOVING)[rows], DOUBTFUL, "moving"), (t_s, recording.flag(SLIDING)[rows], SLIPPING, "sliding")])
    for panel in axes:
        if panel.get_legend_handles_labels()[0]:
            panel.legend(ncol=5, **ABOVE)


class Beside:
    """Another fingertip of the recording, compared with the same truth."""

    def __init__(self, options, truth):
        recording = of_device(options, options.beside, COMPARED_COLUMNS)
        check_time(recording)
        self.name, self.comparison = options.beside_name or options.beside, Comparison(recording, truth, read_run(options.beside_run))
        rows = recording.has_contact
        self.t_s = self.comparison.t_s
        self.good = recording.flag(FIT_VALID)[rows] & ~recording.flag(WARNINGS)[rows]
        self.values = {"x_mm": self.comparison.x_mm, "y_mm": self.comparison.y_mm, "force_N": self.comparison.force_N}


def draw_over_time(axes, t_s, restarts_s, series, good, doubtful, slip, truth, beside):
    for panel in axes:
        for i, at_s in enumerate(restarts_s):
            panel.axvline(at_s, color=FAINT, lw=1, ls=":", label="restarted" if i == 0 else None)
    for panel, (label, name, values) in zip(axes, series):
        if truth is not None:
            on = truth.truth["contact"] > 0.5
            panel.plot(truth.t_s, np.where(on, truth.truth[name], np.nan), color=TRUTH, lw=4, label="truth", zorder=1)
            for start, end in truth.intervals("slip"):
                panel.axvspan(start, end, color=SLIPPING, alpha=0.10, lw=0, zorder=0)
        if beside:
            values_beside = gaps_as_nan(beside.t_s, beside.values[name], beside.good)
            panel.plot(beside.t_s, values_beside, color=ALONG_Y, lw=1.1, ls="--", label=beside.name, zorder=1.5)
        panel.plot(t_s, gaps_as_nan(t_s, values, good), color=MEASURED, lw=1.1, label="measured", zorder=2)
        draw_doubtful(panel, t_s, [values], doubtful, scales=not good.any() and truth is None)
        panel.set_xlim(t_s[0], t_s[-1])
        panel.set_ylabel(label)
    draw_marks(axes[-1], [(t_s, slip, SLIPPING, "slip found")])
    axes[-1].legend(ncol=5, **ABOVE)
    axes[0].set_title("over time" + (" (shaded: true slip)" if truth is not None else ""), loc="left", size=10)


def draw_errors(axes, comparison, beside):
    location, force = axes
    both = [(comparison, {"color": MEASURED})]
    if beside:
        both.append((beside.comparison, {"color": ALONG_Y, "histtype": "step", "lw": 1.1}))
    errors_mm = [one.location_error_mm[one.compared] for one, _ in both]
    reach_mm = max(np.percentile(np.concatenate(errors_mm), 99), 1e-3)
    for error_mm, (_, style) in zip(errors_mm, both):
        location.hist(error_mm, bins=40, range=(0, reach_mm), **style)
        location.axvline(np.median(error_mm), color=INK if style["color"] == MEASURED else ALONG_Y, lw=1)
    location.set_xlabel("location error, mm (line: median)")
    percents = [100 * one.force_error_N[one.strong] / one.true_force_N[one.strong] for one, _ in both]
    if any(map(len, percents)):
        reach = max(np.percentile(np.abs(np.concatenate(percents)), 99), 1e-3)
        for percent, (_, style) in zip(percents, both):
            force.hist(percent, bins=41, range=(-reach, reach), **style)
        force.axvline(0, color=INK, lw=1)
    force.set_xlabel("force error, %")
    force.locator_params(axis="x", nbins=5)
    for panel in axes:
        panel.set_ylabel("frames")


def draw_grasp(path, grip, fingertips):
    """Draws into this file. Returns a line about it."""
    set_style()
    figure = plt.figure(figsize=(14, 8.5))
    grid = figure.add_gridspec(4, 1, height_ratios=[3, 1.6, 1.6, 0.7], hspace=0.18, left=0.055, right=0.985, top=0.9, bottom=0.07)
    force = figure.add_subplot(grid[0])
    panels = [force, *(figure.add_subplot(grid[i], sharex=force) for i in range(1, 4))]
    _, load, width, state = panels
    t_s = grip["time_us"] / 1e6
    controlled = np.isin(grip["state"], ("squeeze", "ready", "holding", "slipping", "placing", "handing"))
    for recording, colour, label in zip(fingertips, (MEASURED, ALONG_Y), ("left", "right")):
        rows = recording.has_contact
        measured_s, flags = recording.time_us[rows] / 1e6, recording.flag(FIT_VALID)[rows]
        doubtful = flags & recording.flag(WARNINGS)[rows]
        values = recording["force_N"][rows]
        force.plot(measured_s, gaps_as_nan(measured_s, values, flags & ~doubtful), color=colour, lw=1.1, label=label, zorder=2)
        draw_doubtful(force, measured_s, [values], doubtful)
    force.plot(t_s, np.where(controlled, grip["wanted_N"], np.nan), color=INK, lw=1.4, drawstyle="steps-post", label="wanted", zorder=3)
    load.plot(t_s, np.where(controlled & (grip["margin"] > 0), grip["load_N"], np.nan), color=MEASURED, lw=1.1)
    width.plot(t_s, grip["width_mm"], color=MEASURED, lw=1.1, label="reported")
    width.plot(t_s, np.where(grip["motion"] == 2, grip["command_mm"], np.nan), color=INK, lw=0.9, ls=":", label="commanded")
    slipping = spans(t_s, grip["state"] == "slipping")
    for panel in panels[:3]:
        for start, end in slipping:
            panel.axvspan(start, max(end, start + 1e-3), color=SLIPPING, alpha=0.15, lw=0, zorder=0)
        panel.grid(color="#e6e8ee", lw=0.6)
        panel.tick_params(labelbottom=False)
    for start, _ in slipping:
        force.axvline(start, color=SLIPPING, lw=1, zorder=1)
    colours = {"slipping": SLIPPING, "dropped": SLIPPING, "missed": SLIPPING, "fault": SLIPPING}
    colours |= dict.fromkeys(("ready", "holding", "placing", "handing"), ALONG_Y)
    for name in dict.fromkeys(grip["state"]):
        for start, end in spans(t_s, grip["state"] == name):
            state.barh(0.5, end - start, left=start, height=1, color=colours.get(name, TRUTH), ec="white", lw=0.5)
            if end - start > 0.05 * (t_s[-1] - t_s[0]):
                state.text((start + end) / 2, 0.5, name, ha="center", va="center", size=8, color="white" if name in colours else INK)
    troubled = spans(t_s, grip["trouble"] != "")
    for start, end in troubled:
        state.plot([start, max(end, start + 1e-3)], [-0.2] * 2, color=DOUBTFUL, lw=4, solid_capstyle="butt")
    state.set_ylim(-0.5, 1)
    state.set_yticks([])
    state.set_xlabel("time, s" + (" (below: something was wrong)" if troubled else ""))
    force.set_ylabel("force, N")
    load.set_ylabel("load, N")
    width.set_ylabel("width, mm")
    force.set_ylim(bottom=0)
    force.set_xlim(t_s[0], t_s[-1])
    force.legend(loc="upper left", ncol=3, fontsize=8, frameon=False)
    width.legend(loc="upper right", ncol=2, fontsize=8, frameon=False)
    slides = int(grip["slides"].max())
    summary = f"{slides} slide{'' if slides == 1 else 's'}, held by at most {np.nanmax(grip['force_N']):.1f} N, at last {grip['state'][-1]}"
    figure.text(0.055, 0.955, "Fingertip, a grasp", size=17, weight="bold")
    identity = "  ·  ".join(
        text for text in (*(f.metadata.get("serial", "") for f in fingertips), fingertips[0].metadata.get("grasp_gripper", "")) if text
    )
    figure.text(0.055, 0.925, f"{identity}  ·  {summary}", size=9, color=FAINT)
    write_figure(figure, path)
    return summary


def set_style():
    colours = {"axes.edgecolor": TRUTH, "axes.labelcolor": INK, "xtick.color": FAINT, "ytick.color": FAINT, "text.color": INK}
    plt.rcParams.update(colours | {"font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "axes.titlecolor": FAINT})


def write_figure(figure, path, dpi=110):
    picture = io.BytesIO()
    figure.savefig(picture, dpi=dpi, format="png")
    write_bytes(path, picture.getvalue())


def of_device(options, device, columns):
    """The recording of this fingertip among several."""
    return load_recording(argparse.Namespace(**{**vars(options), "device": device}), columns=columns)


def compared_in_words(summary):
    """How far location and force were off."""
    force = summary["force_mape_percent"]
    return (
        f"location: median {summary['localisation_median_mm']:.3f} mm, 95 % {summary['localisation_p95_mm']:.3f} mm  ·  force: "
        + (f"median {force:.2f} %, " if force is not None else "")
        + f"RMSE {summary['force_rmse_N']:.3f} N"
    )


def header(recording, comparison, t_s, simulated, beside):
    identity = "  ·  ".join(recording.metadata[key] for key in ("serial", "board", "scene", "git") if recording.metadata.get(key))
    lines = [identity]
    if comparison:
        s = comparison.summary
        lines.append(
            f"{compared_in_words(s)}  ·  slips: {s['slip_found']} found, {s['slip_missed']} missed, {s['slip_false']} false frames  ·  "
            + (f"Q/F: median {s['tangential_ratio_error_p50']:.3f}  ·  " if s["tangential_frames"] else "")
            + f"dropped packets: {'?' if s['dropped_packets'] is None else s['dropped_packets']}"
        )
        if beside:
            lines.append(f"{beside.name}, dashed  ·  {compared_in_words(beside.comparison.summary)}")
    else:
        dropped = (recording.end or {}).get("dropped_packets", "?")
        lines.append(f"{len(recording.has_contact)} frames in {t_s[-1] - t_s[0]:.1f} s  ·  dropped packets: {dropped}")
    return ("Fingertip, simulated sensors" if simulated else "Fingertip"), lines


def main(argv):
    parser = Parser(prog="fingertip-plot", description=__doc__)
    parser.add_argument("recording", metavar="RECORDING.csv")
    parser.add_argument("--truth", metavar="SCENARIO.csv", help="the scenario that was played")
    parser.add_argument("--run", metavar="run.json", help="the emulator's report: the recording is of simulated sensors")
    parser.add_argument("-o", "--output", required=True, metavar="FILE.png")
    parser.add_argument("--beside", metavar="SERIAL", help="another fingertip of the recording with the same scenario; with --truth")
    parser.add_argument("--beside-name", metavar="WORDS", help="what it is called in the picture; default: its serial number")
    parser.add_argument("--beside-run", metavar="run.json", help="the emulator's report of that one")
    add_recording_options(parser)
    options = parser.parse_args(argv)
    if options.beside and not options.truth:
        raise InputError("--beside compares with a truth; give it with --truth SCENARIO.csv")
    if not options.output.lower().endswith(".png"):
        raise InputError(f"{options.output}: no name of a picture; give one that ends in .png")
    check_output(options.output, options.recording, options.truth, options.run, options.beside_run, replace=options.overwrite)
    if not options.device and not options.truth and len(recorded_devices(options.recording)) == 2:
        grip = read_grip(options.recording, options.salvage)
        if grip:
            inside = (grip["time_us"] >= options.from_s * 1e6) & (grip["time_us"] <= options.to_s * 1e6)
            if not inside.any():
                raise InputError(f"{options.recording}: nothing of the grasp from --from to --to; give a part that has some")
            grip = {name: values[inside] for name, values in grip.items()}
            fingertips = [of_device(options, serial, GRASP_COLUMNS) for serial in recorded_devices(options.recording)]
            print(f"{options.output}: {draw_grasp(options.output, grip, fingertips)}")
            return 0
    run = read_run(options.run)
    truth = read_scenario(options.truth) if options.truth else None
    recording = load_recording(options, columns=COMPARED_COLUMNS if truth else COLUMNS)
    if truth:
        check_time(recording)
    comparison = Comparison(recording, truth, run) if truth else None
    beside = Beside(options, truth) if options.beside else None
    rows = np.flatnonzero(recording.has_contact)
    rows = rows if comparison else thinned(recording, rows)
    if not len(rows):
        raise InputError(f"{options.recording}: no contact packet in it, or in this part of it; record with the contact stream on")
    t_s, restarts_s = (comparison.t_s, ()) if comparison else continuous_time_s(recording, rows)
    x, y, force = (recording[name][rows] for name in ("x_mm", "y_mm", "force_N"))
    fitted, slip = recording.flag(FIT_VALID)[rows], recording.flag(SLIP)[rows]
    doubtful = fitted & recording.flag(WARNINGS)[rows]
    good = fitted & ~doubtful

    set_style()
    pulled = recording.flag(TANGENTIAL_VALID)[rows].any()
    over_time = 5 if pulled else 3
    height = 9.2 + 3.6 * pulled
    from_top = lambda of_usual: 1 - (1 - of_usual) * 9.2 / height
    figure = plt.figure(figsize=(14, height))
    edges = {"left": 0.055, "right": 0.985, "top": from_top(0.85 if beside else 0.87), "bottom": 0.06 * 9.2 / height}
    grid = figure.add_gridspec(over_time + bool(comparison), 3, width_ratios=[1.25, 1, 1], hspace=0.38, wspace=0.27, **edges)
    draw_pad(figure.add_subplot(grid[:, 0]), recording, t_s, x, y, good, doubtful, truth)
    first = figure.add_subplot(grid[0, 1:])
    panels = [first, *(figure.add_subplot(grid[i, 1:], sharex=first) for i in range(1, over_time))]
    series = [("x, mm", "x_mm", x), ("y, mm", "y_mm", y), ("force, N", "force_N", force)]
    draw_over_time(panels[:3], t_s, restarts_s, series, good, doubtful, slip, truth, beside)
    if pulled:
        draw_pull(panels[3:], recording, rows, t_s, restarts_s, force, good, doubtful, truth)
    panels[-1].set_xlabel("time, s")
    for panel in panels:
        panel.tick_params(labelbottom=panel is panels[-1])
    if comparison:
        draw_errors([figure.add_subplot(grid[over_time, 1]), figure.add_subplot(grid[over_time, 2])], comparison, beside)
    title, lines = header(recording, comparison, t_s, options.run is not None, beside)
    figure.text(0.055, from_top(0.955), title, size=17, weight="bold")
    for i, line in enumerate(lines):
        figure.text(0.055, from_top(0.93 - 0.022 * i), line, size=9, color=INK if i else FAINT)
    write_figure(figure, options.output)
    print(f"{options.output}: {lines[1]}")
    return 0
