"""The I2C lines as a logic analyser sees them: decoded by sigrok and compared with the emulator's own log; their times
measured and held against UM10204.

usage: test_bus_dump.py --board NAME --image F.bin --node NODE --sigrok SIGROK-CLI
"""

import argparse
import csv
import json
import pathlib
import re
import subprocess
import tempfile
import unittest

from emulation import emulate, main, make_scenario
from vcd import read_vcd

TOOLS = argparse.Namespace()

FROM_S, TO_S = 0.400, 0.420
# The shortest that UM10204 table 10 allows in fast mode, ns.
FAST_MODE_ns = {"tHD_STA": 600, "tLOW": 1300, "tHIGH": 600, "tSU_STA": 600, "tSU_DAT": 100, "tSU_STO": 600, "tBUF": 1300, "period": 2500}
# The longest, but for as much as SCL stays low beyond its shortest time.
TVD_DAT_ns = 900
# The longest rise time that fast mode allows; as good as any for lines whose bus model knows no levels between low and high.
RISE_ns = 300


def run(folder, rise_ns):
    """Report, dump and log of a short run."""
    folder = pathlib.Path(folder)
    scenario = make_scenario(folder / "scenario.csv", "ideal", 1)
    logs = {"vcd": folder / "bus.vcd", "bus_log": folder / "bus.csv", "report": folder / "run.json"}
    window = {"seconds": TO_S + 0.01, "vcd_from": FROM_S, "vcd_to": TO_S}
    done = emulate(TOOLS, board=TOOLS.board, image=TOOLS.image, scenario=scenario, fast_enumeration=True, rise_ns=rise_ns, **window, **logs)
    report = json.loads((folder / "run.json").read_text())
    with open(folder / "bus.csv", newline="") as file:
        log = list(csv.DictReader(file))
    return done, report, log


def decode(path, pairs):
    """What sigrok's decoder makes of each SDA: a list of transactions (address, 'r' or 'w', bytes, acknowledged)."""
    call = [TOOLS.sigrok, "-i", str(path), "-I", f"vcd:skip={int(FROM_S * 1e9)}:downsample=40", "-A", "i2c=addr-data"]
    for sda, scl in pairs:
        call += ["-P", f"i2c:scl={scl}:sda={sda}"]
    output = subprocess.run(call, capture_output=True, text=True, check=True).stdout
    lines = {f"i2c-{i + 1}": [] for i in range(len(pairs))}
    for line in output.splitlines():
        name, _, what = line.partition(": ")
        transactions = lines[name]
        if what in ("Start", "Start repeat"):
            transactions.append({"bytes": "", "acks": [], "whole": False})
        elif not transactions:
            continue
        elif match := re.fullmatch(r"Address (read|write): ([0-9A-F]{2})", what):
            transactions[-1].update(address=int(match[2], 16), rw=match[1][0])
        elif match := re.fullmatch(r"Data (?:read|write): ([0-9A-F]{2})", what):
            transactions[-1]["bytes"] += match[1].lower()
        elif what in ("ACK", "NACK"):
            transactions[-1]["acks"].append(what == "ACK")
        if what == "Start repeat":
            transactions[-2]["whole"] = True
        elif what == "Stop":
            transactions[-1]["whole"] = True
    return [
        [
            # The controller acknowledges each byte that it reads but the last.
            (t["address"], t["rw"], t["bytes"], t["acks"] == [True] * (len(t["acks"]) - 1) + [t["rw"] == "w" or not t["bytes"]])
            for t in lines[name]
            if t["whole"]
        ]
        for name in lines
    ]


def measure(sda, scl, rise_ns):
    """The shortest of each time of UM10204 and the longest tVD;DAT, ns; and the clocks between each START or STOP and the one
    before. A rise is at 0.7 VDD in the dump; times that end at 0.3 VDD end rise_ns earlier."""
    found = {name: float("inf") for name in FAST_MODE_ns}
    found["tVD_DAT"] = 0
    clocks_between = []
    level = {"sda": sda[0][1], "scl": scl[0][1]}
    last = {}
    clocks = None

    def take(name, since, t_ns):
        if since in last:
            found[name] = min(found[name], t_ns - last[since])

    merged = [(t, "scl", v) for t, v in scl[1:]] + [(t, "sda", v) for t, v in sda[1:]]
    # Of changes at one moment a falling SCL is first and a rising one last.
    merged.sort(key=lambda e: (e[0], 1 if e[1] == "sda" else 2 * e[2]))
    for t_ns, line, value in merged:
        level[line] = value
        if line == "scl" and value:
            take("tLOW", "scl fell", t_ns - rise_ns)
            if clocks is not None:
                take("tSU_DAT", "sda changed", t_ns - rise_ns)
                if last.get("sda changed", -1) > last.get("scl fell", t_ns):
                    stretched_ns = max(0, t_ns - rise_ns - last["scl fell"] - FAST_MODE_ns["tLOW"])
                    found["tVD_DAT"] = max(found["tVD_DAT"], last["sda changed"] - last["scl fell"] - stretched_ns)
                clocks += 1
            last["scl rose"] = t_ns
        elif line == "scl":
            take("tHIGH", "scl rose", t_ns)
            take("period", "scl fell", t_ns)
            if "started" in last:
                take("tHD_STA", "started", t_ns)
                del last["started"]
            last["scl fell"] = t_ns
        else:
            if level["scl"]:
                if clocks is not None:
                    clocks_between.append(clocks)
                if value:
                    take("tSU_STO", "scl rose", t_ns - rise_ns)
                    last["stopped"] = t_ns
                    clocks = None
                else:
                    if "stopped" in last:
                        take("tBUF", "stopped", t_ns)
                        del last["stopped"]
                    elif clocks is not None:
                        take("tSU_STA", "scl rose", t_ns)
                    last["started"] = t_ns
                    clocks = 0
            last["sda changed"] = t_ns
    return found, clocks_between


class BusDump(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = cls.enterClassContext(tempfile.TemporaryDirectory())
        cls.dump = pathlib.Path(folder) / "bus.vcd"
        cls.rise_ns = RISE_ns if TOOLS.board == "pico_parallel" else None
        cls.done, cls.report, cls.log = run(folder, cls.rise_ns)
        cls.signals = read_vcd(cls.dump)
        cls.pairs = [(name, "SCL") for name in cls.signals if name != "SCL"]

    def test_sigrok_reads_what_the_emulator_logged(self):
        decoded = decode(self.dump, self.pairs)
        self.assertEqual(len(decoded), 15 if TOOLS.board == "pico_parallel" else 1)
        for (sda, _), transactions in zip(self.pairs, decoded):
            logged = [
                (int(row["address"], 16), row["rw"], row["bytes"], row["ack"] == "1")
                for row in self.log
                if row["muxes"] == sda or TOOLS.board == "pico_mux"
                if float(row["start_ns"]) > FROM_S * 1e9 and float(row["end_ns"]) < TO_S * 1e9
            ]
            self.assertGreater(len(logged), 20)
            # A transfer across the edge of the dump may be whole in one and not in the other.
            at = next(i for i in (0, 1) if transactions[i : i + 10] == logged[:10])
            self.assertLessEqual(abs(len(transactions) - at - len(logged)), 1, sda)
            count = min(len(transactions) - at, len(logged))
            self.assertEqual(transactions[at : at + count], logged[:count], sda)

    def test_times_are_within_the_specification(self):
        for sda, scl in self.pairs:
            found, clocks_between = measure(self.signals[sda], self.signals[scl], self.rise_ns or 0)
            for name, at_least in FAST_MODE_ns.items():
                self.assertGreaterEqual(found[name] + 1, at_least, f"{sda} {name}")  # the dump counts whole ns
            self.assertLessEqual(found["tVD_DAT"], TVD_DAT_ns + 1, sda)
            self.assertGreater(len(clocks_between), 20)
            # A START and a STOP come after whole bytes of nine clocks, within a clock of their own.
            self.assertEqual({clocks % 9 for clocks in clocks_between}, {1}, sda)
            for name, value in self.report["i2c"].get("times_ns", {}).items():
                if name in FAST_MODE_ns:
                    self.assertGreaterEqual(found[name] + 1, value, f"{sda} {name}: the emulator saw a longer one")

    def test_the_emulator_has_nothing_to_object(self):
        self.assertEqual(self.done.returncode, 0, self.done.stderr)


if __name__ == "__main__":
    main(TOOLS, "board", "image", "node", "sigrok")
