#!/usr/bin/python3
"""Every table and picture of the reports on one page.

    page.py -o build/report

    index.html    of what lies in the folder; whatever was not measured is named as such

Each report makes the page again when it ends. Pictures are inside, nothing is loaded from elsewhere: the file can be sent.
"""
import argparse
import base64
import csv
import dataclasses
import fnmatch
import html
import json
import pathlib
import re
import sys
import time

import markdown

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools/report/shared"), str(ROOT / "host_tools/python")]
from fingertip.files import InputError, run_tool, write_text  # noqa: E402
from goals import HEADER, goal_rows  # noqa: E402
from tables import text_of  # noqa: E402

SIMULATED, EMULATED, RECORDED = "simulated", "emulated", "from recordings"
IMAGE, CLOCK, RUN, SAID = "read from the image", "timed on this computer", "run on this computer", "setting"


@dataclasses.dataclass(frozen=True)
class Part:
    name: str  # NAME.json has its figures, NAME.md its text unless it is said where
    title: str
    about: str
    command: str
    origin: str  # of its figures, but for those that match a pattern
    origins: tuple = ()  # (pattern, origin), the first that matches
    text: str = None
    pictures: tuple = ()  # (file, what it shows)
    tables: tuple = ()  # (file, what it holds) beside the JSON


REPORT = "/usr/bin/python3 host_tools/report"
PARTS = (
    Part("fit", "The fit", "How far the fit on the chip is from the least-squares optimum, what it costs there, and what one would use instead.",
         f"{REPORT}/fit/fit.py --build build/host --boards build -o build/report", SIMULATED,
         (("*_cycles", EMULATED), ("speed_vs_*", CLOCK), ("processor", CLOCK), ("seed", SAID)), "fit_table.md",
         (("fit_report.png", "Error of the fit against its run time: presses simulated, cycles emulated, times of this computer"),),
         (("fit_table.csv", "Every kernel and variant"), ("stiff.json", "Presses that are hard, extreme, or none: shares of each flag"))),
    Part("rate", "Rate, latency and cost", "The release images of all boards in the emulator, in contact on every frame.",
         f"{REPORT}/rate/rate.py --build build/host --boards build -o build/report", EMULATED, (("*_bytes", IMAGE), ("fit_iterations", SAID)),
         pictures=(("rate.png", "Rate by oversampling, latency, cycles by stage, rate by number of sensors: emulated"),)),
    Part("validation", "The published experiments", "The experiments of De Clercq et al., RA-L 2022, on the simulated pad with the firmware's own code.",
         f"{REPORT}/validation/validation.py --build build/host --boards build -o build/report", SIMULATED,
         (("emulated_*", EMULATED), ("seconds", CLOCK), ("pads", SAID), ("rate_Hz", SAID), ("prior_*_mm", SAID)),
         pictures=(("validation_force.png", "Estimated and true force: simulated"), ("validation_signals.png", "The fifteen sensors during taps: simulated"),
                   ("validation_slip.png", "Reconstructed pressure during a slip: simulated"))),
    Part("truth", "From the optimum to the truth", "What separates the number from the truth of the contact, on hundreds of pads.",
         f"{REPORT}/truth/truth.py --build build/host --boards build -o build/report", SIMULATED,
         (("real_*", RECORDED), ("strips", RECORDED), ("locations", RECORDED), ("flash*", EMULATED), ("*_cycles", EMULATED), ("seed", SAID), ("pads", SAID)),
         pictures=(("truth.png", "Coverage, warnings, placements, iterations: simulated"),)),
    Part("real", "Real rubber", "The fit, the calibration and the zero on recordings of real pads that other people made.",
         "sh cmake/bootstrap.sh report real FOLDER", RECORDED, pictures=(("real.png", "Response of the sensors, errors over the array, coverage: from recordings"),)),
    Part("shear", "Tangential load", "Size and direction of what pulls along the rubber, from the normal pressures alone: how far from the truth, and what it does "
         "to every other figure.", f"{REPORT}/shear/shear.py --build build/host -o build/report", SIMULATED,
         (("chip_*", EMULATED), ("*_cycles*", EMULATED), ("shear_seed", SAID), ("shear_pads", SAID)),
         pictures=(("shear.png", "Errors by place, arrows, location before and after, bounds, objects, pads that end: simulated"),)),
    Part("grasp", "Grasps", "Thousands of grasps in a simulated cell: two fingertips, an object, a gripper, and the firmware's own controller between them.",
         f"{REPORT}/grasp/grasp.py --build build/host -o build/report", SIMULATED, (("grasp_seed", SAID), ("emulated_*", EMULATED)),
         pictures=(("grasp.png", "Drops, grip, reaction, a slip that is caught: simulated"),)),
    Part("tools", "The tools", "What the tools do to those who use them, with simulated fingertips on pseudo-terminals of this computer.",
         f"{REPORT}/tools/tools.py --build build/host -o build/report", SIMULATED,
         (("*_us", CLOCK), ("*_fps", CLOCK), ("*_percent", CLOCK), ("*_seconds", SAID), ("*_clients", SAID), ("*_fingertips", SAID))),
    Part("reliability", "Reliability", "What the firmware, its protocol and the tools do with whatever they are fed, and what faults and power cuts do to it.",
         f"{REPORT}/reliability/reliability.py --build build/host -o build/report", RUN, (("fuzz_seconds", SAID), ("fuzz_seed", SAID), ("soak_hours_emulated", EMULATED), ("power_cut*", EMULATED), ("soak*", SIMULATED), ("recovery", SIMULATED),
          ("worst_recovery_s", SIMULATED))),
    Part("suite", "The test suite", "The test suite run over and over, half of the runs on a busy machine: whether it is green, and what it takes.",
         "sh cmake/bootstrap.sh report suite", CLOCK, (("*_runs", RUN), ("*_failures", RUN), ("sleeps", RUN), ("retries", RUN), ("mutants_*", RUN))),
    Part("ecosystem", "Ecosystem", "The fingertip in programs of others.", f"{REPORT}/ecosystem/ecosystem.py --build build/host -o build/report", SIMULATED,
         (("*_percent", CLOCK), ("*_us*", CLOCK), ("*_fps", CLOCK), ("*_seconds", SAID), ("python_vectors*", RUN))),
    Part("web", "The page", "What the page costs and keeps up with in a headless Chromium that renders in software, and each of its steps, driven there.",
         f"{REPORT}/web/web.py --build build/host -o build/report", CLOCK,
         (("bundle_*", RUN), ("wasm_cpu_percent", CLOCK), ("wasm_*", SIMULATED), ("web_lost", RUN), ("web_foreign_requests", RUN), ("web_steps*", EMULATED),
          ("*_seconds", SAID))),
    Part("usb", "USB and clocks", "The image's USB device before a Debian kernel in a virtual machine, and two fingertips on one clock.",
         "sh cmake/bootstrap.sh test", EMULATED, (("alignment_fake_*", SIMULATED), ("*_test_s", CLOCK), ("*_seconds", SAID))),
)

STYLE = """
:root { color-scheme: light dark; --ink: #22252e; --faint: #5c6270; --paper: #fff; --line: #d5d9e2; --band: #f4f6fa;
  --met: #1c7a38; --missed: #b3261e; }
@media (prefers-color-scheme: dark) { :root { --ink: #e4e7ee; --faint: #a3aab8; --paper: #16181d; --line: #3a3f4b; --band: #1f232b;
  --met: #7ed99a; --missed: #ff9c92; } }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 1rem; max-width: 75rem; font: 1rem/1.5 system-ui, sans-serif; color: var(--ink); background: var(--paper); }
h2 { margin-top: 3rem; border-top: 2px solid var(--line); padding-top: 1rem; }
a { color: inherit; }
p, li { max-width: 48rem; }
.faint { color: var(--faint); }
.scroll { overflow: auto; max-height: 85vh; margin: 1rem 0; }
td .scroll { max-height: none; margin: 0; }
table { border-collapse: collapse; font-size: .875rem; font-variant-numeric: tabular-nums; }
th, td { border-bottom: 1px solid var(--line); padding: .25rem .75rem .25rem 0; text-align: left; vertical-align: top; }
thead th { position: sticky; top: 0; background: var(--paper); color: var(--faint); font-weight: 600; }
tbody tr:nth-child(odd) > * { background: var(--band); }
.met { color: var(--met); } .missed { color: var(--missed); font-weight: 700; }
figure { margin: 1.5rem 0; }
img { display: block; width: 100%; min-width: 40rem; max-width: 75rem; height: auto; background: #fff; border-radius: .25rem; }
figcaption, code { font-size: .875rem; }
code { overflow-wrap: anywhere; }
summary { cursor: pointer; padding: .5rem 0; }
"""


def origin_of(part, name):
    return next((origin for pattern, origin in part.origins if fnmatch.fnmatchcase(name, pattern)), part.origin)


def table_html(header, rows):
    """Cells are HTML; the first of a row names it."""
    head = "".join(f'<th scope="col">{html.escape(name)}</th>' for name in header)
    body = "".join(f'<tr><th scope="row">{row[0]}</th>{"".join(f"<td>{cell}</td>" for cell in row[1:])}</tr>' for row in rows)
    return f'<div class="scroll"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'


def value_html(value):
    """Any value of a JSON file: what is inside is a table."""
    if isinstance(value, dict):
        return table_html(("", "value"), [(html.escape(name), value_html(item)) for name, item in value.items()])
    if isinstance(value, list) and value and all(isinstance(row, dict) for row in value):
        columns = list(dict.fromkeys(name for row in value for name in row))
        return table_html(columns, [[value_html(row.get(name)) for name in columns] for row in value])
    if isinstance(value, list):
        return ", ".join(value_html(item) for item in value)
    return html.escape(text_of(value, 6))


def verdict_html(verdict):
    kind = {"met": "met", "MISSED": "missed"}.get(verdict, "faint")
    return f'<span class="{kind}">{verdict.lower()}</span>'


def goals_html(part, found):
    rows = [(html.escape(name), html.escape(value), html.escape(goal), verdict_html(verdict), origin_of(part, name))
            for name, value, goal, verdict in goal_rows(found)]
    return table_html(("figure", "found", "asked", "verdict", "how"), rows)


def figures_html(part, found):
    rows = [(html.escape(name), origin_of(part, name), value_html(value)) for name, value in found.items() if name != "goals"]
    return folded(f"Every figure of {part.name}.json", table_html(("figure", "how", "value"), rows))


def folded(summary, inside, state=""):
    return f"<details {state}><summary>{html.escape(summary)}</summary>{inside}</details>"


def text_html(path):
    """The report's own text without what the page shows itself: title, goals, pictures."""
    lines, in_goals = [], False
    for line in path.read_text(encoding="utf-8").split("\n"):
        in_goals = line.startswith("|") and (in_goals or line == f"| {' | '.join(HEADER)} |")
        if not in_goals and not line.startswith("# "):
            lines.append(re.sub(r"^#", "##", re.sub(r"!\[[^]]*]\([^)]*\)", "", line)))
    said = markdown.markdown("\n".join(lines), extensions=["tables", "sane_lists"], output_format="html")
    return said.replace("<table>", '<div class="scroll"><table>').replace("</table>", "</table></div>")


def picture_html(path, caption):
    if not path.is_file():
        return f"<p>{html.escape(caption)} ({path.name}): <strong>not drawn</strong>.</p>"
    data = base64.b64encode(path.read_bytes()).decode("ascii")
    return (f'<figure><div class="scroll"><img alt="{html.escape(caption)}" src="data:image/png;base64,{data}"></div><figcaption>{html.escape(caption)} '
            f"({path.name})</figcaption></figure>")


def further_table_html(path, caption):
    if not path.is_file():
        return f"<p>{html.escape(caption)} ({path.name}): <strong>not there</strong>.</p>"
    if path.suffix == ".json":
        inside = value_html(json.loads(path.read_text(encoding="utf-8")))
    else:
        with open(path, newline="", encoding="utf-8") as file:
            header, *rows = csv.reader(file)
        inside = table_html(header, [[html.escape(cell) for cell in row] for row in rows])
    return folded(f"{caption} ({path.name})", inside)


def read_figures(path):
    """None if the part was not run."""
    if not path.is_file():
        return None
    found = json.loads(path.read_text(encoding="utf-8"))
    if not isinstance(found, dict):
        raise ValueError("no figures")
    return found


def in_short(found):
    by_verdict = {True: [], False: [], None: []}
    for name, goal in found.get("goals", {}).items():
        by_verdict[goal["met"]].append(name)
    said = [f"{len(by_verdict[True])} met"] if by_verdict[True] else []
    said += [f"{len(names)} {what} ({html.escape(', '.join(names))})"
             for names, what in ((by_verdict[False], "missed"), (by_verdict[None], "not measured")) if names]
    return ", ".join(said) or "no goals"


def section(part, folder):
    """(in short, HTML)"""
    path = folder / f"{part.name}.json"
    head = (f'<h2 id="{part.name}">{html.escape(part.title)}</h2><p>{html.escape(part.about)} Regenerated by '
            f"<code>{html.escape(part.command)}</code>.</p>")
    try:
        found = read_figures(path)
        if found is None:
            return "not run", f"{head}<p><strong>not run</strong>: there is no {path.name}.</p>"
        written = time.strftime("%Y-%m-%d %H:%M", time.localtime(path.stat().st_mtime))
        text = folder / (part.text or f"{part.name}.md")
        inside = [head, f'<p class="faint">Written {written}.</p>', goals_html(part, found) if "goals" in found else "",
                  *(picture_html(folder / name, caption) for name, caption in part.pictures),
                  folded(f"Tables and what they say ({text.name})", text_html(text), "open") if text.is_file() else "",
                  *(further_table_html(folder / name, caption) for name, caption in part.tables), figures_html(part, found)]
        return in_short(found), "".join(inside)
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        return "damaged", f"{head}<p><strong>damaged</strong>: {html.escape(str(error))}; run it again.</p>"


def write(folder):
    """Path of the page."""
    folder = pathlib.Path(folder)
    sections = [(part, *section(part, folder)) for part in PARTS]
    contents = "".join(f'<li><a href="#{part.name}">{html.escape(part.title)}</a>: {short}</li>' for part, short, _ in sections)
    path = folder / "index.html"
    write_text(path, "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
               f"content=\"width=device-width, initial-scale=1\"><title>Fingertip: what was measured</title><style>{STYLE}</style></head><body>"
               "<h1>Fingertip: what was measured</h1><p>No hardware: <em>simulated</em> is the firmware's code on this computer with simulated "
               "pads and sensors, <em>emulated</em> the release image on an emulated RP2040, <em>from recordings</em> the firmware's code on "
               "recordings of real strips. All of it is regenerated by <code>sh cmake/bootstrap.sh report</code>, the last part by "
               f"<code>sh cmake/bootstrap.sh test</code>.</p><ul>{contents}</ul>{''.join(body for _, _, body in sections)}</body></html>\n")
    return path


def main(argv):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", required=True, metavar="DIR", help="folder of the reports")
    options = parser.parse_args(argv)
    if not pathlib.Path(options.output).is_dir():
        raise InputError(f"{options.output}: there is no such folder; run a report first")
    print(f"page: {write(options.output)}")
    return 0


if __name__ == "__main__":
    sys.exit(run_tool("page.py", main))
