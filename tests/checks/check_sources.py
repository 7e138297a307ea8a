#!/usr/bin/env python3
"""Checks the rules of the source tree that no compiler checks.

usage: check_sources.py [ROOT]

Prints one line for each violation and exits with 1 if there is any. Each rule has lines that it finds, and fails if it does not.
"""

import pathlib
import re
import sys

SOURCE = {".c", ".h", ".cpp", ".hpp", ".S"}


def strip_comments(text):
    """Blanks comments and string literals, keeping line numbers; include lines stay."""

    def blank(match):
        return re.sub(r"[^\n]", " ", match.group(0))

    lines = []
    for line in re.sub(r"/\*.*?\*/|//[^\n]*", blank, text, flags=re.S).split("\n"):
        if not line.lstrip().startswith("#include"):
            line = re.sub(r'"(?:\\.|[^"\\])*"', '""', line)
        lines.append(line)
    return lines


# Rooms of which the product is made, and which so know no simulation.
PRODUCT = {"library", "tool", "grasp"}
# Rooms of host_tools that measure or make data, and have no part in a test's world.
MEASURING = {"report"}
BOARDS = "|".join(sorted(path.parent.name for path in pathlib.Path(__file__).resolve().parents[2].glob("boards/*/CMakeLists.txt")))


def rules_for(path):
    """(pattern, what is wrong, a line of each kind) that apply to this path, relative to the root."""
    top = path.parts[0]
    rules = [(r'#include\s+"\.\./', 'includes through "../": name the folder in CMake and in the include', '#include "../b/b.h"')]
    if top == "firmware":
        rules += [
            (r"\bvolatile\b", "volatile belongs under boards/", "static volatile int x;"),
            (r"\bdouble\b", "double has no place in the firmware", "double x;"),
            (r"\b(malloc|calloc|realloc|free)\s*\(", "the firmware does not allocate", "p = malloc (4);"),
            (r"#include\s+<(stdio|stdlib)\.h>", "the firmware uses no stdio and no stdlib", "#include <stdio.h>"),
            (r"\b0x(400|501|d00)[0-9A-Fa-f]{5}\b", "register addresses belong under boards/", "(int *)0x40044000"),
            (
                rf'#include\s+"({BOARDS}|reference|libfingertip)/',
                "the firmware does not reach into boards or host tools",
                '#include "rp2040/i2c.h"',
            ),
        ]
    if top == "host_tools" and path.parts[1] not in MEASURING and path.name != "clock.cpp":
        clocks = r"\b(steady|system|high_resolution)_clock::now\s*\(|this_thread::sleep|\bu?sleep\s*\(|\bpoll\([^)]*, -?[1-9]\d*\)"
        message = "time and waits of the host programs come from libfingertip/clock.hpp, so that tests can simulate them"
        rules.append((clocks, message, "steady_clock::now()", "std::this_thread::sleep_for(PAUSE)", "poll(&waiting, 1, 100)"))
    if top == "host_tools" and path.parts[1] in PRODUCT:
        message = "the product does not reach into the simulation, nor into what measures it"
        rules.append((r'#include\s+"(simulation|report)/', message, '#include "simulation/twin/contact.hpp"'))
    for pattern, message, *lines in rules:
        assert all(re.search(pattern, line) for line in lines), message
    return [(re.compile(pattern), message) for pattern, message, *_ in rules]


# What a test waits with, by the system's clock. A file whose subject is real time says so in a comment, "real time: ", and why.
WAITS = (
    (
        "sleep",
        re.compile(
            r"\b(?:usleep|nanosleep|setTimeout|waitForTimeout)\s*\(|\b(?:time|asyncio)\.sleep\s*\(|this_thread::sleep"
            r"|(?<!def )(?<![\w.])sleep\s*\(|(?<![\w.'-])u?sleep [0-9.]"
        ),
    ),
    ("retry", re.compile(r"once_in_three|\b(?:flaky|retries|retry_until|rerun_failures|ctest --repeat)\b")),
)
SLEEPS = (
    (
        "    time.sleep(1)",
        "    await asyncio.sleep(1)",
        '    self.sh("sleep 4")',
        "std::this_thread::sleep_for(milliseconds(1));",
        "  usleep(100);",
    )
    + ("await new Promise((r) => setTimeout(r, 25));", "while :; do sleep 0.1; done"),
    ("world.sleep(1)", "def sleep(self):", "asleep(3)"),  # none
)
assert [sum(map(bool, map(WAITS[0][1].search, lines))) for lines in SLEEPS] == [len(SLEEPS[0]), 0]
TESTS = SOURCE | {".py", ".mjs", ".js", ".ts", ".sh"}
REAL_TIME = re.compile(r"^\s*(?:#|//|\*)?\s*real time: ")


def waits(root):
    """(path, line number, "sleep" or "retry") of each such call in the tests."""
    found = []
    for path in sorted((root / "tests").rglob("*")):
        if path.suffix not in TESTS or "node_modules" in path.parts or path.parent.name == "checks":
            continue
        lines = path.read_text(encoding="utf-8").split("\n")
        if any(REAL_TIME.search(line) for line in lines):
            continue
        found += [
            (path.relative_to(root), number, what)
            for number, line in enumerate(lines, 1)
            for what, pattern in WAITS
            if pattern.search(re.sub(r"\s*(?:#|//).*", "", line))
        ]
    return found


WAIT_MESSAGES = {
    "sleep": "a test that sleeps: let it live on simulated time (tests/README.md), or say in a comment why its subject is real time",
    "retry": "a test that tries again until it passes",
}


def violations(root):
    for path, number, what in waits(root):
        yield f"{path}:{number}: {WAIT_MESSAGES[what]}"
    for folder in ("firmware", "boards", "host_tools", "tests"):
        for path in sorted((root / folder).rglob("*")):
            if path.suffix not in SOURCE or "node_modules" in path.parts:
                continue
            relative = path.relative_to(root)
            lines = strip_comments(path.read_text(encoding="utf-8"))
            for pattern, message in rules_for(relative):
                for number, line in enumerate(lines, 1):
                    if pattern.search(line):
                        yield f"{relative}:{number}: {message}"
            if relative.name == "main.c" and relative.parts[0] == "boards" and len(lines) >= 100:
                yield f"{relative}: main.c only wires and stays under 100 lines; it has {len(lines)}"


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".").resolve()
    if not (root / "firmware").is_dir():
        sys.exit(f"check_sources: {root} has no firmware folder; give the project's root")
    found = list(violations(root))
    print("\n".join(found) if found else "the source tree keeps its rules")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
