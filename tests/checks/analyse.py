#!/usr/bin/env python3
"""Looks for mistakes in firmware/ and boards/ without running them.

usage: analyse.py [--build DIR] [--all] [--json FILE] [FILE...]

clang-tidy (.clang-tidy says what for), cppcheck, and the mandatory rules of MISRA C:2012. --all: besides, gcc's -fanalyzer, clang's
analyser of paths and cppcheck's reading of those rules, which take two minutes; a nightly test does. One line for each finding; exit 1
if there is any. What is no mistake is silenced where it stands, with its reason.

The mandatory rules, and what holds each:
    9.1   read before set          gcc -Wmaybe-uninitialized; cppcheck uninitvar; clang-analyzer core.uninitialized
    12.5  sizeof an array argument gcc -Wsizeof-array-argument
    13.6  sizeof with side effects clang -Wunevaluated-expression
    17.3  undeclared function      gcc -Wimplicit-function-declaration
    17.4  return without a value   gcc -Wreturn-type
    17.6  static in [ ]            no such declaration: here
    19.1  overlapping copies       gcc -Wrestrict; cppcheck overlappingWrite...
    21.13 <ctype.h>                not included: here, by the list of headers
    21.17 string functions' bounds none of them is used: here; 21.18, memory functions' lengths: gcc -Wstringop-..., -fanalyzer
    21.19, 21.20  getenv, strerror, localtime and their like: not called: here
    22.2, 22.4 to 22.6  free() and streams: no allocation, no FILE: here; boards/native allocates: gcc -fanalyzer
What gcc holds are errors of every build (cmake/warnings.cmake).
"""

import argparse
import concurrent.futures
import json
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile

from check_sources import strip_comments

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILDS = ("host", *sorted(path.parent.name for path in ROOT.glob("boards/*/board.json")))
TOOLS = {"clang-tidy-14": "clang-tidy-14", "cppcheck": "cppcheck", "gcc": "gcc", "arm-none-eabi-gcc": "gcc-arm-none-eabi"}
ON_CHIP = ["--target=thumbv6m-none-eabi", "-isystem", "/usr/lib/arm-none-eabi/include"]
SLOW = "-clang-analyzer-*"
# gcc and clang define what C leaves to them: a right shift of a negative number keeps its sign.
CPPCHECK_OFF = ("shiftTooManyBitsSigned", "shiftNegativeLHS", "missingIncludeSystem", "unusedStructMember")
MANDATORY = "9.1 12.5 13.6 17.3 17.4 17.6 19.1 21.13 21.17 21.18 21.19 21.20 22.2 22.4 22.5 22.6".split()
HEADERS = {"math", "stdatomic", "stdbool", "stddef", "stdint", "string"}
NATIVE_HEADERS = HEADERS | {"setjmp", "stdio", "stdlib"}
FORBIDDEN = (
    ("17.6", "an array parameter with static", re.compile(r"\[\s*(const\s+)?static\b")),
    ("21.17", "a function of strings", re.compile(r"\bstr(cat|chr|cmp|coll|cpy|cspn|len|ncat|ncmp|ncpy|pbrk|rchr|spn|str|tok|xfrm)\s*\(")),
    ("21.19", "a pointer to what the library keeps", re.compile(r"\b(localeconv|getenv|setlocale|strerror)\s*\(")),
    ("21.20", "a pointer to what the library keeps", re.compile(r"\b(asctime|ctime|gmtime|localtime)\s*\(")),
    ("22.2", "allocation", re.compile(r"\b(malloc|calloc|realloc|aligned_alloc|free)\s*\(")),
    ("22.5", "a stream", re.compile(r"\bFILE\b|\bf(re)?open\s*\(|\btmpfile\s*\(|\b(stdin|stdout)\b")),
)


class Stop(Exception):
    """What the user can mend, in one line."""


def run(command, **how):
    return subprocess.run([str(word) for word in command], capture_output=True, text=True, errors="replace", **how)


def units(build):
    """(source, entry, is for the chip) of each C file of firmware/ and boards/, by the first build that has it."""
    found = {}
    for name in BUILDS:
        path = build / name / "compile_commands.json"
        if not path.exists():
            raise Stop(f"{path} is not there; build first: cmake --preset host && cmake --build build/host")
        for entry in json.loads(path.read_text(encoding="utf-8")):
            source, words = pathlib.Path(entry["file"]), shlex.split(entry["command"])
            is_test = words[words.index("-o") + 1].startswith("tests/") if "-o" in words else True
            is_ours = source.is_relative_to(ROOT) and source.relative_to(ROOT).parts[0] in ("firmware", "boards")
            if source.suffix == ".c" and is_ours and not is_test:
                found.setdefault(source, (source, {**entry, "words": words}, name != "host"))
    return list(found.values())


def database(found, folder):
    """For clang and cppcheck, which do not know all of gcc's options."""
    entries = []
    for source, entry, on_chip in found:
        kept = [word for word in entry["words"] if word.startswith(("-I", "-D", "-std="))]
        flags = ["clang", "-O1", "-Wall", "-Wextra", "-Wno-unknown-attributes", *(ON_CHIP if on_chip else []), *kept]
        entries.append({"directory": entry["directory"], "file": str(source), "arguments": [*flags, "-c", str(source)]})
    (folder / "compile_commands.json").write_text(json.dumps(entries), encoding="utf-8")


def short(line):
    """Paths of this project, headers by where they are and not by the link that leads there."""
    line = line.replace(f"{ROOT}/", "")
    return re.sub(r"build/\w+/include/(\w+)/\1/", r"firmware/\1/", line)


def tidy(source, folder, all_checks):
    call = ["clang-tidy-14", "-p", folder, "--quiet", *([] if all_checks else [f"--checks={SLOW}"]), source]
    done = run(call)
    lines = [line for line in done.stdout.splitlines() if re.search(r": (warning|error): ", line)]
    if done.returncode and not lines:
        lines = [f"{source}: clang-tidy: {done.stderr.strip().splitlines()[-1]}"]
    return lines


def analyse_paths(source, entry):
    words = [word for word in entry["words"] if word not in ("-g", "-O2", "-O3", "-Os", "-Werror", "-fstack-usage")]
    words[words.index("-o") + 1] = os.devnull
    done = run([*words, "-O1", "-fanalyzer", "-fdiagnostics-plain-output"], cwd=entry["directory"])
    return [line for line in done.stderr.splitlines() if re.search(r": (warning|error): ", line)]


def cppcheck(folder, addon=False):
    kept = folder / "misra"  # else the addon leaves files beside the sources
    kept.mkdir(exist_ok=True)
    looks = ["--enable=warning,performance,portability", "--inconclusive", "--inline-suppr", "--std=c11", "--quiet"]
    looks += ["--template={file}:{line}: {severity}: {message} [{id}]", *(f"--suppress={name}" for name in CPPCHECK_OFF)]
    looks += ["--addon=misra", f"--cppcheck-build-dir={kept}"] if addon else []
    call = ["cppcheck", f"--project={folder}/compile_commands.json", f"-j{os.cpu_count() or 1}", *looks]
    lines = [line for line in run(call).stderr.splitlines() if re.search(r" \[[\w.-]+\]$", line)]
    if not addon:
        return lines
    names = {f"[misra-c2012-{rule}]" for rule in MANDATORY}
    return [line for line in lines if line.rsplit(" ", 1)[-1] in names]


def mandatory(path, text):
    """What our own eyes hold of the mandatory rules."""
    lines, is_native = strip_comments(text), path.parts[:2] == ("boards", "native")
    for number, line in enumerate(lines, 1):
        header = re.match(r"\s*#\s*include\s*<(\w+)\.h>", line)
        if header and header.group(1) not in (NATIVE_HEADERS if is_native else HEADERS):
            yield f"{path}:{number}: MISRA C:2012 21: <{header.group(1)}.h> is none of the headers in use; see analyse.py"
        for rule, what, pattern in FORBIDDEN:
            if pattern.search(line) and not (is_native and rule == "22.2"):
                yield f"{path}:{number}: MISRA C:2012 {rule}: {what}"


def mandatory_in(root):
    for folder in ("firmware", "boards"):
        for path in sorted((root / folder).rglob("*.[ch]")):
            yield from mandatory(path.relative_to(root), path.read_text(encoding="utf-8"))


def findings(build, files, everything):
    for tool, package in TOOLS.items():
        if shutil.which(tool) is None:
            raise Stop(f"{tool} is missing; install Debian's {package}")
    found = units(build)
    if files:
        wanted = {pathlib.Path(file).resolve() for file in files}
        found = [unit for unit in found if unit[0] in wanted]
    told = list(mandatory_in(ROOT))
    with (
        tempfile.TemporaryDirectory(prefix="fingertip-analyse-") as folder,
        concurrent.futures.ThreadPoolExecutor(os.cpu_count() or 1) as pool,
    ):
        folder = pathlib.Path(folder)
        database(found, folder)
        jobs = [pool.submit(tidy, source, folder, everything) for source, _, _ in found]
        jobs += [pool.submit(cppcheck, folder)]
        if everything:
            jobs += [pool.submit(analyse_paths, *unit[:2]) for unit in found] + [pool.submit(cppcheck, folder, True)]
        for job in jobs:
            told += job.result()
    return sorted(set(map(short, told))), len(found)


def main(argv):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build", metavar="DIR", help="with host and the boards in it")
    parser.add_argument("--all", action="store_true", help="the slow ones too")
    parser.add_argument("--json", type=pathlib.Path, metavar="FILE", help="how many were found")
    parser.add_argument("files", nargs="*", metavar="FILE", help="default: all")
    options = parser.parse_args(argv)
    told, count = findings(options.build.resolve(), options.files, options.all)
    print("\n".join(told) if told else f"{count} files, no finding")
    if options.json:
        options.json.write_text(json.dumps({"analyzer_findings": len(told), "analyzed_files": count}) + "\n", encoding="utf-8")
    return 1 if told else 0


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except Stop as stop:
        sys.exit(f"analyse: {stop}")
