"""The gripper's and the controller's rows of a recording: host_tools/grasp/grip_row.hpp."""

from typing import Any

import numpy as np

from .command import Path
from .errors import InputError
from .files import number_of, undamaged
from .grip_table import State

GRIP_WORDS = ("state", "trouble")  # its columns that are names
GRIP_STATES = [state.name.lower() for state in State]
GRIP_ROW = "# grip: "


def _grip_values(path: Path, number: int, columns: list[str], cells: list[str]) -> list[Any]:
    if len(cells) != len(columns):
        raise InputError(
            f"{path}:{number}: {len(cells)} columns of the gripper where its header has {len(columns)}; use salvage=True to skip the line"
        )
    if cells[columns.index("state")] not in GRIP_STATES:
        raise InputError(f'{path}:{number}: state is "{cells[columns.index("state")]}"; use salvage=True to skip the line')
    return [cell if name in GRIP_WORDS else number_of(path, number, name, cell, name != "time_us") for name, cell in zip(columns, cells)]


def read_grip(path: Path, salvage: bool = False) -> dict[str, Any]:
    """The gripper's rows in the recording of a grasp: {column: array}, NaN where empty; of any other recording an empty dictionary."""
    columns: list[str] | None = None
    rows: list[list[Any]] = []
    for number, line, torn in undamaged(path, salvage):
        if not line.startswith(GRIP_ROW):
            continue
        cells = line[len(GRIP_ROW) :].split(",")
        if columns is None:
            if cells[0] != "time_us" or "state" not in cells:
                raise InputError(f"{path}:{number}: a row of the gripper before its header; record again")
            columns = cells
            continue
        try:
            if torn:
                raise InputError(f"{path}:{number}: the last line is torn; use salvage=True to skip the line")
            rows.append(_grip_values(path, number, columns, cells))
        except InputError:
            if not salvage:
                raise
    if columns is None or not rows:
        return {}
    return {name: np.array(values, dtype=None if name in GRIP_WORDS else float) for name, values in zip(columns, zip(*rows))}
