#!/usr/bin/python3
"""How fast the fingertip is, in emulated time: the release images of both boards in the emulator, in contact on every frame.

    rate.py --build build/host [--boards build] -o FOLDER [--plot FILE.png] [--seconds S] [--quick] [--check]

    rate.json    the figures by which the rate is judged, with their goals
    rate.md      the same as a table, with rates and latencies by OSR and by number of sensors
    rate.csv     rates and latencies by board and OSR; sensors.csv by number of sensors
    rate.png     both as a picture

Runs are the same bit for bit each time. A frame is what the sensors gave at one moment. Frames counted as fitted hold a fit of
this moment's pressures, seven iterations from a cold start; held ones, two a second, repeat the fit before while the sensors
measure their temperature. The latency counts from the longest conversion of the datasheet after the command; a packet is
offered when the firmware gives its first part to the USB controller, and delivered when the host has its last byte.
"""
import argparse
import concurrent.futures
import csv
import json
import pathlib
import subprocess
import sys
import tempfile

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "host_tools" / "python"))
from fingertip_files import (CONTACT, FIT_VALID, InputError, check_output, read_recording, run_tool, write_bytes,  # noqa: E402
                             write_text)

HELD = 1 << 6
CLOCK_HZ = 125e6
BOARDS = ("pico_parallel", "pico_mux")
# Longest conversion by OSR, us: MS5840-02BA datasheet.
CONVERSION_us = {256: 560, 512: 1100, 1024: 2170, 2048: 4320, 4096: 8610, 8192: 17200}
# By then the contact stands, the tare is over, and the settings have been obeyed.
FROM_s = 1.0
WIRE_CONTACT = 0x01

GOALS = (
    ("parallel_fps_osr256", ">=", 1250), ("parallel_fps_osr1024", ">=", 410), ("mux_fps_osr256", ">=", 260),
    ("mux_fps_osr1024", ">=", 185), ("latency_parallel_us", "<=", 700), ("idle_sleep_percent", ">=", 80),
    ("contact_sleep_percent", ">=", 40), ("flash_bytes", "<=", 48 * 1024), ("ram_bytes", "<=", 32 * 1024), ("stack_bytes", "<=", 2048),
    ("raw_flash_bytes", "<=", "half_flash_bytes"), ("dropped", "<=", 0))


class Tools:
    def __init__(self, build, boards):
        self.fingertip = pathlib.Path(build) / "host_tools/cli/fingertip"
        self.boards = pathlib.Path(boards)
        for path in (self.fingertip, *(self.image(board) for board in BOARDS)):
            if not path.is_file():
                raise InputError(f"{path}: is not there; build with cmake --build --preset host first")

    def image(self, board, suffix="bin"):
        return self.boards / board / f"fingertip-{board}.{suffix}"

    def run(self, *call):
        done = subprocess.run([str(part) for part in call], capture_output=True, text=True)
        if done.returncode != 0:
            raise InputError(f"{' '.join(str(part) for part in call[:4])} ...: {(done.stderr or done.stdout).strip()[-500:]}")
        return done.stdout

    def encoded(self, *command):
        return self.run(self.fingertip, "encode", *command).strip()


def cobs_header(frame):
    """The first twelve bytes of the packet in a frame."""
    packet, at = bytearray(), 0
    while at < len(frame) and len(packet) < 12:
        code = frame[at]
        packet += frame[at + 1:at + code]
        at += code
        if code != 0xFF:
            packet.append(0)
    return bytes(packet[:12])


def contact_times_us(usb_log, bulk_in, zero_us):
    """For each contact packet: device time of its frame, when its first part was offered, when its last byte was delivered."""
    times, frame, offered_us = [], bytearray(), 0.0
    with open(usb_log, newline="") as file:
        for row in csv.DictReader(file):
            if row["dir"] != "in" or row["endpoint"] != bulk_in:
                continue
            for byte in bytes.fromhex(row["bytes"]):
                if not frame:
                    offered_us = float(row["offered_ns"]) / 1e3 - zero_us
                if byte:
                    frame.append(byte)
                    continue
                header = cobs_header(frame)
                if len(header) == 12 and header[1] == WIRE_CONTACT:
                    times.append((int.from_bytes(header[4:12], "little"), offered_us, float(row["t_ns"]) / 1e3 - zero_us))
                frame = bytearray()
    return np.array(times)


class Measurement:
    """One board at one OSR."""

    def __init__(self, tools, folder, board, osr, scenario, seconds):
        self.board, self.osr = board, osr
        base = pathlib.Path(folder) / f"{board}-{osr}-{scenario.stem}"
        script = base.with_suffix(".script")
        script.write_text(f"0.45 dtr 1\n0.455 {tools.encoded('osr', osr)}\n0.46 {tools.encoded('stream', 'contact,health')}\n")

        def emulate(name, until_s):
            path = pathlib.Path(f"{base}.{name}")
            tools.run("node", ROOT / "host_tools/emulator/main.mjs", "--board", board, "--image", tools.image(board), "--scenario",
                      scenario, "--seconds", until_s, "--host-script", script, "--capture", f"{path}.ftr", "--report", f"{path}.json",
                      "--usb-log", f"{path}.usb")
            return path, json.loads(pathlib.Path(f"{path}.json").read_text())

        _, before = emulate("before", FROM_s)
        path, run = emulate("run", FROM_s + seconds)
        busy = (run["cycles"] - before["cycles"]) / ((run["emulated_s"] - before["emulated_s"]) * CLOCK_HZ)
        self.sleep_percent = 100 * (1 - busy)
        tools.run(tools.fingertip, "replay", f"{path}.ftr", "--to-csv", f"{path}.csv")
        recording = read_recording(f"{path}.csv")
        zero_us = run["device_time_zero_s"] * 1e6
        rows = recording.has_contact & (recording["t_us"] >= FROM_s * 1e6 - zero_us)
        t_us, flags = recording["t_us"][rows], recording["flags"][rows].astype(np.int64)
        self.seconds = (t_us[-1] - t_us[0]) * 1e-6
        held = (flags & HELD) != 0
        fitted = (flags & (CONTACT | FIT_VALID)) == CONTACT | FIT_VALID
        steps = len(t_us) - 1
        self.frames_per_s = steps / self.seconds
        self.fitted_per_s = (fitted & ~held)[1:].sum() / self.seconds
        self.answered_per_s = fitted[1:].sum() / self.seconds
        self.held_per_s = held[1:].sum() / self.seconds
        self.all_in_contact = bool(fitted.all())
        self.clock_jitter_us = float(np.diff(t_us).std())
        self.lost = int((np.diff(recording["frame"][rows]) - 1).sum()) + int(recording.end.get("dropped_packets", 0))
        fresh = ~held & fitted
        for name in ("read_us", "queue_us", "condition_us", "fit_us", "contact_us"):
            setattr(self, name, float(recording[name][rows][fresh].mean()) if fresh.any() else None)
        times = contact_times_us(f"{path}.usb", "2", zero_us)
        times = times[times[:, 0] >= t_us[0]]
        converted_us = times[:, 0] - (CONVERSION_us[osr] * 105 // 100) // 2 + CONVERSION_us[osr]
        self.offered_us, self.delivered_us = times[:, 1] - converted_us, times[:, 2] - converted_us


def rest_scenario(folder, seconds):
    path = pathlib.Path(folder) / "rest.csv"
    zeros = ",".join("0" for _ in range(7 + 15))
    names = ",".join(["t_s", "contact", "x_mm", "y_mm", "force_N", "p0_Pa", "sigma_mm", "slip", *(f"s{k}_Pa" for k in range(15))])
    path.write_text(f"# fingertip-scenario 1\n# name: rest\n{names}\n0,{zeros}\n{seconds},{zeros}\n")
    return path


def sizes(tools, board):
    """Flash, RAM and stack of an image, by the checks that the tests use."""
    checks = ROOT / "tests/checks"
    with tempfile.TemporaryDirectory() as folder:
        image, stack = pathlib.Path(folder) / "image.json", pathlib.Path(folder) / "stack.json"
        tools.run(sys.executable, checks / "check_image.py", tools.image(board, "elf"), "--json", image)
        tools.run(sys.executable, checks / "stack_usage.py", tools.image(board, "elf"), "--su-dir", tools.boards / board, "--json", stack)
        return json.loads(image.read_text()), json.loads(stack.read_text())


def by_sensors(tools, contact, runs):
    """Rates and latencies that follow for other numbers of sensors, from the cycles of what depends on it."""
    rows = json.loads(tools.run("node", ROOT / "host_tools/report/sensors/sensor_cycles.mjs", tools.boards / "pico_parallel"))
    fifteen = next(row for row in rows if row["sensors"] == 15 and row["kernel"] == "fixed point")
    cycles = lambda row: row["take"] + row["condition"] + row["fit"]
    busy = (1 - contact.sleep_percent / 100) * CLOCK_HZ / contact.frames_per_s
    mux = runs["pico_mux", 256]
    found = []
    for row in rows:
        frame_cycles = busy - cycles(fifteen) + cycles(row)
        # A line for each sensor costs no time; behind multiplexers each is selected and read in turn.
        bus_us = {"parallel": 1e6 / contact.frames_per_s, "mux": 1e6 / mux.frames_per_s + (row["sensors"] - 15) * mux.read_us / 15}
        extra_us = (cycles(row) - cycles(fifteen)) / CLOCK_HZ * 1e6
        found.append({
            **row, "frame_cycles": round(frame_cycles),
            "parallel_fps": min(1e6 / bus_us["parallel"], CLOCK_HZ / frame_cycles),
            "mux_fps": min(1e6 / bus_us["mux"], CLOCK_HZ / (frame_cycles + busy_of_mux(mux, contact))),
            "parallel_latency_us": float(np.median(contact.offered_us)) + extra_us,
            "mux_latency_us": float(np.median(mux.offered_us)) + extra_us + (row["sensors"] - 15) * mux.read_us / 15,
        })
    return sorted(found, key=lambda row: (row["kernel"], row["sensors"]))


def busy_of_mux(mux, contact):
    """Cycles that a frame takes on pico_mux beyond those on pico_parallel."""
    return ((1 - mux.sleep_percent / 100) / mux.frames_per_s - (1 - contact.sleep_percent / 100) / contact.frames_per_s) * CLOCK_HZ


def with_goals(found):
    goals = {}
    for name, sign, limit in GOALS:
        bound = found[limit] if isinstance(limit, str) else limit
        value = found[name]
        met = None if value is None or bound is None else value <= bound if sign == "<=" else value >= bound
        goals[name] = {"goal": f"{sign} {bound:g}" if bound is not None else f"{sign} {limit}", "met": met}
    return {**found, "goals": goals}


def text_of(value):
    if value is None:
        return ""
    return f"{value:.1f}" if isinstance(value, float) else str(value)


def write_csv(path, rows):
    names = list(rows[0])
    write_text(path, "\n".join([",".join(names), *(",".join(text_of(row[name]) for name in names) for row in rows)]) + "\n")


def table_md(rows, names):
    lines = ["| " + " | ".join(names) + " |", "|" + "---|" * len(names)]
    return lines + ["| " + " | ".join(text_of(row[name]) for name in names) + " |" for row in rows]


def write_md(path, found, by_osr, counts):
    lines = ["# Rates and latencies", "", "Written by `sh cmake/bootstrap.sh report`, in emulated time.", "", "| figure | found | goal | met |",
             "|---|---|---|---|"]
    for name, goal in found["goals"].items():
        met = {None: "not measured", True: "yes", False: "NO"}[goal["met"]]
        lines.append(f"| {name} | {text_of(found[name])} | {goal['goal']} | {met} |")
    lines += ["", *__doc__.split("\n\n")[-1].strip().split("\n"), "",
              "Skew between taxels: one command reaches all sensors at once on both boards, so they sample together but for their own",
              "oscillators; on pico_mux it is only the reading that takes its turn.", "", "## By OSR", ""]
    lines += table_md(by_osr, list(by_osr[0]))
    lines += ["", "## By number of sensors, OSR 256", "",
              "Cycles are counted on the emulated chip. Rates: what the bus gives or the processor can, whichever is less; more than 15 lines",
              "take a second state machine. Rectangles have a fixed-point kernel compiled for them; float serves any layout.", ""]
    lines += table_md(counts, list(counts[0]))
    write_text(path, "\n".join(lines) + "\n")


def draw(path, by_osr, counts):
    figure, (rate, sensors) = plt.subplots(1, 2, figsize=(10, 4))
    osrs = sorted(CONVERSION_us)
    rate.plot(osrs, [1e6 / CONVERSION_us[osr] for osr in osrs], color="#b4bac6", lw=1, label="conversion alone")
    for board, colour in zip(BOARDS, ("#1f6fd6", "#d98a1f")):
        rows = [row for row in by_osr if row["board"] == board]
        rate.plot([row["osr"] for row in rows], [row["fitted_per_s"] for row in rows], "o-", color=colour, label=board)
    rate.set(xscale="log", yscale="log", xlabel="OSR", ylabel="fitted frames a second", xticks=osrs, xticklabels=[str(o) for o in osrs])
    rate.minorticks_off()
    for kernel, style in (("fixed point", "o-"), ("float", "s--")):
        rows = [row for row in counts if row["kernel"] == kernel]
        for name, colour in (("parallel", "#1f6fd6"), ("mux", "#d98a1f")):
            sensors.plot([row["sensors"] for row in rows], [row[f"{name}_fps"] for row in rows], style, color=colour,
                         label=f"pico_{name}, {kernel}")
    sensors.set(xlabel="sensors", ylabel="frames a second at OSR 256", yscale="log")
    for axes in (rate, sensors):
        axes.grid(alpha=0.3)
        axes.legend(frameon=False, fontsize=8)
    figure.tight_layout()
    with tempfile.NamedTemporaryFile(suffix=".png") as file:
        figure.savefig(file.name, dpi=120, metadata={"Software": None})
        write_bytes(path, pathlib.Path(file.name).read_bytes())
    plt.close(figure)


def scene_flash(out, scene):
    """Flash of another scene, from the report of the scenes."""
    path = pathlib.Path(out) / "scenes.json"
    if not path.is_file():
        return None
    for row in json.loads(path.read_text())["rows"]:
        if row["scene"] == scene and row["board"] == BOARDS[0]:
            return row["flash_bytes"]
    return None


def measure(tools, options, out):
    with tempfile.TemporaryDirectory() as folder:
        longest = FROM_s + options.seconds
        wander = pathlib.Path(folder) / "wander.csv"
        tools.run(sys.executable, ROOT / "host_tools/python/scenario.py", "wander", "-o", wander, "--seconds", f"{longest + 1:g}")
        rest = rest_scenario(folder, longest + 1)
        short = min(options.seconds, 4)
        plan = {("pico_parallel", 256): options.seconds, ("pico_parallel", 1024): short, ("pico_mux", 256): short, ("pico_mux", 1024): short}
        if not options.quick:
            for board in BOARDS:
                for osr in CONVERSION_us:
                    plan.setdefault((board, osr), 2 if osr < 4096 else short)
        with concurrent.futures.ThreadPoolExecutor(2) as pool:
            jobs = {key: pool.submit(Measurement, tools, folder, *key, wander, seconds) for key, seconds in plan.items()}
            resting = pool.submit(Measurement, tools, folder, "pico_parallel", 256, rest, short)
            runs = {key: job.result() for key, job in jobs.items()}
            return runs, resting.result()


def main(argv):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", required=True, help="host build folder")
    parser.add_argument("--boards", default="build", help="folder of the boards' builds; default build")
    parser.add_argument("-o", "--out", required=True, metavar="FOLDER")
    parser.add_argument("--plot", metavar="FILE.png", help="another copy of rate.png")
    parser.add_argument("--seconds", type=float, default=30, help="emulated, of the longest run; default 30")
    parser.add_argument("--quick", action="store_true", help="OSR 256 and 1024 only")
    parser.add_argument("--check", action="store_true", help="exit with 1 if a goal is missed")
    options = parser.parse_args(argv)
    if not 1 <= options.seconds <= 600:
        raise InputError(f"--seconds {options.seconds:g} is out of range; give 1 to 600")
    out = pathlib.Path(options.out)
    out.mkdir(parents=True, exist_ok=True)
    if options.plot:
        check_output(options.plot)
    tools = Tools(options.build, options.boards)
    runs, resting = measure(tools, options, out)
    parallel = runs["pico_parallel", 256]
    image, stack = sizes(tools, "pico_parallel")
    found = with_goals({
        "parallel_fps_osr256": parallel.fitted_per_s, "parallel_fps_osr1024": runs["pico_parallel", 1024].answered_per_s,
        "parallel_fresh_fps_osr1024": runs["pico_parallel", 1024].fitted_per_s,
        "mux_fps_osr256": runs["pico_mux", 256].fitted_per_s, "mux_fps_osr1024": runs["pico_mux", 1024].fitted_per_s,
        "latency_parallel_us": float(parallel.offered_us.max()), "latency_parallel_median_us": float(np.median(parallel.offered_us)),
        "delivery_parallel_us": float(parallel.delivered_us.max()),
        "clock_jitter_us": parallel.clock_jitter_us,
        "skew_us": 0,
        "idle_sleep_percent": resting.sleep_percent, "contact_sleep_percent": parallel.sleep_percent,
        "flash_bytes": image["flash_bytes"], "ram_bytes": image["constants_in_sram_bytes"] + image["variables_bytes"] + stack["worst_bytes"],
        "code_in_sram_bytes": image["code_in_sram_bytes"], "stack_bytes": stack["worst_bytes"],
        "raw_flash_bytes": scene_flash(out, "raw"), "half_flash_bytes": image["flash_bytes"] // 2,
        "dropped": parallel.lost, "seconds": parallel.seconds, "every_frame_in_contact": parallel.all_in_contact,
    })
    by_osr = [{
        "board": board, "osr": osr, "frames_per_s": run.frames_per_s, "fitted_per_s": run.fitted_per_s, "held_per_s": run.held_per_s,
        "sleep_percent": run.sleep_percent, "read_us": run.read_us, "condition_us": run.condition_us, "fit_us": run.fit_us,
        "offered_median_us": float(np.median(run.offered_us)), "offered_max_us": float(run.offered_us.max()),
        "delivered_median_us": float(np.median(run.delivered_us)), "delivered_max_us": float(run.delivered_us.max()),
    } for (board, osr), run in sorted(runs.items(), key=lambda item: (BOARDS.index(item[0][0]), item[0][1]))]
    counts = by_sensors(tools, parallel, runs)
    write_text(out / "rate.json", json.dumps(found, indent=2) + "\n")
    write_csv(out / "rate.csv", by_osr)
    write_csv(out / "sensors.csv", counts)
    write_md(out / "rate.md", found, by_osr, counts)
    draw(out / "rate.png", by_osr, counts)
    if options.plot:
        write_bytes(options.plot, (out / "rate.png").read_bytes())
    for name, goal in found["goals"].items():
        verdict = {None: "-", True: "ok", False: "MISSED"}[goal["met"]]
        print(f"{verdict:7s} {name:28s} {text_of(found[name]):>12s}   goal {goal['goal']}")
    print(f"report: {out / 'rate.json'}, {out / 'rate.md'}, {out / 'rate.png'}")
    missed = any(goal["met"] is False for goal in found["goals"].values())
    return 1 if options.check and missed else 0


if __name__ == "__main__":
    sys.exit(run_tool("rate.py", main))
