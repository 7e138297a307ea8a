#!/usr/bin/python3
"""The version number is in CMakeLists.txt, project VERSION. Packages that others build from their own files carry a copy of it.

version.py            writes the copies
version.py --check    fails if one differs, or if CHANGELOG.md does not begin with this version
version.py --print    prints it
"""

import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
# Where each copy is, and what comes before it: between quotation marks, at its first place in the file.
COPIES = [("host_tools/python/fingertip/version.py", r"__version__ = "), ("host_tools/python/lerobot/pyproject.toml", r"\nversion = ")]
for folder in ("host_tools/web", "host_tools/simulation/emulator"):
    COPIES += [
        (f"{folder}/package.json", r'\n  "version": '),
        (f"{folder}/package-lock.json", r'\n  "version": '),
        (f"{folder}/package-lock.json", r'"": {\n      "name": "[a-z-]*",\n      "version": '),
    ]
CHANGE = re.compile(r"^## \[(\d+\.\d+\.\d+)\]", re.M)


def version(root):
    return re.search(r"^project\(\S+ VERSION (\d+\.\d+\.\d+)", (root / "CMakeLists.txt").read_text(encoding="utf-8"), re.M)[1]


def main(argv, root=ROOT):
    number, wrong = version(root), []
    if argv == ["--print"]:
        print(number)
        return 0
    if argv not in ([], ["--check"]):
        sys.exit(__doc__)
    for name, before in COPIES:
        path = root / name
        text = path.read_text(encoding="utf-8")
        pattern = re.compile(rf'({before}")[^"\n]*(")')
        if not pattern.search(text):
            sys.exit(f"version.py: {name} has no version")
        written = pattern.sub(rf"\g<1>{number}\g<2>", text, count=1)
        if written != text:
            wrong.append(name)
            if not argv:
                path.write_text(written, encoding="utf-8")
    if argv and wrong:
        sys.exit(f"version.py: {', '.join(wrong)} are not of version {number}; run python3 cmake/version.py")
    newest = CHANGE.search((root / "CHANGELOG.md").read_text(encoding="utf-8"))
    if argv and (not newest or newest[1] != number):
        sys.exit(
            f"version.py: CHANGELOG.md begins with version {newest[1] if newest else 'none'}, not with {number}; write down what changed"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
