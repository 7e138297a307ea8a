"""Names that the programs of line.toml share."""

MADE_BY = "written by firmware/wire/line.py from line.toml; change it there"
SETS = {"flags": "Flag", "streams": "Streams", "capabilities": "Capability", "stored": "Stored"}
# What a C++ header begins with: what it is about, what it includes, its namespace.
HPP_HEAD = """/* {made_by}.
 *
 * {about} */
#pragma once

#include "libfingertip/wire.hpp"

{includes}

namespace {namespace} {{
"""


def hpp_head(about, includes, namespace):
    lines = "\n".join(f"#include <{name}>" for name in includes)
    return HPP_HEAD.format(made_by=MADE_BY, about=about, includes=lines, namespace=namespace).split("\n")
