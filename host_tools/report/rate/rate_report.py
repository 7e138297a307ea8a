"""rate.json as a picture."""

import itertools
import textwrap

import matplotlib
from boards import BOARDS, PARALLEL
from presentation import BLUE, FAINT, GOAL, ORANGE, plt, save
from emulated import CONVERSION_us
from scenes import WORDS, capabilities

COLOURS = dict(zip(BOARDS, itertools.cycle((BLUE, ORANGE, GOAL, FAINT))))


def draw(path, found, parallel):
    figure, panels = plt.subplot_mosaic("RL;SS", figsize=(12, 8))
    draw_rates(panels["R"], found)
    draw_latency(panels["L"], found, parallel)
    draw_stages(panels["S"], found)
    for axes in panels.values():
        axes.grid()
        axes.legend(fontsize=8)
    figure.tight_layout()
    save(figure, path)


def draw_scenes(path, rows):
    """What each scene computes and leaves out on the parallel board, with its bytes and cycles."""
    rows, on = [row for row in rows if row["board"] == PARALLEL], capabilities()
    names = ("flash_bytes", "ram_bytes", "stack_bytes", "cycles_of_frame")
    headings = [textwrap.fill(name.replace("_", " "), 13) for name in (*WORDS.values(), *names)]
    cells = [["" for _ in WORDS] + [f"{row[name]:.0f}" for name in names] for row in rows]
    colours = [[BLUE if name in on[row["scene"]] else "white" for name in (*WORDS, *names)] for row in rows]
    figure, axes = plt.subplots(figsize=(13, 1.6 + 0.35 * len(rows)), layout="constrained")
    table = axes.table(
        cells, colours, rowLabels=[row["scene"] for row in rows], colLabels=headings, cellLoc="center", bbox=(0.05, 0, 0.95, 1)
    )
    table.auto_set_font_size(False)
    for (down, _), cell in table.get_celld().items():
        cell.set(height=4 if down == 0 else 1, edgecolor=FAINT, fontsize=8.5)
    axes.set_axis_off()
    axes.set_title(
        f"What each scene computes (blue), leaves out (white) and takes: {PARALLEL}, OSR 256, in contact", loc="left", weight="bold"
    )
    save(figure, path)


def draw_rates(axes, found):
    osrs = sorted({row["osr"] for row in found["by_osr"]})
    axes.plot(osrs, [1e6 / CONVERSION_us[osr] for osr in osrs], "--", color=FAINT, lw=1, label="conversion alone")
    for board in BOARDS:
        rows = [row for row in found["by_osr"] if row["board"] == board]
        axes.plot([row["osr"] for row in rows], [row["fitted_per_s"] for row in rows], "o-", color=COLOURS[board], label=board)
        for row in rows:
            axes.annotate(
                f"{row['fitted_per_s']:.0f}",
                (row["osr"], row["fitted_per_s"]),
                textcoords="offset points",
                xytext=(5, 6 if board == BOARDS[0] else -13),
                fontsize=8,
                bbox={"fc": "white", "ec": "none", "pad": 0.5},
            )
    for name, sign, osr in (("parallel", 1250, 256), ("parallel", 410, 1024), ("mux", 260, 256), ("mux", 185, 1024)):
        axes.plot(osr, sign, "_", color=GOAL, ms=16, mew=2, label="goal" if (name, osr) == ("parallel", 256) else None)
    axes.set(xscale="log", yscale="log", xlabel="OSR", ylabel="fitted frames a second", title="Rate in contact")
    axes.set_ylim(bottom=0.7 * axes.get_ylim()[0])
    axes.set_xticks(osrs, [str(osr) for osr in osrs])
    axes.minorticks_off()


def draw_latency(axes, found, parallel):
    for name, values, colour in (
        ("offered to the USB controller", parallel.offered_us, BLUE),
        ("last byte on the wire", parallel.delivered_us, FAINT),
    ):
        axes.hist(values, bins=120, histtype="stepfilled", alpha=0.6, color=colour, label=name, log=True)
    goal_us = float(found["goals"]["latency_parallel_us"]["goal"].split()[1])
    axes.axvline(goal_us, color=GOAL, lw=2, label=f"goal of the first: {goal_us:.0f} us")
    axes.set(xlabel="us after the end of conversion", ylabel="packets", title=f"Latency on {PARALLEL}, OSR 256")


def draw_stages(axes, found):
    rows = found["scenes"][::-1]
    labels = [f"{row['scene']}\n{row['board']}" for row in rows]
    left = [0] * len(rows)
    for i, stage in enumerate(rows[0]["cycles_by_stage"]):
        width = [row["cycles_by_stage"][stage] / 1e3 for row in rows]
        axes.barh(labels, width, left=left, color=matplotlib.colormaps["tab20"](i), label=stage)
        left = [a + b for a, b in zip(left, width)]
    axes.set(xlabel="thousand cycles of a frame, OSR 256, in contact", title="Where the cycles go")
    axes.tick_params(axis="y", labelsize=7)
