"""Mutants that change nothing that anybody could see: equivalent.txt, one after another, as

firmware/scan/scan.c take_codes
- the line
+ the line of the mutant
= why that makes no difference
"""


class Unclear(Exception):
    """The file does not keep its form."""


def read(path):
    """{key of a mutant: reason}"""
    known, lines = {}, []
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines() + [""], 1):
        if line.startswith("#") and not lines:
            continue
        if line:
            lines.append(line)
            continue
        if lines:
            if [text[:2] for text in lines[1:3]] != ["- ", "+ "] or len(lines) < 4 or not lines[3].startswith("= "):
                raise Unclear(f"{path.name}:{number - len(lines)}: a file and its function, then lines with -, + and =")
            key = "\n".join(lines[:3])
            if key in known:
                raise Unclear(f"{path.name}:{number - len(lines)}: is there twice")
            known[key] = " ".join(line.removeprefix("= ") for line in lines[3:])
        lines = []
    return known


def stale(known, found):
    """Keys of files in `found`, {path: mutants}, that are of no mutant any more."""
    keys = {mutant.key for own in found.values() for mutant in own}
    return [key for key in known if key.split(" ", 1)[0] in found and key not in keys]


def gone(known, root):
    """Keys whose line is not in its file any more; quick, and nearly as good."""
    texts = {}
    for key in known:
        path = key.split(" ", 1)[0]
        if path not in texts:
            file = root / path
            texts[path] = {line.strip() for line in file.read_text(encoding="utf-8").splitlines()} if file.is_file() else set()
    return [key for key in known if key.split("\n")[1].removeprefix("- ") not in texts[key.split(" ", 1)[0]]]
