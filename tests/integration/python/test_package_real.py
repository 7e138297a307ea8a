"""The Python package in real time: on pseudo-terminals, under asyncio, and the manuals' examples.

usage: test_package_real.py FINGERTIP FAKE_DEVICE [unittest arguments]
"""

# real time: asyncio and pyserial wait by clocks of their own
import asyncio
import contextlib
import math
import os
import pathlib
import re
import sys
import tty
import unittest
from unittest import mock

import numpy as np

FINGERTIP, FAKE_DEVICE = (os.path.abspath(path) for path in sys.argv[1:3])
ROOT = pathlib.Path(__file__).resolve().parents[3]
PACKAGE = ROOT / "host_tools/python"
sys.path[:0] = [str(PACKAGE), str(ROOT / "tests/support")]
import fingertip  # noqa: E402
import readme_example  # noqa: E402
from fingertip import Fingertip, Flag, wire  # noqa: E402
from world_case import WorldCase  # noqa: E402

PATIENCE_s = 300
SERIAL = "E660583883265A2C"  # of the fake device where none is said


class DeviceTest(WorldCase):
    DEVICE = FAKE_DEVICE

    def setUp(self):
        super().setUp()
        self.enterContext(mock.patch.dict(os.environ, self.environment, clear=True))


class Streaming(DeviceTest):
    def test_one_that_streams_already(self):
        with self.device("rate=1000"):
            other = os.open(self.port, os.O_RDWR | os.O_NOCTTY)
            self.addCleanup(os.close, other)
            tty.setraw(other)
            os.write(other, wire.encode(wire.Packet(0, 0, wire.SetStreams(7))))
            self.assertTrue(os.read(other, 10))
            with Fingertip(self.port, timeout_s=PATIENCE_s) as tip:
                np.testing.assert_array_equal(np.diff(tip.read_block(50).frame), 1)

    def test_one_port_one_program(self):
        with self.device(), Fingertip(self.port, timeout_s=PATIENCE_s):
            with self.assertRaisesRegex(fingertip.PortInUseError, "in use by another program, or by a Fingertip of this one"):
                Fingertip(self.port)

    def test_asyncio(self):
        async def talk():
            async with fingertip.AsyncFingertip(self.port, timeout_s=PATIENCE_s) as tip:
                await tip.set(osr=512)
                await tip.tare()
                self.assertEqual([(await tip.read_info()).osr, tip.info.osr], [512, 512])
                self.assertEqual((await tip.read_health()).capabilities & 1, 1)
                numbers = []
                async for frame in tip:
                    numbers.append(frame.frame)
                    if len(numbers) == 60:
                        break
                self.assertEqual(numbers, list(range(numbers[0], numbers[0] + 60)))
                before = await tip.read_block(10)
                with self.assertRaises(asyncio.TimeoutError):
                    await asyncio.wait_for(tip.read_block(100_000), 0.2)
                after = await tip.read_block(30)  # nothing is lost to the one that was cancelled
                self.assertEqual(after.frame.tolist(), list(range(before.frame[-1] + 1, before.frame[-1] + 31)))
                with await tip.record(self.csv) as writer:
                    while writer.frames < 20:  # the first frames may have come before it
                        self.assertEqual(len(await anext(tip.blocks(20))), 20)
                    self.assertGreater((await tip.latest()).frame, numbers[-1])

        async def cancelled():
            opening = asyncio.ensure_future(fingertip.AsyncFingertip(self.port).__aenter__())
            await asyncio.sleep(0)
            opening.cancel()
            with self.assertRaises(asyncio.CancelledError):
                await opening
            Fingertip(self.port).close()  # which is free

        async def gone():
            async with fingertip.AsyncFingertip(self.port, timeout_s=PATIENCE_s) as tip:
                async for _ in tip:
                    pass

        with self.device():
            asyncio.run(talk())
            asyncio.run(cancelled())
        with self.device("frames=30"), self.assertRaises(fingertip.GoneError):
            asyncio.run(gone())


class Simulated(DeviceTest):
    """Against what `fingertip simulate` simulates, found as any program finds it."""

    def test_the_example_of_the_readme_runs_as_printed(self):
        environment = readme_example.environment_of(self.folder)
        with readme_example.simulated(FINGERTIP, environment):
            lines, err = readme_example.run_example(environment)
        self.assertEqual(err, "")
        self.assertTrue(readme_example.runs(lines), lines)

    def test_names(self):
        self.assertRaisesRegex(
            fingertip.NoFingertipError, "sim:: nothing is simulated there; start `fingertip simulate`", Fingertip, "sim:"
        )
        with readme_example.simulated(FINGERTIP, readme_example.environment_of(self.folder), "--fingertips", "2"):
            serials = []
            for name in ("sim:", "sim:left", "sim:right"):
                with Fingertip(name, timeout_s=PATIENCE_s) as tip:
                    serials.append(tip.info.serial)
            self.assertEqual((serials[0], len(set(serials))), (serials[1], 2))
            self.assertRaisesRegex(fingertip.NoFingertipError, "sim:up: nothing is simulated there", Fingertip, "sim:up")
            self.assertRaises(fingertip.SeveralFingertipsError, Fingertip)


class Examples(DeviceTest):
    """The code in the manuals runs."""

    def setUp(self):
        super().setUp()
        self.enterContext(mock.patch.dict(Fingertip.__init__.__kwdefaults__, {"timeout_s": PATIENCE_s}))
        self.enterContext(mock.patch.dict(os.environ, {"ROS_LOCALHOST_ONLY": "1"}))

    def blocks(self, path, language="python"):
        return re.findall(rf"```{language}\n(.*?)```", (ROOT / path).read_text(encoding="utf-8"), re.S)

    def test_package_readme(self):
        os.environ |= {"FINGERTIP_PORT": self.port, "FINGERTIP_TOOL": FINGERTIP}
        # test_zenoh.py and test_grip_python.py run the others.
        examples = [code for code in self.blocks("host_tools/python/README.md") if not re.search("import zenoh|class HandE", code)]
        self.assertGreater(len(examples), 3)
        for code in examples:
            with self.subTest(code), self.device("frames=120"):
                shown = []
                os.chdir(self.folder)
                self.addCleanup(os.chdir, ROOT)
                with contextlib.suppress(fingertip.GoneError):
                    exec(compile(code, "README.md", "exec"), {"print": lambda *values: shown.append(values), "__name__": "__main__"})
                self.assertTrue(shown, code)
                self.assertFalse([values for values in shown if any(isinstance(value, float) and math.isnan(value) for value in values)])

    def test_readme(self):
        """Frames with a warning are not shown, whichever it is."""
        os.environ["FINGERTIP_PORT"] = self.port
        text = (ROOT / "README.md").read_text(encoding="utf-8")
        code = re.search(r"(?m)^    import matplotlib.*\n(?:    .*\n|\n)+", text).group().replace("\n    ", "\n")[4:]
        self.assertIn("seconds=10", code)
        plots = mock.MagicMock()
        with mock.patch.dict(sys.modules, {"matplotlib": plots, "matplotlib.pyplot": plots.pyplot}):
            for bit in (None, *range(8, 19)):
                shown = []
                flags = int(Flag.CONTACT | Flag.FIT_VALID) | (0 if bit is None else 1 << bit)
                with self.device("rate=1000", "frames=300", f"flags={flags}"), self.assertRaises(fingertip.GoneError):
                    exec(
                        compile(code.replace("seconds=10", "seconds=0.1"), "README.md", "exec"),
                        {"print": lambda *values: shown.append(values)},
                    )
                self.assertEqual(bool(shown), bit is None, bit)
        t_s, force_N = plots.pyplot.plot.call_args.args
        self.assertEqual(len(t_s), len(force_N))
        self.assertEqual(plots.pyplot.show.call_count, 12)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])
