"""A value change dump of lines, as the emulator writes it."""

import re


def read_vcd(path):
    """name -> list of (t_ns, level), the first being the level at the beginning."""
    names, changes, t_ns = {}, {}, None
    for line in path.read_text().splitlines():
        if match := re.fullmatch(r"\$var wire 1 (\S) (\S+) \$end", line):
            names[match[1]] = match[2]
            changes[match[2]] = []
        elif line.startswith("#"):
            t_ns = int(line[1:])
        elif line[:1] in "01" and line[1:] in names:
            changes[names[line[1:]]].append((t_ns, int(line[0])))
    return changes
