"""Text files, line by line, and numbers as text in them."""
import math
import os

import numpy as np

from .errors import InputError


def shortest(value: float) -> str:
    """The shortest text that reads back the same binary32; nothing for NaN."""
    if math.isnan(value):
        return ""
    return str(np.float32(value)).removesuffix(".0")


class LineFile:
    """Whole lines, one at a time. Raises InputError."""

    def __init__(self, path: "str | os.PathLike[str]", replace: bool) -> None:
        self.path = os.fspath(path)
        try:
            self._file = open(self.path, "wb" if replace else "xb", buffering=0)
        except FileExistsError:
            raise InputError(f"{self.path}: exists; give replace=True or another name") from None
        except OSError as error:
            raise InputError(f"{self.path}: {error.strerror}; choose another place") from None

    def line(self, text: str) -> None:
        self.append(text.encode("utf-8") + b"\n")

    def append(self, data: bytes) -> None:
        try:
            while data:
                data = data[self._file.write(data):]
        except OSError as error:
            raise InputError(f"{self.path}: {error.strerror}; the file ends early") from None

    def close(self) -> None:
        try:
            self._file.close()
        except OSError as error:
            raise InputError(f"{self.path}: {error.strerror}; the file ends early") from None
