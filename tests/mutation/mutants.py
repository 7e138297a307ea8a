"""The mutants of a C source: each one small change that its tests should notice, found on clang's syntax tree."""

import bisect
import dataclasses
import json
import pathlib
import re
import subprocess

OPERATORS = {
    "<": ("<=", ">="),
    "<=": ("<", ">"),
    ">": (">=", "<="),
    ">=": (">", "<"),
    "==": ("!=",),
    "!=": ("==",),
    "+": ("-",),
    "-": ("+",),
    "*": ("/",),
    "/": ("*",),
    "%": ("/",),
    "&": ("|",),
    "|": ("&",),
    "^": ("|",),
    "<<": (">>",),
    ">>": ("<<",),
    "&&": ("||",),
    "||": ("&&",),
    "+=": ("-=",),
    "-=": ("+=",),
    "*=": ("/=",),
    "/=": ("*=",),
    "&=": ("|=",),
    "|=": ("&=",),
    "^=": ("|=",),
    "<<=": (">>=",),
    ">>=": ("<<=",),
    "++": ("--",),
    "--": ("++",),
}
DROPPED = {"!", "-", "~"}
DELETED = {"CallExpr", "CompoundAssignOperator", "UnaryOperator", "BreakStmt", "ContinueStmt"}
CONDITIONS = {"IfStmt": ("true", "false"), "WhileStmt": ("false",), "ForStmt": ("false",), "ConditionalOperator": ("true", "false")}
NUMBER = re.compile(r"(0[xX][0-9a-fA-F]+|(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)([uUlLfF]*)")
# Up to here a number is one off, beyond it twice as large and half.
SMALL = 16


@dataclasses.dataclass(frozen=True)
class Mutant:
    path: str  # below the root
    function: str  # or "" outside of all
    line: int
    begin: int  # offsets in the file
    end: int
    text: str  # in their place
    before: str  # the line, without its indentation
    after: str
    in_macro: bool  # spelled in a definition, so that no line tells who runs it

    @property
    def key(self):
        """What it is, wherever in the file it stands."""
        return f"{self.path} {self.function}\n- {self.before}\n+ {self.after}"


class NoTree(Exception):
    """clang does not take the source."""


def parse(source, flags):
    done = subprocess.run(["clang-14", "-w", "-fsyntax-only", "-Xclang", "-ast-dump=json", *flags, source], capture_output=True)
    if done.returncode:
        raise NoTree(f"{source}: {done.stderr.decode('utf-8', 'replace').strip()}")
    return json.loads(done.stdout)


def name_files(node, last):
    """clang names a file only where it differs from the location before; names it everywhere. Returns the last."""
    if isinstance(node, list):
        for child in node:
            last = name_files(child, last)
    elif "offset" in node:
        last = node.setdefault("file", last)
    else:
        for name, child in node.items():
            if name not in ("includedFrom", "referencedDecl") and isinstance(child, (dict, list)):
                last = name_files(child, last)
    return last


class Finder:
    def __init__(self, path, text, tree, file):
        """path: as it is told; file: as the tree has it, resolved."""
        self.path, self.text, self.file = path, text, file
        self.same = {}
        self.starts = [0] + [m.end() for m in re.finditer("\n", text)]
        self.lines = text.split("\n")
        self.found = {}
        self.function = ""
        name_files(tree, "")
        self.visit(tree, None)

    def is_ours(self, name):
        if name not in self.same:
            self.same[name] = pathlib.Path(name).resolve() == self.file if name else False
        return self.same[name]

    def span(self, location):
        """(begin, end) of a token of this file; None if it is of another."""
        for place in (location.get("spellingLoc"), location.get("expansionLoc"), location):
            if place and "offset" in place and self.is_ours(place["file"]):
                return place["offset"], place["offset"] + place["tokLen"]
        return None

    def extent(self, node):
        """(begin, end) of what the node spans; None if a macro or another file has a part in it."""
        begin, end = (node.get("range", {}).get(name, {}) for name in ("begin", "end"))
        outer = [self.span({"expansionLoc": place["expansionLoc"]} if "expansionLoc" in place else place) for place in (begin, end)]
        if None in outer or outer[0][0] > outer[1][0]:
            return None
        if "expansionLoc" in end and self.text[outer[1][1] : outer[1][1] + 1] == "(":
            return None  # a macro with arguments: where they end is not told
        return outer[0][0], outer[1][1]

    def add(self, begin, end, text):
        index = bisect.bisect_right(self.starts, begin) - 1
        line, column = self.lines[index], begin - self.starts[index]
        last = bisect.bisect_right(self.starts, end) - 1
        rest = self.text[end : self.starts[last] + len(self.lines[last])]
        mutant = Mutant(
            self.path,
            self.function,
            index + 1,
            begin,
            end,
            text,
            line.strip(),
            (line[:column] + text + rest).strip(),
            self.is_in_macro(index),
        )
        self.found.setdefault((begin, end, text), mutant)

    def is_in_macro(self, index):
        while index > 0 and self.lines[index - 1].endswith("\\"):
            index -= 1
        return self.lines[index].lstrip().startswith("#")

    def visit(self, node, parent):
        kind = node.get("kind")
        if kind is None or kind == "StaticAssertDecl":
            return
        inner = node.get("inner", [])
        outside = self.function
        if kind == "FunctionDecl":
            self.function = node.get("name", "")
        if kind in ("BinaryOperator", "CompoundAssignOperator") and len(inner) == 2:
            self.binary(node, *inner)
        elif kind == "UnaryOperator":
            self.unary(node)
        elif kind in ("IntegerLiteral", "FloatingLiteral"):
            self.literal(node)
        if kind in CONDITIONS:
            self.condition(node, inner)
        if parent in ("CompoundStmt", "IfStmt", "CaseStmt", "DefaultStmt", "ForStmt", "WhileStmt"):
            self.statement(node)
        for child in inner:
            self.visit(child, kind)
        self.function = outside

    def binary(self, node, left, right):
        opcode = node["opcode"]
        between = self.extent(left), self.extent(right)
        if None in between:
            between = tuple(self.span(side["range"][end]) for side, end in ((left, "end"), (right, "begin")) if "range" in side)
        if len(between) != 2 or None in between:
            return
        begin, end = between[0][1], between[1][0]
        gap = re.sub(r"/\*.*?\*/|//[^\n]*", lambda m: " " * len(m.group()), self.text[begin:end], flags=re.S)
        if gap.strip(" \n\\") != opcode:
            return
        at = begin + gap.index(opcode)
        for text in OPERATORS.get(opcode, ()):
            self.add(at, at + len(opcode), text)

    def unary(self, node):
        opcode = node["opcode"]
        place = self.span(node["range"]["end" if node.get("isPostfix") else "begin"])
        if place is None or self.text[place[0] : place[1]] != opcode:
            return
        if opcode in DROPPED:
            self.add(*place, "")
        elif opcode in ("++", "--"):
            self.add(*place, *OPERATORS[opcode])

    def literal(self, node):
        place = self.span(node["range"]["begin"])
        if place is None:
            return
        text = self.text[slice(*place)]
        if text in ("true", "false"):
            self.add(*place, "false" if text == "true" else "true")
            return
        number = NUMBER.fullmatch(text)
        if not number:
            return
        digits, suffix = number.groups()
        if node["kind"] == "FloatingLiteral":
            value = float(digits)
            others = ["1.0"] if value == 0 else [f"({text} * 2.0{suffix})", f"({text} / 2.0{suffix})"]
        else:
            value = int(digits, 0) if not re.fullmatch(r"0\d+", digits) else int(digits, 8)
            if value <= SMALL:
                others = [f"{value + 1}{suffix}"] + ([f"{value - 1}{suffix}"] if value else [])
            else:
                others = [f"({text} / 2)"] + ([f"{2 * value}{suffix}"] if value < 2**30 else [])
        for other in others:
            self.add(*place, other)

    def condition(self, node, inner):
        test = inner[2] if node["kind"] == "ForStmt" and len(inner) == 5 else inner[0] if inner else {}
        place = self.extent(test) if test.get("kind") else None
        if place is None:
            return
        for forced in CONDITIONS[node["kind"]]:
            text = self.text[slice(*place)]
            self.add(*place, f"(1 || ({text}))" if forced == "true" else f"(0 && ({text}))")

    def statement(self, node):
        if node["kind"] not in DELETED and not (node["kind"] == "BinaryOperator" and node["opcode"] == "="):
            return
        place = self.extent(node)
        if place and re.match(r"\s*;", self.text[place[1] :]):
            self.add(*place, "(void)0")


def find(root, path, source, flags):
    """The mutants of root/path, as the translation unit `source` has it, in their order."""
    text = (root / path).read_text(encoding="utf-8")
    if not text.isascii():
        raise NoTree(f"{path}: offsets are of ASCII only")
    found = Finder(path, text, parse(source, flags), (root / path).resolve()).found.values()
    return sorted(found, key=lambda mutant: (mutant.begin, mutant.end, mutant.text))
