"""The picture of what truth.py measured."""

from presentation import BLUE, FAINT, GOAL, INK, ORANGE, draw_panels, tidy

# Share of truths within one and two radial standard deviations of a normal distribution in the plane.
IDEAL_PERCENT = (63.2, 98.2)
PICTURED = ()


def named(axes, names):
    axes.set_xticks(range(len(names)), names, rotation=25, ha="right")


def draw_coverage(axes, cases):
    places = range(len(cases))
    for offset, key, colour, label in ((-0.2, "cover_1sd", BLUE, "within 1 sd"), (0.2, "cover_2sd", ORANGE, "within 2 sd")):
        axes.bar([x + offset for x in places], [row[key] for row in cases], 0.38, color=colour, label=label)
    for ideal in IDEAL_PERCENT:
        axes.axhline(ideal, color=GOAL, lw=1, ls="--")
    named(axes, [row["case"] for row in cases])
    axes.set_ylim(0, 115)
    axes.legend(fontsize=8, ncols=2, loc="upper right")
    tidy(axes, "True places within the predicted standard deviation (dashed: ideal)", "% of touches")


def draw_warnings(axes, cases):
    places = range(len(cases))
    axes.bar([x - 0.2 for x in places], [row["warned"] for row in cases], 0.38, color=BLUE, label="warned")
    axes.bar([x + 0.2 for x in places], [row["bad"] for row in cases], 0.38, color=ORANGE, label="off by more than 1 mm")
    for x, row in enumerate(cases):
        axes.annotate(f"{row['bad_unflagged']:.2g}", (x + 0.2, row["bad"]), ha="center", va="bottom", size=8, color=INK)
    named(axes, [row["case"] for row in cases])
    axes.legend(fontsize=8)
    tidy(axes, "Warnings (number: % off by more than 1 mm and not warned)", "% of touches")


def draw_placements(axes, calibration, before_mm):
    rows = calibration["by_placements"]
    axes.plot([row["placements"] for row in rows], [row["median_mm"] for row in rows], "o-", color=BLUE, label="after calibration")
    axes.axhline(before_mm, color=FAINT, ls="--", lw=1, label="never calibrated")
    axes.set_ylim(bottom=0)
    axes.set_xlabel("placements of one weight", size=9)
    axes.legend(fontsize=8)
    tidy(axes, "Location on pads of 10 % gain spread", "median error, mm")


def draw_iterations(axes, rows):
    for layer, colour in ((12, BLUE), (6, ORANGE)):
        for gain, style in ((0, "o-"), (10, "s--")):
            line = [row for row in rows if row["layer_mm"] == layer and round(row["gain_percent"]) == gain]
            axes.plot(
                [row["iterations"] for row in line],
                [row["error_p50_mm"] for row in line],
                style,
                color=colour,
                ms=4,
                label=f"{layer} mm, gains {gain} %",
            )
    axes.set_ylim(bottom=0)
    axes.set_xlabel("iterations of the fit", size=9)
    axes.legend(fontsize=7.5, loc="lower right", ncols=2)
    tidy(axes, "What iterations do to the truth", "median error, mm")


def draw(found, path):
    panels = (
        ("cases", lambda axes: draw_coverage(axes, found["cases"])),
        ("cases", lambda axes: draw_warnings(axes, found["cases"])),
        ("truth_calibration", lambda axes: draw_placements(axes, found["truth_calibration"], found["before_cal_median_mm"])),
        ("iterations", lambda axes: draw_iterations(axes, found["iterations"])),
    )
    draw_panels(found, path, "From the optimum to the truth: simulated pads, the firmware's own code", (2, 2), (12, 8), panels)
