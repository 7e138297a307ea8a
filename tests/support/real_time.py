"""The world as simulated_time.SimulatedTime has it, in real time: for the few tests whose subject that is.

Patience is a guard against hanging, not a limit: a busy machine takes as long as it takes.
"""

# real time: programs on pseudo-terminals of this kernel
import contextlib
import os
import pathlib
import subprocess
import time

PATIENCE_s = 300
LOOK_s = 0.01


@contextlib.contextmanager
def plugged_in(fake_device, port, *options):
    """A fake device at this port, which is yielded once it is there."""
    port, device = pathlib.Path(port), subprocess.Popen([fake_device, port, *options])
    try:
        RealTime().until(port.is_symlink)
        yield port
    finally:
        device.kill()
        device.wait()


class RealTime:
    def __init__(self):
        self._processes = []

    def close(self):
        for process in self._processes:
            process.kill()
            with process:
                pass

    @property
    def now_s(self):
        return time.monotonic()

    def until(self, condition):
        end_s = self.now_s + PATIENCE_s
        while not (answer := condition()):
            assert self.now_s < end_s, f"waited {PATIENCE_s} s"
            time.sleep(LOOK_s)
        return answer

    def start(self, arguments, env=None, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options):
        process = subprocess.Popen(arguments, env=env or os.environ, stdin=stdin, stdout=stdout, stderr=stderr, text=text, **options)
        self._processes.append(process)
        return process

    def run(self, arguments, **options):
        process = self.start(arguments, **options)
        out, err = process.communicate(timeout=PATIENCE_s)
        return process.returncode, out, err
