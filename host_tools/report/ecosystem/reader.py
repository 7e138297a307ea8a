#!/usr/bin/python3
"""Reads a fingertip by the Python package and says as JSON what it cost and what it lost.

    reader.py PORT SECONDS

core_percent: processor time of all threads over wall-clock time, while every frame is taken and judged. lost: frames that their numbers
show to be missing, packets that the line lost or damaged, and frames that this program did not take in time.
"""

import json
import pathlib
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "python"))
from fingertip import Fingertip  # noqa: E402


def read(port, seconds):
    sum_N, taken, missing = 0.0, 0, 0
    with Fingertip(port) as fingertip:
        frames = iter(fingertip)
        last = next(frames).frame
        begun_s, busy_s = time.perf_counter(), time.process_time()
        for frame in frames:
            taken += 1
            missing += frame.frame - last - 1
            last = frame.frame
            if frame.trusted:
                sum_N += frame.force_N
            if taken % 100 == 0 and time.perf_counter() - begun_s >= seconds:
                break
        wall_s, cpu_s = time.perf_counter() - begun_s, time.process_time() - busy_s
        line = fingertip.statistics
        damaged = line.crc_errors + line.format_errors + line.out_of_order
        return {
            "wall_s": wall_s,
            "frames": taken,
            "fps": taken / wall_s,
            "core_percent": 100 * cpu_s / wall_s,
            "us_per_packet": 1e6 * cpu_s / (2 * taken),
            "lost": missing + line.dropped_packets + damaged + fingertip.overrun_frames,
            "uncertainty_us": fingertip.clock.uncertainty_us,
            "mean_N": sum_N / taken,
        }


if __name__ == "__main__":
    print(json.dumps(read(sys.argv[1], float(sys.argv[2]))))
