#!/usr/bin/env python3
"""Checks that an image has what its scene switches on, and no symbol of what it switches off.

usage: check_scene.py IMAGE.elf --build FOLDER --capabilities NAME...

A capability owns the symbols that its sources define, as the objects in the build folder have them, and those of its packets
and commands. Exit 1 and one line for the first thing that is wrong.
"""

import argparse
import pathlib
import re
import subprocess

from elf import Elf, fail

# Objects below firmware/CMakeFiles, and names of other symbols.
OWNED = {
    "FIT": (
        ["ft_fit.dir/fit/*.obj", "ft_app.dir/app/location_stage.c.obj"],
        r"wire_contact_\w+|contact_scale_force|cmd_(calibrate|prior|location_limit)_\w+",
    ),
    "SLIP": (["ft_contact.dir/contact/slip.c.obj"], r"contact_update|cmd_slip_\w+"),
    "FULL_GRID": (["ft_fit.dir/fit/fit_grid.c.obj"], r"fit_grid"),
    "OUTLIERS": ([], r"fit_grid_outlier|leave_outlier_out|fit_gaussian_grid_update"),
    "TANGENTIAL_BIAS": (
        ["ft_fit.dir/fit/fit_bias.c.obj", "ft_fit.dir/fit/fit_gains.c.obj", "ft_app.dir/app/uncertainty_stage.c.obj"],
        r"fit_(bias|gains)_\w+",
    ),
    "SHAPES": (
        ["ft_fit.dir/fit/fit_shapes*.obj", "ft_contact.dir/contact/shapes.c.obj", "ft_app.dir/app/shapes_stage.c.obj"],
        r"fit_shapes\w*",
    ),
    "TANGENTIAL": (
        [
            "ft_fit.dir/fit/fit_tangential*.obj",
            "ft_contact.dir/contact/tangential.c.obj",
            "ft_app.dir/app/jobs.c.obj",
            "ft_app.dir/app/tangential_stage.c.obj",
        ],
        r"store_put_profile|cmd_(pad|erase_pad)_\w+",
    ),
    "RAW_STREAM": ([], r"wire_raw_\w+"),
    "SYNC": (["ft_app.dir/app/sync.c.obj"], r"sync|sync_pin|numbers|times_us|port_sync_\w+|(wire|cmd)_sync_\w+"),
}


def symbols_of(objects):
    try:
        lines = subprocess.run(["arm-none-eabi-nm", "--defined-only", *objects], check=True, capture_output=True, text=True).stdout
    except (OSError, subprocess.CalledProcessError) as error:
        fail(f"arm-none-eabi-nm: {error}")
    return {name for name in re.findall(r"(?m)^[0-9a-f]+ \w (\S+)$", lines) if not name.startswith(("$", "."))}


def defined_in(build, patterns):
    """Symbols of these objects; not names of functions of a file that another file has too."""
    folder = pathlib.Path(build) / "firmware/CMakeFiles"
    owned = set()
    for pattern in patterns:
        objects = set(folder.glob(pattern))
        if not objects:
            fail(f"{build}: no objects {pattern}; build the image there first")
        owned |= objects
    others = set(folder.glob("**/*.obj")) - owned
    return symbols_of(owned) - (symbols_of(others) if others else set()) if owned else set()


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("elf")
    parser.add_argument("--build", required=True, help="build folder of the image")
    parser.add_argument("--capabilities", required=True, nargs="+", choices=OWNED, help="those that are on")
    args = parser.parse_args()

    names = {symbol.name for symbol in Elf(args.elf).symbols if not symbol.is_file}
    for capability, (objects, pattern) in OWNED.items():
        owned = defined_in(args.build, objects)
        there = sorted(name for name in names if name in owned or re.fullmatch(pattern, name))
        if capability in args.capabilities and not there:
            fail(f"{args.elf}: {capability} is on, but the image has no symbol of it")
        if capability not in args.capabilities and there:
            fail(f"{args.elf}: {capability} is off, but the image has {there[0]}; find who calls it in the map file")
        print(f"{capability:12} {'on ' if capability in args.capabilities else 'off'} {len(there):4} symbols")


if __name__ == "__main__":
    main()
