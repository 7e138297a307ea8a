#!/usr/bin/python3
"""What a logic analyser on the sensor bus of a good board shows, from its start on: pictures for boards/BRINGUP.md.

    traces.py --boards build -o boards

    BOARD/traces.png    the start by transactions, the first command, a frame, and one byte close

The release images run in the emulator, whose dump of the lines this is: nothing here was measured on a board. A level is high
from 0.7 VDD on.
"""

import argparse
import csv
import pathlib
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "host_tools/report/shared"), str(ROOT / "host_tools/python")]
from boards import BOARDS, DESCRIPTORS, TO_BUILD, image_of  # noqa: E402
from presentation import BLUE, FAINT, GOAL, INK, ORANGE, plt, save  # noqa: E402
from emulated import scenario  # noqa: E402
from fingertip.command import InputError, run_tool  # noqa: E402
from reporting import run  # noqa: E402
from vcd import read_vcd  # noqa: E402

SECONDS = 0.08
SENSOR = "0x76"
# First byte of a write to a sensor (MS5840-02BA datasheet, commands)
RESET, PROM, READ = "1e", "a", "00"
KINDS = (("multiplexers", FAINT), ("reset", GOAL), ("calibration (PROM)", ORANGE), ("convert", INK), ("read the result", BLUE))
# UM10204 table 10, fast mode: ns
BYTE_TIMES = (("low", 1300), ("high", 600), ("period", 2500))


class Trace:
    def __init__(self, boards, board, folder):
        image, base = image_of(boards, board), pathlib.Path(folder) / board
        if not image.is_file():
            raise InputError(f"{image}: is not there; {TO_BUILD}")
        options = {"board": board, "image": image, "scenario": scenario(folder, "rest", 1, board), "seconds": SECONDS + 0.001}
        options |= {"vcd": f"{base}.vcd", "vcd-to": SECONDS, "bus-log": f"{base}.csv", "report": f"{base}.json"}
        words = [word for name, value in options.items() for word in (f"--{name}", value)]
        run("node", ROOT / "host_tools/simulation/emulator/main.mjs", "--fast-enumeration", *words)
        self.board = board
        last = DESCRIPTORS[board]["wiring"]["sensor_count"] - 1
        data = [f"SDA{k}" for k in (0, last // 2, last)] if DESCRIPTORS[board]["bus"] == "parallel" else ["SDA"]
        self.lines = ["SCL", *data]  # that are drawn
        self.levels = read_vcd(base.with_suffix(".vcd"))
        self.transactions = []
        with open(f"{base}.csv", newline="") as file:
            rows = [row for row in csv.DictReader(file) if data[0] in ("SDA", row["muxes"])]
        kind = None
        for row in rows:
            if row["address"] != SENSOR:
                what = 0
            elif row["rw"] == "w":
                byte = row["bytes"][:2]
                what = kind = 1 if byte == RESET else 2 if byte[0] == PROM else 4 if byte == READ else 3
            else:
                what = kind
            self.transactions.append((int(row["start_ns"]), int(row["end_ns"]), what, row))

    def commands(self, kind):
        """Those that command the sensors to do so."""
        return [at for at in self.transactions if at[2] == kind and at[3]["rw"] == "w"]

    def frame(self):
        """From one command to convert to the next, when there has been a temperature."""
        begins = [at[0] for at in self.commands(3)]
        return begins[-2], begins[-1]


def label(row):
    bytes_ = " ".join(row["bytes"][i : i + 2] for i in range(0, len(row["bytes"]), 2))
    return f"{row['address']} {row['rw'].upper()} {bytes_}"


def draw_lines(axes, trace, from_ns, to_ns, unit_ns, unit):
    names = trace.lines
    for i, name in enumerate(reversed(names)):
        changes = [change for change in trace.levels[name] if change[0] < to_ns]
        first = sum(t_ns <= from_ns for t_ns, _ in changes) - 1
        times_ns = [from_ns, *(t_ns for t_ns, _ in changes[first + 1 :]), to_ns]
        levels = [1.4 * i + level for _, level in [*changes[first:], changes[-1]]]
        colour = ORANGE if name == "SCL" else BLUE
        axes.plot([(t_ns - from_ns) / unit_ns for t_ns in times_ns], levels, drawstyle="steps-post", color=colour, lw=0.8)
    axes.set_yticks([1.4 * i + 0.5 for i in range(len(names))], list(reversed(names)))
    axes.set(xlim=(0, (to_ns - from_ns) / unit_ns), xlabel=f"{unit} from {from_ns / 1e6:.2f} ms after power-on")


def draw_labels(axes, trace, from_ns, to_ns, unit_ns):
    for begin, end, _, row in trace.transactions:
        if begin >= from_ns and end <= to_ns:
            at = ((begin + end) / 2 - from_ns) / unit_ns
            axes.annotate(label(row), (at, 1.01), xycoords=("data", "axes fraction"), ha="center", fontsize=7)


def draw_start(axes, trace):
    for begin, end, kind, _ in trace.transactions:
        axes.broken_barh([(begin / 1e6, max(end - begin, 6e4) / 1e6)], (kind - 0.4, 0.8), color=KINDS[kind][1])
    axes.set_yticks(range(len(KINDS)), [name for name, _ in KINDS])
    axes.set(xlim=(0, 1000 * SECONDS), ylim=(-0.6, len(KINDS) - 0.4), xlabel="ms after power-on", title="The start, by transactions")
    axes.invert_yaxis()


def draw_command(axes, trace):
    begin, end = trace.transactions[0][0] - 10e3, trace.commands(1)[0][1] + 10e3
    draw_lines(axes, trace, begin, end, 1e3, "us")
    draw_labels(axes, trace, begin, end, 1e3)
    axes.set_title("The first command: reset, to all sensors at once", pad=16)


def draw_frame(axes, trace):
    begin, end = trace.frame()
    draw_lines(axes, trace, begin - 20e3, end - 20e3, 1e6, "ms")
    read = trace.commands(4)
    first = next(at for at in read if at[0] > begin)
    axes.axvspan((trace.commands(3)[-2][1] - begin + 20e3) / 1e6, (first[0] - begin + 20e3) / 1e6, color=FAINT, alpha=0.15, lw=0)
    axes.set_title("A frame: convert, wait (grey), read all", pad=16)


def draw_byte(axes, trace):
    """The address byte of the first transaction, and its shortest times beside what fast mode allows."""
    scl = [(t, v) for t, v in trace.levels["SCL"] if t >= trace.transactions[0][0]]
    falls = [t for t, v in scl if v == 0][:10]
    rises = [t for t, v in scl if v == 1][:9]
    draw_lines(axes, trace, trace.transactions[0][0] - 2e3, falls[9] + 1e3, 1e3, "us")
    found = {
        "low": min(r - f for f, r in zip(falls, rises)),
        "high": min(f - r for f, r in zip(falls[1:], rises)),
        "period": min(b - a for a, b in zip(falls, falls[1:])),
    }
    times = ", ".join(f"{name} {found[name] / 1e3:.2f} us (at least {least / 1e3:.1f})" for name, least in BYTE_TIMES)
    axes.set_title(f"Its first byte. SCL, with the rise: {times}", pad=8)
    return found


def draw(trace, path):
    figure, axes = plt.subplots(4, 1, figsize=(11, 10))
    draw_start(axes[0], trace)
    draw_command(axes[1], trace)
    draw_frame(axes[2], trace)
    found = draw_byte(axes[3], trace)
    figure.suptitle(f"{trace.board}: emulated, no board was measured", color=INK)
    figure.tight_layout()
    save(figure, path)
    return found


def main(argv):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--boards", required=True, metavar="DIR", help="folder of the boards' builds")
    parser.add_argument("-o", "--output", required=True, metavar="DIR", help="folder of the boards")
    options = parser.parse_args(argv)
    out = pathlib.Path(options.output)
    with tempfile.TemporaryDirectory() as folder:
        for board in BOARDS:
            path = out / board / "traces.png"
            found = draw(Trace(options.boards, board, folder), path)
            print(f"{path}: SCL " + ", ".join(f"{name} {value:.0f} ns" for name, value in found.items()))
    return 0


if __name__ == "__main__":
    sys.exit(run_tool("traces.py", main))
