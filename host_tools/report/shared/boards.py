"""The boards, by their descriptors (boards/README.md). As a program: prints their names, the fastest first."""

import json
import pathlib

ROOT = pathlib.Path(__file__).resolve().parents[3]
DESCRIPTORS = {path.parent.name: json.loads(path.read_text(encoding="utf-8")) for path in ROOT.glob("boards/*/board.json")}
BOARDS = tuple(sorted(DESCRIPTORS, key=lambda board: DESCRIPTORS[board]["overhead_us"]))  # the fastest first
TO_BUILD = "build it: cmake --preset host && cmake --build --preset host"


def of_bus(bus):
    """The fastest board with such a bus."""
    return next(board for board in BOARDS if DESCRIPTORS[board]["bus"] == bus)


PARALLEL, MULTIPLEXED = of_bus("parallel"), of_bus("multiplexed")


def short(board):
    """What figures and columns call it."""
    return board.removeprefix("pico_")


def image_of(builds, board, suffix="bin"):
    """In the folder of the boards' builds."""
    return pathlib.Path(builds) / board / f"fingertip-{board}.{suffix}"


def fit_cycles_of(builds):
    """The image that counts the cycles of the fit; the fastest builds it."""
    return pathlib.Path(builds) / BOARDS[0] / "fit_cycles.bin"


if __name__ == "__main__":
    print("\n".join(BOARDS))
