"""The report card as one page of HTML: what was found, the figures beside those of simulated pads, pictures. It loads nothing and runs no
script. The same card gives the same bytes."""

import html
import math

import numpy as np

from .marks_fit import NARROW
from .plot import Plot, range_of

_MAGNIFIED = 5.0  # errors in the picture of the pad
_SPARE_mm, _PACKAGE_mm = 6.0, 3.3  # around the sensors; of an MS5840, each way
_FAR_mm, _MOVES_mm, _SHARE = 30.0, 3.0, 0.6  # reach of the pictures of the response and of the pulls

_STYLE = (
    "body{font:16px/1.5 system-ui,sans-serif;max-width:62rem;margin:2rem auto;padding:0 1rem;color:#1c1d22;background:#fff}"
    "h1{font-size:1.6rem;margin:0}h2{font-size:1.15rem;margin:2rem 0 .4rem}p{margin:.4rem 0}table{border-collapse:collapse;width:100%}"
    "td,th{text-align:left;padding:.25rem .6rem;border-bottom:1px solid #ddd;vertical-align:top}td.n,th.n{text-align:right;white-space:nowrap}"
    ".faint{color:#60626b}.find,.caution,.note,.good{border-left:4px solid #999;padding:.2rem .8rem;margin:.5rem 0}"
    ".find{border-color:#c62828;background:#fdecea}.caution{border-color:#f9a825;background:#fff6e0}.good{border-color:#2e7d32;background:#e9f5ea}"
    ".pictures{display:flex;flex-wrap:wrap;gap:1.2rem}figure{margin:0;max-width:100%}figcaption{max-width:28rem;font-size:.9rem;color:#444}"
    "svg{max-width:100%;height:auto}svg text{font:11px system-ui,sans-serif;fill:#333}svg .frame{fill:#fafafa;stroke:#999}svg .tick{stroke:#999}"
    "svg .ours{fill:none;stroke:#1565c0;stroke-width:1.5}svg .thin{fill:none;stroke:#1565c0;stroke-opacity:.45}"
    "svg .red{fill:none;stroke:#c62828;stroke-width:1.5}svg .dot{fill:#1565c0}svg .mark{fill:none;stroke:#333}"
    "svg .open{fill:none;stroke:#c62828;stroke-width:1.5}svg .bar{fill:#90b4dc}svg .badbar{fill:#c62828}svg .sensor{fill:none;stroke:#bbb}"
    "svg .grey{fill:none;stroke:#888;stroke-dasharray:4 3}svg .error{stroke:#333}@media(prefers-color-scheme:dark){body{color:#dedee4;"
    "background:#14151c}td,th{border-color:#34364a}.faint,figcaption{color:#9a9cab}.find{background:#3a1d1d}.caution{background:#3a3115}"
    ".good{background:#1b3320}svg text{fill:#c8c8d0}svg .frame{fill:#1b1c26;stroke:#666}svg .mark,svg .error{stroke:#ddd}svg .sensor{stroke:#555}}"
)
_NOTES = (
    "The location's error is the distance from the fingertip's estimate to where the press was. That follows from the readings of all sensors "
    "and from the marks together, whatever the gains are. The print's shift and turn on the pad are found from the sensors' own places. So a "
    "shift that all sensors have in common against the board's drawing remains invisible.",
    'The hand\'s error is taken out of location and repeatability. The figure "from the marks themselves" has it. A press is read from half a '
    "second to a second after it was set down.",
)
_OF_PULLS = (
    "The tangential force of a pull is the change from the rest before it. The thread pulls above the rubber, and the card corrects the "
    "location for that. The weight itself moves by some tenths of a millimetre as the rubber shears. The card does not correct for this, here "
    "or in the figures of simulated pads. A pulley with friction pulls less than the mass on it."
)


def _row(cells, tag):
    numbers = ("", *[' class="n"'] * (len(cells) - 1))
    return "<tr>" + "".join(f"<{tag}{number}>{cell}</{tag}>" for number, cell in zip(numbers, cells)) + "</tr>\n"


def _picture(plot, title, caption):
    return f"<figure>{plot.svg(title)}<figcaption><b>{html.escape(title)}.</b> {html.escape(caption)}</figcaption></figure>\n"


def _head(card, version):
    measured, pad = card.measured, card.measured.pad
    text = (
        (f"Fingertip {pad.serial}, " if pad.serial else "")
        + f"board {pad.board}, {card.sensors} sensors, firmware {pad.firmware}, {'calibrated' if card.is_calibrated else 'never calibrated'}, "
        f"rubber given as {measured.skin_mm:.0f} mm. {len(measured.presses)} presses of {measured.weight_g:.0f} g. "
        f"Made by fingertip {version}."
    )
    return f'<h1>A pad\'s report card</h1>\n<p class="faint">{html.escape(text)}</p>\n'


def _findings(card):
    texts = [("find", finding.text) for finding in card.findings] + [("caution", text) for text in card.cautions]
    if not texts:
        texts = [("good", "Nothing is wrong that this validation can see.")]
    texts += [("note", card.pull_note)] * bool(card.pull_note)
    return "".join(f'<p class="{style}">{html.escape(text)}</p>\n' for style, text in texts)


def _figures(card):
    text = "<h2>Figures</h2>\n<table>\n" + _row(("", "this pad", "median of simulated pads", "nine in ten of them"), "th")
    for figure in card.figures:
        low, middle, high = card.expected(figure.key) or (None,) * 3
        beside = ("", "") if low is None else (figure.shown(middle), f"{low:.{figure.digits}f} to {figure.shown(high)}")
        text += _row((html.escape(figure.text), figure.shown(figure.value), *beside), "td")
    about = "Simulated pads are there only for 12 mm of rubber over fifteen sensors 9 mm apart."
    if card.is_comparable():
        about = (
            "Simulated pads are healthy pads of 12 mm with the errors that recordings of real pads show, validated in the same way. No real pad "
            "has been compared with them yet."
        )
        if card.figure("pull_true"):
            about += (
                " A tangential force that is found is compared with pads whose sensors differ in their gains alone: on those with all errors "
                "the simulated fingertip mostly estimates none."
            )
    return text + f'</table>\n<p class="faint">{about}</p>\n'


def _pad(card):
    array, half = card.array, 0.5 * _PACKAGE_mm
    x, y = ((values.min() - _SPARE_mm, values.max() + _SPARE_mm) for values in (array.x_mm, array.y_mm))
    plot = Plot(420, 520, x, y, "x, mm", "y, mm", True)
    for k, (at_x, at_y) in enumerate(zip(array.x_mm, array.y_mm)):
        corners = [(at_x + half * a, at_y + half * b) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1))]
        plot.line(corners, "red" if k in card.named else "sensor")
        plot.text(at_x, at_y - half - 2.2, str(k))
    for press, at, error in zip(card.measured.presses, card.fit.press_mm, card.location_mm):
        plot.dot(*at, 2.0, "mark")
        if error is not None:
            plot.line([at, at + _MAGNIFIED * error], "red" if press.estimate.warned else "ours")
    return _picture(
        plot,
        "Where it was pressed, and what the fingertip estimates",
        "Circles: presses. Lines: to the estimate, five times as long as the error; red where the fingertip warned. Squares: sensors; red where "
        "something is wrong.",
    )


def _forces(card):
    seen = [(i, press.estimate) for i, press in enumerate(card.measured.presses, 1) if press.estimate.frames]
    count = len(card.measured.presses)
    ratios = [estimate.force_N / card.weight_N for _, estimate in seen]
    plot = Plot(440, 240, (0.0, count + 1.0), range_of([1.0, *ratios], True), "press", "force over the weight")
    plot.line([(0, 1), (count + 1, 1)], "grey")
    for (i, estimate), ratio in zip(seen, ratios):
        plot.dot(i, ratio, 3.0, "open" if estimate.warned else "dot")
    return _picture(plot, "Force of each press", "Open: with a warning. The dashed line is the weight.")


def _gains(card):
    known = np.flatnonzero(card.gain > 0)
    reach = 2 * card.gain * card.gain_sd
    values = [1.0, *(card.gain + reach)[known], *(card.gain - reach)[known]]
    plot = Plot(440, 240, (-0.7, card.sensors - 0.3), range_of(values), "sensor", "gain")
    for k in known:
        plot.bar(k, 0.35, card.gain[k], 1.0, "badbar" if k in card.named else "bar")
        plot.line([(k, card.gain[k] - reach[k]), (k, card.gain[k] + reach[k])], "error")
        if card.is_calibrated:
            plot.dot(k, card.measured.pad.gains[k], 3.0, "open")
    caption = "Lines: two standard deviations. A sensor that is dead or loose has none."
    return _picture(plot, "Gains of the sensors", caption + (" Circles: the stored calibration." if card.is_calibrated else ""))


def _profile(card):
    found = card.solution
    if not found["peak_Pa"] > 0:
        return ""
    plot = Plot(440, 260, (0.0, _FAR_mm), (-0.1, 1.15), "distance from the press, mm", "reading over gain, of the peak")
    places = np.column_stack([card.array.x_mm, card.array.y_mm])[card.fit.place]
    for press, at in zip(card.measured.presses, card.fit.press_mm):
        distance = np.hypot(*(places - at).T)
        for k in np.flatnonzero((card.gain > 0) & press.placement.usable & (distance < _FAR_mm)):
            plot.dot(distance[k], press.placement.reading_Pa[k] / card.gain[k] / found["peak_Pa"], 1.2, "dot")
    r = np.arange(0, _FAR_mm + 0.5, 0.5)
    wide, narrow, dip = (np.exp(-0.5 * (r / sd) ** 2) for sd in (found["width_mm"], NARROW * found["width_mm"], found["dip_sd_mm"]))
    plot.line(zip(r, (1 - found["mixing"]) * wide + found["mixing"] * narrow - found["dip"] * dip), "red")
    return _picture(
        plot,
        "The response that the presses teach",
        "Dots: each reading. Curve: what fits all of them; findings follow from dots that leave it.",
    )


def _empty(card):
    empty = card.measured.empty
    if not empty or not len(empty.seconds_Pa):
        return ""
    plot = Plot(440, 240, (0.0, float(len(empty.seconds_Pa))), range_of(empty.seconds_Pa.ravel()), "s", "zero, Pa")
    for k, zeros_Pa in enumerate(empty.seconds_Pa.T):
        plot.line(((t + 0.5, zero_Pa) for t, zero_Pa in enumerate(zeros_Pa)), "red" if k in card.named else "thin")
    return _picture(plot, "The empty minute", "One line a sensor, from its first second; red where something is wrong.")


def _hold(card):
    if not card.measured.hold or not card.measured.hold.sum_Pa:
        return ""
    line = [(t_s, 1e-3 * sum_Pa) for t_s, sum_Pa in card.measured.hold.sum_Pa]
    t_s, sums_kPa = zip(*line)
    plot = Plot(440, 240, range_of(t_s), range_of(sums_kPa, True), "s after the touch", "all sensors, kPa")
    plot.line(line, "ours")
    return _picture(plot, "The hold, the release and the rest", "Readings above those before the touch, summed.")


def _pulls(card):
    is_blind = card.figure("pull_true") is None
    if is_blind and card.figure("pull_blind_true") is None:
        return ""
    reach = _MOVES_mm if is_blind else _SHARE
    names = ("location against the rest, x, mm", "y, mm") if is_blind else ("tangential force over force, x", "y")
    plot = Plot(330, 330, (-reach, reach), (-reach, reach), *names, True)
    for one in card.measured.pulls:
        rest, pull = one.rest, one.pull
        if not rest.frames or not pull.frames:
            continue
        if is_blind:
            plot.line([(0, 0), (pull.x_mm - rest.x_mm, pull.y_mm - rest.y_mm)], "ours")
            continue
        share, angle = one.weight_g / card.measured.weight_g, math.radians(one.toward_deg)
        plot.dot(share * math.cos(angle), share * math.sin(angle), 5.0, "mark")
        if rest.pull_frames and pull.pull_frames:
            ends = [(state.qx_N / state.force_N, state.qy_N / state.force_N) for state in (rest, pull)]
            plot.line(ends, "red" if pull.warned else "ours")
    caption = (
        "Lines: how each pull moves the location. The fingertip estimates no tangential force."
        if is_blind
        else "Lines: the tangential force that is found, from the rest before to each pull; red where the fingertip warned. Circles: that of the "
        "thread."
    )
    return _picture(plot, "The pulls", caption)


def card_html(card, version):
    """version: of the tool."""
    asked = card.measured.pulls_asked > 0
    missing = f"Not measured here: other forces, other objects, {'' if asked else 'pulls, '}temperature."
    pictures = "".join(picture(card) for picture in (_pad, _forces, _gains, _profile, _empty, _hold, _pulls))
    notes = [*_NOTES, *[_OF_PULLS] * asked, missing]
    return (
        '<!doctype html>\n<html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width">'
        f"<title>A pad's report card</title><style>{_STYLE}</style>\n{_head(card, version)}{_findings(card)}{_figures(card)}"
        f'<h2>Pictures</h2>\n<div class="pictures">\n{pictures}</div>\n<h2>How to read it</h2>\n'
        + "".join(f"<p>{html.escape(note, quote=False)}</p>\n" for note in notes)
        + "</html>\n"
    )


def card_json(card):
    """The figures, for programs."""
    presses = []
    for press, error, at in zip(card.measured.presses, card.location_mm, card.fit.press_mm):
        estimate = press.estimate
        presses.append(
            {"mark": press.mark, **{name: getattr(estimate, name) for name in ("frames", "x_mm", "y_mm", "force_N", "warned")}}
            | {"off_mm": -1.0 if error is None else float(np.hypot(*error)), "pressed_x_mm": at[0], "pressed_y_mm": at[1]}
        )
    pulls = []
    for toward_deg, _, _, rest, pull in card.measured.pulls:
        then = {"x_mm": pull.x_mm, "y_mm": pull.y_mm, "force_N": pull.force_N, "frames": pull.pull_frames}
        then |= {"qx_N": pull.qx_N - rest.qx_N, "qy_N": pull.qy_N - rest.qy_N}
        pulls.append({"toward_deg": toward_deg, "rest_x_mm": rest.x_mm, "rest_y_mm": rest.y_mm} | then)
    return {
        "verdict": card.verdict,
        "figures": {figure.key: round(figure.value, figure.digits + 2) for figure in card.figures},
        "findings": [{"finding": finding.code, "sensors": finding.sensors, "text": finding.text} for finding in card.findings],
        "cautions": card.cautions,
        "presses": presses,
        "gain": list(card.gain),
        "gain_sd": list(card.gain_sd),
        "pulls": pulls,
        "pull_note": card.pull_note,
        "calibrated": card.is_calibrated,
        "calibration": card.judged["text"].decode(),
    }
