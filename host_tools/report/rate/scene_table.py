#!/usr/bin/python3
"""The table of the scenes in host_tools/README.md: what each computes, what it leaves out, and what that costs.

    scene_table.py --build build/host             # measures all scenes in the emulator and writes the table
    scene_table.py --build build/host --check     # compares words and sizes: exit 1 if a figure is off by 2 % and more

The images are those of the tests: ctest --test-dir build/host -R 'checks.scene_.*_builds'
"""

import pathlib
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools/report/shared"), str(ROOT / "host_tools/python"), str(ROOT / "host_tools/report/rate")]
import scenes  # noqa: E402
from emulated import FROM_s, Measurement, Tools, distribution, scenario  # noqa: E402
from fingertip.command import Parser, run_tool  # noqa: E402
from fingertip.files import InputError, write_text  # noqa: E402
from grasp_rate import PAD  # noqa: E402
from presentation import table_md  # noqa: E402

from boards import PARALLEL  # noqa: E402

README = ROOT / "host_tools/README.md"
BEGIN, END = "<!-- scenes: python3 host_tools/report/rate/scene_table.py --build build/host -->", "<!-- /scenes -->"
SECONDS, OSR, TOLERANCE = 0.5, 256, 0.02
HEADINGS = (
    "scene",
    "computes",
    "leaves out",
    "flash, B",
    "RAM, B",
    "stack, B",
    "cycles of a frame",
    "latency, median, us",
    "latency, p99, us",
)


class OneScene(Tools):
    """The image of one scene."""

    def __init__(self, build, scene):
        self.scene = scene
        self.place = ROOT / "build" / (f"scenes/{scene}" if scene != Tools.scene else "") / PARALLEL
        super().__init__(build, ROOT / "build")

    def image(self, board, suffix="bin"):
        return self.place / f"fingertip-{PARALLEL}.{suffix}"


def sizes(tools):
    found = scenes.sizes(tools.place, PARALLEL)
    return [found[f"{name}_bytes"] for name in ("flash", "ram", "stack")]


def times(tools, folder, own):
    """Cycles of the first processor in a frame, and how long after the conversion a packet is offered."""
    if tools.scene == "paper":  # at 20 Hz there is nothing to compare
        return ["", "", ""]
    cycles = scenes.cycles(tools.command_frame, tools.place, tools.scene, PARALLEL, (OSR,), folder)["cycles_of_frame"]
    if "FIT" not in own:
        return [cycles, "", ""]
    pad = [tools.encoded("pad", *PAD)] if "TANGENTIAL" in own else []
    path = scenario(folder, "wander", FROM_s + SECONDS + 1, tools.scene)
    latency_us = distribution(Measurement(tools, folder, PARALLEL, OSR, path, SECONDS, commands=pad).offered_us)
    return [cycles, *(round(latency_us[name]) for name in ("median", "p99"))]


def lines_of(rows):
    return [
        BEGIN,
        "",
        *table_md(HEADINGS, rows),
        "",
        f"On {PARALLEL} at OSR {OSR}, in contact, emulated. RAM is without code. Cycles are the first processor's, without a profile of the pad.",
        "Latency counts from the conversion to the packet; in scenes `grasp` and `shapes` with a profile.",
        "",
        END,
    ]


def rows_in(text):
    lines = text.split(BEGIN)[1].split(END)[0].strip().split("\n")[2:]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("|")]


def differences(found, expected):
    """Lines that report where the words or figures of two tables differ."""
    if [row[0] for row in found] != [row[0] for row in expected]:
        return ["other scenes"]
    lines = []
    for a, b in zip(found, expected):
        for heading, x, y in zip(HEADINGS[1:], a[1:], b[1:]):
            x, y = str(x), str(y)
            both = x.isdigit() and y.isdigit()
            if abs(int(x) - int(y)) > TOLERANCE * int(y) if both else x != y:
                lines.append(f"{a[0]}, {heading}: {x} in the table, {y} now")
    return lines


def main(argv):
    parser = Parser(description=__doc__)
    parser.add_argument("--build", required=True, metavar="DIR", help="build folder of the host tools")
    parser.add_argument("--check", action="store_true", help="compare words and sizes with the table instead of writing it")
    options = parser.parse_args(argv)
    text, on, rows = README.read_text(encoding="utf-8"), scenes.capabilities(), []
    with tempfile.TemporaryDirectory() as folder:
        for scene in scenes.SCENES:
            tools = OneScene(options.build, scene)
            words = [", ".join(word for name, word in scenes.WORDS.items() if (name in on[scene]) is there) for there in (True, False)]
            figures = [] if options.check else times(tools, folder, on[scene])
            rows.append([f"`{scene}`", words[0] or "pressures", words[1], *sizes(tools), *figures])
    if not options.check:
        head, tail = text.split(BEGIN)[0], text.split(END)[1]
        write_text(README, head + "\n".join(lines_of(rows)) + tail)
        return 0
    wrong = differences([row[:6] for row in rows_in(text)], rows)
    if wrong:
        raise InputError("; ".join([*wrong, f"{README.relative_to(ROOT)} is out of date: run scene_table.py without --check"]))
    return 0


if __name__ == "__main__":
    sys.exit(run_tool("scene_table.py", main))
