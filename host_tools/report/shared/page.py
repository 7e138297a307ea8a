"""Every table and picture of the reports on one page, index.html, of what lies in the folder; whatever was not measured is named as such.

Each report makes the page again when it ends. Pictures are inside, nothing is loaded from elsewhere: the file can be sent.
"""

import base64
import fnmatch
import html
import json
import pathlib
import re
import time

import markdown

from fingertip.files import write_text
from parts import PARTS
from presentation import HEADER, goal_rows, text_of

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
    return next((origin for pattern, origin in part.page.origins if fnmatch.fnmatchcase(name, pattern)), part.page.origin)


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
    rows = [
        (html.escape(name), html.escape(value), html.escape(goal), verdict_html(verdict), origin_of(part, name))
        for name, value, goal, verdict in goal_rows(found)
    ]
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
    text = markdown.markdown("\n".join(lines), extensions=["tables", "sane_lists"], output_format="html")
    return text.replace("<table>", '<div class="scroll"><table>').replace("</table>", "</table></div>")


def picture_html(path, caption):
    if not path.is_file():
        return f"<p>{html.escape(caption)} ({path.name}): <strong>not drawn</strong>.</p>"
    data = base64.b64encode(path.read_bytes()).decode("ascii")
    return (
        f'<figure><div class="scroll"><img alt="{html.escape(caption)}" src="data:image/png;base64,{data}"></div><figcaption>{html.escape(caption)} '
        f"({path.name})</figcaption></figure>"
    )


def further_table_html(path, caption):
    if not path.is_file():
        return f"<p>{html.escape(caption)} ({path.name}): <strong>not there</strong>.</p>"
    return folded(f"{caption} ({path.name})", value_html(json.loads(path.read_text(encoding="utf-8"))))


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
    parts = [f"{len(by_verdict[True])} met"] if by_verdict[True] else []
    parts += [
        f"{len(names)} {what} ({html.escape(', '.join(names))})"
        for names, what in ((by_verdict[False], "missed"), (by_verdict[None], "not measured"))
        if names
    ]
    return ", ".join(parts) or "no goals"


def section(part, folder):
    """(in short, HTML)"""
    path = folder / f"{part.name}.json"
    head = (
        f'<h2 id="{part.name}">{html.escape(part.page.title)}</h2><p>{html.escape(part.page.about)} Regenerated by '
        f"<code>{html.escape(part.command)}</code>.</p>"
    )
    try:
        found = read_figures(path)
        if found is None:
            return "not run", f"{head}<p><strong>not run</strong>: there is no {path.name}.</p>"
        written = time.strftime("%Y-%m-%d %H:%M", time.localtime(path.stat().st_mtime))
        text = folder / (part.page.text or f"{part.name}.md")
        inside = [
            head,
            f'<p class="faint">Written {written}.</p>',
            goals_html(part, found) if "goals" in found else "",
            *(picture_html(folder / name, caption) for name, caption in part.page.pictures),
            folded(f"Tables in words ({text.name})", text_html(text), "open") if text.is_file() else "",
            *(further_table_html(folder / name, caption) for name, caption in part.page.tables),
            figures_html(part, found),
        ]
        return in_short(found), "".join(inside)
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        return "damaged", f"{head}<p><strong>damaged</strong>: {html.escape(str(error))}; run it again.</p>"


def write(folder):
    """Path of the page."""
    folder = pathlib.Path(folder)
    sections = [(part, *section(part, folder)) for part in PARTS if part.page]
    contents = "".join(f'<li><a href="#{part.name}">{html.escape(part.page.title)}</a>: {short}</li>' for part, short, _ in sections)
    path = folder / "index.html"
    write_text(
        path,
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><meta name="viewport" '
        f'content="width=device-width, initial-scale=1"><title>Fingertip: what was measured</title><style>{STYLE}</style></head><body>'
        "<h1>Fingertip: what was measured</h1><p>No hardware: <em>simulated</em> is the firmware's code on this computer with simulated "
        "pads and sensors, <em>emulated</em> the release image on an emulated RP2040, <em>from recordings</em> the firmware's code on "
        f"recordings of real strips. All of it is regenerated by <code>sh cmake/bootstrap.sh report</code>.</p><ul>{contents}</ul>{''.join(body for _, _, body in sections)}</body></html>\n",
    )
    return path
