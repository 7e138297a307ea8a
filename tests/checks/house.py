#!/usr/bin/env python3
"""Counts how often the house says a thing, and fails where it is said more often than agreed.

usage: house.py [ROOT]

Counted are the files of the product that people write: not the tests, not what a program wrote (its first line says so), no pictures, no
lock files. A figure is the worst of its kind:

files_per_board     files outside the board's folder that name it
files_per_gripper   files outside host_tools/grasp/gripper that name the model
files_per_field     files that name the probe of a packet's field, or files that list a packet: that name half and more of those of its
                    fields whose names are no plain words (they have an underscore)
files_per_setting   files that list the settings: that name half and more of the fields by which an info packet tells them
rooms               folders of host_tools
circles             modules that need themselves, by way of others: of the Python package, and sources of firmware/app
page_codec_lines    lines of the page in the folders of line and recordings, but for files that only ask and show; and elsewhere those that take
                    numbers out of bytes
longest_file        lines of the longest source; firmware/fit and condition apart
readme_words        words of README.md, the first screen
product_lines       lines of sources (C, C++, Python, JavaScript, TypeScript) outside of tests/
test_lines          the same in tests/
grasp_lines         lines of the cell, of grasps and of their report, manuals too, CMakeLists.txt apart
private_words       words and phrases of this house that PRIVATE_WORDS replaces, in product files, CHANGELOG.md apart
longest_function_lines  lines of the longest function of firmware/ and boards/
board_lines         lines of the circuit boards' generator and of its checks
app_ifs             conditional blocks (#if) in the source of firmware/app that has most, the list of stages apart
"""

import argparse
import ast
import pathlib
import re
import subprocess
import sys
import tomllib

# figure: what it shall be, and what it may be until then. The second only ever falls.
LIMITS = {
    "files_per_board": (8, 8),
    "files_per_gripper": (5, 5),
    "files_per_field": (6, 6),
    "files_per_setting": (6, 6),
    "rooms": (9, 9),
    "circles": (0, 0),
    "page_codec_lines": (0, 0),
    "longest_file": (700, 700),
    "readme_words": (600, 600),
    "product_lines": (104191, 104191),
    "test_lines": (61698, 61698),
    "grasp_lines": (11000, 11000),
    "private_words": (9, 9),
    "longest_function_lines": (60, 60),
    "board_lines": (894, 894),
    "app_ifs": (1, 1),
}
APART = ("firmware/fit/", "firmware/condition/")  # from longest_file
SOURCES = {".c", ".h", ".cpp", ".hpp", ".S", ".py", ".mjs", ".ts", ".mts", ".sh", ".cmake", ".inc", ".css", ".toml"}
TEXTS = SOURCES | {".md", ".txt", ".json", ".html", ".in", ".1", ".bash", ".fish", ".cfg", ".msg", ""}
CIRCUIT_BOARD = re.compile(r"boards/drawing/(layout|route|board_file|fabricate|pcb|pcb_check)\.py|tests/checks/test_pcb\.py")
CODE = {".c", ".h", ".cpp", ".hpp", ".py", ".js", ".mjs", ".ts", ".mts"}
GRASP = ("host_tools/simulation/cell/", "host_tools/grasp/", "host_tools/report/grasp/")
STAGES = "firmware/app/stages.c"  # lists the stages of each scene
# Words that readers from elsewhere do not know in this sense, and what the field writes instead.
PRIVATE_WORDS = {
    r"tells?|told": "reports, indicates, states, configures",
    r"says?|said": "states, reports",
    r"felt|feels": "measured, sensed",
    r"so[ _](?:many|long|much)": "N frames, by its name",
    r"stands?|stood": "is",
    r"looks|looked": "samples, updates",
    r"acts": "is applied",
    r"what[ _]presses": "contact shape",
    r"plays": "scenario",
    r"(?:goes|comes|go|come)[ _]round": "cycles",
    r"owes?|owed": "await",
    r"bells|nearest_pairs|ears|keeper|thrown": "what is in it",
    r"anew|heed|whoever|likewise|nobody|of[ _]late": "again, use, who, also, no one, recently",
}
WRITTEN = re.compile(r"[Ww]ritten by |[Gg]enerated by ")
# A field that is told and computed by few, so that each file that names it is one more to change.
PROBE = "vy_mm_s"
SETTINGS = ("rate_mHz", "osr", "slip_window_ms", "slip_threshold_mm", "prior_sigma_mm", "prior_width_mm", "location_limit_mm")
CODEC = ("host_tools/web/src/line/", "host_tools/web/src/recording/")
PAGE = "host_tools/web/src/"
OUT_OF_BYTES = re.compile(r"^.*\b(?:DataView|[gs]et(?:Big)?(?:Uint|Int|Float)\d+)\b.*$", re.M)
NO_CODEC = {"line.ts", "serial_line.ts", "line_facts.ts", "output.ts", "recorder.ts", "replay_line.ts"}  # they ask, and show


def written(root, endings):
    """{path: text} of what people write, with these endings."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=root, capture_output=True, check=True).stdout.decode().split("\0")
    found = {}
    for name in filter(None, listed):
        path = root / name
        if path.suffix not in endings or path.name.endswith("-lock.json") or not path.is_file():
            continue
        text = path.read_text(encoding="utf-8", errors="replace")
        if not WRITTEN.search(text[: text.find("\n")]):
            found[name] = text
    return found


def product(root):
    """{path: text} of what people write, tests apart."""
    return {name: text for name, text in written(root, TEXTS).items() if not name.startswith("tests/")}


def private_words(files):
    """{path: how many private words} of those that have any. A name counts by its parts: told_frames, toldFrames."""
    pattern = re.compile("|".join(rf"(?<![A-Za-z])(?i:{each})(?![a-z])" for each in PRIVATE_WORDS))

    def is_whole(found):  # CMAKE_C_STANDARD has no word "STAND"
        return not (found[0].isupper() and found.string[found.end() : found.end() + 1].isupper())

    counts = {name: sum(map(is_whole, pattern.finditer(text))) for name, text in files.items() if name != "CHANGELOG.md"}
    return {name: count for name, count in counts.items() if count}


def function_lines(text):
    """[(name, lines)] of the functions of formatted C: each begins at the left edge and ends with a brace there."""
    lines = text.split("\n")
    found, begin = [], None
    for at, line in enumerate(lines):
        if begin is None and line.endswith(") {"):
            begin = at
            while begin > 0 and lines[begin - 1] and not re.match(r"[#/}]|.*[;*/}]$", lines[begin - 1]):
                begin -= 1
        elif begin is not None and line.startswith("}"):
            found.append((lines[begin].split("(")[0], at - begin + 1))
            begin = None
    return found


def naming(files, word, own=()):
    """The files that name a word, those apart that begin with own."""
    pattern = re.compile(rf"(?<![A-Za-z0-9_]){re.escape(word)}(?![A-Za-z0-9_])")
    return [name for name, text in files.items() if not name.startswith(tuple(own)) and pattern.search(text)]


def listing(files, words, own=()):
    """The files that name half of the words and more."""
    named = [name for word in words for name in naming(files, word, own)]
    return sorted(name for name in set(named) if 2 * named.count(name) >= len(words))


def worst(named):
    """(key, files) of {key: files} with the most."""
    return max(named.items(), key=lambda one: len(one[1]), default=("", []))


def reached(needs, one):
    """All that one needs, by whatever way, in {one: what it needs}."""
    seen, left = set(), list(needs[one])
    while left:
        each = left.pop()
        if each not in seen:
            seen.add(each)
            left += needs.get(each, ())
    return seen


def circle(needs):
    """What needs itself, by way of others."""
    return sorted(one for one in needs if one in reached(needs, one))


def python_needs(folder):
    needs = {}
    for path in sorted(folder.glob("*.py")):
        nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        imports = [node for node in nodes if isinstance(node, ast.ImportFrom) and node.level == 1]
        needs[path.stem] = {name for node in imports for name in ([node.module] if node.module else [each.name for each in node.names])}
    return needs


def call_needs(folder):
    """{source: sources whose functions it calls}, of a folder of C."""
    texts = {path.stem: path.read_text(encoding="utf-8") for path in sorted(folder.glob("*.c"))}
    made = {stem: set(re.findall(r"^(?!static\b)[a-z][\w *]*?\b(\w+)\([^;{]*\)\s*\{", text, re.M)) for stem, text in texts.items()}
    return {
        stem: {other for other in texts if other != stem and any(re.search(rf"\b{name}\(", text) for name in made[other])}
        for stem, text in texts.items()
    }


def measure(root):
    files = product(root)
    line = tomllib.loads((root / "firmware/wire/line.toml").read_text(encoding="utf-8"))
    own_line = ("firmware/wire/",)
    boards = [path.parent.name for path in sorted(root.glob("boards/*/main.c")) if path.parent.name != "native"]
    text = (root / "host_tools/grasp/gripper/models.cpp").read_text(encoding="utf-8")
    models = re.findall(r'(?:robotiq|feetech)_traits\("(\w+)"', text)
    if not boards or not models:
        raise SystemExit("house.py: found no board or no gripper; does it still look in the right place?")
    listed = [(kind, [field["name"] for field in packet.get("fields", ())]) for kind, packet in line["packet"].items()]
    listed = [(kind, [name for name in names if "_" in name]) for kind, names in listed]
    fields = {kind: listing(files, names, own_line) for kind, names in listed if len(names) >= 5}
    found = {
        "files_per_board": worst({board: naming(files, board, (f"boards/{board}/",)) for board in boards}),
        "files_per_gripper": worst({model: naming(files, model, ("host_tools/grasp/gripper/",)) for model in models}),
        "files_per_field": worst({PROBE: naming(files, PROBE, own_line), **fields}),
        "files_per_setting": ("all", listing(files, SETTINGS, own_line)),
        "rooms": ("all", sorted({name.split("/")[1] for name in files if name.startswith("host_tools/") and name.count("/") > 1})),
        "circles": ("all", circle(python_needs(root / "host_tools/python/fingertip")) + circle(call_needs(root / "firmware/app"))),
    }
    figures = {name: len(where) for name, (_, where) in found.items()}
    codec = [name for name in files if name.startswith(CODEC) and pathlib.PurePath(name).name not in NO_CODEC]
    figures["page_codec_lines"] = sum(files[name].count("\n") for name in codec)
    taking = {name: len(OUT_OF_BYTES.findall(text)) for name, text in files.items() if name.startswith(PAGE) and name not in codec}
    figures["page_codec_lines"] += sum(taking.values())
    codec += [name for name, lines in taking.items() if lines]
    sources = {name: text for name, text in files.items() if pathlib.PurePath(name).suffix in SOURCES}
    lengths = {name: text.count("\n") for name, text in sources.items() if not name.startswith(APART)}
    longest = max(lengths, key=lengths.get)
    figures["longest_file"] = lengths[longest]
    figures["readme_words"] = len(files.get("README.md", "").split())
    code = written(root, CODE)
    figures["product_lines"] = sum(text.count("\n") for name, text in code.items() if not name.startswith("tests/"))
    figures["test_lines"] = sum(text.count("\n") for name, text in code.items() if name.startswith("tests/"))
    figures["grasp_lines"] = sum(text.count("\n") for name, text in files.items() if name.startswith(GRASP) and "CMakeLists" not in name)
    figures["board_lines"] = sum(text.count("\n") for name, text in code.items() if CIRCUIT_BOARD.fullmatch(name))
    words = private_words(files)
    figures["private_words"] = sum(words.values())
    on_chip = {name: text for name, text in code.items() if name.startswith(("firmware/", "boards/")) and name.endswith((".c", ".h"))}
    functions = {name: max((lines for _, lines in function_lines(text)), default=0) for name, text in on_chip.items()}
    slowest = max(functions, key=functions.get)
    figures["longest_function_lines"] = functions[slowest]
    app = {name: text for name, text in code.items() if name.startswith("firmware/app/") and name.endswith(".c") and name != STAGES}
    ifs = {name: len(re.findall(r"^\s*#\s*if", text, re.M)) for name, text in app.items()}
    most = max(ifs, key=ifs.get)
    figures["app_ifs"] = ifs[most]
    found |= {
        "product_lines": ("all", []),
        "test_lines": ("all", []),
        "grasp_lines": ("all", []),
        "board_lines": ("all", []),
        "longest_function_lines": (slowest, [slowest]),
        "app_ifs": (most, [most]),
        "private_words": ("all", sorted(words, key=words.get, reverse=True)[:8]),
    }
    found |= {"page_codec_lines": ("all", codec), "longest_file": (longest, [longest]), "readme_words": ("all", ["README.md"])}
    return figures, {name: {"of": key, "files": where} for name, (key, where) in found.items()}


def judged(figures):
    """[(figure, found, what it shall be, what it may be)] of those that are above what they may be."""
    return [(name, figures[name], goal, may) for name, (goal, may) in LIMITS.items() if figures.get(name, 0) > may]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("root", nargs="?", default=".")
    options = parser.parse_args()
    root = pathlib.Path(options.root).resolve()
    figures, where = measure(root)
    for name, value in figures.items():
        goal, may = LIMITS.get(name, (None, None))
        said = "" if goal is None else f"   goal {goal}" + ("" if value <= goal else f", may be {may} until then")
        print(f"{name:20s} {value:7d}{said}")
    for name, value, goal, may in judged(figures):
        places = f"{where[name]['of']} in {', '.join(where[name]['files'])}"
        print(f"house.py: {name} is {value}, more than {may} (goal {goal}): {places}", file=sys.stderr)
    return 1 if judged(figures) else 0


if __name__ == "__main__":
    sys.exit(main())
