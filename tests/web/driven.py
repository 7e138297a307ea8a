"""Steps on the page that its tests and its report share."""

import pathlib
import re
import subprocess
import sys

TESTS = pathlib.Path(__file__).with_name("test_page.py")

COUNTS = """(() => {
  const [first] = fingertip.fingertips;
  return {at_ms: performance.now(), pictures: fingertip.pictures, frames: first.contacts, raws: first.raws, lost: first.lost};
})()"""


def ready_s(page):
    """From the address to a picture and buttons that work."""
    return page.until("globalThis.fingertip?.ready_ms") / 1000


def connected(page, count):
    """So many fingertips stream."""
    page.until(f"fingertip.fingertips.filter(each => each.state === 'live' && each.contacts > 0).length === {count}")


def run_all(build, image):
    """Every test of the page: {"web_steps": [{"step", "outcome"}], "web_steps_driven": how many, "web_steps_failed": how many}."""
    done = subprocess.run(
        [sys.executable, str(TESTS), "--build", str(build), "--image", str(image), "--node", "node"], capture_output=True, text=True
    )
    steps = [
        {"step": f"{group}: {name.replace('_', ' ')}", "outcome": outcome}
        for name, group, outcome in re.findall(
            r"(?ms)^test_(\w+) \(__main__\.(\w+)\.\w+\)(?:(?!^test_).)*? \.\.\. (ok|FAIL|ERROR|skipped)", done.stderr
        )
    ]
    return {
        "web_steps": steps,
        "web_steps_driven": len(steps),
        "web_steps_failed": sum(each["outcome"] != "ok" for each in steps) if steps else None,
    }
