"""Makes a pad's report card in ten minutes, with one weight and a printed template: `fingertip validate`, which starts this."""

import argparse
import json
import math
import os
import sys

from .errors import FingertipError, InputError
from .files import SENSOR_X_mm, SENSOR_Y_mm, PITCH_mm, printable
from .validation.assess import Card
from .validation.card import card_html, card_json
from .validation.live import validate_live
from .validation.measure import read_measurement
from .validation.protocol import HEIGHT_mm, PULL_SHARE_MAX, PULL_SHARE_MIN, array_of
from .validation.template import RULER_mm, template_pdf, template_svg
from .version import __version__

NAME = "fingertip validate"
SKIN_mm = 12.0
COLOURS = ("auto", "truecolour", "256", "plain")
_UNITS = {"GRAMS": "grams", "MM": "mm"}
_LIVE = ("weight", "skin", "pull", "thread_height", "record", "serial")  # of these none with --from, and with --template nothing at all


class WrongUsage(Exception):
    pass


class _Parser(argparse.ArgumentParser):
    def error(self, message):
        raise WrongUsage(f"{message}; see {NAME} --help")


class _Number(argparse.Action):
    """In a range, which its help names."""

    def __init__(self, *names, low, high, metavar, help, **more):
        self.low, self.high = low, high
        super().__init__(*names, metavar=metavar, help=f"{help} ({low} to {high} {_UNITS[metavar]})", **more)

    def __call__(self, parser, options, text, option=None):
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not self.low <= value <= self.high:
            parser.error(f'{option} takes {self.low} to {self.high} {_UNITS[self.metavar]}, not "{printable(text)}"')
        setattr(options, self.dest, value)


def _parser():
    parser = _Parser(prog=NAME, description=__doc__.split(":")[0] + ".", allow_abbrev=False, usage=f"{NAME} [OPTIONS]")
    parser.formatter_class = lambda prog: argparse.HelpFormatter(prog, max_help_position=28, width=80)
    add = parser.add_argument
    add("--device", metavar="SERIAL", help="Serial number of the fingertip; default: the only one there is")
    add("--port", metavar="PATH", help="Serial port or pseudo-terminal; default: $FINGERTIP_PORT, or a fingertip plugged in")
    add(
        "--transport",
        metavar="KIND",
        choices=("auto", "socket", "serial"),
        default="auto",
        help="socket (of fingertip serve, which reaches one by libusb too), serial, or auto: the first of these that there is",
    )
    add(
        "--template",
        metavar="SHEET.pdf|SHEET.svg",
        help="Only write the template to print at 1:1, with the marks to press (not with other options than --overwrite)",
    )
    add("--weight", action=_Number, low=50, high=2000, metavar="GRAMS", help="Mass of the weight")
    add("--skin", action=_Number, low=4, high=30, metavar="MM", help=f"Rubber above the sensors, as it was cast; default {SKIN_mm:g}")
    add(
        "--pull",
        action=_Number,
        low=10,
        high=1000,
        metavar="GRAMS",
        help="Also measure pulls: mass on a level thread, over a pulley, that pulls the weight; a third of --weight",
    )
    add(
        "--thread-height",
        action=_Number,
        low=0,
        high=10,
        metavar="MM",
        help=f"Height of that thread above the rubber; default {HEIGHT_mm:g}; only with --pull",
    )
    add(
        "--record",
        metavar="FILE.csv",
        help="The recording that is kept, to send or to make the card from again: it has what was measured, and no name, port or serial number",
    )
    add("--serial", action="store_true", default=None, help="Keep the serial number in the recording")
    add(
        "--from",
        dest="recording",
        metavar="FILE.csv",
        help="Make the card from a recording that validate kept (not with "
        + ", ".join(f"--{name.replace('_', '-')}" for name in _LIVE)
        + ")",
    )
    add("-o", "--output", metavar="CARD.html", help="The card, a page with pictures")
    add("--figures", metavar="FILE.json", help="The card's figures, for programs")
    add("--overwrite", action="store_true", help="Replace files that exist")
    add("--colour", metavar="MODE", default="auto", help="auto, truecolour, 256, or plain: a line a second")
    return parser


def _options(argv):
    options, rest = _parser().parse_known_args(argv)
    if rest:
        what = "is no option of it" if rest[0].startswith("-") else "is one word too many"
        raise WrongUsage(f'"{printable(rest[0])}" {what}; see {NAME} --help')
    given = [f"--{name.replace('_', '-')}" for name in _LIVE if getattr(options, name) is not None]
    given += [
        name for name, value in (("--from", options.recording), ("--output", options.output), ("--figures", options.figures)) if value
    ]
    for first, others in (
        ("--template", given),
        ("--from", [name for name in given if name.removeprefix("--").replace("-", "_") in _LIVE]),
    ):
        if (options.template if first == "--template" else options.recording) and others:
            raise WrongUsage(f"{first} excludes {others[0]}; see {NAME} --help")
    if options.thread_height is not None and options.pull is None:
        raise WrongUsage(f"--thread-height requires --pull; see {NAME} --help")
    if options.colour not in COLOURS:
        raise WrongUsage(f'--colour "{printable(options.colour)}" is not possible; give auto, truecolour, 256 or plain; see {NAME} --help')
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


def _check_output(path, overwrite):
    """Before any work. Raises InputError."""
    if os.path.exists(path) and not overwrite:
        raise InputError(f"{path}: exists; give --overwrite or another name")
    folder = os.path.dirname(path) or "."
    if not os.path.isdir(folder):
        raise InputError(f"{path}: No such file or directory; choose another place")
    if os.path.isdir(path) or not os.access(path if os.path.exists(path) else folder, os.W_OK):
        raise InputError(f"{path}: it may not be written; choose another place")


def _write(path, text):
    """Whole or not at all."""
    try:
        with open(f"{path}.part", "w", encoding="utf-8") as file:
            file.write(text)
        os.replace(f"{path}.part", path)
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}; choose another place") from None


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


def run(argv):
    options = _options(argv)
    for path in (options.template, options.output, options.figures, options.record):
        if path:
            _check_output(path, options.overwrite)
    if options.template:
        array = array_of(SENSOR_X_mm, SENSOR_Y_mm, PITCH_mm)
        draw = template_pdf if options.template.lower().endswith(".pdf") else template_svg
        _write(options.template, draw(array))
        print(f"{printable(options.template)}: print it at 100 %, and measure its line of {RULER_mm:.0f} mm")
        return
    measured = read_measurement(options.recording, options.device) if options.recording else validate_live(options)
    card = Card(measured, printable(options.recording or options.record))
    if options.output:
        _write(options.output, card_html(card, __version__))
    if options.figures:
        _write(options.figures, json.dumps(card_json(card), indent=1) + "\n")
    _print(card)


def main(argv):
    """Exit status."""
    try:
        run(argv)
        sys.stdout.flush()
        return 0
    except WrongUsage as error:
        text, status = str(error), 2
    except (FingertipError, InputError) as error:
        text, status = str(error), 1
    except KeyboardInterrupt:
        text, status = "interrupted", 1
    print(f"fingertip: {printable(text)}", file=sys.stderr)
    return status


def command():
    """The console command fingertip-validate."""
    return main(sys.argv[1:])
