"""The picture of what shear.py measured."""

import numpy as np
from presentation import BLUE, FAINT, GOAL, INK, ORANGE, draw_panels, tidy

PICTURED = ("map", "arrows", "location_quantiles")  # tables that only the picture shows


def draw_map(axes, cells):
    xs, ys = (sorted({cell[name] for cell in cells}) for name in ("x_mm", "y_mm"))
    values = {(cell["x_mm"], cell["y_mm"]): cell["vector_error_p50"] for cell in cells}
    step = xs[1] - xs[0]
    grid = np.array([[values[x, y] for x in xs] for y in ys], dtype=float)
    extent = (xs[0] - step / 2, xs[-1] + step / 2, ys[0] - step / 2, ys[-1] + step / 2)
    image = axes.imshow(grid, origin="lower", extent=extent, cmap="viridis", vmin=0)
    axes.plot(*zip(*((9 * i, 9 * k) for i in (-1, 0, 1) for k in range(-2, 3))), "o", color="white", mec=INK, ms=4, clip_on=False)
    axes.figure.colorbar(image, ax=axes, shrink=0.8).ax.tick_params(labelsize=8)
    tidy(axes, "Error of Q/F by place\n(median, Q/F = 0.3; dots: sensors)", "y, mm", grid=None)
    axes.set_xlabel("x, mm", size=9)


def draw_arrows(axes, arrows):
    scale = 25  # mm for Q/F = 1
    for arrow in arrows:
        for x, y, qx, qy, colour, width in (
            (arrow["x_mm"], arrow["y_mm"], arrow["qx"], arrow["qy"], GOAL, 3),
            (arrow["estimated_x_mm"], arrow["estimated_y_mm"], arrow["estimated_qx"], arrow["estimated_qy"], BLUE, 1.2),
        ):
            axes.annotate(
                "",
                (x + scale * qx, y + scale * qy),
                (x, y),
                arrowprops={"arrowstyle": "->", "color": colour, "lw": width, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 8},
            )
        axes.plot(arrow["without_x_mm"], arrow["without_y_mm"], "x", color=ORANGE, ms=5)
    for colour, style, label in ((GOAL, "-", "true"), (BLUE, "-", "estimated"), (ORANGE, "x", "location without the correction")):
        axes.plot([], [], style, color=colour, label=label)
    axes.plot(*zip(*((9 * i, 9 * k) for i in (-1, 0, 1) for k in range(-2, 3))), ".", color=FAINT, ms=3)
    axes.set_xlim(-15, 15)
    axes.set_ylim(-22, 27)
    axes.set_aspect("equal")
    axes.legend(fontsize=7, loc="upper right")
    tidy(axes, "Fifteen touches of 5 N that pull by 1.5 N\n(sphere of 15 mm, a calibrated pad)", "y, mm", grid=None)
    axes.set_xlabel("x, mm", size=9)


def draw_location(axes, rows):
    for load, style in ((0, "--"), (0.3, "-")):
        some = [row for row in rows if row["load"] == load]
        for key, colour, label in (("without_mm", ORANGE, "before"), ("with_mm", BLUE, "after")):
            axes.plot([row[key] for row in some], [row["percent"] for row in some], style, color=colour, label=f"{label}, Q/F = {load:g}")
    axes.set_xscale("log")
    axes.set_xlim(0.01, 3)
    axes.legend(fontsize=8)
    axes.set_xlabel("error of the location, mm", size=9)
    tidy(axes, "Location before and after (calibrated pads)", "% of touches below", grid="both")


def draw_objects(axes, rows):
    rows = sorted((row for row in rows if row["load"] == 0.3), key=lambda row: (row["vector_error_p50"] is None, row["vector_error_p50"]))
    places = range(len(rows))
    axes.bar(places, [row["vector_error_p50"] or 0 for row in rows], 0.7, color=BLUE, label="median")
    axes.plot(places, [row["vector_error_p95"] for row in rows], "_", color=INK, ms=8, label="95 %")
    for x, row in enumerate(rows):
        if row["valid_percent"] < 99:
            at = x, row["vector_error_p95"] or 0
            axes.annotate(f"{row['valid_percent']:.0f}", at, ha="center", va="bottom", size=7, color=ORANGE)
    axes.set_xticks(places, [row["object"] for row in rows], rotation=60, ha="right")
    axes.axhline(0.05, color=GOAL, lw=1, ls="--")
    axes.legend(fontsize=8, loc="upper left")
    tidy(axes, "Error of Q/F by object (orange: % that is valid)", "error at Q/F = 0.3")


def draw_overhang(axes, rows):
    rows = sorted((row for row in rows if row["place"] == "anywhere"), key=lambda row: row["overhang_mm"])
    overhangs = sorted({row["overhang_mm"] for row in rows})
    bars = (
        ("thickness", "zero_error_p50", "#f0c891", "zero, thickness set"),
        ("thickness", "increment_error_p50", "#9cc1f0", "increment since first touch"),
        ("thickness and ends", "zero_error_p50", ORANGE, "zero, ends set"),
        ("thickness and ends", "increment_error_p50", BLUE, "increment"),
    )
    for place, (profile, key, colour, label) in enumerate(bars):
        heights = [next(row[key] for row in rows if (row["profile"], row["overhang_mm"]) == (profile, overhang)) for overhang in overhangs]
        axes.bar([x + 0.2 * (place - 1.5) for x in range(len(overhangs))], heights, 0.19, color=colour, label=label)
    axes.set_xticks(range(len(overhangs)), [f"{overhang:g} mm" for overhang in overhangs])
    axes.axhline(0.05, color=GOAL, lw=1, ls="--")
    axes.legend(fontsize=8)
    axes.set_xlabel("rubber beyond the outer sensors, 12 mm thick", size=9)
    tidy(axes, "Pads that end", "median error of Q/F")


def draw(found, path):
    panels = (
        ("map", lambda axes: draw_map(axes, found["map"])),
        ("arrows", lambda axes: draw_arrows(axes, found["arrows"])),
        ("location_quantiles", lambda axes: draw_location(axes, found["location_quantiles"])),
        ("by_object", lambda axes: draw_objects(axes, found["by_object"])),
        ("by_overhang", lambda axes: draw_overhang(axes, found["by_overhang"])),
    )
    draw_panels(found, path, "Tangential force: simulated pads, the firmware's own code", (2, 3), (15, 9.5), panels)
