"""What the Python package costs a program that takes every frame at the highest rate, and what it loses."""

# real time: processor time of a program at its pace
import itertools
import json
import os
import subprocess
import sys
import time

from nightly import PATIENCE_s, REPORT, Programs, job, run, wait_for

from fingertip import Fingertip
from fingertip.files import InputError, read_recording

RATE_Hz, SECONDS, MANY_s = 1310, 60, 10


def read_here(port, seconds):
    taken = missing = 0
    with Fingertip(port) as fingertip:
        frames = iter(fingertip)
        last = next(frames).frame
        begun_s, cpu_s = time.perf_counter(), time.process_time()
        for frame in frames:
            taken += 1
            missing += frame.frame - last - 1
            last = frame.frame
            if taken % 100 == 0 and time.perf_counter() - begun_s >= seconds:
                break
        wall_s, cpu_s = time.perf_counter() - begun_s, time.process_time() - cpu_s
        line = fingertip.statistics
        return {
            "frames": taken,
            "fps": taken / wall_s,
            "core_percent": 100 * cpu_s / wall_s,
            "us_per_packet": 1e6 * cpu_s / (2 * taken),
            "lost": missing + line.dropped_packets + line.crc_errors + line.format_errors + line.out_of_order + fingertip.overrun_frames,
            "clock_us": fingertip.clock.uncertainty_us,
        }


def read(port, seconds):
    """By a process of its own."""
    words = [sys.executable, __file__, str(port), str(seconds)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=seconds + PATIENCE_s, check=False)
    if done.returncode != 0:
        raise InputError(f"the Python reader failed: {done.stderr.strip()[-500:]}")
    return json.loads(done.stdout)


@job("ecosystem", ("python_core_percent", "<=", 6), ("python_lost", "<=", 0), ("python_fps", ">=", 1308))
def python(build):
    with Programs(build) as programs:
        found = read(programs.fake_device("AAAA", f"rate={RATE_Hz}"), SECONDS)
    return {"python_seconds": SECONDS} | {f"python_{name}": round(value, 2) for name, value in found.items()}


@job(
    "tools",
    ("python_mcap_us_per_row_over_csv", "<=", 1.5),
    ("hour_mcap_GB", "<=", 0.8),
    ("recordings_refused_wrongly", "<=", 0),
    ("rows_lost_silently", "<=", 0),
)
def recordings(build):
    """Processor time of read_recording for a row of a minute of `fingertip simulate`, the better of three readings of each kind; the size of an hour at
    the highest rate, with that noise; and what the test formats counted."""
    with Programs(build) as programs:
        tool, files, found = build / "host_tools/tool/cli/fingertip", [programs.folder / f"minute.{end}" for end in ("csv", "mcap")], {}
        log = programs.folder / "log"
        programs.start(tool, "simulate", stdout=programs.enter_context(open(log, "wb")))
        wait_for(lambda: b"ready:" in log.read_bytes(), "simulated fingertip")
        run(tool, "set", "osr=256", "rate=max")
        run(tool, "record", files[0], "--seconds", SECONDS)
        run(tool, "convert", *files)
        for file in files:
            times_s = []
            for _ in range(3):
                begun_s = time.process_time()
                rows = len(read_recording(file)["t_us"])
                times_s.append(time.process_time() - begun_s)
            found[f"python_{file.suffix[1:]}_us_per_row"] = round(min(times_s) / rows * 1e6, 2)
        found["hour_mcap_GB"] = round(files[1].stat().st_size / rows * RATE_Hz * 3600 / 1e9, 2)
    formats = json.loads((REPORT / "formats.json").read_text(encoding="utf-8")) if (REPORT / "formats.json").exists() else {}
    found |= {name: formats.get(name) for name in ("recordings_refused_wrongly", "rows_lost_silently")}
    return found | {"python_mcap_us_per_row_over_csv": round(found["python_mcap_us_per_row"] / found["python_csv_us_per_row"], 2)}


@job("tools", ("record1_lost", "<=", 0), ("record8_lost", "<=", 0), ("record16_lost", "<=", 0), ("stall_2s_lost", "<=", 0))
def many(build):
    """Packets that `record --all` counts as lost, of one, eight and sixteen fingertips at the highest rate; and those of a pipe that no one reads
    for two seconds in the middle of it."""
    found = {"stall_2s_lost": 0}
    for count, name, stalls_at in itertools.product((1, 8, 16), ("many.mcap", "many.csv"), (0, 100_000)):
        with Programs(build) as programs:
            ports = [programs.fake_device(f"{i:04X}", f"rate={RATE_Hz}") for i in range(count)]
            file, pipe = programs.folder / name, programs.folder / f"pipe_{name}"
            os.mkfifo(pipe)
            disk = programs.start("sh", "-c", f"(head -c {count * stalls_at}; sleep {2 * bool(stalls_at)}; cat) < {pipe} > {file}")
            environment = programs.environment | {"FINGERTIP_PORT": ":".join(map(str, ports))}
            run(build / "host_tools/tool/cli/fingertip", "record", pipe, "--all", "--overwrite", "--seconds", MANY_s, env=environment)
            disk.wait()
            ends = [read_recording(file, serial=f"{i:04X}" if count > 1 else None, columns=("t_us", "frame")).end for i in range(count)]
            figure = "stall_2s_lost" if stalls_at else f"record{count}_lost"
            found[figure] = found.get(figure, 0) + sum(int(end["dropped_packets"]) for end in ends)
    return found


if __name__ == "__main__":
    print(json.dumps(read_here(sys.argv[1], float(sys.argv[2]))))
