"""What each scene costs on each board: flash, RAM, stack, cycles of a frame by stage, frames a second by OSR, from images in the emulator."""

import json
import pathlib
import re
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools/report/shared"), str(ROOT / "host_tools/python")]
from boards import BOARDS  # noqa: E402
from emulated import CONVERSION_us, Tools, scenario  # noqa: E402
from reporting import run  # noqa: E402

SCENES = ("raw", "press", "slip", "grasp", "shapes", "paper")
WORDS = {
    "FIT": "location, force",
    "FULL_GRID": "widths, elongated contacts",
    "OUTLIERS": "search for a broken sensor",
    "TANGENTIAL_BIAS": "warning of a tangential force that is not estimated, learning of gains",
    "SLIP": "slip",
    "TANGENTIAL": "tangential force, velocity",
    "SHAPES": "contact shapes",
    "RAW_STREAM": "raw packets",
    "SYNC": "sync pin",
}
STREAM = dict.fromkeys(SCENES, "contact") | {"raw": "raw"}
# The contact of the scenario "wander" lasts from 0.65 s on; windows of whole temperature intervals.
REST_s = (0.5, 0.58)
CONTACT_FROM_s, WINDOW_s, SETTLE_s = 1.0, 1.0, 0.1


def capabilities():
    """{scene: its capabilities}, as cmake/options.cmake has them."""
    text = (ROOT / "cmake/options.cmake").read_text(encoding="utf-8")
    found = {}
    for scene, names in re.findall(r"^set\(capabilities_of_(\w+) (.*)\)$", text, re.M):
        found[scene] = sum((found[name[18:-1]] if name.startswith("${") else [name] for name in names.split()), [])
    return found


def build(scene, board, folder, root=ROOT):
    """Folder of the images of a scene on a board of the tree `root`."""
    place = pathlib.Path(folder).absolute() / scene / board
    chip = ["-DCMAKE_BUILD_TYPE=Release", f"-DCMAKE_TOOLCHAIN_FILE={root}/cmake/toolchain-arm-none-eabi.cmake"]
    run("cmake", "-G", "Ninja", "-S", root, "-B", place, *chip, f"-DFINGERTIP_BOARD={board}", f"-DFINGERTIP_SCENE={scene}")
    run("cmake", "--build", place, "--target", f"fingertip-{board}", "-j", "1")
    return place


class SceneTools(Tools):
    """The images of a scene instead of the boards' own; builds them."""

    def __init__(self, build_folder, boards, scene, on=BOARDS):
        super().__init__(build_folder, boards)
        self.scene = scene
        self.places = {board: build(scene, board, self.boards / "scenes") for board in on}

    def image(self, board, suffix="bin"):
        return self.places[board] / f"fingertip-{board}.{suffix}" if hasattr(self, "places") else super().image(board, suffix)


def sizes(place, board):
    """Bytes, by the checks of the tests. RAM is what is not code: constants, variables and the whole stack."""
    elf = place / f"fingertip-{board}.elf"
    with tempfile.TemporaryDirectory() as folder:
        image, stack = pathlib.Path(folder) / "image.json", pathlib.Path(folder) / "stack.json"
        run(sys.executable, ROOT / "tests/checks/check_image.py", elf, "--json", image)
        run(sys.executable, ROOT / "tests/checks/stack_usage.py", elf, "--su-dir", place / "firmware", place / "boards", "--json", stack)
        image, stack = json.loads(image.read_text()), json.loads(stack.read_text())
    return {
        "flash_bytes": image["flash_bytes"],
        "ram_bytes": image["constants_in_sram_bytes"] + image["variables_bytes"] + image["stack_reserved_bytes"],
        "code_in_sram_bytes": image["code_in_sram_bytes"],
        "stack_bytes": stack["worst_bytes"],
    }


def cycles(command_frame, place, scene, board, osrs, folder, contact=None, root=ROOT):
    """Cycles of a frame by stage without and in contact, at the first OSR, and frames a second at each. contact(seconds) writes the scenario, which
    touches from CONTACT_FROM_s on, else "wander" is it; root: the tree that has the board."""

    def encoded(*command):
        return run(command_frame, *command).strip()

    script, windows, t_s = [(0.45, "dtr 1"), (0.46, encoded("stream", STREAM[scene]))], [("rest", *REST_s)], CONTACT_FROM_s
    for osr in osrs:
        first = osr == osrs[0]
        script.append((0.455 if first else t_s, encoded("osr", osr)))
        begin_s = t_s if first else t_s + SETTLE_s
        windows.append((str(osr), begin_s, begin_s + WINDOW_s))
        t_s = begin_s + WINDOW_s
    host_script = pathlib.Path(folder) / f"{scene}-{board}.script"
    host_script.write_text("".join(f"{at_s:.3f} {what}\n" for at_s, what in sorted(script)))
    windows = [word for name, from_s, to_s in windows for word in ("--window", f"{name}:{from_s:.3f}:{to_s:.3f}")]
    image = ("--image", place / f"fingertip-{board}", "--board", board, "--host-script", host_script)
    path = contact(t_s + 1) if contact else scenario(folder, "wander", t_s + 1, f"{scene}-{board}")
    found = json.loads(run("node", root / "host_tools/report/rate/stage_cycles.mjs", *image, "--scenario", path, *windows))
    contact = found[str(osrs[0])]
    return {
        "cycles_of_frame_at_rest": found["rest"]["total_cycles_per_frame"],
        "cycles_of_frame": contact["total_cycles_per_frame"],
        "cycles_by_stage": contact["cycles_per_frame"],
        "frames_per_s": {str(osr): found[str(osr)]["frames_per_s"] for osr in osrs},
    }


def measure(command_frame, scenes_folder, steps, scenes=SCENES, boards=BOARDS, osrs=tuple(CONVERSION_us)):
    """Rows of the table."""

    def one(scene, board, folder):
        place = build(scene, board, scenes_folder)
        return {"scene": scene, "board": board, **sizes(place, board), **cycles(command_frame, place, scene, board, osrs, folder)}

    with tempfile.TemporaryDirectory() as folder:
        jobs = {
            (scene, board): (f"scene {scene} on {board}", lambda s=scene, b=board: one(s, b, folder))
            for board in boards
            for scene in scenes
        }
        return list(steps.run_all(jobs).values())
