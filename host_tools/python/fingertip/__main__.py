"""The package's commands: what pip installs as fingertip-plot, fingertip-scenario and so on.

    python -m fingertip plot|scenario|evaluate|fit|validate|ros2|ros2_gripper|bridge|recorder ...

--help after a command has its options.
"""

import functools
import importlib
import pathlib
import sys
from collections.abc import Callable

from .command import run_tool

COMMANDS = ("plot", "scenario", "evaluate", "fit", "validate", "ros2", "ros2_gripper", "bridge", "recorder")


def _tool(name: str) -> Callable[[], int]:
    called = {"fit": "fingertip fit", "validate": "fingertip"}.get(name, f"fingertip-{name.replace('_', '-')}")
    return functools.partial(run_tool, called, importlib.import_module(f"fingertip.{name}").main)


def command() -> Callable[[], int]:
    """What the first word names, which is taken out of sys.argv."""
    if len(sys.argv) < 2 or sys.argv[1] not in COMMANDS:
        sys.exit(__doc__)
    return _tool(sys.argv.pop(1))


def installed() -> int:
    """What the program's name names."""
    name = pathlib.PurePath(sys.argv[0]).stem.removeprefix("fingertip-").replace("-", "_")
    return _tool(name)() if name in COMMANDS else command()()


if __name__ == "__main__":
    sys.exit(command()())
