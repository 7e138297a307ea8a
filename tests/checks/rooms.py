#!/usr/bin/env python3
"""Draws in CONTRIBUTING.md which folder needs which, from the CMake lists.

usage: rooms.py [ROOT] [--check]

Writes the picture between its marks. With --check it writes nothing, and fails if the picture is out of date or a folder needs itself.
A folder needs another if its list names a library of the other, or one of its sources. The picture leaves out a need that follows from another need.
"""

import argparse
import pathlib
import re
import sys

from house import circle, reached

MARKS = "<!-- rooms: python3 tests/checks/rooms.py -->\n", "<!-- /rooms -->\n"
WHOLE = "host_tools/report boards host_tools/library/libfingertip host_tools/install".split()  # drawn as one, with the folders below them
LIBRARY = re.compile(r"\badd_library\(\s*(\w+)")
TARGET = re.compile(r"\badd_(?:library|executable)\(")
VARIABLE = re.compile(r"\bset\((\w+) (\$\{CMAKE_SOURCE_DIR\}/[\w/]+)\)")
SOURCE = re.compile(r"\$\{CMAKE_SOURCE_DIR\}/(host_tools/[\w/]+\.(?:c|cpp))(?![\w.])")
LAYER = re.compile(r"\bft_library\((\w+)[^)]*?(?:DEPENDS([\w\s]*))?\)")


def folder_of(path):
    name = path.parent.as_posix()
    return next((whole for whole in WHOLE if name == whole or name.startswith(whole + "/")), name)


def needs(lists):
    """{folder: folders that it needs} of {path of a CMake list: its text}."""
    texts = {path: re.sub(r"#[^\n]*", "", text) for path, text in lists.items()}
    homes = {target: folder_of(path) for path, text in texts.items() for target in LIBRARY.findall(text)}
    found = {}
    for path, text in texts.items():
        for name, others in LAYER.findall(text):
            homes["ft_" + name] = f"{path.parent.as_posix()}/{name}"
            found[f"{path.parent.as_posix()}/{name}"] = {f"{path.parent.as_posix()}/{other}" for other in others.split()}
    for path, text in texts.items():
        if TARGET.search(text):
            for variable, value in VARIABLE.findall(text):
                text = text.replace(f"${{{variable}}}", value)
            named = {homes[word] for word in re.findall(r"\w+", text) if word in homes}
            named |= {folder_of(pathlib.PurePosixPath(source)) for source in SOURCE.findall(text)}
            found.setdefault(folder_of(path), set()).update(named)
    return {folder: others - {folder} for folder, others in found.items()}


def picture(found):
    """Lines, each folder above those that it needs."""
    everything = {folder: reached(found, folder) for folder in found}
    short = {folder: folder.removeprefix("host_tools/") for folder in found}
    width = max(map(len, short.values())) + 2
    lines = []
    for folder in sorted(found, key=lambda each: (not each.startswith("host_tools"), -len(everything[each]), each)):
        direct = [other for other in found[folder] if not any(other in everything.get(third, ()) for third in found[folder])]
        lines.append("    " + (short[folder].ljust(width) + "  ".join(sorted(short.get(other, other) for other in direct))).rstrip())
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("root", nargs="?", default=".")
    parser.add_argument("--check", action="store_true")
    options = parser.parse_args()
    root = pathlib.Path(options.root).resolve()
    paths = [path for top in ("firmware", "boards", "host_tools") for path in sorted((root / top).rglob("CMakeLists.txt"))]
    paths = [path for path in paths if not {"node_modules", "example"} & set(path.parts)]
    found = needs({path.relative_to(root): path.read_text(encoding="utf-8") for path in paths})
    if circles := circle(found):
        sys.exit("rooms.py: these folders need themselves, by way of others: " + ", ".join(circles))
    page = root / "CONTRIBUTING.md"
    text = page.read_text(encoding="utf-8")
    if any(text.count(mark) != 1 for mark in MARKS):
        sys.exit(f"rooms.py: CONTRIBUTING.md needs each of the marks {MARKS} once")
    before, rest = text.split(MARKS[0])
    drawn = before + MARKS[0] + "\n" + picture(found) + "\n" + MARKS[1] + rest.split(MARKS[1])[1]
    if options.check and drawn != text:
        sys.exit("rooms.py: the picture in CONTRIBUTING.md is not that of the CMake lists; run python3 tests/checks/rooms.py")
    page.write_text(drawn, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
