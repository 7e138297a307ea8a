"""What grasp.py measured as a picture."""

from presentation import BLUE, FAINT, GOAL, INK, ORANGE, plt, save, text_of, tidy
from kinds import GRIPPERS


def labelled(axes, title, label, up=""):
    tidy(axes, title, up, grid="both")
    axes.set_xlabel(label, size=9)


def draw_distribution(axes, found, key, title, label, most):
    for one in found["distributions"]:
        values = one[key]
        shares = [100 * i / (len(values) - 1) for i in range(len(values))] if len(values) > 1 else []
        axes.plot(values, shares, color=GRIPPERS[one["gripper"]][1], label=one["gripper"])
    axes.set_xlim(0, most)
    axes.set_ylim(0, 100)
    axes.legend(fontsize=8, loc="lower right")
    labelled(axes, title, label, "% below")


def draw_drops(axes, found):
    rows = {}
    for row in found["kinds"]:
        name = row["row"] + ("" if row["controller"] == "ours" else f", {row['controller']}")
        rows.setdefault(name, {})[row["gripper"]] = row["drops_percent"]
    for i, (gripper, (_, colour)) in enumerate(GRIPPERS.items()):
        places = [place + 0.26 * (i - 1) for place in range(len(rows))]
        bars = axes.barh(places, [values[gripper] for values in rows.values()], 0.25, color=colour, label=gripper)
        axes.bar_label(bars, [text_of(values[gripper], 2) for values in rows.values()], size=6, padding=2)
    axes.set_yticks(range(len(rows)), list(rows), size=7)
    axes.invert_yaxis()
    axes.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.07), ncols=3)
    counts = sorted({row["grasps"] for row in found["kinds"]})
    labelled(axes, "Dropped", f"% of {' to '.join(str(count) for count in dict.fromkeys((counts[0], counts[-1])))} grasps")


def draw_caught(axes, caught):
    series = caught["series"]
    t_ms = [1e3 * (at - caught["begin_s"]) for at in series["lift_s"]]
    slid_from_mm = series["slid_mm"][min(range(len(t_ms)), key=lambda i: abs(t_ms[i]))]
    for key, colour, label in (
        ("force_N", BLUE, "grip"),
        ("sensed_N", FAINT, "as measured"),
        ("least_N", GOAL, "least that holds"),
        ("load_N", ORANGE, "load of a fingertip"),
    ):
        axes.plot(t_ms, series[key], color=colour, lw=1, label=label)
    axes.plot(t_ms, [value - slid_from_mm for value in series["slid_mm"]], color=INK, lw=1.4, label="slid, mm")
    axes.set_xlim(-80, 300)
    shown = [i for i, at in enumerate(t_ms) if -80 <= at <= 300]
    axes.set_ylim(0, 1.15 * max(series["force_N"][i] for i in shown))
    axes.legend(fontsize=7, loc="upper left", ncols=3)
    what = f"{caught['mass_kg']:.2f} kg, friction {caught['friction']:.2f}, {caught['gripper']}, {' and '.join(caught['events'])}"
    labelled(axes, f"A slip that is caught: {what}", "ms since it began to slide; N, and mm that it slid")


def draw(found, path):
    figure = plt.figure(figsize=(15, 11), layout="constrained")
    above, below = figure.subfigures(2, 1, height_ratios=(1.2, 1))
    places = above.subplots(1, 4, width_ratios=(1.3, 1, 1, 1))
    draw_drops(places[0], found)
    draw_distribution(places[1], found, "margin", "Grip over the least that holds", "median over the hold", 8)
    draw_distribution(places[2], found, "reaction_ms", "From slip to 5 % more grip", "ms", 120)
    draw_distribution(places[3], found, "slid_mm", "Slid in all, what was not dropped", "mm", 6)
    if "caught" in found:
        draw_caught(below.subplots(), found["caught"])
    figure.suptitle("Grasps: simulated, the tool's own controller", x=0.01, ha="left", size=12, weight="bold")
    save(figure, path)
