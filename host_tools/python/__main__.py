"""The package's commands, out of the source tree.

    /usr/bin/python3 host_tools/python plot|scenario|evaluate|ros2 ...

what pip installs as fingertip-plot, fingertip-scenario, fingertip-evaluate and fingertip-ros2; --help after a command has its options.
"""
import importlib
import sys

COMMANDS = ("plot", "scenario", "evaluate", "ros2")

if __name__ == "__main__":
    if len(sys.argv) < 2 or sys.argv[1] not in COMMANDS:
        sys.exit(__doc__)
    sys.exit(importlib.import_module(f"fingertip.{sys.argv.pop(1)}").command())
