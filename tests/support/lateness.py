"""How late the machine itself was while something was measured: for tests whose subject is real time.

    with Lateness() as machine:
        took_s = measure()
    machine.judge(took_s, LIMIT_s)

A thread asks to be woken every few milliseconds. What it oversleeps, anything else may have been held up too.
"""

# real time: the machine's own lateness is what this measures
import threading
import time

INTERVAL_s = 0.002


class Lateness:
    def __init__(self):
        self.late_s = 0.0  # in all, beyond one interval each
        self.worst_s = 0.0
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._ended.set()
        self._thread.join()

    def _watch(self):
        last_s = time.monotonic()
        while not self._ended.is_set():
            time.sleep(INTERVAL_s)
            now_s = time.monotonic()
            late_s = now_s - last_s - 2 * INTERVAL_s
            if late_s > 0:
                self.late_s += late_s
                self.worst_s = max(self.worst_s, late_s)
            last_s = now_s

    def judge(self, measured_s, limit_s):
        """Fails unless measured is within limit, but for what the machine was late in all."""
        if measured_s > limit_s + self.late_s:
            raise AssertionError(f"took {measured_s:.3f} s, {limit_s:g} s are allowed and this machine was {self.late_s:.3f} s late")
