"""The host's clock: the one place where the package reads the time, waits, and starts threads that wait.

use() puts another in its place, before anything is opened: tests run the package on simulated time. time.perf_counter(), and on Linux
CLOCK_MONOTONIC, in which joint recordings are, too.
"""

import select
import threading
import time
from collections.abc import Callable
from typing import Any


class HostTime:
    def now_ns(self) -> int:
        return time.perf_counter_ns()

    def wall_ns(self) -> int:
        """Since 1970, for people and other hosts; it may jump."""
        return time.time_ns()

    def sleep(self, seconds: float) -> None:
        time.sleep(seconds)

    def readable(self, descriptor: int, seconds: float) -> bool:
        """Whether there is something to read, within this time."""
        return bool(select.select([descriptor], [], [], seconds)[0])

    def condition(self) -> threading.Condition:
        return threading.Condition()

    def event(self) -> threading.Event:
        return threading.Event()

    def thread(self, target: Callable[..., None], **options: Any) -> threading.Thread:
        """Not started. options: as threading.Thread has them."""
        return threading.Thread(target=target, **options)


_real = HostTime()
now_ns, wall_ns, sleep, readable = _real.now_ns, _real.wall_ns, _real.sleep, _real.readable
condition, event, thread = _real.condition, _real.event, _real.thread


def use(host: HostTime) -> None:
    global now_ns, wall_ns, sleep, readable, condition, event, thread
    now_ns, wall_ns, sleep, readable = host.now_ns, host.wall_ns, host.sleep, host.readable
    condition, event, thread = host.condition, host.event, host.thread


def now_us() -> int:
    return now_ns() // 1000


def now_s() -> float:
    return now_ns() / 1e9
