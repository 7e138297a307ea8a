"""Figures beside their goals, tables of Markdown and pictures, as every report judges and shows them.

A goal is (name, sign, limit): sign ">=" or "<="; limit a number or the name of another figure; or sign "within", and two limits. A figure that was not
measured is None.
"""

import itertools

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
from fingertip.files import InputError  # noqa: E402

INK, FAINT, GRID, GOAL, BLUE, ORANGE = "#22252e", "#8a8f9c", "#e6e8ee", "#2a9d4a", "#1f6fd6", "#d98a1f"

plt.rcParams.update(
    {
        "font.size": 9,
        "axes.edgecolor": "#b4bac6",
        "axes.labelcolor": INK,
        "xtick.color": FAINT,
        "ytick.color": FAINT,
        "text.color": INK,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.axisbelow": True,
        "grid.color": GRID,
        "grid.linewidth": 0.6,
        "legend.frameon": False,
    }
)

VERDICTS = {True: "met", False: "MISSED", None: "not measured"}
HEADER = ("figure", "found", "goal", "verdict")


def quantile(values, share):
    """Of none, 0."""
    at = int(share * (len(values) - 1))
    return float(np.partition(values, at)[at]) if len(values) else 0.0


def percent(chosen):
    """Share of the true ones; of none, 0."""
    return 100.0 * float(np.count_nonzero(chosen)) / len(chosen) if len(chosen) else 0.0


def text_of(value, digits=4):
    if value is None:
        return ""
    return f"{value:.{digits}g}" if isinstance(value, float) else str(value)


def table_md(header, rows):
    """Lines. rows: lists of cells, each already as it is to be shown."""
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    return lines + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]


def table_of_dicts_md(rows):
    """Lines; a column for each key of any row."""
    columns = list(dict.fromkeys(name for row in rows for name in row))
    return table_md(columns, [[text_of(row.get(name)) for name in columns] for row in rows])


def judge(found, goals):
    """found with "goals" added: name -> {"goal": text, "met": True, False or None}."""
    judged = {}
    for name, sign, limit in goals:
        if sign == "within":
            met = None if found[name] is None else limit[0] <= found[name] <= limit[1]
            judged[name] = {"goal": "{:g} to {:g}".format(*limit), "met": met}
            continue
        value, bound = found[name], found[limit] if isinstance(limit, str) else limit
        met = None
        if value is not None and bound is not None:
            met = bool(value <= bound if sign == "<=" else value >= bound)
        judged[name] = {"goal": f"{sign} {limit if bound is None else f'{bound:g}'}", "met": met}
    return {**found, "goals": judged}


def missed(found):
    return [name for name, goal in found["goals"].items() if goal["met"] is False]


def goal_rows(found, digits=4):
    """(figure, found, goal, verdict) for a table."""
    return [(name, text_of(found[name], digits), goal["goal"], VERDICTS[goal["met"]]) for name, goal in found["goals"].items()]


def goal_table_md(found):
    """Lines of Markdown."""
    return table_md(HEADER, goal_rows(found))


def print_goals(found):
    rows = goal_rows(found, digits=6)
    width = max(len(row[0]) for row in rows)
    for name, value, goal, verdict in rows:
        print(f"{verdict:12s} {name:{width}s} {value:>12s}   goal {goal}")


def save(figure, path):
    """The same bytes from the same figure: no version of the library is written into it."""
    try:
        figure.savefig(path, dpi=110, metadata={"Software": None})
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}; choose another place") from None
    plt.close(figure)


def tidy(axes, title, label="", grid="y"):
    axes.set_title(title, loc="left", size=10, color=INK)
    axes.set_ylabel(label, size=9)
    if grid:
        axes.grid(axis=grid)
    axes.tick_params(labelsize=8)


def draw_panels(found, path, title, shape, size, panels):
    """A picture of rows and columns of panels (figure, draw(axes)), each where the figure was measured."""
    figure, places = plt.subplots(*shape, figsize=size, layout="constrained")
    for axes, (name, panel) in itertools.zip_longest(places.flat, panels, fillvalue=(None, None)):
        if name in found:
            panel(axes)
        else:
            axes.set_axis_off()
    figure.suptitle(title, x=0.01, ha="left", size=12, weight="bold")
    save(figure, path)
