#!/usr/bin/env python3
"""Worst-case use of the main stack of a linked RP2040 image.

usage: stack_usage.py IMAGE.elf --su-dir FOLDER... [--indirect FILE] [--of FUNCTION...] [--limit BYTES] [--json FILE]

Frames come from the compiler (GCC's -fstack-usage files below the folders, which hold nothing but what the image may be linked from); of
functions that it did not compile, from the disassembly, as the sum of all that they push. Calls are read from the linked code, because only
there library functions and tail calls can be seen; a tail call counts as a call. Calls through pointers are resolved by a table
(indirect_calls.txt tells its form). A call that the table does not resolve, recursion, and a frame of unknown size fail.

A handler is interrupted only by one of higher priority, as the table rp2040_irq_priorities has them, so at most one of each priority runs
on top of the main program: worst case = start-up and main + for each priority an exception frame and its deepest handler. A fault can come
on top, but it ends in a reset. With --of: what each of these functions needs, from its call on, and no more.

The exception frame has 32 bytes, and 4 more when the stack must be aligned (ARMv6-M B1.5.7).
"""

import argparse
import bisect
import json
import pathlib
import re
import struct
import subprocess

from elf import Elf, fail

EXCEPTION_FRAME_BYTES = 32 + 4
RETURNS = ("lr",)


class Function:
    def __init__(self, name, start):
        self.name = name
        self.names = {name}
        self.start = start
        self.pushed = 0
        self.frame = None
        self.unknown_frame_at = None
        self.callees = set()
        self.indirect_at = []
        self.external = 0
        self.starts_over = False


def read_functions(elf):
    functions = {}
    for s in elf.symbols:
        if s.is_function:
            start = s.value & ~1
            if start in functions:
                functions[start].names.add(s.name)
            else:
                functions[start] = Function(s.name, start)
    return functions


def disassemble(path, functions):
    try:
        call = ["arm-none-eabi-objdump", "-d", "--no-show-raw-insn", path]
        lines = subprocess.run(call, check=True, capture_output=True, text=True).stdout.splitlines()
    except (OSError, subprocess.CalledProcessError) as error:
        fail(f"arm-none-eabi-objdump {path}: {error}")
    starts = sorted(functions)
    owner = lambda address: functions[starts[bisect.bisect_right(starts, address) - 1]]
    for line in lines:
        found = re.match(r"\s*([0-9a-f]+):\t(\S+)\t?([^@;]*)", line)
        if not found:
            continue
        address, operation, operands = int(found[1], 16), found[2], found[3].strip()
        if operation.startswith("."):
            continue
        if address < starts[0]:
            fail(f"code at {address:#x} belongs to no function")
        function = owner(address)
        if operation == "push":
            function.pushed += 4 * count_registers(operands)
        elif operation == "sub" and operands.startswith("sp,"):
            amount = re.search(r"#(\d+)$", operands)
            if amount:
                function.pushed += int(amount[1])
            else:
                function.unknown_frame_at = address
        elif operation in ("add", "mov") and re.match(r"sp, r\d+$", operands):
            function.unknown_frame_at = address
        elif operation == "msr" and operands.startswith("MSP"):
            function.starts_over = True
        elif operation in ("blx", "bx") and operands not in RETURNS:
            function.indirect_at.append(address)
        elif re.fullmatch(r"bl|b(eq|ne|cs|cc|mi|pl|vs|vc|hi|ls|ge|lt|gt|le)?(\.[nw])?", operation):
            target = int(operands.split()[0], 16)
            callee = owner(target)
            # Within a function a branch is no call; a long one is a BL too.
            if callee is not function or operation == "bl" and target == function.start:
                if not function.starts_over:
                    function.callees.add(callee)


def count_registers(operands):
    count = 0
    for part in operands.strip("{}").split(","):
        first, _, last = part.strip().partition("-")
        count += int(last[1:]) - int(first[1:]) + 1 if last else 1
    return count


def read_compiler_frames(folders):
    """Function name to the largest frame of that name; a clone is listed under its own name."""
    frames = {}
    for path in (path for folder in folders for path in pathlib.Path(folder).rglob("*.su")):
        for line in path.read_text().splitlines():
            place, size, kind = line.split("\t")
            if kind == "dynamic":
                fail(f"{place}: a frame of variable size; use arrays of fixed size")
            name = place.rsplit(":", 1)[1]
            frames[name] = max(frames.get(name, 0), int(size))
    if not frames:
        fail(f"{' '.join(folders)}: no .su files; compile with -fstack-usage")
    return frames


def set_frames(functions, frames):
    for f in functions.values():
        known = [frames[n] for name in f.names for n in (name, name.split(".")[0]) if n in frames]
        if known:
            f.frame = max(known)
        elif f.unknown_frame_at is not None:
            fail(f"{f.name}: the stack pointer is computed at {f.unknown_frame_at:#x} and there is no .su file for it")
        else:
            f.frame = f.pushed


def resolve_indirect_calls(functions, path, among=None):
    """Of these functions; among: all that there are, where these are some of them."""
    table = {}
    with open(path) as file:
        for number, line in enumerate(file, 1):
            line = line.split("#")[0].strip()
            if line:
                caller, colon, callees = line.partition(":")
                if not colon or not callees.split():
                    fail(f"{path}:{number}: write CALLER: CALLEE...")
                table[caller] = callees.split()
    by_name = {name: f for f in (among or functions).values() for name in f.names}
    for f in functions.values():
        if not f.indirect_at:
            continue
        callees = [c for name in f.names for c in table.get(name, [])]
        if not callees:
            fail(f"{f.name} calls through a pointer at {f.indirect_at[0]:#x}; list what it may reach in {path}")
        external = [int(c.removeprefix("external:")) for c in callees if c.startswith("external:")]
        found = [by_name[c] for c in callees if c in by_name]
        if not external and not found:
            fail(f"{f.name} calls through a pointer, but none of {' '.join(callees)} is in the image; mend {path}")
        f.callees.update(found)
        f.external = max(external, default=0)


def worst(function, path=(), memory=None):
    """Bytes, and the functions of the deepest chain."""
    memory = {} if memory is None else memory
    if function in path:
        names = [f.name for f in path[path.index(function) :]] + [function.name]
        fail("recursion: " + " -> ".join(names))
    if function not in memory:
        deepest = (function.external, ())
        for callee in sorted(function.callees, key=lambda f: f.start):
            deepest = max(deepest, worst(callee, path + (function,), memory), key=lambda d: d[0])
        memory[function] = (function.frame + deepest[0], (function,) + deepest[1])
    return memory[function]


def reachable(function, found):
    if function not in found:
        found.add(function)
        for callee in function.callees:
            reachable(callee, found)
    return found


def worst_of(names, functions, limit, indirect):
    by_name = {name: f for f in functions.values() for name in f.names}
    for name in names:
        if name not in by_name:
            fail(f"the image has no function {name}")
        resolved = set()
        while fresh := reachable(by_name[name], set()) - resolved:
            resolve_indirect_calls({f.start: f for f in fresh}, indirect, functions)
            resolved |= fresh
        size, chain = worst(by_name[name])
        print(f"{size:5}  {chain_text(chain)}")
        if limit is not None and size > limit:
            fail(f"{name} may need {size} bytes of stack, more than the {limit} allowed; see the chain above")


def chain_text(chain):
    return " > ".join(f"{f.name} {f.frame}" for f in chain)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("elf")
    parser.add_argument("--su-dir", required=True, nargs="+", help="build folders with the .su files")
    parser.add_argument("--indirect", default=str(pathlib.Path(__file__).with_name("indirect_calls.txt")))
    parser.add_argument("--of", nargs="+", metavar="FUNCTION", help="of these functions alone")
    parser.add_argument("--limit", type=int, help="fail above this many bytes")
    parser.add_argument("--reserved", type=int, help="fail unless the image reserves this many")
    parser.add_argument("--json", help="write the result to this file")
    args = parser.parse_args()

    elf = Elf(args.elf)
    functions = read_functions(elf)
    disassemble(args.elf, functions)
    set_frames(functions, read_compiler_frames(args.su_dir))
    if args.of:
        worst_of(args.of, functions, args.limit, args.indirect)
        return
    resolve_indirect_calls(functions, args.indirect)

    vectors = struct.unpack("<48I", elf.bytes_of(".vectors"))
    memory = {}
    main_bytes, main_chain = worst(functions[vectors[1] & ~1], memory=memory)
    fault = functions[vectors[3] & ~1]
    priorities = elf.bytes_at("rp2040_irq_priorities", len(vectors) - 16)
    deepest = {}
    for vector, priority in zip(vectors[16:], priorities):
        if functions[vector & ~1] is not fault:
            deepest[priority] = max(deepest.get(priority, (0, ())), worst(functions[vector & ~1], memory=memory), key=lambda d: d[0])
    handler_bytes = sum(d[0] for d in deepest.values())
    frames_bytes = EXCEPTION_FRAME_BYTES * len(deepest)
    total = main_bytes + frames_bytes + handler_bytes
    reserved = elf.value("__stack_top") - elf.value("__stack_limit")

    print(f"main      {main_bytes:5}  {chain_text(main_chain)}")
    for priority, (depth, chain) in sorted(deepest.items()):
        print(f"interrupt {depth:5}  {chain_text(chain)} (priority {priority >> 6})")
    print(f"worst     {total:5}  of {reserved} reserved, exception frames of {frames_bytes} included")
    if args.json:
        with open(args.json, "w") as file:
            json.dump({"worst_bytes": total}, file)
            file.write("\n")
    if args.reserved is not None and reserved != args.reserved:
        fail(f"the image reserves {reserved} bytes of stack, not the {args.reserved} of firmware/common/limits.h")
    limit = reserved if args.limit is None else min(args.limit, reserved)
    if total > limit:
        fail(f"the stack may need {total} bytes, more than the {limit} allowed; see the chain above")


if __name__ == "__main__":
    main()
