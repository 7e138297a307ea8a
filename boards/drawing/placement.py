"""placement.svg: where the sensors sit."""

from geometry import PACKAGE_mm
from sheet import RULER_mm, cross, rectangle, ruler, sheet, text

MARGIN_mm = 14.0


def drawn(sensors):
    """y points up on the pad, down in the picture."""
    reach_x_mm = max([abs(x) for x, _ in sensors] + [RULER_mm / 2]) + MARGIN_mm
    reach_y_mm = max(abs(y) for _, y in sensors) + MARGIN_mm
    lines = []
    for k, (x, y) in enumerate(sensors):
        lines += [rectangle(x, -y, PACKAGE_mm, PACKAGE_mm), cross(x, -y, 2.5), text(x + 2, -y - 2, k)]
    lines += ruler(-RULER_mm / 2, reach_y_mm - 5)
    return sheet("Places of the sensors, 1:1", -reach_x_mm, -reach_y_mm, 2 * reach_x_mm, 2 * reach_y_mm, lines)
