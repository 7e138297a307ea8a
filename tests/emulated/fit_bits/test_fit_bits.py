"""The fit computes the same bits on every machine: every byte of the result of 10 000 presses a kernel.

usage: test_fit_bits.py --host TOOL --m4f ELF --m0 ELF --rp2040 BIN --qemu QEMU --node NODE [--one-in N]

Compared with the host build, one in N presses, all unless said otherwise:
- the Cortex-M4F build, hardware floating point, in QEMU (mps2-an386): all kernels;
- the Cortex-M0+ objects of the firmware in the RP2040's emulator: the fixed-point kernels, one in N of those;
- what scene grasp computes on the second core, there, a fifth of that;
- those of float32 take a million cycles a fit there. The emulator does the first 200 at most, and QEMU's Cortex-M0 (microbit),
  which has not the RP2040's divider but needs none for this kernel, does all with the same objects.
"""

import argparse
import functools
import pathlib
import subprocess
import sys
import unittest

KERNELS = ["grid", "masked", "general", "tangential", "load", "shapes"]  # the order of enum fit_bits_kernel
PRESSES = dict.fromkeys(KERNELS, 10000) | {"shapes": 2000}  # of that many frames each
FOLDER = pathlib.Path(__file__).resolve().parent
TOOLS = argparse.Namespace()


def presses_in_qemu(kernel):
    return PRESSES[kernel] // TOOLS.one_in


def presses_in_emulator(kernel):
    return min(presses_in_qemu(kernel) // TOOLS.one_in, 200 if kernel == "general" else PRESSES[kernel])


def output_of(*command):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, timeout=900, check=False)
    if done.returncode != 0:
        raise AssertionError(f"{command[0]} failed with {done.returncode}: {done.stderr.strip()[-500:]}")
    return done.stdout.split()


def on_host(kernel, count=None):
    return output_of(TOOLS.host, KERNELS.index(kernel), PRESSES[kernel] if count is None else count)


@functools.cache
def in_emulator(kernel, presses, *core):
    return output_of(TOOLS.node, FOLDER / "run_on_chip.mjs", TOOLS.rp2040, KERNELS.index(kernel), presses, *core)


def in_qemu(kernel, presses, machine, image):
    options = "-nographic -monitor none -serial none -chardev stdio,id=host".split()
    semihosting = f"enable=on,target=native,chardev=host,arg=fit,arg={KERNELS.index(kernel)},arg={presses}"
    return output_of(TOOLS.qemu, "-M", machine, *options, "-kernel", image, "-semihosting-config", semihosting)


class SameBits(unittest.TestCase):
    def compare(self, kernel, count, run, *how):
        crcs, expected = run(kernel, count, *how), on_host(kernel, count)
        self.assertEqual(len(crcs), count, f"{kernel}: {len(crcs)} results")
        differing = [press for press in range(count) if crcs[press] != expected[press]]
        print(f"same bits: {count - len(differing)} presses of {kernel}")
        self.assertFalse(differing, f"{kernel}: {len(differing)} of {count} differ, the first is press {differing[:1]}")

    def test_results_differ_from_press_to_press(self):
        for kernel in KERNELS:
            # Without a valid result every member is zero.
            least = 0.35 if kernel == "tangential" else 0.85
            self.assertGreater(len(set(on_host(kernel))), least * PRESSES[kernel])

    def test_cortex_m4f(self):
        for kernel in KERNELS:
            with self.subTest(kernel):
                self.compare(kernel, presses_in_qemu(kernel), in_qemu, "mps2-an386", TOOLS.m4f)

    def test_cortex_m0(self):
        self.compare("general", presses_in_qemu("general"), in_qemu, "microbit", TOOLS.m0)

    def test_rp2040(self):
        for kernel in KERNELS:
            with self.subTest(kernel):
                self.compare(kernel, presses_in_emulator(kernel), in_emulator)

    def test_second_core_of_the_rp2040(self):
        """What scene grasp computes there."""
        for kernel in ("tangential", "shapes"):
            with self.subTest(kernel):
                self.compare(kernel, presses_in_emulator(kernel) // 5, in_emulator, "second")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("host", "m4f", "m0", "rp2040", "qemu", "node"):
        parser.add_argument(f"--{name}", required=True)
    parser.add_argument("--one-in", type=int, default=1, metavar="N")
    _, rest = parser.parse_known_args(namespace=TOOLS)
    unittest.main(argv=[sys.argv[0], *rest], verbosity=2)
