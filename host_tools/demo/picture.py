#!/usr/bin/python3
"""Draws the monitor's screen while it replays a recording as a PNG, with --until as one that moves (APNG).

    picture.py RECORDING.csv -o FILE.png [--device SERIAL] [--at S] [--until S [--every S]] [--size COLUMNSxROWS] [--tool PATH]

The picture in the README of the project is that of the first touch of the calibrated fingertip in the demo:

    sh cmake/bootstrap.sh demo
    build/host/host_tools/tool/cli/fingertip convert build/demo/recording.csv build/demo/rubber.csv --device 000000000000B0BB
    /usr/bin/python3 host_tools/demo/picture.py build/demo/rubber.csv --at 0.9 --until 4.3 -o host_tools/demo/monitor.png

That of a lift in host_tools/README.md is of the firmware on the host:

    cd build/host/host_tools
    simulation/twin/twin scenario lift --seconds 20 --force 6 --tangential 0.35,-40 --effects gain=2 --seed 5 -o lift_scenario.csv
    simulation/player/fingertip_player play lift_scenario.csv -o lift.csv --raw --pad 12 --rate 200
    /usr/bin/python3 ../../../host_tools/demo/picture.py lift.csv --at 17.2 -o ../../../host_tools/demo/lift.png

So is that of a grasp there, recorded for seven seconds by the commands of host_tools/simulation/cell/README.md:

    /usr/bin/python3 host_tools/demo/picture.py grasp.csv --at 0.6 --until 5.4 --every 0.2 -o host_tools/demo/grasp_screen.png
"""

import copy
import fcntl
import io
import os
import pathlib
import pty
import re
import select
import struct
import sys
import termios
import time

import matplotlib
import pyte
from PIL import Image, ImageDraw, ImageFont

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "host_tools/python"))
from fingertip.command import Parser, check_output, run_tool  # noqa: E402
from fingertip.files import InputError, write_bytes  # noqa: E402

PATIENCE_s = 120
SPEED = 8  # times the recorded one, to save time
STEPS_PER_s = 12  # of a monitor that replays, at least: so it shows each step of a picture that moves
SLOWEST = 1 / 16  # times the recorded speed: a busy machine shows fewer steps a second
TENTH_s = 0.1  # resolution of the time in the monitor's last line
NEAR_s = 0.5  # of one screen to the time that was asked for
LAST_s = 1.5  # the last screen stays longer by this
WIDTH, HEIGHT = 8, 16  # of a cell
BACKGROUND, FOREGROUND = "#0c0d16", "#dededf"
COLOURS = 64  # of all screens together
BRAILLE = 0x2800
PLACES = [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2), (0, 3), (1, 3)]  # of a braille character's dots, by bit
FONTS = pathlib.Path(matplotlib.get_data_path()) / "fonts/ttf"


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


def image(screen, fonts):
    picture = Image.new("RGB", (screen.columns * WIDTH, screen.lines * HEIGHT), BACKGROUND)
    draw = ImageDraw.Draw(picture)
    for row in range(screen.lines):
        for column in range(screen.columns):
            cell = screen.buffer[row][column]
            x, y, ink = column * WIDTH, row * HEIGHT, FOREGROUND if cell.fg == "default" else f"#{cell.fg}"
            if cell.bg != "default":
                draw.rectangle((x, y, x + WIDTH - 1, y + HEIGHT - 1), fill=f"#{cell.bg}")
            dots = ord(cell.data[0]) - BRAILLE if cell.data else -1
            if cell.data in ("\u2580", "\u2584"):  # half blocks
                top = y + (HEIGHT // 2 if cell.data == "\u2584" else 0)
                draw.rectangle((x, top, x + WIDTH - 1, top + HEIGHT // 2 - 1), fill=ink)
            elif 0 <= dots < 256:
                for i, j in (place for bit, place in enumerate(PLACES) if dots >> bit & 1):
                    draw.rectangle((x + 1 + 4 * i, y + 1 + 4 * j, x + 2 + 4 * i, y + 2 + 4 * j), fill=ink)
            elif cell.data.strip():
                draw.text((x, y), cell.data, font=fonts[cell.bold], fill=ink)
    return picture


def png(screens, every_s):
    """The bytes of a PNG; several screens repeat for ever; viewers of still pictures show the middle one."""
    fonts = {bold: ImageFont.truetype(str(FONTS / f"DejaVuSansMono{'-Bold' if bold else ''}.ttf"), 13) for bold in (False, True)}
    pictures = [image(screen, fonts) for screen in screens]
    together = Image.new("RGB", (pictures[0].width, sum(picture.height for picture in pictures)))
    for i, picture in enumerate(pictures):
        together.paste(picture, (0, i * picture.height))
    palette = together.quantize(COLOURS, dither=Image.Dither.NONE)
    drawn = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    durations_ms = [round(1000 * every_s)] * (len(drawn) - 1) + [round(1000 * (every_s + LAST_s))]
    moving = {"save_all": True, "append_images": drawn, "duration": durations_ms, "loop": 0, "default_image": True} if drawn[1:] else {}
    out = io.BytesIO()
    drawn[len(drawn) // 2].save(out, format="PNG", optimize=True, **moving)
    return out.getvalue()


def main(argv):
    parser = Parser(description=__doc__)
    parser.add_argument("recording", metavar="RECORDING.csv")
    parser.add_argument("-o", "--output", required=True, metavar="FILE.png")
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
    if not options.output.endswith(".png"):
        raise InputError(f"{options.output}: give a name that ends in .png")
    if options.until is not None and not (options.every >= TENTH_s and options.until > options.at):
        raise InputError("--until has to be later than --at, and --every at least 0.1")
    check_output(options.output, options.recording)
    replay = [options.tool, "replay", os.path.relpath(options.recording), *(["--device", options.device] if options.device else [])]
    times_s, near_s, speed = [options.at], NEAR_s, SPEED
    if options.until is not None:
        times_s = [options.at + i * options.every for i in range(1 + int((options.until - options.at) / options.every))]
        near_s, speed = options.every, options.every * STEPS_PER_s
    write_bytes(options.output, png(replayed(replay, int(size[1]), int(size[2]), times_s, near_s, speed), options.every))
    return 0


if __name__ == "__main__":
    sys.exit(run_tool("picture.py", main))
