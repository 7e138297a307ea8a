"""rate.json as text and as a picture."""

import itertools

import matplotlib
import scenes
from boards import BOARDS, DESCRIPTORS, PARALLEL, short
from presentation import BLUE, FAINT, GOAL, ORANGE, goal_table_md, plt, save, table_md
from emulated import CONVERSION_us

# Twenty-six pins on a Pico's edge, one for SCL.
DATA_PINS = 25
COLOURS = dict(zip(BOARDS, itertools.cycle((BLUE, ORANGE, GOAL, FAINT))))


def number(value):
    if value is None:
        return ""
    return f"{value:.1f}" if isinstance(value, float) else str(value)


def table(rows, columns):
    """columns: heading -> function of a row."""
    return table_md(columns, [[number(cell(row)) for cell in columns.values()] for row in rows])


def text(found, how):
    field = lambda *names: lambda row: row[names[0]] if len(names) == 1 else row[names[0]][names[1]]
    lines = [
        "# Rate, latency and cost",
        "",
        "Written by `sh cmake/bootstrap.sh report`.",
        "",
        "![Rates, latency, cycles](rate.png)",
        "",
        *goal_table_md(found),
        "",
        how.strip(),
        "",
        f"On {PARALLEL} at OSR 256, over {found['seconds']:.0f} s at {found['contact_frames_per_s']:.0f} frames/s:",
        "",
        *table(
            [
                {"what": what, **{name: found[f"{key}_parallel_{name}_us"] for name in ("median", "p99", "p99_9", "max")}}
                for what, key in (("offered", "latency"), ("delivered", "delivery"))
            ],
            {
                "us after the conversion": field("what"),
                "median": field("median"),
                "p99": field("p99"),
                "p99.9": field("p99_9"),
                "max": field("max"),
            },
        ),
        "",
        f"- Lost: {found['sequence_gaps']} gaps in the sequence, {found['packets_dropped']} packets dropped and {found['frames_skipped']} frames",
        f"  skipped by the device's own count, {found['frames_missing']} frame numbers that never came, {found['unfitted']} frames without a fit.",
        f"- Steps of the frame clock differ by {found['clock_jitter_us']:.0f} us at most.",
        "- Skew between taxels: 0 with a data line for each sensor, one command on all lines at once. With multiplexers one command",
        "  reaches all sensors too, through all channels; only the reading takes its turn. Their own oscillators remain.",
        "",
        "## By OSR",
        "",
    ]
    lines += table(
        found["by_osr"],
        {
            "board": field("board"),
            "OSR": field("osr"),
            "frames/s": field("frames_per_s"),
            "fitted/s": field("fitted_per_s"),
            "held/s": field("held_per_s"),
            "asleep, %": field("sleep_percent"),
            "convert, us": field("convert_us"),
            "read": field("read_us"),
            "queue": field("queue_us"),
            "condition": field("condition_us"),
            "fit": field("fit_us"),
            "contact": field("contact_us"),
            "offered, median": field("latency_us", "median"),
            "p99": field("latency_us", "p99"),
            "max": field("latency_us", "max"),
            "delivered, median": field("delivery_us", "median"),
            "p99 ": field("delivery_us", "p99"),
            "max ": field("delivery_us", "max"),
        },
    )
    lines += [
        "",
        "## By number of sensors",
        "",
        "Cycles are counted on the emulated chip, which takes presses on that many sensors through compensation, conditioning and fit.",
        "Rates and latencies at OSR 256 follow from them and from the measured ones of fifteen: the bus or the processor, whichever is",
        f"slower; more than 15 lines take a second state machine, and a Pico has pins for {DATA_PINS}. Rectangles have a fixed-point",
        "kernel compiled for them; float serves any layout.",
        "",
    ]
    lines += table(
        found["by_sensors"],
        {
            "kernel": field("kernel"),
            "sensors": field("sensors"),
            "layout": field("layout"),
            "compensate, cycles": field("take"),
            "condition": field("condition"),
            "fit": field("fit"),
            "worst location, um": lambda row: f"{row['error_um']:.3f}",
            **{
                heading: field(f"{short(board)}_{name}")
                for i, board in enumerate(BOARDS)
                for heading, name in ((f"{board} frames/s", "fps"), ("latency, us" + i * " ", "latency_us"))
            },
        },
    )
    lines += [
        "",
        "## Scene grasp",
        "",
        f"With a profile of 12 mm, on {PARALLEL} at OSR 256: {found['grasp_parallel_fps_osr256']:.1f} fitted frames/s, {found['grasp_frames_skipped']} skipped, the first",
        f"core asleep {found['grasp_sleep_percent']:.1f} %. A packet is offered {found['grasp_parallel_latency_median_us']:.0f} us after the conversion in the median, p99",
        f"{found['grasp_latency_p99_us']:.0f}, with two contacts {found['grasp_two_latency_p99_us']:.0f}, with a sensor that reads double {found['grasp_broken_latency_p99_us']:.0f}",
        f"(at {found['grasp_broken_fps_osr256']:.1f} frames/s). {found['grasp_load_percent']:.1f} % of the frames have a load, which is that of the",
        f"frame before, and {found['grasp_shape_percent']:.1f} % of scene shapes have a contact shape, on average {found['grasp_shape_age_ms']:.1f} ms old.",
    ]
    return "\n".join([*lines, "", "## By scene", "", *scenes.text(found["scenes"])]) + "\n"


def draw(path, found, parallel):
    figure, ((rate, latency), (stages, sensors)) = plt.subplots(2, 2, figsize=(12, 8))
    draw_rates(rate, found)
    draw_latency(latency, found, parallel)
    draw_stages(stages, found)
    draw_sensors(sensors, found)
    for axes in (rate, latency, stages, sensors):
        axes.grid()
        axes.legend(fontsize=8)
    figure.tight_layout()
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


def draw_sensors(axes, found):
    for kernel, style in (("fixed point", "o-"), ("float", "s--")):
        for board in BOARDS:
            rows = [
                row
                for row in found["by_sensors"]
                if row["kernel"] == kernel and (DESCRIPTORS[board]["bus"] != "parallel" or row["sensors"] <= DATA_PINS)
            ]
            axes.plot(
                [row["sensors"] for row in rows],
                [row[f"{short(board)}_fps"] for row in rows],
                style,
                color=COLOURS[board],
                label=f"{board}, {kernel}",
            )
    axes.set(
        xlabel="sensors", ylabel="frames a second, OSR 256", yscale="log", title="More or fewer sensors: cycles measured, rates computed"
    )
