"""Pictures of real.py."""

import numpy as np
from presentation import BLUE, FAINT, GOAL, INK, ORANGE, plt, save
from pace import PUBLISHED_ITERATIONS
from pace import WAYS as PACE_WAYS

WAYS = (("shipped", "as shipped"), ("raw", "width set"), ("calibrated", "calibrated"))
PROFILE_TO = 6.0  # widths


def draw_profile(axes, shown):
    """Mean reading over the sensor's own peak, by distance in its own widths."""
    edges = np.arange(0.0, PROFILE_TO + 0.25, 0.25)
    middle = 0.5 * (edges[1:] + edges[:-1])
    for key, each in shown.items():
        grid = each["grid"]
        apart = np.hypot(grid.xy[:, None, 0] - grid.layout[:, 0], grid.xy[:, None, 1] - grid.layout[:, 1]) / grid.width_mm
        which = np.digitize(apart, edges) - 1
        share = grid.reading_Pa / grid.peak_Pa
        mean = [share[which == k].mean() if (which == k).any() else np.nan for k in range(len(middle))]
        axes.plot(middle, 100 * np.array(mean), lw=1.1, label=key)
    axes.plot(middle, 100 * np.exp(-(middle**2) / 2), color=INK, lw=1, ls=":", label="Gaussian")
    axes.axhline(0, color=FAINT, lw=0.6)
    axes.set(title="Response: the dip three to five widths away", xlabel="distance / width", ylabel="% of the peak, symmetric log")
    axes.set_yscale("symlog", linthresh=5)
    axes.legend(fontsize=7)


def draw_map(axes, each, way, title):
    grid = each["grid"]
    xy = grid.xy[grid.judged]
    error = np.minimum(each[way].error_mm, 2.0)
    points = axes.scatter(xy[:, 0], xy[:, 1], c=error, s=5, vmin=0, vmax=2, cmap="viridis_r", linewidths=0)
    axes.plot(*grid.layout.T, "s", color=ORANGE, ms=5)
    axes.set(title=title, aspect="equal", xlabel="x mm", ylabel="y mm")
    return points


def draw_coverage(axes, shown, part):
    for way, name, colour in (("raw", "width set", ORANGE), ("calibrated", "calibrated, one session", BLUE)):
        ratios = [
            each[way].error_mm[each["inside"]] / np.maximum(each[way].sd_mm[each["inside"]], 1e-6)
            for key, each in shown.items()
            if each[way] is not None and key in part
        ]
        if ratios:
            ratio = np.sort(np.concatenate(ratios))
            axes.plot(ratio, 100 * np.arange(1, len(ratio) + 1) / len(ratio), color=colour, label=name)
    sd = np.linspace(0, 3, 100)
    axes.plot(sd, 100 * (1 - np.exp(-(sd**2))), color=GOAL, ls=":", label="what the sd promises")
    axes.set(title="Coverage, inside", xlabel="error / location_sd_mm", ylabel="% of presses", xlim=(0, 3), ylim=(0, 100))
    axes.legend(fontsize=7)


def draw(found, shown, path):
    figure, axes = plt.subplots(1, 5, figsize=(16, 4.2), layout="constrained", width_ratios=(1.6, 1, 1, 1, 1.4))
    judges = {row["recording"] for row in found["grids"] if row["part"] == "judges"}
    if shown:
        draw_profile(axes[0], shown)
        each = next((shown[key] for key in shown if key in judges), next(iter(shown.values())))
        points = None
        for ax, (way, name) in zip(axes[1:4], WAYS):
            if each[way] is not None:
                points = draw_map(ax, each, way, name[:1].upper() + name[1:])
        figure.colorbar(points, ax=axes[3], label="mm, 2 and more: darkest", shrink=0.8)
        draw_coverage(axes[4], shown, judges or set(shown))
    save(figure, path)


def draw_pace(rows, path):
    """Error against run time: simulated presses left, real ones right."""
    figure, both = plt.subplots(1, 2, figsize=(12, 4.8), layout="constrained", sharey=True)
    for axes, presses, title in zip(both, ("twin", "real"), ("Simulated pads: dip, gains of 20 %, widths, places", "Real pads of others")):
        for (way, name), colour in zip(PACE_WAYS, (ORANGE, GOAL, BLUE)):
            these = [row for row in rows if row["presses"] == presses and row["way"] == way]
            x = [row["run_time"] for row in these]
            for key, style in (("p50_mm", "-o"), ("p95_mm", ":o")):
                axes.plot(
                    x,
                    [row[key] for row in these],
                    style,
                    color=colour,
                    ms=3.5,
                    lw=1.3,
                    label=f"{name}, {'half' if key == 'p50_mm' else '95 %'} below",
                )
            for row in these:
                if row["iterations"] in (1, PUBLISHED_ITERATIONS, 10):
                    axes.annotate(
                        str(row["iterations"]),
                        (row["run_time"], row["p50_mm"]),
                        (0, 5),
                        textcoords="offset points",
                        size=7,
                        ha="center",
                        color=colour,
                    )
        axes.set(title=title, yscale="log", xlabel=f"run time over that of the published fit with {PUBLISHED_ITERATIONS} iterations")
        axes.grid()
    both[0].set_ylabel("distance from where the press was, mm")
    both[0].legend(fontsize=7)
    save(figure, path)
