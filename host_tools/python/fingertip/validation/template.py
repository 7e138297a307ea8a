"""The template of a validation, to be printed at 1:1: the marks in their order, the sensors' places to align it by, and a line of 50 mm to
measure the print. SVG, or PDF: A4, one page, nothing but lines and Helvetica."""

from .protocol import marks_of

RULER_mm = 50.0
_PACKAGE_mm = 3.3  # of an MS5840, each way (De Clercq et al., RA-L 2022, III.A)
_CROSS_mm, _RING_mm, _MARGIN_mm, _LETTERS_mm, _LINE_mm = 1.5, 4.0, 14.0, 2.4, 0.15
_PAGE_mm, _POINTS_PER_mm = (210.0, 297.0), 72 / 25.4
_QUARTER = 0.5523  # of a circle by a cubic


def _drawing(array):
    """Lines (x, y, to x, to y), circles (x, y, radius) and texts (x, y, text), mm, y up; and half of the width and of the height."""
    lines, circles, texts = [], [], []
    reach_x = max(0.5 * RULER_mm, abs(array.x_mm).max()) + _MARGIN_mm
    reach_y = abs(array.y_mm).max() + _MARGIN_mm
    half = 0.5 * _PACKAGE_mm
    for k, (x, y) in enumerate(zip(array.x_mm, array.y_mm)):
        corners = [(x - half, y - half), (x + half, y - half), (x + half, y + half), (x - half, y + half)]
        lines += [(*a, *b) for a, b in zip(corners, corners[1:] + corners[:1])]
        texts.append((x + 2, y - 2, f"s{k}"))
    for number, (x, y) in enumerate(marks_of(array), 1):
        lines += [(x - _CROSS_mm, y, x + _CROSS_mm, y), (x, y - _CROSS_mm, x, y + _CROSS_mm)]
        circles.append((x, y, 0.5 * _RING_mm))
        texts.append((x + 2.2, y + 0.3, str(number)))  # above the sensor's name
    y, left = -reach_y + 6, -0.5 * RULER_mm
    lines.append((left, y, -left, y))
    lines += [(left + mm, y, left + mm, y + (1 if mm % 10 else 2)) for mm in range(int(RULER_mm) + 1)]
    texts.append((left, y - 3, f"{RULER_mm:.0f} mm: measure this line before you use the print"))
    top, right = reach_y - 3, reach_x - 3
    lines += [(0, top - 8, 0, top), (-1, top - 2, 0, top), (1, top - 2, 0, top)]
    lines += [(right - 8, 0, right, 0), (right - 2, -1, right, 0), (right - 2, 1, right, 0)]
    texts += [(1.5, top - 2, "+y"), (right - 3, 1.5, "+x")]
    return lines, circles, texts, reach_x, reach_y


def template_svg(array):
    lines, circles, texts, reach_x, reach_y = _drawing(array)
    width, height = 2 * reach_x, 2 * reach_y
    parts = [f'<path d="M{x:.2f} {-y:.2f}L{to_x:.2f} {-to_y:.2f}"/>' for x, y, to_x, to_y in lines]
    parts += [f'<circle cx="{x:.2f}" cy="{-y:.2f}" r="{radius:.2f}"/>' for x, y, radius in circles]
    parts += [f'<text x="{x:.2f}" y="{-y:.2f}">{text}</text>' for x, y, text in texts]
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.2f}mm" height="{height:.2f}mm" '
        f'viewBox="{-reach_x:.2f} {-reach_y:.2f} {width:.2f} {height:.2f}">\n  <title>Template of a validation, 1:1</title>\n'
        f"  <style>text {{ font: {_LETTERS_mm}px sans-serif }} path, circle {{ stroke: #000; stroke-width: {_LINE_mm}; fill: none }}</style>\n"
        f'  <rect x="{-reach_x:.2f}" y="{-reach_y:.2f}" width="{width:.2f}" height="{height:.2f}" fill="#fff"/>\n'
        + "".join(f"  {part}\n" for part in parts)
        + "</svg>\n"
    )


def template_pdf(array):
    lines, circles, texts, _, _ = _drawing(array)

    def at(x, y):
        return f"{(0.5 * _PAGE_mm[0] + x) * _POINTS_PER_mm:.3f} {(0.5 * _PAGE_mm[1] + y) * _POINTS_PER_mm:.3f}"

    def circle(x, y, r):
        c = _QUARTER * r
        turns = [(r, c, c, r, 0, r), (-c, r, -r, c, -r, 0), (-r, -c, -c, -r, 0, -r), (c, -r, r, -c, r, 0)]
        curves = (f"{at(x + a, y + b)} {at(x + d, y + e)} {at(x + f, y + g)} c" for a, b, d, e, f, g in turns)
        return f"{at(x + r, y)} m {' '.join(curves)} S"

    body = [f"{_LINE_mm * _POINTS_PER_mm:.3f} w"]
    body += [f"{at(x, y)} m {at(to_x, to_y)} l S" for x, y, to_x, to_y in lines]
    body += [circle(*each) for each in circles]
    body += [f"BT /F {_LETTERS_mm * _POINTS_PER_mm:.2f} Tf {at(x, y)} Td ({text}) Tj ET" for x, y, text in texts]
    stream = "".join(f"{line}\n" for line in body)
    page = " ".join(f"{side * _POINTS_PER_mm:.3f}" for side in _PAGE_mm)
    objects = (
        "<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>",
        "<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
        f"<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {page}] /Resources << /Font << /F 4 0 R >> >> /Contents 5 0 R >>",
        "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>",
        f"<< /Length {len(stream)} >>\nstream\n{stream}endstream",
    )
    text, offsets = "%PDF-1.4\n", []
    for number, each in enumerate(objects, 1):
        offsets.append(len(text))
        text += f"{number} 0 obj\n{each}\nendobj\n"
    table = "0000000000 65535 f \n" + "".join(f"{offset:010d} 00000 n \n" for offset in offsets)
    count = len(objects) + 1
    return f"{text}xref\n0 {count}\n{table}trailer\n<< /Size {count} /Root 1 0 R >>\nstartxref\n{len(text)}\n%%EOF\n"
