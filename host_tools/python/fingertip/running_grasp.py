"""Requests to a running `fingertip grasp`, over its socket: CONTROL.md in host_tools/grasp/control has the lines.

with RunningGrasp() as grasp:
    grasp.ask("cap=8 place")                       # raises the reason where it is refused
    print(grasp.report()["state"], grasp.states())
"""

import socket

from . import host_time
from .discovery import is_served, share_folders
from .errors import FingertipError, GoneError, NotSharedError

ANSWERS_s = 1.0  # it takes 20 ms


class RunningGrasp:
    """left: the serial number of its left fingertip; None: the only one that runs. Not for two threads at once. Raises NotSharedError."""

    def __init__(self, left: str | None = None) -> None:
        paths = [
            path for folder in share_folders() for path in sorted(folder.glob("*.grasp")) if left in (None, path.stem) and is_served(path)
        ]
        if len(paths) != 1:
            names = ", ".join(path.stem for path in paths)
            raise NotSharedError(f"several grasps run, choose one: {names}" if paths else "no `fingertip grasp` runs")
        self._line = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._line.connect(str(paths[0]))
        self._came = b""
        self._states: list[str] = []

    def close(self) -> None:
        """The grasp goes on."""
        self._line.close()

    def _next(self) -> str:
        while b"\n" not in self._came:
            if not host_time.readable(self._line.fileno(), ANSWERS_s) or not (more := self._line.recv(4096)):
                raise OSError
            self._came += more
        line, _, self._came = self._came.partition(b"\n")
        return line.decode()

    def _answer(self, asked: str) -> str:
        try:
            self._line.sendall(asked.encode() + b"\n")
            while (line := self._next()).startswith("state "):
                self._states.append(line.removeprefix("state "))
        except OSError:
            raise GoneError("`fingertip grasp` has ended, or does not answer") from None
        return line

    def ask(self, line: str) -> None:
        """Raises FingertipError with the grasp's reason where it refuses."""
        answer = self._answer(line)
        if answer != "ok":
            raise FingertipError(answer.removeprefix("error "))

    def report(self) -> dict[str, str]:
        """By the columns of a recording; "" where a value is unknown. Raises GoneError."""
        return dict(word.split("=", 1) for word in self._answer("report").split()[1:])

    def states(self) -> list[str]:
        """The states that it entered since the last call, as far as the answers have brought them."""
        states, self._states = self._states, []
        return states
