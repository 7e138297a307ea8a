"""An SVG at 1:1: one unit is one millimetre, and a ruler shows whether the print has its size."""

RULER_mm = 50
STYLE = (
    "text { font: 2.2px sans-serif } path, rect, circle { stroke: #000; stroke-width: 0.15; fill: none } "
    ".small { font-size: 1px } .measure { stroke: #1f5fa8 } .blue { fill: #1f5fa8 } .cut { fill: #e8e8e8 }"
)


def number(value):
    return f"{round(value, 4) + 0.0:g}"


def rectangle(x, y, width, height, kind=""):
    """Around its middle."""
    name = f' class="{kind}"' if kind else ""
    return f'  <rect{name} x="{number(x - width / 2)}" y="{number(y - height / 2)}" width="{number(width)}" height="{number(height)}"/>'


def circle(x, y, diameter, kind=""):
    name = f' class="{kind}"' if kind else ""
    return f'  <circle{name} cx="{number(x)}" cy="{number(y)}" r="{number(diameter / 2)}"/>'


def path(kind, d):
    name = f' class="{kind}"' if kind else ""
    return f'  <path{name} d="{d}"/>'


def text(x, y, words, kind="", anchor="start"):
    name = f' class="{kind}"' if kind else ""
    return f'  <text{name} x="{number(x)}" y="{number(y)}" text-anchor="{anchor}">{words}</text>'


def cross(x, y, arm):
    return path("", f"M{number(x - arm)} {number(y)}h{number(2 * arm)}M{number(x)} {number(y - arm)}v{number(2 * arm)}")


def across(x, y, width, words):
    """A measure from x to x + width."""
    return [
        path("measure", f"M{number(x)} {number(y - 1)}v2M{number(x)} {number(y)}h{number(width)}m0 -1v2"),
        text(x + width / 2, y - 0.8, words, "blue", "middle"),
    ]


def down(x, y, height, words):
    """A measure from y to y + height."""
    return [
        path("measure", f"M{number(x - 1)} {number(y)}h2M{number(x)} {number(y)}v{number(height)}m-1 0h2"),
        text(x + 1.2, y + height / 2 + 0.8, words, "blue"),
    ]


def ruler(x, y):
    ticks = "".join(f"M{number(x + mm)} {number(y)}v{-2 if mm % 10 == 0 else -1}" for mm in range(RULER_mm + 1))
    return [
        path("", f"M{number(x)} {number(y)}h{RULER_mm}{ticks}"),
        text(x, y + 3, f"{RULER_mm} mm: measure this line before you use the print"),
    ]


def svg(title, size, lines):
    head = f'<svg xmlns="http://www.w3.org/2000/svg" {size} role="img" aria-label="{title}">'
    return "\n".join([head, f"  <title>{title}</title>", *lines, "</svg>"]) + "\n"


def sheet(title, left, top, width, height, lines):
    x, y, w, h = map(number, (left, top, width, height))
    back = f'  <rect x="{x}" y="{y}" width="{w}" height="{h}" style="fill: #fff; stroke: none"/>'
    return svg(title, f'width="{w}mm" height="{h}mm" viewBox="{x} {y} {w} {h}"', [f"  <style>{STYLE}</style>", back, *lines])
