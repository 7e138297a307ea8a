"""Pictures of a replay on a terminal, of a lift that the firmware on the host played: usage
test_replay_pull.py FINGERTIP TWIN PLAYER TABLES [unittest arguments]."""

import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

from PIL import Image

FINGERTIP, TWIN, PLAYER, TABLES = sys.argv[1:5]
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "host_tools/demo"))
import picture  # noqa: E402


def setUpModule():
    global folder, recording
    folder = pathlib.Path(unittest.enterModuleContext(tempfile.TemporaryDirectory(prefix="fingertip-test-")))
    scenario, recording = folder / "lift.csv", folder / "recording.csv"
    options = "--seconds 6 --force 6 --tangential 0.35,0 --seed 5"
    subprocess.run([TWIN, "scenario", "lift", *options.split(), "-o", scenario, "--cache", TABLES], check=True, stdout=subprocess.DEVNULL)
    subprocess.run([PLAYER, "play", scenario, "-o", recording, "--raw", "--rate", "100", "--quiet"], check=True)


class ReplayPull(unittest.TestCase):
    def test_a_picture_that_moves(self):
        out = folder / "moving.png"
        options = "--at 1 --until 4 --every 0.5 --size 100x30 --tool"
        self.assertEqual(picture.main([str(recording), "-o", str(out), *options.split(), FINGERTIP]), 0)
        with Image.open(out) as moving:
            # The first is for viewers of still pictures.
            self.assertEqual((moving.n_frames, moving.size), (8, (100 * picture.WIDTH, 30 * picture.HEIGHT)))
            frames = []
            for i in range(moving.n_frames):
                moving.seek(i)
                frames.append(moving.convert("RGB").tobytes())
        self.assertEqual(len(set(frames)), 7)  # a lift: each differs
        self.assertLess(out.stat().st_size, 1e6)

    def test_what_the_replay_was_too_quick_for_is_shown_more_slowly(self):
        replay, times_s = [FINGERTIP, "replay", str(recording)], [round(1 + 0.1 * i, 1) for i in range(6)]
        self.assertGreater(picture.screens_at([*replay, "--speed", "96"], 100, 30, times_s)[1], 0.1)
        shown = picture.replayed(replay, 100, 30, times_s, 0.1, 96)
        self.assertEqual([re.search(r"at (\d+\.\d) s of ", screen.display[-1])[1] for screen in shown], [f"{at_s:.1f}" for at_s in times_s])
        with self.assertRaisesRegex(picture.InputError, "too busy to show each time within 0 s"):
            picture.replayed(replay, 100, 30, [0.2], 0, 1)

    def test_pictures_that_cannot_be(self):
        for words, said in (
            (("-o", "p.png", "--at", "3", "--until", "2"), "later than --at"),
            (("-o", "p.png", "--until", "2", "--every", "0.05"), "--every at least 0.1"),
            (("-o", "p.svg"), "ends in .png"),
        ):
            with self.assertRaisesRegex(picture.InputError, said):
                picture.main(["lift.csv", *words])


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[5:]])
