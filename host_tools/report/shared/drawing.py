"""How every picture of a report looks, and how it gets into its file."""

import matplotlib

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


def save(figure, path):
    """The same bytes from the same figure: no version of the library is written into it."""
    try:
        figure.savefig(path, dpi=110, metadata={"Software": None})
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}; choose another place") from None
    plt.close(figure)


def tidy(axes, title, label):
    axes.set_title(title, loc="left", size=10, color=INK)
    axes.set_ylabel(label, size=9)
    axes.grid(axis="y")
    axes.tick_params(labelsize=8)
