#!/usr/bin/python3
"""What to expect of a pad, never calibrated, calibrated and pulled side by side: the tables of README.md and host_tools/README.md.

    expected.py --build build/host            writes them, from the table of pads, of 200 of each case
    expected.py --build build/host --check    fails if they are not what would be written

Medians over touches anywhere on the array, 1 to 10 N, of seven objects, on 12 mm of simulated rubber without end whose sensors' gains differ by
10 %. Calibrated: with twenty placements of a known weight. Pulled: along the rubber by 0.3 of the force. Rubber does not relax here.
"""

import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / part) for part in ("host_tools/report/shared", "host_tools/report/measure", "host_tools/python")]
import static  # noqa: E402
from fingertip.command import InputError, Parser, run_tool  # noqa: E402
from reporting import contacts_of  # noqa: E402

PADS = 200
RAW, CALIBRATED = "10 %, not calibrated", "10 %, calibrated"
STRAIGHT, PULLED = "Q/F 0", "Q/F 0.3"
BEGIN, END = "<!--expected-->", "<!--/expected-->"


def rows_of(options):
    """{(pad, load): row}"""
    found = static.figures(contacts_of(options), pads=PADS, tables=("pads",))
    rows = {row["case"]: row for row in found["by_pad_and_load"]}
    return {(pad, load): rows[f"{pad}, {load}"] for pad in (RAW, CALIBRATED) for load in (STRAIGHT, PULLED)}


def mm(value):
    return f"{value:.2f} mm" if value < 0.995 else f"{value:.1f} mm"


def percent(value):
    return f"{value:.1f} %" if value < 2 else f"{value:.0f} %"


def share(value):
    return f"{value:.2f}"


def table(header, lines):
    line = lambda cells: "| " + " | ".join(cells) + " |\n"
    return line(header) + "|---" * len(header) + "|\n" + "".join(map(line, lines))


def long_table(rows):
    cases = [(pad, load) for pad in (RAW, CALIBRATED) for load in (STRAIGHT, PULLED)]
    lines = [
        [name, *(write(rows[case][key]) for case in cases)]
        for name, key, write in (
            ("location off by, scene `slip`", "location_without_p50_mm", mm),
            ("location, scene `grasp`", "location_p50_mm", mm),
            ("force off by, scene `slip`", "force_without_p50_percent", percent),
            ("force, scene `grasp`", "force_p50_percent", percent),
            ("pull off by, of the force, scene `grasp`", "vector_error_p50", share),
        )
    ]
    return table(["median, simulated 12 mm", "never calibrated", "and pulled by 0.3 of the force", "calibrated", "and pulled"], lines)


def short_table(rows):
    straight, pulled = rows[CALIBRATED, STRAIGHT], rows[CALIBRATED, PULLED]
    return table(
        ["off by, simulated", "`slip`, never calibrated", "`slip`, calibrated", "`slip`, and pulled", "`grasp`, and pulled"],
        [
            [
                "location",
                mm(rows[RAW, STRAIGHT]["location_without_p50_mm"]),
                *(mm(row["location_without_p50_mm"]) for row in (straight, pulled)),
                mm(pulled["location_p50_mm"]),
            ],
            [
                "force",
                percent(rows[RAW, STRAIGHT]["force_without_p50_percent"]),
                *(percent(row["force_without_p50_percent"]) for row in (straight, pulled)),
                percent(pulled["force_p50_percent"]),
            ],
            ["pull", "", "", "", f"{share(pulled['vector_error_p50'])} of force"],
        ],
    )


def filled(path, text):
    page = path.read_text(encoding="utf-8")
    if page.count(BEGIN) != 1 or page.count(END) != 1:
        raise InputError(f"{path}: has no place for the figures to expect; put a line {BEGIN} and a line {END} there")
    before, _, rest = page.partition(BEGIN)
    return before + BEGIN + "\n\n" + text + "\n" + END + rest.partition(END)[2]


def main(argv):
    parser = Parser(description=__doc__)
    parser.add_argument("--build", required=True, type=pathlib.Path, metavar="DIR")
    parser.add_argument("--check", action="store_true")
    options = parser.parse_args(argv)
    rows = rows_of(options)
    wrong = []
    for path, text in ((ROOT / "README.md", short_table(rows)), (ROOT / "host_tools/README.md", long_table(rows))):
        page = filled(path, text)
        if not options.check:
            path.write_text(page, encoding="utf-8")
        elif page != path.read_text(encoding="utf-8"):
            wrong.append(str(path.relative_to(ROOT)))
    if wrong:
        raise InputError(
            f"{' and '.join(wrong)}: the figures to expect are not those that host_tools/report/shear/expected.py finds; run it"
        )
    return 0


if __name__ == "__main__":
    sys.exit(run_tool("expected.py", main))
