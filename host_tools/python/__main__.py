"""As python -m fingertip, out of the source tree: /usr/bin/python3 host_tools/python COMMAND ..."""

import os
import sys

SYSTEM = "/usr/bin/python3"  # has what the system's packages install
try:
    from fingertip.__main__ import command

    run = command()
except ModuleNotFoundError as error:
    if os.path.exists(SYSTEM) and not os.path.samefile(SYSTEM, sys.executable):
        os.execv(SYSTEM, [SYSTEM, *sys.argv])
    sys.exit(f"fingertip: {' '.join(sys.argv[1:2])} needs the Python module {error.name}: sudo apt install python3-numpy python3-serial")
sys.exit(run())
