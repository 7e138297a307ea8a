"""What the tangential force costs on the chip: the images of scene grasp in the emulator, a pad of 12 mm in their profile, and the cycles of
the estimate alone."""

import pathlib
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools/report/shared"), str(ROOT / "host_tools/report/rate"), str(ROOT / "host_tools/python")]
import numpy as np  # noqa: E402
import scenes  # noqa: E402
from boards import PARALLEL as BOARD, fit_cycles_of, image_of  # noqa: E402
from emulated import FROM_s, Measurement, Tools, scenario  # noqa: E402
from fingertip.files import TANGENTIAL_VALID, read_recording  # noqa: E402
from grasp_rate import PAD  # noqa: E402
from reporting import run  # noqa: E402

OSRS = (256, 1024)
SECONDS = 6.0


def measure(build, boards, progress):
    tools = Tools(build, boards)
    sizes = scenes.sizes(image_of(boards, BOARD).parent, BOARD)
    found = {"chip_flash_bytes": sizes["flash_bytes"], "chip_ram_bytes": sizes["ram_bytes"], "chip_stack_bytes": sizes["stack_bytes"]}
    with tempfile.TemporaryDirectory() as folder:
        path = scenario(folder, "wander", FROM_s + SECONDS + 1)
        for osr in OSRS:
            measured = Measurement(tools, folder, BOARD, osr, path, SECONDS, commands=[tools.encoded("pad", *PAD)])
            read = read_recording(f"{measured.name}.csv")
            flags = read["flags"][read.has_contact & (read["t_us"] > read["t_us"][-1] - 1e6 * SECONDS)].astype(np.int64)
            found |= {
                f"chip_fps_osr{osr}": measured.fitted_per_s,
                f"chip_frames_per_s_osr{osr}": measured.frames_per_s,
                f"chip_frames_skipped_osr{osr}": measured.frames_skipped,
                f"chip_latency_us_osr{osr}": float(measured.offered_us.max()),
                f"chip_latency_median_us_osr{osr}": float(np.median(measured.offered_us)),
                f"chip_fit_us_osr{osr}": measured.stages_us["fit_us"],
                f"chip_valid_percent_osr{osr}": 100 * float(((flags & TANGENTIAL_VALID) != 0).mean()),
                f"chip_sleep_percent_osr{osr}": measured.sleep_percent,
            }
            progress(f"grasp on {BOARD}, OSR {osr}: {measured.fitted_per_s:.0f} frames/s")
    cycles = run("node", pathlib.Path(__file__).with_name("cycles.mjs"), fit_cycles_of(boards)).split()
    return {**found, "fit_cycles_median": int(cycles[0]), "shear_cycles_median": int(cycles[1]), "shear_cycles": int(cycles[2])}
