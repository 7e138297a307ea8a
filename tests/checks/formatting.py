#!/usr/bin/env python3
"""Checks that sources are formatted: C and C++ by clang-format, Python by ruff, JavaScript and TypeScript by biome.

usage: formatting.py [ROOT] [--write]

It prints each file that its formatter would change, and exits with 1 if there is one. With --write it formats them. Generated files, whose
first line says so, are left alone. Formatters that are not in PATH are looked for where cmake/bootstrap.sh puts them. One that is missing is
an error: exit 2.
"""

import argparse
import pathlib
import shutil
import subprocess
import sys

import house

FORMATTERS = {
    # formatter: (endings, where bootstrap puts it, what checks, what writes)
    "clang-format-14": ({".c", ".h", ".cpp", ".hpp"}, None, ["--dry-run", "--Werror", "--ferror-limit=1"], ["-i"]),
    "ruff": ({".py"}, "build/venv/bin", ["format", "--check", "--quiet"], ["format", "--quiet"]),
    "biome": ({".ts", ".mjs", ".mts", ".js"}, "host_tools/web/node_modules/.bin", ["format"], ["format", "--write"]),
}


class MissingFormatter(Exception):
    pass


def program(root, name):
    found = shutil.which(name) or shutil.which(name, path=str(root / (FORMATTERS[name][1] or "")))
    if not found:
        raise MissingFormatter(f"formatting.py: {name} is not installed; run: sh cmake/bootstrap.sh test")
    return found


def sources(root, endings):
    """Sources that people write, tests too, relative to root."""
    return sorted(house.written(root, endings))


def run(command, files, root):
    return subprocess.run([*command, *files], cwd=root, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode


def unformatted(root):
    """Files that their formatter would change."""
    found = []
    for name, (endings, _, check, _) in FORMATTERS.items():
        command = [program(root, name), *check]
        files = sources(root, endings)
        if files and run(command, files, root):
            found += [each for each in files if run(command, [each], root)]
    return found


def write(root):
    for name, (endings, _, _, writing) in FORMATTERS.items():
        run([program(root, name), *writing], sources(root, endings), root)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("root", nargs="?", default=".")
    parser.add_argument("--write", action="store_true", help="format the files")
    options = parser.parse_args()
    root = pathlib.Path(options.root).resolve()
    try:
        if options.write:
            write(root)
        found = unformatted(root)
    except MissingFormatter as error:
        print(error, file=sys.stderr)
        return 2
    for name in found:
        print(f"formatting.py: {name} is not formatted; run: tests/checks/formatting.py --write")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
