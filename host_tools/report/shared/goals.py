"""Figures beside their goals, as every report judges and shows them.

A goal is (name, sign, limit): sign ">=" or "<="; limit a number or the name of another figure. A figure that was not
measured is None.
"""

from tables import table_md, text_of

VERDICTS = {True: "met", False: "MISSED", None: "not measured"}
HEADER = ("figure", "found", "goal", "verdict")


def judge(found, goals):
    """found with "goals" added: name -> {"goal": text, "met": True, False or None}."""
    judged = {}
    for name, sign, limit in goals:
        value, bound = found[name], found[limit] if isinstance(limit, str) else limit
        met = None
        if value is not None and bound is not None:
            met = bool(value <= bound if sign == "<=" else value >= bound)
        judged[name] = {"goal": f"{sign} {limit if bound is None else f'{bound:g}'}", "met": met}
    return {**found, "goals": judged}


def missed(found):
    return [name for name, goal in found["goals"].items() if goal["met"] is False]


def goal_rows(found, digits=4):
    """(figure, found, goal, verdict) for a table."""
    return [(name, text_of(found[name], digits), goal["goal"], VERDICTS[goal["met"]]) for name, goal in found["goals"].items()]


def goal_table_md(found):
    """Lines of Markdown."""
    return table_md(HEADER, goal_rows(found))


def print_goals(found):
    rows = goal_rows(found, digits=6)
    width = max(len(row[0]) for row in rows)
    for name, value, goal, verdict in rows:
        print(f"{verdict:12s} {name:{width}s} {value:>12s}   goal {goal}")
