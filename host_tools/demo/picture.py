#!/usr/bin/python3
"""Draws the monitor's screen while it replays a recording: as an SVG, or as a PNG that moves (APNG).

    picture.py RECORDING.csv -o FILE.svg [--device SERIAL] [--at S] [--size COLUMNSxROWS] [--tool PATH]
    picture.py RECORDING.csv -o FILE.png --until S [--every S] ...

The picture in the README of the project is that of the first touch of the calibrated fingertip in the demo. The replay shows its S in the last line:

    sh cmake/bootstrap.sh demo
    /usr/bin/python3 host_tools/demo/picture.py build/demo/recording.csv --device 000000000000B0BB --at S --until S -o host_tools/demo/monitor.png

That of a lift in host_tools/README.md is of the firmware on the host:

    cd build/host/host_tools
    simulation/twin/twin scenario lift --seconds 20 --force 6 --tangential 0.35,-40 --gain 2 --seed 5 -o lift_scenario.csv
    simulation/player/fingertip_player play lift_scenario.csv -o lift.csv --raw --pad 12 --rate 200
    /usr/bin/python3 ../../../host_tools/demo/picture.py lift.csv --at 17.2 -o ../../../host_tools/demo/lift.svg
"""

import argparse
import copy
import fcntl
import html
import os
import pathlib
import pty
import re
import select
import struct
import sys
import termios
import time

import pyte

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "host_tools/python"))
import moving  # noqa: E402
from fingertip.files import InputError, check_output, run_tool, write_bytes, write_text  # noqa: E402

PATIENCE_s = 120
SPEED = 8  # times the recorded one, to save time
STEPS_PER_s = 12  # of a monitor that replays, at least: so it shows each step of a picture that moves
SLOWEST = 1 / 16  # times the recorded speed: a busy machine shows fewer steps a second
TENTH_s = 0.1  # resolution of the time in the monitor's last line
NEAR_s = 0.5  # of one screen to the time that was asked for
WIDTH, HEIGHT, BACKGROUND, FOREGROUND = moving.WIDTH, moving.HEIGHT, moving.BACKGROUND, moving.FOREGROUND


def screens_at(command, columns, rows, times_s):
    """The screens at these times, which rise, by the time in their last line; and how late the latest was, s."""
    pid, terminal = pty.fork()
    if pid == 0:
        time.sleep(0.1)  # until the terminal has its size
        environment = {k: v for k, v in os.environ.items() if k != "NO_COLOR"}
        os.execve(command[0], command, {**environment, "TERM": "xterm", "COLORTERM": "truecolor", "LC_ALL": "C.UTF-8"})
    fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
    screen = pyte.Screen(columns, rows)
    stream = pyte.ByteStream(screen)
    found, late_s, end = [], 0.0, time.monotonic() + PATIENCE_s
    try:
        while time.monotonic() < end:
            if not select.select([terminal], [], [], 0.1)[0]:
                continue
            try:
                output = os.read(terminal, 65536)
            except OSError:
                break
            for part in re.split(rb"(?<=\x1b\[\?2026l)", output):
                stream.feed(part)
                shown = re.search(r"at (\d+\.\d) s of ", screen.display[-1])
                if not part.endswith(b"\x1b[?2026l") or not shown:
                    continue
                tenths = round(float(shown.group(1)) / TENTH_s)
                while len(found) < len(times_s) and tenths >= round(times_s[len(found)] / TENTH_s):
                    late_s = max(late_s, TENTH_s * (tenths - round(times_s[len(found)] / TENTH_s)))
                    found.append(copy.deepcopy(screen))
                if len(found) == len(times_s):
                    os.write(terminal, b"q")
                    return found, late_s
    finally:
        os.close(terminal)
        os.waitpid(pid, 0)
    raise InputError(f"the monitor never came to {times_s[len(found)]:g} s; its last line: {screen.display[-1].strip()}")


def replayed(replay, columns, rows, times_s, near_s, speed):
    """A screen for each of these times, none later by near_s: more slowly where the machine is too busy for that."""
    while speed >= SLOWEST:
        found, late_s = screens_at([*replay, "--speed", f"{speed:g}"], columns, rows, times_s)
        if late_s < near_s - TENTH_s / 2:
            return found
        speed /= 2
    raise InputError(f"this machine is too busy to show each time within {near_s:g} s")


def screen_at(replay, columns, rows, at_s):
    return replayed(replay, columns, rows, [at_s], NEAR_s, SPEED)[0]


def shapes(column, row, cell):
    """A cell's character where it is better drawn than written."""
    x, y, ink = column * WIDTH, row * HEIGHT, moving.colour(cell.fg, FOREGROUND)
    if cell.data in "▀▄":
        return [f'<rect x="{x}" y="{y + (HEIGHT // 2 if cell.data == "▄" else 0)}" width="{WIDTH}" height="{HEIGHT // 2}" fill="{ink}"/>']
    dots = moving.dots(cell)
    return dots if dots is None else [f'<circle cx="{x + i}" cy="{y + j}" r="1.4" fill="{ink}"/>' for i, j in dots]


def svg(screen):
    columns, rows = screen.columns, screen.lines
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {columns * WIDTH + 16} {rows * HEIGHT + 16}">',
        f'<rect width="100%" height="100%" rx="8" fill="{BACKGROUND}"/>',
        '<g transform="translate(8 8)" shape-rendering="crispEdges" font-family="DejaVu Sans Mono, Menlo, Consolas, monospace" font-size="13">',
    ]
    marks, texts = [], []
    for row in range(rows):
        cells = [screen.buffer[row][column] for column in range(columns)]
        start = 0
        while start < columns:  # backgrounds, as long as they stay the same
            end = start
            while end < columns and cells[end].bg == cells[start].bg:
                end += 1
            if cells[start].bg != "default":
                out.append(
                    f'<rect x="{start * WIDTH}" y="{row * HEIGHT}" width="{(end - start) * WIDTH}" height="{HEIGHT}" '
                    f'fill="{moving.colour(cells[start].bg, BACKGROUND)}"/>'
                )
            start = end
        column = 0
        while column < columns:
            cell = cells[column]
            drawn = shapes(column, row, cell)
            if drawn is not None or cell.data in " ":
                marks += drawn or []
                column += 1
                continue
            end = column  # a word of one style
            while (
                end < columns
                and cells[end].data != " "
                and shapes(end, row, cells[end]) is None
                and (cells[end].fg, cells[end].bold) == (cell.fg, cell.bold)
            ):
                end += 1
            word = "".join(each.data for each in cells[column:end])
            weight = ' font-weight="bold"' if cell.bold else ""
            texts.append(
                f'<text x="{column * WIDTH}" y="{row * HEIGHT + 12}" textLength="{(end - column) * WIDTH}" '
                f'fill="{moving.colour(cell.fg, FOREGROUND)}"{weight}>{html.escape(word)}</text>'
            )
            column = end
    return "\n".join([*out, *marks, '<g shape-rendering="auto">', *texts, "</g></g>", "</svg>"]) + "\n"


def main(argv):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recording", metavar="RECORDING.csv")
    parser.add_argument("-o", "--output", required=True, metavar="FILE")
    parser.add_argument("--device", metavar="SERIAL", help="one of several fingertips in the recording")
    parser.add_argument("--at", type=float, default=0.0, metavar="S", help="time in the recording")
    parser.add_argument("--until", type=float, metavar="S", help="and where a picture that moves ends")
    parser.add_argument("--every", type=float, default=0.1, metavar="S", help="time between its screens; default 0.1")
    parser.add_argument("--size", default="110x32", metavar="COLUMNSxROWS")
    parser.add_argument("--tool", default=str(ROOT / "build/host/host_tools/tool/cli/fingertip"), metavar="PATH")
    options = parser.parse_args(argv)
    size = re.fullmatch(r"(\d+)x(\d+)", options.size)
    if not size:
        raise InputError(f"--size {options.size}: give COLUMNSxROWS, as 110x32")
    moves = options.until is not None
    if not options.output.endswith(".png" if moves else ".svg"):
        raise InputError(f"{options.output}: give a name that ends in .svg; with --until one that ends in .png")
    if moves and not (options.every >= TENTH_s and options.until > options.at):
        raise InputError("--until has to be later than --at, and --every at least 0.1")
    check_output(options.output, options.recording)
    replay = [options.tool, "replay", os.path.relpath(options.recording), *(["--device", options.device] if options.device else [])]
    columns, rows = int(size[1]), int(size[2])
    if moves:
        times_s = [options.at + i * options.every for i in range(1 + int((options.until - options.at) / options.every))]
        write_bytes(
            options.output, moving.png(replayed(replay, columns, rows, times_s, options.every, options.every * STEPS_PER_s), options.every)
        )
    else:
        write_text(options.output, svg(screen_at(replay, columns, rows, options.at)))
    return 0


if __name__ == "__main__":
    sys.exit(run_tool("picture.py", main))
