"""What arrays of other sizes take: for each a pad and boards like the own ones, in a copy of the tree, whose images run in the emulator."""

import json
import pathlib
import shutil

import numpy as np
from boards import BOARDS, DESCRIPTORS, PARALLEL, short
from emulated import pressed
from scenes import CONTACT_FROM_s, ROOT, SCENES, build, cycles, sizes

SCENE, OSR, PITCH_mm, SIGMA_mm, PEAK_Pa = "grasp", 256, 9.0, 5.7, 25000.0  # as the boards' own images
RECTANGLES = ("2x2", "2x4", "3x3", "3x5", "4x4", "4x5", "5x6", "6x6")
FREE = ("4x8",)  # more along one side than the fixed-point kernels take
LINES = 15  # a parallel board has a data line for each sensor
SHOWN = ("flash_bytes", "ram_bytes", "stack_bytes", "cycles_of_frame")


def size_of(name):
    return tuple(map(int, name.split("x")))


def add_board(tree, like, pad):
    """The board's name: a copy of another one in this tree, with the pad's sensors, a strip a column."""
    name, (columns, rows) = f"{short(like)}_{pad}", size_of(pad)
    board = tree / "boards" / name
    shutil.copytree(tree / "boards" / like, board)
    for path in (*board.glob("*.[ch]"), board / "CMakeLists.txt"):
        path.write_text(path.read_text(encoding="utf-8").replace(like, name), encoding="utf-8")
    wiring = DESCRIPTORS[like]["wiring"] | {"sensor_count": columns * rows, "sensors_of_strip": rows}
    (board / "board.json").write_text(json.dumps(DESCRIPTORS[like] | {"pad": pad, "wiring": wiring}), encoding="utf-8")
    described = {"name": pad, "sensor": "ms5840", "pitch_mm": PITCH_mm, "columns": columns, "rows": rows}
    (tree / f"boards/pads/{pad}.json").write_text(json.dumps(described), encoding="utf-8")
    return name


def copied_tree(folder):
    tree, emulator = pathlib.Path(folder) / "tree", "host_tools/simulation/emulator/node_modules"
    shutil.copytree(ROOT, tree, symlinks=True, ignore=shutil.ignore_patterns("build", "node_modules", ".git"))
    (tree / emulator).symlink_to((ROOT / emulator).resolve())
    return tree


def contact_on(pad, path):
    """Writes a scenario: a contact that moves across the pad."""
    (columns, rows), begin_s = size_of(pad), CONTACT_FROM_s - 0.3
    column, row = np.divmod(np.arange(columns * rows), rows)

    def contact(seconds):
        t_s = np.append([0, begin_s], np.arange(begin_s + 0.05, seconds, 0.01))
        x, y = (np.sin(3 * t_s + turn) * (count - 1) / 4 + (count - 1) / 2 for count, turn in ((columns, 0), (rows, 1)))
        square_mm2 = PITCH_mm**2 * ((column - x[:, None]) ** 2 + (row - y[:, None]) ** 2)
        return pressed(path, pad, t_s, (t_s > begin_s)[:, None] * PEAK_Pa * np.exp(-square_mm2 / (2 * SIGMA_mm**2)))

    return contact


def measure(folder, command_frame, steps):
    """Rows of the table; and the rectangles whose images of every scene are built."""
    tree, jobs = copied_tree(folder), {}
    pairs = [(pad, board) for pad in (*RECTANGLES, *FREE) for board in BOARDS if board != PARALLEL or np.prod(size_of(pad)) <= LINES]
    names = {pair: add_board(tree, pair[1], pair[0]) for pair in pairs}

    def one(pad, board, scene):
        name = names[pad, board]
        place = build(scene, name, tree / "images", tree)
        if scene != SCENE:
            return None
        contact = contact_on(pad, tree / f"{name}.csv")
        found = sizes(place, name) | cycles(command_frame, place, scene, name, (OSR,), tree, contact, tree)
        row = {"array": pad, "board": board, "kernel": "float" if pad in FREE else "fixed point"}
        return row | {key: found[key] for key in SHOWN} | {"frames_per_s": found["frames_per_s"][str(OSR)]}

    for pad, board in pairs:
        for scene in SCENES if board != PARALLEL else (SCENE,):
            jobs[pad, board, scene] = f"{pad} on {board}, scene {scene}", lambda p=pad, b=board, s=scene: one(p, b, s)
    rows = list(filter(None, steps.run_all(jobs).values()))
    return rows, list(RECTANGLES)
