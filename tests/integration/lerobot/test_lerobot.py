"""The plugin for LeRobot: found, fed by fake devices, around a robot of pretence.

usage: test_lerobot.py FAKE_DEVICE [unittest arguments]. Where LeRobot is installed it is that which is plugged into, else a stand-in beside
this file.
"""

# real time: the plugin as a robot program calls it, on pseudo-terminals
import contextlib
import dataclasses
import importlib
import importlib.util
import math
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time
import unittest
import zipfile
from unittest import mock

FAKE_DEVICE = os.path.abspath(sys.argv[1])
HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[2]
REAL = importlib.util.find_spec("lerobot") is not None
sys.path[:0] = [str(ROOT / "host_tools/python"), str(ROOT / "tests/support"), *([] if REAL else [str(HERE / "stand_in")])]
import fingertip  # noqa: E402
from fingertip import Flag, Frame, wire  # noqa: E402
from fingertip.clock import NO_CLOCK  # noqa: E402
from real_time import plugged_in  # noqa: E402

PATIENCE_s = 300
SERIALS = {"left": "AAAAAAAAAAAAAAA1", "right": "AAAAAAAAAAAAAAA2"}
TRUSTED = Flag.CONTACT | Flag.FIT_VALID | Flag.TARED | Flag.UNCERTAINTY_VALID | Flag.SLIP_VALID
PRETENDED = """
import dataclasses
from lerobot.robots import Robot, RobotConfig

@RobotConfig.register_subclass("pretended")
@dataclasses.dataclass(kw_only=True)
class PretendedConfig(RobotConfig):
    joints: int = 2

class Pretended(Robot):
    config_class, name = PretendedConfig, "pretended"
    is_connected = is_calibrated = False
    def __init__(self, config):
        super().__init__(config)
        self.config, self.actions, self.cameras = config, [], {}
    @property
    def observation_features(self):
        return {f"joint{k}.pos": float for k in range(self.config.joints)}
    action_features = observation_features
    def connect(self, calibrate=True):
        self.is_connected = True
    def calibrate(self):
        self.is_calibrated = True
    def configure(self):
        pass
    def get_observation(self):
        return {f"joint{k}.pos": 10.0 + k for k in range(self.config.joints)}
    def send_action(self, action):
        self.actions.append(action)
        return action
    def disconnect(self):
        self.is_connected = False
"""


class Plugin(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        """Both distributions, this one built as its users would, become importable, and LeRobot finds them."""
        stack = contextlib.ExitStack()
        cls.addClassCleanup(stack.close)
        cls.folder = pathlib.Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="fingertip-test-")))
        stack.enter_context(mock.patch.dict(os.environ, {"XDG_RUNTIME_DIR": str(cls.folder), "HF_HOME": str(cls.folder)}))
        source, site = cls.folder / "source", cls.folder / "site"
        shutil.copytree(ROOT / "host_tools/python/lerobot", source, ignore=shutil.ignore_patterns("__pycache__"))
        backend = f"from setuptools import build_meta as b; b.build_wheel({str(cls.folder)!r})"
        done = subprocess.run([sys.executable, "-c", backend], cwd=source, capture_output=True, text=True, timeout=PATIENCE_s)
        assert done.returncode == 0, done.stderr
        (wheel,) = cls.folder.glob("*.whl")
        zipfile.ZipFile(wheel).extractall(site)
        other = site / "lerobot_robot_pretended-1.dist-info"
        other.mkdir()
        (other / "METADATA").write_text("Metadata-Version: 2.1\nName: lerobot_robot_pretended\nVersion: 1\n")
        (site / "lerobot_robot_pretended").mkdir()
        (site / "lerobot_robot_pretended/config_pretended.py").write_text(PRETENDED)
        (site / "lerobot_robot_pretended/__init__.py").write_text("from .config_pretended import Pretended, PretendedConfig\n")
        sys.path.insert(0, str(site))
        (cls.metadata,) = (path.read_text() for path in site.glob("lerobot_robot_fingertip-*.dist-info/METADATA"))
        importlib.import_module("lerobot.utils.import_utils").register_third_party_plugins()
        cls.robots = importlib.import_module("lerobot.robots")
        cls.observation = importlib.import_module("lerobot_robot_fingertip.observation")
        cls.not_connected = importlib.import_module("lerobot.utils.errors").DeviceNotConnectedError

    def config(self, **options):
        own = self.robots.RobotConfig.get_choice_class("fingertip")
        robot = {"type": "pretended", "calibration_dir": str(self.folder)}
        return own(**{"id": "black", "calibration_dir": self.folder, "robot": robot, "fingertips": SERIALS, **options})

    def make(self, **options):
        return self.robots.make_robot_from_config(self.config(**options))

    def device(self, name, *options):
        port = self.folder / f"{len(list(self.folder.iterdir()))}-{name}"
        return str(self.enterContext(plugged_in(FAKE_DEVICE, port, f"serial={SERIALS[name]}", *options)))

    def test_names(self):
        self.assertRegex(self.metadata, r"(?m)^Name: lerobot_robot_fingertip$")
        self.assertRegex(self.metadata, rf"(?m)^Version: {fingertip.__version__}$")
        self.assertEqual(self.make().robot.id, "black")
        for wrong, said in (
            ({"robot": {}}, "no robot; give"),
            ({"fingertips": {}}, "no fingertips; give"),
            ({"sensors": 33}, "33 is out of"),
        ):
            self.assertRaisesRegex(ValueError, said, self.config, **wrong)
        with self.assertRaisesRegex(ValueError, "the robot has clash.contact.pos itself"):
            robot = self.make(fingertips={"clash": ""})
            with mock.patch.object(type(robot.robot), "observation_features", {"clash.contact.pos": float}):
                self.assertTrue(robot.observation_features)

    def frame(self, flags, **values):
        contact = wire.Contact._make(3 if field.code != "f" else math.nan for _, field in wire.layout_of(wire.Contact))
        numbers = {"force_N": 5.0, "x_mm": 1.0, "y_mm": -2.0, "location_sd_mm": 0.25, "slip_mm": 0.5} if flags & Flag.FIT_VALID else {}
        readings = tuple(int(1024 * value) for value in (101000.0, 100000.0, 100500.0, 100000.0, 99000.0, 100000.0))
        raw = wire.Raw(3, int(flags), 0b011, 0, 0, 2000, 3, readings)
        return Frame("A", 0, 0, contact._replace(flags=int(flags), **{**numbers, **values}), raw, 0, 0, NO_CLOCK)

    def test_what_a_frame_is_for_a_policy(self):
        def found(flags, **values):
            all_found = self.observation.observation("tip", self.frame(flags, **values), 3)
            self.assertEqual(list(all_found), self.observation.features("tip", 3))
            return list(all_found.values())

        trusted = [5.0, 1.0, -2.0, 0.25, 0.5]
        pressures = [1000.0, 500.0, 0.0]  # the third sensor is missing
        self.assertEqual(found(TRUSTED), [1, 1, 0, *trusted, 0, 0, *pressures])
        self.assertEqual(found(TRUSTED | Flag.TANGENTIAL_VALID, qx_N=0.5, qy_N=-1.0), [1, 1, 1, *trusted, 0.5, -1.0, *pressures])
        since_touch = TRUSTED | Flag.TANGENTIAL_VALID | Flag.TANGENTIAL_FROM_TOUCH
        self.assertEqual(found(since_touch, qx_N=0.5, qy_N=-1.0), [1, 1, 0, *trusted, 0, 0, *pressures])
        self.assertEqual(
            found(TRUSTED | Flag.UNCERTAIN | Flag.TANGENTIAL_VALID, qx_N=0.5, qy_N=-1.0), [1, 0, 0, 0, 0, 0, 0, 0, 0, 0, *pressures]
        )
        self.assertEqual(found(Flag.TARED), [0] * 10 + pressures)
        self.assertEqual(found(TRUSTED, slip_mm=math.nan)[7], 0)
        self.assertEqual(found(Flag.CONTACT), [1] + [0] * 12)  # of no zero yet
        names = self.observation.features("tip", 15)
        self.assertEqual((len(names), names[3], names[-1]), (25, "tip.force_N.pos", "tip.s14_Pa.pos"))
        self.assertTrue(all(name.endswith(".pos") for name in names))

    def test_a_robot_that_feels(self):
        ports = {name: self.device(name, f"flags={int(TRUSTED)}") for name in SERIALS}
        robot = self.make(fingertips=ports)
        wanted = ["joint0.pos", "joint1.pos", *self.observation.features("left", 15), *self.observation.features("right", 15)]
        self.assertEqual(robot.observation_features, dict.fromkeys(wanted, float))
        self.assertEqual(list(robot.action_features), wanted[:2])
        self.assertFalse(robot.is_connected)
        with self.assertRaises(self.not_connected):
            robot.get_observation()
        robot.connect()
        self.assertTrue(robot.is_connected and robot.robot.is_connected)
        with self.assertRaises(ConnectionError):
            robot.connect()
        found = robot.get_observation()
        self.assertEqual(list(found), wanted)
        self.assertTrue(all(isinstance(value, float) and math.isfinite(value) for value in found.values()))
        self.assertEqual((found["joint1.pos"], found["left.trusted.pos"], found["right.force_N.pos"]), (11.0, 1.0, 5.0))
        self.assertNotEqual(found["left.x_mm.pos"], 0.0)
        self.assertTrue(any(found[f"right.s{k}_Pa.pos"] for k in range(15)))
        self.assertEqual(robot.send_action({"joint0.pos": 1.0}), {"joint0.pos": 1.0})
        self.assertEqual(robot.robot.actions, [{"joint0.pos": 1.0}])
        robot.calibrate()
        self.assertTrue(robot.is_calibrated)
        robot.disconnect()
        self.assertFalse(robot.is_connected or robot.robot.is_connected)
        with self.assertRaises(self.not_connected):
            robot.send_action({})

    def test_one_that_is_unplugged_or_silent_is_said(self):
        for option, said in (("frames=60", ""), ("stall=60", ".*no frame in 0.2 s")):
            robot = self.make(fingertips={"left": self.device("left", option)}, sensors=0)
            robot.connect()
            with self.assertRaisesRegex(self.not_connected, f"^fingertip left: {said}"):
                end_s = time.monotonic() + PATIENCE_s
                while time.monotonic() < end_s:
                    self.assertEqual(len(robot.get_observation()), 2 + 10)
                    time.sleep(0.01)
            robot.disconnect()

    def test_what_is_wrong_is_said_before_the_robot_moves(self):
        for options, said in (
            ({"fingertips": {"left": "/nowhere"}}, "fingertip left: .*nowhere"),
            ({"fingertips": {"left": self.device("left")}, "sensors": 9}, "has 15 sensors; give --robot.sensors"),
        ):
            robot = self.make(**options)
            with self.assertRaisesRegex(self.not_connected, said):
                robot.connect()
            self.assertFalse(robot.robot.is_connected)

    @unittest.skipUnless(REAL, "LeRobot is not here")
    def test_command_line_and_dataset(self):
        import draccus
        from lerobot.utils.feature_utils import build_dataset_frame, hw_to_dataset_features

        @dataclasses.dataclass
        class Recording:
            robot: self.robots.RobotConfig

        ports = {name: self.device(name, f"flags={int(TRUSTED)}") for name in SERIALS}
        fingertips = ", ".join(f"{name}: {port}" for name, port in ports.items())
        pretended = f"{{type: pretended, joints: 3, calibration_dir: {self.folder}}}"
        own = dict(type="fingertip", id="black", calibration_dir=self.folder, robot=pretended, fingertips=f"{{{fingertips}}}")
        words = [f"--robot.{name}={value}" for name, value in own.items()]
        robot = self.robots.make_robot_from_config(draccus.parse(Recording, args=words).robot)
        robot.connect()
        kinds = hw_to_dataset_features(robot.observation_features, "observation")
        self.assertEqual(kinds["observation.state"]["shape"], (3 + 2 * 25,))
        row = build_dataset_frame(kinds, robot.get_observation(), "observation")["observation.state"]
        self.assertEqual((row.shape, row[1], row[3:6].tolist(), row[6]), ((53,), 11.0, [1.0, 1.0, 0.0], 5.0))
        robot.disconnect()


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[2:]], verbosity=2)
