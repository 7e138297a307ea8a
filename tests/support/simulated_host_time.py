"""The Python package's clock (fingertip.host_time), simulated: the package's threads live in the world of simulated_time.py, as its
programs do, each with a connection of its own to the keeper.

    host_time.use(SimulatedHostTime(world))
"""

import contextlib
import os
import select
import threading

from simulated_time import BYE, FOR_EVER_us, VARIABLE, Line

WALL_ZERO_ns = 1767225600 * 10**9  # as simulated_clock.cpp has it


class Waiters:
    """Descriptors that are set for those who wait; a context manager that removes its own."""

    def __init__(self, host):
        self._host, self._all = host, []

    def set(self):
        for fd in self._all:
            os.eventfd_write(fd, 1)

    def wait(self, seconds, before=lambda: None):
        """before: done once it can be woken."""
        fd = os.eventfd(0, os.EFD_NONBLOCK)
        self._all.append(fd)
        try:
            before()
            return self._host.readable(fd, seconds)
        finally:
            self._all.remove(fd)
            os.close(fd)


class Condition:
    def __init__(self, host):
        self._lock, self._waiters = threading.RLock(), Waiters(host)

    def __enter__(self):
        return self._lock.__enter__()

    def __exit__(self, *error):
        return self._lock.__exit__(*error)

    def notify_all(self):
        self._waiters.set()

    def wait(self, timeout=None):
        try:
            return self._waiters.wait(timeout, self._lock.release)
        finally:
            self._lock.acquire()


class Event:
    def __init__(self, host):
        self._waiters, self._is_set = Waiters(host), False

    def is_set(self):
        return self._is_set

    def set(self):
        self._is_set = True
        self._waiters.set()

    def clear(self):
        self._is_set = False

    def wait(self, timeout=None):
        return self._is_set or self._waiters.wait(timeout) or self._is_set


class Thread(threading.Thread):
    def __init__(self, host, target, args=(), **options):
        super().__init__(**options)
        self._host, self._work, self._arguments, self._ended = host, target, args, Event(host)

    def start(self):
        self._line = self._host.new_line()
        super().start()

    def run(self):
        self._host.take_first_turn(self._line)
        try:
            self._work(*self._arguments)
        finally:
            self._ended.set()
            with contextlib.suppress(OSError):
                self._line.say(BYE)
            self._line.close()

    def join(self, timeout=None):
        self._ended.wait(timeout)
        if self._ended.is_set():
            super().join()


class SimulatedHostTime:
    def __init__(self, world):
        self._world, self._own = world, threading.local()
        self._us = round(world.now_s * 1e6)

    def new_line(self):
        return Line(self._world.environment[VARIABLE])

    def take_first_turn(self, line):
        self._own.line = line
        self._took_turn(line.take_turn())

    def now_ns(self):
        return max(self._us, round(self._world.now_s * 1e6)) * 1000

    def wall_ns(self):
        return WALL_ZERO_ns + self.now_ns()

    def readable(self, descriptor, seconds):
        self._wait([descriptor], seconds)
        return self._has_something(descriptor)

    def sleep(self, seconds):
        self._wait([], seconds)

    def condition(self):
        return Condition(self)

    def event(self):
        return Event(self)

    def thread(self, target, **options):
        return Thread(self, target, **options)

    def _wait(self, descriptors, seconds):
        line = getattr(self._own, "line", None)
        if line is None:  # the test itself
            self._world.wait(descriptors, FOR_EVER_us / 2e6 if seconds is None else seconds)
            self._us = round(self._world.now_s * 1e6)
            return
        until_us = FOR_EVER_us if seconds is None else self._us + max(1, round(seconds * 1e6))
        self._took_turn(line.wait(until_us, descriptors))

    def _took_turn(self, is_whole):
        """Ends the thread where the world has ended."""
        if not is_whole:
            raise SystemExit
        self._us = self._own.line.now_us

    @staticmethod
    def _has_something(descriptor):
        return bool(select.select([descriptor], [], [], 0)[0])
