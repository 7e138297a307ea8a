"""As python -m fingertip, out of the source tree: /usr/bin/python3 host_tools/python COMMAND ..."""

import os
import sys

SYSTEM = "/usr/bin/python3"  # has what the system's packages install
WORDS = sys.argv[1:]
try:
    from fingertip.__main__ import main

    sys.exit(main())
except ModuleNotFoundError as error:
    if os.path.exists(SYSTEM) and not os.path.samefile(SYSTEM, sys.executable):
        os.execv(SYSTEM, [SYSTEM, sys.argv[0], *WORDS])
    sys.exit(f"fingertip: {' '.join(WORDS[:1])} needs the Python module {error.name}: sudo apt install python3-numpy python3-serial")
