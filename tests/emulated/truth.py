"""What a recording of an emulated run says, held against what its scenario made the sensors feel."""

import numpy as np
from emulation import files

HELD = 1 << 6
# A location without one of these is meant to be right: LOW_SIGNAL to SENSOR_DOUBTFUL but for SENSOR_MASKED, which only tells why.
WARNINGS = 0x7BF00
# The readings of a frame are of one moment, its time stamp; within this long around it the truth may be met.
MOMENT_s = 1e-3


class Truth:
    def __init__(self, path):
        self.path = path
        self.scenario = files.read_scenario(path)
        self.ambient_Pa = float(self.scenario.metadata["ambient_Pa"])

    def times_s(self, recording, report):
        """Since power-on."""
        return recording["t_us"] * 1e-6 + report["device_time_zero_s"]

    def worst_reading_Pa(self, recording, t_s, rows=slice(None)):
        """Of the readings that are said to be valid in these rows, the largest deviation from the truth."""
        scenario, sensors = self.scenario, recording.sensors_Pa.shape[1]
        truth_Pa = np.column_stack([np.interp(t_s, scenario.t_s, scenario.sensors_Pa[:, k]) for k in range(sensors)])
        is_valid = ((np.nan_to_num(recording["valid"]).astype(int)[:, None] >> np.arange(sensors)) & 1) == 1
        slope_Pa = np.abs(np.gradient(truth_Pa, t_s, axis=0)) * MOMENT_s
        error_Pa = np.abs(recording.sensors_Pa - self.ambient_Pa - truth_Pa) - slope_Pa
        return float(np.nanmax(np.where(is_valid, error_Pa, 0)[rows]))

    def unwarned_errors_mm(self, recording, t_s):
        """Distances from the truth of all locations without a warning, where the scenario presses with at least 0.3 N."""
        flags = np.nan_to_num(recording["flags"]).astype(int)
        told = (flags & files.FIT_VALID != 0) & (flags & (WARNINGS | HELD) == 0)
        pressed = (self.scenario.at("force_N", t_s - MOMENT_s) > 0.3) & (self.scenario.at("force_N", t_s + MOMENT_s) > 0.3)
        rows = told & pressed
        return np.hypot(
            recording["x_mm"][rows] - self.scenario.at("x_mm", t_s[rows]), recording["y_mm"][rows] - self.scenario.at("y_mm", t_s[rows])
        )
