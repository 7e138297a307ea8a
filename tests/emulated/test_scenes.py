"""The images of the scenes raw, press, slip and shapes in the emulator, and the board's own, of scene grasp: nothing comes of what is off, and
no command brings it back; lengths of packets are judged by unit.wire and unit.app_of_*. Scenes grasp and shapes report the tangential force
in every frame, and shapes the contact shape too. Slip, grasp and shapes keep up with the fastest sensors.

usage: test_scenes.py --scenes FOLDER --image FILE.bin --fingertip TOOL --command_frame PROGRAM --node NODE
"""

import argparse
import tempfile
import unittest

from emulation import Run, main, make_scenario
from fingertip import Flag, files

TOOLS = argparse.Namespace()
BOARD = "pico_parallel"
UNKNOWN_COMMAND, OUT_OF_RANGE = "1", "2"


class SceneRun(Run):
    """A second in contact. extra: (s, command...). acks: sequence number of the command -> result."""

    def __init__(self, folder, scene, stream, extra=()):
        numbered = (("info",), ("stream", "contact,raw,health"), ("slip", "1", "100"), ("stream", f"{stream},health"))
        commands = [(0.46 + 0.01 * i, "--sequence", str(1 + i), *command) for i, command in enumerate(numbered)]
        commands += [(1.7, "--sequence", "5", "health"), *extra]
        image = TOOLS.image if scene == "grasp" else f"{TOOLS.scenes}/{scene}/{BOARD}/fingertip-{BOARD}.bin"
        super().__init__(TOOLS, folder, scene, BOARD, make_scenario(f"{folder}/wander.csv", "wander", 3), 1.8, commands, image=image)
        self.acks = {fields["command_sequence"]: fields["result"] for kind, fields in self.recording.packets if kind == "ack"}
        self.has_contact = self.recording.has_contact
        self.has_raw = self.recording["valid"] == self.recording["valid"]


class Scenes(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = cls.enterClassContext(tempfile.TemporaryDirectory())
        cls.raw, cls.press = SceneRun(cls.folder, "raw", "raw"), SceneRun(cls.folder, "press", "contact")

    def test_raw_streams_readings_and_nothing_of_a_fit(self):
        self.assertEqual(self.raw.recording.metadata["scene"], "raw")
        self.assertTrue(self.raw.has_raw.all())
        self.assertFalse(self.raw.has_contact.any())
        self.assertGreater(len(self.raw.has_raw), 400 * 1.3)

    def test_press_streams_contacts_and_nothing_of_slip_and_raw(self):
        self.assertEqual(self.press.recording.metadata["scene"], "press")
        self.assertTrue(self.press.has_contact.all())
        self.assertFalse(self.press.has_raw.any())
        self.assertTrue(self.press.recording.flag(files.FIT_VALID)[-400:].all())
        self.assertFalse(self.press.recording.flag(files.SLIP | files.SLIP_VALID).any())

    def at_the_fastest(self, scene):
        """With a pad's profile, if it takes one: the recording, and which of its rows are of the last 0.9 s."""
        extra = [(0.455, "--sequence", "6", "osr", "256"), (0.5, "--sequence", "7", "pad", "12", "0")]
        run = SceneRun(self.folder, scene, "contact", extra)
        self.assertEqual({name: run.acks[name] for name in ("6", "7")}, {"6": "0", "7": UNKNOWN_COMMAND if scene == "slip" else "0"})
        recording = run.recording
        self.assertEqual(recording.metadata["scene"], scene)
        late = recording["t_us"] > recording["t_us"][-1] - 900e3
        t_us = recording["t_us"][late]
        self.assertGreater((len(t_us) - 1) / (t_us[-1] - t_us[0]) * 1e6, 1250)
        frames = recording["frame"][late]
        self.assertEqual(int(frames[-1] - frames[0]), len(frames) - 1)
        self.assertEqual(recording.health()[-1]["frames_skipped"], 0)
        return recording, late

    def test_slip_keeps_up_without_a_tangential_force(self):
        recording, late = self.at_the_fastest("slip")
        self.assertTrue(recording.flag(files.FIT_VALID)[late].all())
        self.assertFalse(recording.flag(files.TANGENTIAL_VALID | int(Flag.SHAPE_VALID)).any())

    def test_grasp_reports_the_tangential_force_in_every_frame(self):
        recording, late = self.at_the_fastest("grasp")
        self.assertTrue(recording.flag(files.TANGENTIAL_VALID)[late].all())
        self.assertFalse(recording.flag(int(Flag.SHAPE_VALID)).any())

    def test_shapes_reports_the_contact_shape_too(self):
        recording, late = self.at_the_fastest("shapes")
        self.assertTrue(recording.flag(files.TANGENTIAL_VALID)[late].all())
        # The shape is known by then, and of a frame shortly before.
        self.assertTrue(recording.flag(int(Flag.SHAPE_VALID))[late].all())
        self.assertLess(recording["shape_age_ms"][late].max(), 10)

    def test_commands_for_what_is_off_are_refused(self):
        for run in (self.raw, self.press):
            self.assertEqual(run.acks, {"1": "0", "2": OUT_OF_RANGE, "3": UNKNOWN_COMMAND, "4": "0", "5": "0"})
            self.assertEqual(run.recording.health()[-1]["commands_rejected"], 2)


if __name__ == "__main__":
    main(TOOLS, "scenes", "image", "fingertip", "command_frame", "node")
