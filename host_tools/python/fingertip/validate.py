"""Makes a pad's report card in ten minutes, with one weight and a printed template: `fingertip validate`, which starts this."""

import argparse
import contextlib
import json
import math
import re

from .command import Parser, WrongUsage, check_output, printable
from .files import SENSOR_X_mm, SENSOR_Y_mm, PITCH_mm, read_lines, write_text
from .validation.assess import Card
from .validation.card import card_html, card_json
from .validation.live import validate_live
from .validation.measure import read_measurement
from .validation.protocol import HEIGHT_mm, PULL_SHARE_MAX, PULL_SHARE_MIN, array_of
from .validation.template import RULER_mm, template_pdf, template_svg
from .version import __version__

NAME = "fingertip validate"
SKIN_mm = 12.0
_LIVE = ("weight", "skin", "pull", "thread_height", "record", "serial")  # of these none with --from, and with --template nothing at all


def _number(low, high, unit):
    """The type of an option in a range, and how its help ends."""

    def number(text):
        with contextlib.suppress(ValueError):
            if low <= float(text) <= high:
                return float(text)
        raise argparse.ArgumentTypeError(f'takes {low} to {high} {unit}, not "{text}"')

    return number, f" ({low} to {high} {unit})"


def _name(text):
    if not text:
        raise argparse.ArgumentTypeError("takes a name, and this one is empty")
    return text


def _parser():
    parser = Parser(prog=NAME, description=__doc__.split(":")[0] + ".", allow_abbrev=False, usage=f"{NAME} [OPTIONS]")
    parser.formatter_class = lambda prog: argparse.HelpFormatter(prog, max_help_position=28, width=80)

    def add(*names, help, number=(_name, ""), **more):
        parser.add_argument(*names, help=help + number[1], **({} if "action" in more else {"type": number[0]}), **more)

    kinds, colours = ("auto", "socket", "serial"), ("auto", "truecolour", "256", "plain")
    transport = "socket (of fingertip serve, which reaches one by libusb too), serial, or auto: the first of these that there is"
    template = "Only write the template to print at 1:1, with the marks to press (not with other options than --overwrite)"
    pull = "Also measure pulls: mass on a level thread, over a pulley, that pulls the weight; a third of --weight"
    height = f"Height of that thread above the rubber; default {HEIGHT_mm:g}; only with --pull"
    record = (
        "The recording that is kept, to send or to make the card from again: it has what was measured, and no name, port or serial number"
    )
    excluded = ", ".join(map(_option, _LIVE))
    grams = {"metavar": "GRAMS"}
    add("--device", metavar="SERIAL", help="Serial number of the fingertip; default: the only one there is")
    add("--port", metavar="PATH", help="Serial port or pseudo-terminal; default: $FINGERTIP_PORT, or a fingertip plugged in")
    add("--transport", metavar="KIND", choices=kinds, default="auto", help=transport)
    add("--template", metavar="SHEET.pdf|SHEET.svg", help=template)
    add("--weight", number=_number(50, 2000, "grams"), help="Mass of the weight", **grams)
    add("--skin", number=_number(4, 30, "mm"), metavar="MM", help=f"Rubber above the sensors, as it was cast; default {SKIN_mm:g}")
    add("--pull", number=_number(10, 1000, "grams"), help=pull, **grams)
    add("--thread-height", number=_number(0, 10, "mm"), metavar="MM", help=height)
    add("--record", metavar="FILE.csv", help=record)
    add("--serial", action="store_true", default=None, help="Keep the serial number in the recording")
    add("--from", dest="recording", metavar="FILE.csv", help=f"Make the card from a recording that validate kept (not with {excluded})")
    add("-o", "--output", metavar="CARD.html", help="The card, a page with pictures")
    add("--figures", metavar="FILE.json", help="The card's figures, for programs")
    add("--form", metavar="FILE.md", help="A form of your measurements, whose {keys} of --figures are replaced by the card's figures")
    add("--overwrite", action="store_true", help="Replace files that exist")
    add("--colour", metavar="MODE", choices=colours, default="auto", help="auto, truecolour, 256, or plain: a line a second")
    return parser


def _option(name):
    return "--" + name.replace("_", "-")


def _options(argv):
    parser = _parser()
    options = parser.parse_args(argv)
    live = [_option(name) for name in _LIVE if getattr(options, name) is not None]
    card = [name for name, value in (("--from", options.recording), ("--output", options.output), ("--figures", options.figures)) if value]
    if options.template and live + card:
        parser.error(f"--template excludes {(live + card)[0]}")
    if options.recording and live:
        parser.error(f"--from excludes {live[0]}")
    if options.thread_height is not None and options.pull is None:
        parser.error("--thread-height requires --pull")
    _check(options)
    options.skin = SKIN_mm if options.skin is None else options.skin
    options.thread_height = HEIGHT_mm if options.thread_height is None else options.thread_height
    return options


def _check(options):
    if options.template:
        if not options.template.lower().endswith((".pdf", ".svg")):
            raise WrongUsage(f"{printable(options.template)}: the template is a .pdf or a .svg; give such a name")
    elif not options.output and not options.figures:
        raise WrongUsage("no place for the card; give -o CARD.html, or --template SHEET.pdf for the template")
    elif not options.recording and not options.weight:
        raise WrongUsage("the weight is not known; give --weight GRAMS, or --from a recording of a validation")
    elif not options.recording and not options.record:
        raise WrongUsage("no place for the recording; give --record FILE.csv")
    elif options.pull and not PULL_SHARE_MIN <= options.pull / options.weight <= PULL_SHARE_MAX:
        least, most = math.ceil(PULL_SHARE_MIN * options.weight), math.floor(PULL_SHARE_MAX * options.weight)
        raise WrongUsage(
            f"a pull of {options.pull:.0f} g is {options.pull / options.weight:.2f} of the weight; give --pull from {least} to {most} grams, so "
            "that it shows and the weight does not slide"
        )


def _print(card):
    for figure in card.figures:
        print(f"{figure.value:9.{figure.digits}f} {figure.unit:7s} {figure.text}")
    print("\nnothing is wrong that this validation can see" if card.verdict == "good" else "")
    for text in (
        card.pull_note,
        *(f"{finding.code}: {finding.text}" for finding in card.findings),
        *(f"caution: {one}" for one in card.cautions),
    ):
        if text:
            print(text)


def main(argv):
    """Exit status."""
    options = _options(argv)
    outputs = [options.template, options.output, options.figures, options.record, options.form]
    for i, path in enumerate(outputs):
        if path is not None:
            check_output(path, options.recording, *outputs[:i], replace=options.overwrite or path == options.form)
    form = "\n".join(read_lines(options.form)) + "\n" if options.form else ""
    if options.template:
        array = array_of(SENSOR_X_mm, SENSOR_Y_mm, PITCH_mm)
        draw = template_pdf if options.template.lower().endswith(".pdf") else template_svg
        write_text(options.template, draw(array))
        print(f"{printable(options.template)}: print it at 100 %, and measure its line of {RULER_mm:.0f} mm")
        return 0
    measured = read_measurement(options.recording, options.device) if options.recording else validate_live(options)
    card = Card(measured, printable(options.recording or options.record))
    if options.output:
        write_text(options.output, card_html(card, __version__))
    if options.figures:
        write_text(options.figures, json.dumps(card_json(card), indent=1) + "\n")
    if options.form:
        known = {figure.key: figure.shown(figure.value) for figure in card.figures}
        write_text(options.form, re.sub(r"\{(\w+)\}", lambda key: known.get(key[1], "not measured"), form))
    _print(card)
    return 0
