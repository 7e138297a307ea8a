"""The text of a report: the file text.md.in of its folder with the figures filled in, then every table that this file does not name.

In text.md.in, {goals} is the table of goals, {table NAME} a table of the figures, and {NAME:.1f} a figure in Python's format,
{NAME.KEY:.1f} one of a dict. A section (##) whose table was not measured is left out.
"""

import pathlib
import re

from fingertip.files import write_text
from presentation import goal_table_md, table_of_dicts_md

TABLE = re.compile(r"^\{table (\w+)\}$", re.M)
FIGURE = re.compile(r"\{([\w.]+):([^}]+)\}")


def is_table(value):
    return isinstance(value, list) and bool(value) and all(isinstance(row, dict) for row in value)


def flat(row, before=""):
    """Cells of a row: what is in a dict is a column of its own, a list of plain values is one cell, and tables within tables are left out."""
    cells = {}
    for name, value in row.items():
        if isinstance(value, dict):
            cells |= flat(value, f"{before}{name} ")
        elif not is_table(value):
            cells[before + name] = ", ".join(map(str, value)) if isinstance(value, list) else value
    return cells


def table(found, name):
    return "\n".join(table_of_dicts_md([flat(row) for row in found[name]]))


def figure(found, name, form):
    for key in name.split("."):
        found = (found or {}).get(key)
    return "(not measured)" if found is None else format(found, form)


def filled(template, found, pictured=()):
    """Markdown. pictured: tables that only the picture shows."""
    sections = re.split(r"^(?=## )", template, flags=re.M)
    sections = [section for section in sections if all(is_table(found.get(name)) for name in TABLE.findall(section))]
    named = {name for section in sections for name in TABLE.findall(section)} | set(pictured)
    text = TABLE.sub(lambda match: table(found, match[1]), "".join(sections))
    text = FIGURE.sub(lambda match: figure(found, match[1], match[2]), text).replace("{goals}", "\n".join(goal_table_md(found)))
    others = [name for name, value in found.items() if is_table(value) and name not in named]
    return text + "".join(f"\n## {name.replace('_', ' ')}\n\n{table(found, name)}\n" for name in others)


def write(found, part, out, pictured=()):
    """PART.md in the folder of the reports."""
    template = pathlib.Path(__file__).resolve().parents[1] / part / "text.md.in"
    write_text(out / f"{part}.md", filled(template.read_text(encoding="utf-8"), found, pictured))
