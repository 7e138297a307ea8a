"""Screens of a terminal as a PNG that moves, and the drawing of a cell."""

import io
import pathlib

import matplotlib
from PIL import Image, ImageDraw, ImageFont

WIDTH, HEIGHT = 8, 16  # of a cell
BACKGROUND, FOREGROUND = "#0c0d16", "#dededf"
COLOURS = 64  # of all screens together
LAST_s = 1.5  # the last screen stays longer by this
BRAILLE = 0x2800
PLACES = [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2), (0, 3), (1, 3)]  # of a braille character's dots, by bit
FONTS = pathlib.Path(matplotlib.get_data_path()) / "fonts/ttf"


def colour(name, default):
    return default if name == "default" else f"#{name}"


def dots(cell):
    """[(x, y)] of a braille character's dots, None of another one."""
    bits = ord(cell.data[0]) - BRAILLE if cell.data else -1
    return [(2 + 4 * i, 2 + 4 * j) for bit, (i, j) in enumerate(PLACES) if bits >> bit & 1] if 0 <= bits < 256 else None


def image(screen, fonts):
    picture = Image.new("RGB", (screen.columns * WIDTH, screen.lines * HEIGHT), BACKGROUND)
    draw = ImageDraw.Draw(picture)
    for row in range(screen.lines):
        for column in range(screen.columns):
            cell = screen.buffer[row][column]
            x, y, ink = column * WIDTH, row * HEIGHT, colour(cell.fg, FOREGROUND)
            if cell.bg != "default":
                draw.rectangle((x, y, x + WIDTH - 1, y + HEIGHT - 1), fill=colour(cell.bg, BACKGROUND))
            there = dots(cell)
            if cell.data in ("\u2580", "\u2584"):  # half blocks
                top = y + (HEIGHT // 2 if cell.data == "\u2584" else 0)
                draw.rectangle((x, top, x + WIDTH - 1, top + HEIGHT // 2 - 1), fill=ink)
            elif there is not None:
                for i, j in there:
                    draw.rectangle((x + i - 1, y + j - 1, x + i, y + j), fill=ink)
            elif cell.data.strip():
                draw.text((x, y), cell.data, font=fonts[cell.bold], fill=ink)
    return picture


def png(screens, every_s):
    """The bytes of an APNG that repeats the screens for ever."""
    fonts = {bold: ImageFont.truetype(str(FONTS / f"DejaVuSansMono{'-Bold' if bold else ''}.ttf"), 13) for bold in (False, True)}
    pictures = [image(screen, fonts) for screen in screens]
    together = Image.new("RGB", (pictures[0].width, sum(picture.height for picture in pictures)))
    for i, picture in enumerate(pictures):
        together.paste(picture, (0, i * picture.height))
    palette = together.quantize(COLOURS, dither=Image.Dither.NONE)
    frames = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    durations_ms = [round(1000 * every_s)] * (len(frames) - 1) + [round(1000 * (every_s + LAST_s))]
    out = io.BytesIO()
    frames[0].save(out, format="PNG", save_all=True, append_images=frames[1:], duration=durations_ms, loop=0, optimize=True)
    return out.getvalue()
