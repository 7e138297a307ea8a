"""Tables of Markdown, as every report writes them, and what is in them."""

import numpy as np


def quantile(values, share):
    """Of none, 0."""
    at = int(share * (len(values) - 1))
    return float(np.partition(values, at)[at]) if len(values) else 0.0


def percent(chosen):
    """Share of the true ones; of none, 0."""
    return 100.0 * float(np.count_nonzero(chosen)) / len(chosen) if len(chosen) else 0.0


def text_of(value, digits=4):
    if value is None:
        return ""
    return f"{value:.{digits}g}" if isinstance(value, float) else str(value)


def table_md(header, rows):
    """Lines. rows: lists of cells, each already as it is to be shown."""
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    return lines + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]


def table_of_dicts_md(rows):
    """Lines; a column for each key of any row."""
    columns = list(dict.fromkeys(name for row in rows for name in row))
    return table_md(columns, [[text_of(row.get(name)) for name in columns] for row in rows])
