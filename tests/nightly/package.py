"""What the Python package costs a program that takes every frame at the highest rate, and what it loses."""

# real time: processor time of a program at its pace
import itertools
import json
import os
import sys
import time

from nightly import HOST, REPORT, ROOT, Programs, job, run, wait_for

from fingertip import Fingertip
from fingertip.files import read_recording

RATE_Hz, SECONDS, MINUTE_us, MANY_s = 1310, 60, 60_000_000, 10
OLD = "ac68022d"  # half of the time of its reader of CSV is the goal
READ = """import json, resource, sys, time
sys.path.insert(0, sys.argv[1])
from fingertip.files import read_recording
times_s = []
for _ in range(3):
    begun_s = time.process_time()
    rows = len(read_recording(sys.argv[2], **json.loads(sys.argv[3]))["t_us"])
    times_s.append(time.process_time() - begun_s)
MB = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1000
print(json.dumps({"us": round(min(times_s) / rows * 1e6, 2), "s": round(min(times_s), 2), "MB": round(MB)}))"""


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


def cost(file, package=HOST / "python", **part):
    """Of reading it by a process of its own, the best of three: processor time in all and for each row, memory."""
    return json.loads(run(sys.executable, "-c", READ, package, file, json.dumps(part)))


@job("ecosystem", ("python_core_percent", "<=", 6), ("python_lost", "<=", 0), ("python_fps", ">=", 1308))
def python(build):
    with Programs(build) as programs:
        found = json.loads(run(sys.executable, __file__, programs.fake_device("AAAA", f"rate={RATE_Hz}"), SECONDS))
    return {"python_seconds": SECONDS} | {f"python_{name}": round(value, 2) for name, value in found.items()}


@job(
    "tools",
    ("python_mcap_us_per_row_over_csv", "<=", 1.5),
    ("python_csv_us_per_row_over_old_csv", "<=", 0.5),
    ("hour_python_MB", "<=", 1000),
    ("minute_55_s", "<=", 1),
    ("hour_mcap_GB", "<=", 0.8),
    ("recordings_refused_wrongly", "<=", 0),
    ("rows_lost_silently", "<=", 0),
)
def recordings(build):
    """read_recording of a minute of `fingertip simulate` at the highest rate, with its noise, and of that sixty times in a row; by the package of
    OLD, too; and what the test formats counted."""
    with Programs(build) as programs:
        tool, log = build / "host_tools/tool/cli/fingertip", programs.folder / "log"
        csv, mcap, hour_csv, hour_mcap = (programs.folder / f"{name}.{end}" for name in ("minute", "hour") for end in ("csv", "mcap"))
        programs.start(tool, "simulate", stdout=programs.enter_context(open(log, "wb")))
        wait_for(lambda: b"ready:" in log.read_bytes(), "simulated fingertip")
        run(tool, "set", "osr=256", "rate=max")
        run(tool, "record", csv, "--seconds", SECONDS)
        run(tool, "convert", csv, mcap)
        run("sh", "-c", f"git -C {ROOT} archive {OLD} host_tools/python | tar x -C {programs.folder}")
        lines = csv.read_text(encoding="utf-8").splitlines(keepends=True)
        rows = [line.split(",", 2) for line in lines if line[0].isdigit()]
        with open(hour_csv, "w", encoding="utf-8") as file:
            file.writelines(lines[: lines.index(",".join(rows[0]))])
            for at in range(60):
                file.writelines(f"{int(t_us) + at * MINUTE_us},{int(frame) + at * len(rows)},{rest}" for t_us, frame, rest in rows)
        run(tool, "convert", hour_csv, hour_mcap)
        kinds = {"csv": (csv,), "mcap": (mcap,), "old_csv": (csv, programs.folder / "host_tools/python")}
        us = {kind: cost(*each)["us"] for kind, each in kinds.items()}
        found = {f"python_{kind}_us_per_row": value for kind, value in us.items()} | {"hour_python_MB": cost(hour_mcap)["MB"]}
        for one, other in (("mcap", "csv"), ("csv", "old_csv")):
            found[f"python_{one}_us_per_row_over_{other}"] = round(us[one] / us[other], 2)
        found |= {"minute_55_s": cost(hour_mcap, from_s=3300, to_s=3360)["s"], "hour_mcap_GB": round(hour_mcap.stat().st_size / 1e9, 2)}
    formats = json.loads((REPORT / "formats.json").read_text(encoding="utf-8")) if (REPORT / "formats.json").exists() else {}
    return found | {name: formats.get(name) for name in ("recordings_refused_wrongly", "rows_lost_silently")}


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
