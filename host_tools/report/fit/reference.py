#!/usr/bin/python3
"""The least-squares optimum in double precision that the fingertip's fit is measured against.

    reference.py FILE [--noise PA]    the optimum of each frame of a recording with the raw stream

Readings are above each sensor's zero and over the gains of a calibrated fingertip, as the fit gets them. A frame without a zero, or in which too few
sensors were measured, has none. condition_number and observable are of compared.cpp.
"""

import pathlib
import sys

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools" / part) for part in ("report/measure", "python")]
import presses  # noqa: E402
from fingertip.command import Parser, check_range, run_tool  # noqa: E402
from fingertip.files import InputError, read_recording  # noqa: E402
from measure import Measure, usable_of  # noqa: E402

SENSORS_MIN = 4
FOUND = ("x_mm", "y_mm", "p0_Pa", "sigma_mm", "force_N", "location_sd_mm", "condition_number")


def readings_Pa(path):
    """t_us [frame], and what the fit gets [frame, sensor]: NaN where a sensor has none."""
    recording = read_recording(path)
    gains = np.array(recording.metadata.get("gains", presses.SENSORS * " 1").split(), float)
    if recording.sensors_Pa.shape[1] != len(gains) or len(gains) != presses.SENSORS:
        raise InputError(f"{path}: has the readings of {recording.sensors_Pa.shape[1]} sensors, and the reference is of {presses.SENSORS}")
    valid = np.nan_to_num(recording["valid"]).astype(np.int64)[:, None] >> np.arange(presses.SENSORS) & 1
    zero_Pa = np.where((valid > 0) & (recording.tare_Pa > 0), recording.tare_Pa, np.nan)
    return recording["t_us"], (recording.sensors_Pa - zero_Pa) / gains


def main(argv):
    parser = Parser(prog="reference.py", description=__doc__)
    parser.add_argument("--build", default=ROOT / "build/host", metavar="DIR", help="build folder of the host tools (default: %(default)s)")
    parser.add_argument("file", metavar="FILE", help="the recording")
    parser.add_argument("--noise", type=float, default=5.0, metavar="PA", help="of a sensor, rms; default 5")
    options = parser.parse_args(argv)
    check_range("noise", options.noise, 0.01, 10000)
    t_us, readings = readings_Pa(options.file)
    fits = (~np.isnan(readings)).sum(axis=1) >= SENSORS_MIN
    usable = np.where(fits, usable_of(readings), np.uint64(0))
    best = presses.Compared(Measure(options.build)).optimum(1024 * np.nan_to_num(readings), usable, np.full(len(readings), options.noise))
    located = best["observable"] & (np.nan_to_num(readings).max(axis=1) >= presses.GATE_NOISES * options.noise)
    print("t_us", *FOUND, "observable", "at_bound", sep=",")
    for at_us, fit, is_located, found in zip(t_us, fits, located, best):
        cells = [*(f"{found[name]:.7g}" for name in FOUND), int(is_located), int(found["at_bound"])]
        print(f"{at_us:.0f}", *(cells if fit else len(cells) * [""]), sep=",")
    return 0


if __name__ == "__main__":
    sys.exit(run_tool("reference.py", main))
