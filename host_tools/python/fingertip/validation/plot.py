"""Pictures of the card: SVG within a page, drawn from numbers."""

import html
import math

_SPARE, _TICKS = 0.05, 5.0


def range_of(values, from_zero=False):
    """With five percent of space; of nothing, or of one value, one wide."""
    low, high = (min(values), max(values)) if len(values) else (0.0, 0.0)
    if from_zero:
        low, high = min(low, 0.0), max(high, 0.0)
    spare = _SPARE * (high - low) if high > low else 0.5
    return (0.0 if from_zero and low == 0 else low - spare), high + spare


class Plot:
    """A frame with ticks and names; what is drawn comes in its units. equal: a unit is as long in y as in x."""

    def __init__(self, width, height, x, y, x_name, y_name, equal=False):
        self._x, self._y = x, y
        self._left, self._top, self._right, self._bottom = 46.0, 8.0, width - 8.0, height - 34.0
        if equal:
            unit = min((self._right - self._left) / (x[1] - x[0]), (self._bottom - self._top) / (y[1] - y[0]))
            self._right, self._bottom = self._left + unit * (x[1] - x[0]), self._top + unit * (y[1] - y[0])
        self._size = int(self._right) + 8, int(self._bottom) + 34
        middle = 0.5 * (self._left + self._right), 0.5 * (self._top + self._bottom)
        self._body = []
        self._frame = [
            f'<rect class="frame" x="{self._left:.1f}" y="{self._top:.1f}" width="{self._right - self._left:.1f}" '
            f'height="{self._bottom - self._top:.1f}"/>',
            *(
                f'<path class="tick" d="M{self._px(at):.1f} {self._bottom:.1f}v4"/>'
                f'<text x="{self._px(at):.1f}" y="{self._bottom + 15:.1f}" text-anchor="middle">{text}</text>'
                for at, text in self._ticks(*x)
            ),
            *(
                f'<path class="tick" d="M{self._left:.1f} {self._py(at):.1f}h-4"/>'
                f'<text x="{self._left - 6:.1f}" y="{self._py(at) + 4:.1f}" text-anchor="end">{text}</text>'
                for at, text in self._ticks(*y)
            ),
            f'<text class="name" x="{middle[0]:.1f}" y="{self._bottom + 30:.1f}" text-anchor="middle">{html.escape(x_name)}</text>',
            f'<text class="name" transform="translate(11 {middle[1]:.1f}) rotate(-90)" text-anchor="middle">{html.escape(y_name)}</text>',
        ]

    def _px(self, x):
        return self._left + (self._right - self._left) * (x - self._x[0]) / (self._x[1] - self._x[0])

    def _py(self, y):
        return self._bottom - (self._bottom - self._top) * (y - self._y[0]) / (self._y[1] - self._y[0])

    @staticmethod
    def _ticks(low, high):
        rough = (high - low) / _TICKS
        decade = 10.0 ** math.floor(math.log10(rough))
        step = decade * next(each for each in (1, 2, 5, 10) if rough / decade <= each)
        digits = max(0, -math.floor(math.log10(step) + 1e-9))
        first, last = math.ceil(low / step), math.floor(high / step + 1e-9)
        return [(number * step, f"{number * step:.{digits}f}") for number in range(first, last + 1)]

    def line(self, points, style):
        path = "L".join(f"{self._px(x):.1f} {self._py(y):.1f}" for x, y in points)
        self._body.append(f'<path class="{style}" d="M{path}"/>')

    def dot(self, x, y, radius_px, style):
        self._body.append(f'<circle class="{style}" cx="{self._px(x):.1f}" cy="{self._py(y):.1f}" r="{radius_px:.1f}"/>')

    def bar(self, x, half_width, y, foot, style):
        low, high = self._py(min(y, foot)), self._py(max(y, foot))
        width = self._px(x + half_width) - self._px(x - half_width)
        self._body.append(
            f'<rect class="{style}" x="{self._px(x - half_width):.1f}" y="{high:.1f}" width="{width:.1f}" height="{low - high:.1f}"/>'
        )

    def text(self, x, y, text):
        self._body.append(f'<text x="{self._px(x):.1f}" y="{self._py(y):.1f}" text-anchor="middle">{html.escape(text)}</text>')

    def svg(self, title):
        """title: for those who cannot see it."""
        inner = f'width="{self._right - self._left:.1f}" height="{self._bottom - self._top:.1f}"'
        box = f"{self._left:.1f} {self._top:.1f} {self._right - self._left:.1f} {self._bottom - self._top:.1f}"
        return (
            f'<svg role="img" width="{self._size[0]}" viewBox="0 0 {self._size[0]} {self._size[1]}"><title>{html.escape(title)}</title>'
            f'{"".join(self._frame)}<svg x="{self._left:.1f}" y="{self._top:.1f}" {inner} viewBox="{box}">{"".join(self._body)}</svg></svg>'
        )
