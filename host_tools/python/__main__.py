"""The package's commands, out of the source tree.

    /usr/bin/python3 host_tools/python plot|scenario|evaluate|ros2|bridge|recorder ...

what pip installs as fingertip-plot, fingertip-scenario and so on; --help after a command has its options.
"""

import importlib
import sys

COMMANDS = ("plot", "scenario", "evaluate", "ros2", "bridge", "recorder")

if __name__ == "__main__":
    if len(sys.argv) < 2 or sys.argv[1] not in COMMANDS:
        sys.exit(__doc__)
    sys.exit(importlib.import_module(f"fingertip.{sys.argv.pop(1)}").command())
