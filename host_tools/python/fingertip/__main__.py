"""The package's commands: what pip installs as fingertip-plot, fingertip-scenario and so on.

    python -m fingertip plot|scenario|evaluate|fit|validate|ros2|bridge|recorder ...

--help after a command has its options.
"""

import importlib
import sys
from typing import Any

COMMANDS = ("plot", "scenario", "evaluate", "fit", "validate", "ros2", "bridge", "recorder")


def main() -> Any:
    if len(sys.argv) < 2 or sys.argv[1] not in COMMANDS:
        return __doc__
    return importlib.import_module(f"fingertip.{sys.argv.pop(1)}").command()


if __name__ == "__main__":
    sys.exit(main())
