"""Text files, line by line, and numbers as text in them."""

import math
import os

import numpy as np

from .errors import InputError


def shortest(value: float) -> str:
    """The shortest text that reads back the same binary32; nothing for NaN."""
    if math.isnan(value):
        return ""
    text = str(np.float32(value)).removesuffix(".0")
    return min(str(int(value)), text, key=len) if "e+" in text else text


def _lock(descriptor: int) -> None:
    """As the tool locks what it records, where system and file system can. Raises BlockingIOError."""
    try:
        import fcntl

        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise
    except (ImportError, OSError):
        return


class LineFile:
    """Whole lines, one at a time. Raises InputError."""

    def __init__(self, path: "str | os.PathLike[str]", replace: bool) -> None:
        self.path = os.fspath(path)
        try:
            self._is_new = not os.path.exists(self.path)
            self._file = open(self.path, "ab" if replace else "xb", buffering=0)
            if os.path.isfile(self.path):
                _lock(self._file.fileno())
                self._file.truncate(0)
        except BlockingIOError:
            raise InputError(f"{self.path}: is being recorded; give another name") from None
        except FileExistsError:
            raise InputError(f"{self.path}: exists; give replace=True or another name") from None
        except OSError as error:
            raise InputError(f"{self.path}: {error.strerror}; choose another place") from None
        self._length = 0

    def line(self, text: str) -> None:
        self.write(text.encode("utf-8") + b"\n")

    def write(self, data: bytes) -> None:
        try:
            while data:
                written = self._file.write(data)
                self._length += written
                data = data[written:]
        except OSError as error:
            raise InputError(f"{self.path}: {error.strerror}; the file ends early") from None

    def tell(self) -> int:
        return self._length

    def flush(self) -> None:
        """Nothing waits to be written."""

    def close(self) -> None:
        try:
            self._file.close()
            if not self._length and self._is_new:  # nothing could be written
                os.remove(os.path.realpath(self.path))
        except OSError as error:
            raise InputError(f"{self.path}: {error.strerror}; the file ends early") from None
