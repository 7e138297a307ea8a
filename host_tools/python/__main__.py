"""The package's commands, out of the source tree.

    /usr/bin/python3 host_tools/python plot|scenario|evaluate|fit|validate|ros2|bridge|recorder ...

what pip installs as fingertip-plot, fingertip-scenario and so on; --help after a command has its options.
"""

import importlib
import os
import sys

COMMANDS = ("plot", "scenario", "evaluate", "fit", "validate", "ros2", "bridge", "recorder")
SYSTEM = "/usr/bin/python3"  # has what the system's packages install


def main():
    name = sys.argv.pop(1)
    try:
        command = importlib.import_module(f"fingertip.{name}").command
    except ModuleNotFoundError as error:
        if os.path.exists(SYSTEM) and not os.path.samefile(SYSTEM, sys.executable):
            os.execv(SYSTEM, [SYSTEM, sys.argv[0], name, *sys.argv[1:]])
        return f"fingertip: {name} needs the Python module {error.name}: sudo apt install python3-numpy python3-serial"
    return command()


if __name__ == "__main__":
    if len(sys.argv) < 2 or sys.argv[1] not in COMMANDS:
        sys.exit(__doc__)
    sys.exit(main())
