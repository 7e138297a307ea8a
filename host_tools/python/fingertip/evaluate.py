"""Compares a recording with the truth of its scenario.

    fingertip-evaluate RECORDING.csv SCENARIO.csv [--run run.json] -o summary.json [--overwrite]

Scenario time = device time + device_time_zero_s of the run report (0 without one). The truth is taken at each frame's own time, linear
between the scenario's rows. Frames whose time falls between a row with and a row without contact belong to neither.

    frames, frames_per_s       contact packets in the recording, and their rate in device time
    fitted_frames              frames with truth in contact and FIT_VALID: the ones compared
    localisation_median_mm, localisation_p95_mm      distance of the location from the truth
    force_rmse_N               root mean square error of the force
    force_mape_percent         median absolute percentage error, as in De Clercq et al., RA-L 2022, section IV.C
    force_mape_frames          only frames with a true force above 0.2 N count for it
    tangential_frames          of the fitted ones, those with a tangential force; null, as what follows, where there is none
    tangential_ratio_error_p50, tangential_ratio_error_p95      of tangential over normal force, as a vector
    tangential_direction_p90_deg     only frames with a true ratio above 0.1 count for it
    tangential_from_touch      frames whose load is what changed since the touch: their truth is taken as it is all the same
    contact_missed, contact_false     frames above 0.2 N without CONTACT; frames without contact but with CONTACT
    slip_found, slip_missed    true slips of at least 50 ms with, without a SLIP frame between start and end + 0.1 s
    slip_delay_ms              of the found ones, from the start of the slip to the first SLIP frame
    slip_valid_lost            of these true slips, those with a frame without SLIP_VALID between start and end
    slip_false                 SLIP frames outside of all true slips; a slip's end is widened by the slip window
    total_us_median            from the first bus activity of a frame to its packet
    stages_sum_wrong           frames whose stages do not add up to their total
    dropped_packets, crc_errors, format_errors       as the recorder counted; null if it was killed
    emulator_warnings          of the run report
"""

import json
import math
import sys

import numpy as np

from .command import Parser, check_output, printable, progress
from .files import CONTACT, FIT_VALID, SLIP, SLIP_VALID, STAGES, TANGENTIAL_FROM_TOUCH, TANGENTIAL_VALID, InputError
from .files import read_recording, read_run, read_scenario, recorded_devices, restart_rows, write_text

FORCE_MIN_N = 0.2
SLIP_MIN_s = 0.05
SLIP_LATE_s = 0.1
DEFAULT_SLIP_WINDOW_ms = 100
SATURATED_us = 65535
RATIO_MIN = 0.1
ENDED = ("dropped_packets", "crc_errors", "format_errors")


class Comparison:
    """Arrays over the frames that hold a contact packet, and the summary."""

    def __init__(self, recording, scenario, run):
        rows = recording.has_contact
        if not rows.any():
            raise InputError("the recording holds no contact packet; record with the contact stream on")
        zero_s = run.get("device_time_zero_s", 0.0)
        if not isinstance(zero_s, (int, float)):
            raise InputError("device_time_zero_s of the run report is no number; the image never started its timer")
        self.t_s = recording["t_us"][rows] / 1e6 + zero_s
        flag = {bit: recording.flag(bit)[rows] for bit in (CONTACT, FIT_VALID, SLIP_VALID, SLIP)}
        self.true_force_N = scenario.at("force_N", self.t_s)
        in_contact = scenario.is_on("contact", self.t_s)
        self.compared = in_contact & flag[FIT_VALID]
        if not self.compared.any():
            raise InputError("no fitted frame falls into a true contact; give the scenario and run report of this recording")
        x, y, force = (recording[name][rows] for name in ("x_mm", "y_mm", "force_N"))
        self.x_mm, self.y_mm, self.force_N = x, y, force
        self.fitted, self.slip = flag[FIT_VALID], flag[SLIP]
        self.location_error_mm = np.hypot(x - scenario.at("x_mm", self.t_s), y - scenario.at("y_mm", self.t_s))
        self.force_error_N = force - self.true_force_N
        self.strong = self.compared & (self.true_force_N > FORCE_MIN_N)

        recorded = (self.t_s[0], self.t_s[-1])
        missed = valid_lost = 0
        delays_ms = []
        window_s = float(recording.metadata.get("slip_window_ms", DEFAULT_SLIP_WINDOW_ms)) / 1000
        outside = self.slip.copy()
        for start, end in scenario.intervals("slip"):
            outside &= ~((self.t_s >= start) & (self.t_s <= end + window_s))
        for start, end in scenario.intervals("slip"):
            if end - start < SLIP_MIN_s or start < recorded[0] or end > recorded[1]:
                continue
            found = self.t_s[self.slip & (self.t_s >= start) & (self.t_s <= end + SLIP_LATE_s)]
            if len(found):
                delays_ms.append(round(1000 * float(found[0] - start), 1))
            else:
                missed += 1
            during = (self.t_s >= start) & (self.t_s <= end)
            valid_lost += bool((during & ~flag[SLIP_VALID]).any())

        total = recording["total_us"][rows]
        stages = np.column_stack([recording[name][rows] for name in STAGES])
        unsaturated = (total < SATURATED_us) & (stages < SATURATED_us).all(axis=1)
        error_mm, error_N = self.location_error_mm[self.compared], self.force_error_N[self.compared]
        percent = 100 * np.abs(self.force_error_N[self.strong]) / self.true_force_N[self.strong]
        self.summary = {
            "frames": len(self.t_s),
            "frames_per_s": float((len(self.t_s) - 1) / (recorded[1] - recorded[0])) if len(self.t_s) > 1 else 0.0,
            "fitted_frames": int(self.compared.sum()),
            "localisation_median_mm": float(np.median(error_mm)),
            "localisation_p95_mm": float(np.percentile(error_mm, 95)),
            "force_rmse_N": float(np.sqrt(np.mean(error_N**2))),
            "force_mape_percent": float(np.median(percent)) if len(percent) else None,
            "force_mape_frames": int(self.strong.sum()),
            **self.tangential(recording, scenario, rows),
            "contact_missed": int((in_contact & (self.true_force_N > FORCE_MIN_N) & ~flag[CONTACT]).sum()),
            "contact_false": int((scenario.is_off("contact", self.t_s) & flag[CONTACT]).sum()),
            "slip_found": len(delays_ms),
            "slip_missed": missed,
            "slip_delay_ms": delays_ms,
            "slip_valid_lost": valid_lost,
            "slip_false": int(outside.sum()),
            "total_us_median": float(np.median(total)),
            "stages_sum_wrong": int((unsaturated & (stages.sum(axis=1) != total)).sum()),
            **{key: int(recording.end[key]) if key in recording.end else None for key in ENDED},
            "emulator_warnings": len(run.get("warnings", [])),
        }

    def tangential(self, recording, scenario, rows):
        """The part of the summary that is about the tangential force."""
        pulled = self.compared & recording.flag(TANGENTIAL_VALID)[rows] & (self.true_force_N > FORCE_MIN_N)
        keys = ("frames", "ratio_error_p50", "ratio_error_p95", "direction_p90_deg", "from_touch")
        if not scenario.has_pull or not pulled.any():
            return {f"tangential_{key}": None for key in keys}
        found = np.array([recording[name][rows][pulled] for name in ("qx_N", "qy_N")]) / self.force_N[pulled]
        truth = np.array([scenario.at(name, self.t_s[pulled]) for name in ("Qx_N", "Qy_N")]) / self.true_force_N[pulled]
        error = np.hypot(*(found - truth))
        aimed = np.hypot(*truth) > RATIO_MIN
        turned = np.arctan2(*found[::-1, aimed]) - np.arctan2(*truth[::-1, aimed])
        turned_deg = np.degrees(np.abs(np.angle(np.exp(1j * turned))))
        from_touch = int((recording.flag(TANGENTIAL_FROM_TOUCH)[rows] & pulled).sum())
        p50, p95 = (float(np.percentile(error, share)) for share in (50, 95))
        values = (int(pulled.sum()), p50, p95, float(np.percentile(turned_deg, 90)) if aimed.any() else None, from_touch)
        return {f"tangential_{key}": value for key, value in zip(keys, values)}


def add_recording_options(parser):
    parser.add_argument("--overwrite", action="store_true", help="replace the output if it exists")
    parser.add_argument("--salvage", action="store_true", help="skip damaged lines of the recording and print how many")
    parser.add_argument("--device", metavar="SERIAL", help="one of several fingertips in the recording")
    parser.add_argument("--from", dest="from_s", type=float, default=0.0, metavar="S", help="leave out what is before; since its begin")
    parser.add_argument("--to", dest="to_s", type=float, default=math.inf, metavar="S", help="leave out what is after")


def load_recording(options, columns=None):
    devices = recorded_devices(options.recording)
    if len(devices) > 1 and not options.device:
        raise InputError(f"{options.recording}: holds several fingertips; choose one with --device: {' '.join(devices)}")
    part = {"from_s": options.from_s, "to_s": options.to_s}
    with progress("reading") as show:
        recording = read_recording(options.recording, options.salvage, options.device, columns, show, **part)
    if recording.skipped_lines:
        print(f"{printable(options.recording)}: {recording.skipped_lines} damaged lines skipped", file=sys.stderr)
    if not recording.end:
        print(f"{printable(options.recording)}: no end line: the recording was cut short", file=sys.stderr)
    return recording


def check_time(recording):
    """One run of the device is one axis of time: a recording that crosses a restart has none."""
    t_us, frame = recording["t_us"], recording["frame"]
    restarts = restart_rows(t_us, frame)
    contact = np.flatnonzero(recording.has_contact)
    repeated = contact[1:][np.diff(t_us[contact]) == 0]
    for rows, what in (
        (restarts, "the fingertip restarted here; record again, or cut the file before this line"),
        (repeated, "a second frame of the same time; remove the line"),
    ):
        if len(rows):
            raise InputError(f"{recording.path}:{recording.line_numbers[rows[0]]}: {what}")


def main(argv):
    parser = Parser(prog="fingertip-evaluate", description=__doc__)
    parser.add_argument("recording", metavar="RECORDING.csv")
    parser.add_argument("scenario", metavar="SCENARIO.csv")
    parser.add_argument("--run", metavar="run.json", help="the emulator's report")
    parser.add_argument("-o", "--output", required=True, metavar="summary.json")
    add_recording_options(parser)
    options = parser.parse_args(argv)
    check_output(options.output, options.recording, options.scenario, options.run, replace=options.overwrite)
    recording = load_recording(options)
    check_time(recording)
    comparison = Comparison(recording, read_scenario(options.scenario), read_run(options.run))
    write_text(options.output, json.dumps(comparison.summary, indent=2) + "\n")
    return 0
