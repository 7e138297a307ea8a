"""What the commands share: their errors, their progress, their options' ranges, and where they may write."""

import argparse
import contextlib
import os
import sys
from collections.abc import Callable, Iterator
from typing import Any, NoReturn

from . import host_time
from .errors import FingertipError, InputError

Path = str | os.PathLike[str]
WORTH_SHOWING_s, LINES_s = 2.0, 10.0  # of a progress


class WrongUsage(InputError):
    status = 2


class Parser(argparse.ArgumentParser):
    """Keeps the lines of a description, and says in one what is wrong."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**{"formatter_class": argparse.RawDescriptionHelpFormatter, **options})

    def error(self, message: str) -> NoReturn:
        raise WrongUsage(f"{printable(message).removeprefix('argument ')}; see {self.prog} --help")


def run_tool(name: str, main: Callable[[list[str]], int]) -> int:
    """Exit status of a command line tool: 0, or 1 after one line on stderr."""
    try:
        status = main(sys.argv[1:])
        sys.stdout.flush()
        return status
    except FingertipError as error:
        text, status = str(error).replace("salvage=True", "--salvage"), getattr(error, "status", 1)
    except KeyboardInterrupt:
        text, status = "interrupted", 1
    except OSError as error:  # other files' are InputErrors
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # what waits to be written would fail once more
        if isinstance(error, BrokenPipeError):  # a reader that has left has what it wanted
            return 0
        text, status = f"{error.filename or 'standard output'}: {error.strerror}", 1
    print(f"{name}: {printable(text)}", file=sys.stderr)
    return status


def check_range(name: str, value: float, low: float, high: float) -> None:
    """Of an option of a command."""
    if not low <= value <= high:  # false for NaN
        raise InputError(f"--{name} {value:.10g} is out of range; give {low:.10g} to {high:.10g}")


@contextlib.contextmanager
def progress(what: str) -> Iterator[Callable[[float], None]]:
    """Shows a share and, above 1 %, the time that is left, from the third second on: in place on a terminal, else a line every ten seconds."""
    begun_s = shown_s = host_time.now_s()
    in_place = sys.stderr.isatty()

    def show(share: float) -> None:
        nonlocal shown_s
        now_s = host_time.now_s()
        if now_s - begun_s < WORTH_SHOWING_s or now_s - shown_s < (0 if in_place else LINES_s):
            return
        shown_s = now_s
        text = f"{what} {100 * share:.0f} %" + (f", {(now_s - begun_s) * (1 / share - 1):.0f} s left" if share > 0.01 else "")
        print(f"\r\x1b[K{text}" if in_place else text, end="" if in_place else "\n", file=sys.stderr, flush=True)

    try:
        yield show
    finally:
        print("\r\x1b[K" if in_place and shown_s > begun_s else "", end="", file=sys.stderr, flush=True)


def reporter(name: str) -> Callable[[str], None]:
    """Of a command: a line on stderr."""
    return lambda text: print(f"{name}: {printable(text)}", file=sys.stderr, flush=True)


def printable(text: str) -> str:
    """In one line and harmless to a terminal: control characters and stray bytes as \\x1b."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text)


def check_output(path: Path, *others: Path | None, replace: bool = True) -> None:
    """Fails before any work where write_text or write_bytes would fail, or would replace an input or another output, the others."""
    if os.path.isdir(path) or not os.path.basename(path):
        raise InputError(f"{path or repr(path)}: is a folder; give the name of a file in it")
    for other in others:
        exist = other is not None and os.path.exists(other) and os.path.exists(path)
        if other is not None and (os.path.samefile(path, other) if exist else os.path.realpath(path) == os.path.realpath(other)):
            raise InputError(f"{path}: is named twice, to be read or written; give another name")
    if os.path.exists(path) and not replace:
        raise InputError(f"{path}: exists; give --overwrite or another name")
    folder = os.path.dirname(path) or "."
    if not os.path.isdir(folder):
        raise InputError(f"{path}: there is no folder {folder}; choose another place")
    if not os.access(path if os.path.exists(path) else folder, os.W_OK):
        raise InputError(f"{path}: it may not be written; choose another place")
