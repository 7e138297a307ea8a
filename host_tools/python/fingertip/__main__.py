"""The package's commands: what pip installs as fingertip-plot, fingertip-scenario and so on.

    python -m fingertip plot|scenario|evaluate|fit|validate|ros2|ros2_gripper|bridge|recorder ...

--help after a command has its options.
"""

import importlib
import sys
from collections.abc import Callable
from typing import Any

COMMANDS = ("plot", "scenario", "evaluate", "fit", "validate", "ros2", "ros2_gripper", "bridge", "recorder")


def command() -> Callable[[], Any]:
    """What the first word names, which is taken out of sys.argv."""
    if len(sys.argv) < 2 or sys.argv[1] not in COMMANDS:
        sys.exit(__doc__)
    named: Callable[[], Any] = importlib.import_module(f"fingertip.{sys.argv[1]}").command
    del sys.argv[1]
    return named


if __name__ == "__main__":
    sys.exit(command()())
