"""What grasp.py measured as text and as a picture."""

import bisect

import emulated_grasp
import faults
import kinds
from presentation import BLUE, FAINT, GOAL, INK, ORANGE, goal_table_md, plt, save, table_md, text_of
from fingertip.files import write_text
from kinds import GRIPPERS

# key: what its column is called
COLUMNS = {
    "gripper": "gripper",
    "about": "what",
    "object": "object",
    "friction": "friction",
    "mass": "mass",
    "disturbance": "disturbance",
    "grasps": "grasps",
    "drops_percent": "dropped, %",
    "margin_p50": "grip over least grip: p50",
    "margin_p5": "p5",
    "margin_p95": "p95",
    "force_told_p50": "reported over true force",
    "force_taken_p50": "taken for over true",
    "slips": "slips",
    "unanswered": "never answered",
    "reaction_p50_ms": "slip to 5 % more grip, ms: p50",
    "reaction_p95_ms": "p95 ",
    "reaction_after_lift_p50_ms": "after the lift: p50",
    "slid_p95_mm": "slid, mm: p95",
    "disturbance_slip_p95_mm": "by disturbances: p95",
    "peak_p95_N": "largest grip, N: p95",
}
STILL = {
    "gripper": "gripper",
    "about": "what",
    "set_force": "set force",
    "grasps": "grasps",
    "settle_p50_s": "settles within, s: p50",
    "settle_p95_s": "p95",
    "never_settled_percent": "never, %",
    "rms_p50_percent": "rms error, %: p50",
    "rms_of_steps_p50_percent": "of it by rounding to the gripper's steps",
    "limit_cycles": "limit cycles",
}
ABOUT = """Written by `sh cmake/bootstrap.sh report`. Simulated rubber, objects, sensors and grippers; the controller is the tool's own,
the fingertips' code the firmware's. Nothing was checked on hardware.

In the twin's cell, each grasp: an object of 0.1 to 1 kg with a friction of 0.25 to 1 is on a table; the gripper closes, holds, lifts it within 0.1 to 1 s; then come up to
two of: 30 to 150 % more mass is poured in, the hand jerks by 2 to 9 m/s2, a knock of 0.03 to 0.12 m/s, friction falls by 20 to 45 %. What would take more than
15 N to hold at its worst is not drawn. The rubber relaxes by 9 to 26 % in 8 s, each fingertip's force is off by 5 % (sd), gains are those after a
calibration. This rubber has no dip, though cast rubber has one: what a dip does to the load that a fingertip estimates is in the part `shear` (`dip_*`), to
location and force in `truth` and `validation`. The kinds below are judged without readings: there a fingertip reports force and load with an error that is drawn.
Dropped: slid by 22 mm, or lost. Least grip: load / (2 friction), without
what a turning object takes of the friction. Reported force: the mean of what both fingertips report; taken for: what the controller reckons with,
of flats what lies on the pad. A slip: all of both contacts slides, 0.3 mm or more. Settled: within 10 % for
0.5 s, by what the fingertips report. A limit cycle: the commanded width turns four times or more in the last half of a hold."""
FIRM = """Set forces of 8 N and more. The oracle knows the true force, how it follows the width and how the rubber is going to relax. Of the positions that
the gripper can reach it takes the one whose mean squared error over the rest of the hold is least, and it moves no more often than ours may. It plans no
second move, so it shows what is possible, and is no least bound. Ours does not know how the rubber is going to relax."""
PARTS = {"by_object": "By object", "by_friction": "By friction", "by_mass": "By mass", "by_disturbance": "By disturbance"}


def rows_md(rows, columns):
    used = [key for key in columns if any(key in row for row in rows)]
    return table_md([columns[key].strip() for key in used], [[text_of(row.get(key), 3) for key in used] for row in rows])


def write(found, path):
    moving = [row for row in found["rows"] if "drops_percent" in row]
    still = [row for row in found["rows"] if "settle_p50_s" in row]
    lines = [
        "# Grasps",
        "",
        *ABOUT.split("\n"),
        "",
        "![Drops, grip, reaction, a slip that is caught](grasp.png)",
        "",
        *goal_table_md(found),
        "",
        "## By kind",
        "",
        *kinds.text(found),
        "## In the twin's cell, by gripper, mode and rate",
        "",
        *rows_md(moving, COLUMNS),
        "",
        "## Set forces",
        "",
        *rows_md(still, STILL),
        "",
    ]
    if "by_set" in found:
        lines += [*firm_of(found), "", "Of those held for 12 s, by the set force:", "", *rows_md(found["by_set"], STILL), ""]
    for name, title in PARTS.items():
        if name in found:
            lines += [f"## {title}", "", "Round objects, 410 frames a second.", "", *rows_md(found[name], COLUMNS), ""]
    lines += ["## Faults", "", *faults.text(found)]
    if "emulated_grasp" in found:
        lines += ["## With the release image", "", *emulated_grasp.text(found["emulated_grasp"])]
    write_text(path, "\n".join(lines))


def firm_of(found):
    """What is asked of set forces of 8 N and more, what is possible, and what ours does."""
    rows = [
        [
            gripper,
            found["goals"][f"hold_rms_percent_{called}"]["goal"],
            text_of(found.get(f"hold_rms_possible_percent_{called}"), 3),
            text_of(found[f"hold_rms_percent_{called}"], 3),
        ]
        for gripper, (called, _) in GRIPPERS.items()
    ]
    return [*FIRM.split("\n"), "", *table_md(("gripper", "rms error asked, %", "possible: the oracle's", "ours"), rows)]


def tidy(axes, title, label):
    axes.set_title(title, loc="left", size=10, color=INK)
    axes.set_xlabel(label, size=9)
    axes.tick_params(labelsize=8)
    axes.grid()


def draw_distribution(axes, found, key, title, label, most):
    for one in found["distributions"]:
        values = one[key]
        shares = [100 * i / (len(values) - 1) for i in range(len(values))] if len(values) > 1 else []
        axes.plot(
            [most * 2 if value is None else value for value in values], shares, color=GRIPPERS[one["gripper"]][1], label=one["gripper"]
        )
    axes.set_xlim(0, most)
    axes.set_ylim(0, 100)
    axes.legend(fontsize=8, loc="lower right")
    tidy(axes, title, label)
    axes.set_ylabel("% below", size=9)


def draw_drops(axes, found):
    rows = [row for row in found["rows"] if "drops_percent" in row]
    sets = list(dict.fromkeys(row["set"] for row in rows))
    for i, (gripper, (_, colour)) in enumerate(GRIPPERS.items()):
        values = {row["set"]: row["drops_percent"] for row in rows if row["gripper"] == gripper}
        places = [place + 0.26 * (i - 1) for place in range(len(sets))]
        bars = axes.barh(places, [values.get(name) or 0 for name in sets], 0.25, color=colour, label=gripper)
        axes.bar_label(bars, [text_of(values.get(name), 2) for name in sets], size=6, padding=2)
    axes.set_yticks(range(len(sets)), [next(row["about"] for row in rows if row["set"] == name) for name in sets], size=7)
    axes.invert_yaxis()
    axes.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.07), ncols=3)
    tidy(axes, "Dropped", "% of grasps")


def moment(series, t_s):
    return min(bisect.bisect_left(series["t_s"], t_s), len(series["t_s"]) - 1)


def draw_film(axes, series, at):
    """Seen along the pads: rubber grey, between them the object; drawn to scale but for the arrows."""
    i = moment(series, at)
    half_mm, thick_mm, base_mm = 14, 12, 0.5 * series["width_mm"][i]
    for side in (-1, 1):
        inner, outer = side * base_mm, side * (base_mm + thick_mm)
        axes.fill_betweenx([-18, 18], inner, outer, color="#c9ced8", lw=0)
        axes.plot([outer, outer], [-18, 18], color=INK, lw=2)
        force_N, load_N = series["force_N"][i], series["load_N"][i]
        axes.annotate(
            "",
            (inner + side * 1, -series["way_mm"][i]),
            (inner + side * (1 + 0.8 * force_N), -series["way_mm"][i]),
            arrowprops={"arrowstyle": "-|>", "color": BLUE, "lw": 1.5, "shrinkA": 0, "shrinkB": 0},
        )
        axes.annotate(
            "",
            (side * (base_mm - 1), -series["way_mm"][i] + 2 + 3 * load_N),
            (side * (base_mm - 1), -series["way_mm"][i] + 2),
            arrowprops={"arrowstyle": "-|>", "color": ORANGE, "lw": 1.5, "shrinkA": 0, "shrinkB": 0},
        )
    axes.add_patch(
        plt.Rectangle(
            (-base_mm - 1, -half_mm - series["way_mm"][i]), 2 * base_mm + 2, 2 * half_mm, angle=0, color="#f3ddb8", ec=INK, lw=0.8, zorder=2
        )
    )
    axes.axhline(0, color=FAINT, lw=0.6, ls=":", zorder=3)
    axes.plot([-base_mm, base_mm], [-series["way_mm"][i]] * 2, color=INK, lw=0.8, zorder=3)
    axes.set_xlim(-base_mm - 16, base_mm + 16)
    axes.set_ylim(-26, 22)
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_title(
        f"{1e3 * (series['lift_s'][i] - series['begin_s']):+.0f} ms\ngrip {series['force_N'][i]:.1f} N, slid {series['slid_mm'][i] - series['slid_from_mm']:.1f} mm"
        f"{', slides' if series['slips'][i] else ''}",
        size=8,
        color=INK,
    )


def draw_caught(axes, series, shots):
    begin = series["begin_s"]
    t_ms = [1e3 * (at - begin) for at in series["lift_s"]]
    for key, colour, label in (
        ("force_N", BLUE, "grip"),
        ("felt_N", FAINT, "as measured"),
        ("least_N", GOAL, "least that holds"),
        ("load_N", ORANGE, "load of a fingertip"),
    ):
        axes.plot(t_ms, series[key], color=colour, lw=1, label=label)
    axes.plot(t_ms, [value - series["slid_from_mm"] for value in series["slid_mm"]], color=INK, lw=1.4, label="slid, mm")
    for shot in shots:
        axes.axvline(1e3 * shot, color=FAINT, lw=0.5, ls=":")
    axes.set_xlim(-80, 300)
    shown = [i for i, at in enumerate(t_ms) if -80 <= at <= 300]
    axes.set_ylim(0, 1.15 * max(series["force_N"][i] for i in shown))
    axes.legend(fontsize=7, loc="upper left", ncols=3)
    tidy(axes, "The same over time: N, and mm that it slid", "ms since it began to slide; dotted: the pictures above")


def draw(found, path):
    figure = plt.figure(figsize=(15, 12.5), layout="constrained")
    above, below = figure.subfigures(2, 1, height_ratios=(1, 1))
    places = above.subplots(1, 4, width_ratios=(1.3, 1, 1, 1))
    draw_drops(places[0], found)
    draw_distribution(places[1], found, "margin", "Grip over the least that holds", "median over the hold", 8)
    draw_distribution(places[2], found, "reaction_ms", "From slip to 5 % more grip", "ms", 120)
    draw_distribution(places[3], found, "slid_mm", "Slid in all, what was not dropped", "mm", 6)
    if "caught" in found:
        caught = found["caught"]
        series = {**caught["series"], "begin_s": caught["begin_s"]}
        start = min(range(len(series["lift_s"])), key=lambda i: abs(series["lift_s"][i] - caught["begin_s"]))
        series["slid_from_mm"] = series["slid_mm"][start]
        offset_s = series["t_s"][start] - caught["begin_s"]
        shots = (-0.05, 0.01, 0.03, 0.06, 0.1, 0.25)
        film, course = below.subfigures(2, 1, height_ratios=(1, 1.1))
        for axes, shot in zip(film.subplots(1, len(shots)), shots):
            draw_film(axes, series, caught["begin_s"] + offset_s + shot)
        draw_caught(course.subplots(), series, shots)
        film.suptitle(
            f"A slip that is caught: {caught['face']}, {caught['mass_kg']:.2f} kg, friction {caught['friction']:.2f}, {caught['gripper']}, "
            f"{' and '.join(caught['disturbances'])} (blue: grip; orange: load)",
            x=0.01,
            ha="left",
            size=10,
        )
    figure.suptitle(
        "Grasps: simulated cell, the tool's own controller, the firmware's own fingertips", x=0.01, ha="left", size=12, weight="bold"
    )
    save(figure, path)
