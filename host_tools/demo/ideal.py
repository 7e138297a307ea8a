#!/usr/bin/python3
"""The same contacts as in another scenario, on a pad without errors: perfect Gaussians, equal sensors.

    ideal.py SCENARIO.csv -o IDEAL.csv

Location and force stay; the pressure is the Gaussian of De Clercq et al., RA-L 2022, eq. (2), of the width that they found
on 12 mm of rubber.
"""
import argparse
import pathlib
import sys

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "python"))
from fingertip.files import SENSOR_X_mm, SENSOR_Y_mm, TRUTH_COLUMNS, check_output, read_scenario, run_tool, write_scenario  # noqa: E402

SIGMA_mm = 5.7


def main(argv):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenario", metavar="SCENARIO.csv")
    parser.add_argument("-o", "--output", required=True, metavar="IDEAL.csv")
    options = parser.parse_args(argv)
    check_output(options.output, options.scenario)
    scenario = read_scenario(options.scenario)
    truth = {name: scenario.truth[name] for name in TRUTH_COLUMNS}
    p0_Pa = truth["force_N"] / (2 * np.pi * (SIGMA_mm * 1e-3)**2)
    square_mm2 = (np.subtract.outer(truth["x_mm"], SENSOR_X_mm)**2 + np.subtract.outer(truth["y_mm"], SENSOR_Y_mm)**2)
    sensors_Pa = p0_Pa[:, None] * np.exp(-square_mm2 / (2 * SIGMA_mm**2))
    metadata = {"name": "ideal", "description": f"the contacts of {scenario.metadata.get('name', options.scenario)} as perfect Gaussians",
                "ambient_Pa": 101325, "temperature_degC": 25, "sensors": len(SENSOR_X_mm)}
    write_scenario(options.output, metadata, {**truth, "p0_Pa": p0_Pa, "sigma_mm": np.full_like(p0_Pa, SIGMA_mm),
                                              "t_s": scenario.t_s, "sensors_Pa": sensors_Pa})
    return 0


if __name__ == "__main__":
    sys.exit(run_tool("ideal.py", main))
