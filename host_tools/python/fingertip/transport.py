"""Ways to a fingertip: a serial port, or the socket of `fingertip serve`."""

import contextlib
import errno
import os
import socket
import stat
import sys
from typing import Protocol

from . import host_time
from .errors import GoneError, NoSuchPortError, NotAPortError, NotSharedError, PermissionDeniedError, PortError, PortInUseError

BAUD = 115200  # USB does not care
WRITE_TIMEOUT_s = 1.0
READ_BYTES = 65536
ADDRESS_BYTES = 108  # of a Unix socket on Linux: sun_path of fingertip's tools, whole


class Transport(Protocol):
    description: str

    def read(self, wait_s: float, settle_s: float) -> bytes:
        """What has come, settle_s after its first byte; nothing if none comes in wait_s. Raises GoneError."""
        ...

    def write(self, data: bytes) -> None:
        """Raises GoneError."""
        ...

    def close(self) -> None: ...


def _read_descriptor(fd: int, wait_s: float, settle_s: float) -> bytes:
    """Raises OSError at its end."""
    if not host_time.readable(fd, wait_s):
        return b""
    if settle_s > 0:
        host_time.sleep(settle_s)
    data = os.read(fd, READ_BYTES)
    if not data:
        raise OSError(errno.EIO, "end")
    return data


def _port_error(path: str, error: OSError) -> PortError:
    """pyserial has the reason in errno, on Windows only in its text."""
    text = str(error)
    code = error.errno
    if code in (errno.ENOENT, errno.ENODEV, errno.ENXIO) or "FileNotFoundError" in text:
        return NoSuchPortError(f"{path}: no such port")
    if code in (errno.EBUSY, errno.EAGAIN) or "exclusively lock" in text or (sys.platform == "win32" and "PermissionError" in text):
        return PortInUseError(f"{path}: in use by another program, or by a Fingertip of this one that was not closed")
    if code in (errno.EACCES, errno.EPERM):
        return PermissionDeniedError(f"{path}: permission denied")
    if code == errno.ENOTTY or "Could not configure port" in text:
        return NotAPortError(f"{path}: no serial port")
    return PortError(f"{path}: cannot open ({error.strerror or text})")


class SerialTransport:
    """pyserial's port. On Linux and macOS it is locked as fingertip's tools lock it: the second program gets an error."""

    def __init__(self, path: str) -> None:
        import serial

        self.description = path
        try:
            self._port = serial.Serial(path, BAUD, timeout=0.05, write_timeout=WRITE_TIMEOUT_s, exclusive=sys.platform != "win32" or None)
        except (OSError, ValueError) as error:  # SerialException is an OSError
            raise _port_error(path, error if isinstance(error, OSError) else OSError(None, str(error))) from None

    def read(self, wait_s: float, settle_s: float) -> bytes:
        try:
            if sys.platform != "win32":
                return _read_descriptor(self._port.fileno(), wait_s, settle_s)
            if self._port.timeout != wait_s:
                self._port.timeout = wait_s
            data = self._port.read(1)
            if data:
                host_time.sleep(settle_s)
                data += self._port.read(self._port.in_waiting)
            return bytes(data)
        except OSError:
            raise GoneError(f"{self.description}: vanished") from None

    def write(self, data: bytes) -> None:
        try:
            self._port.write(data)
        except OSError:
            raise GoneError(f"{self.description}: takes nothing") from None

    def close(self) -> None:
        with contextlib.suppress(OSError):
            self._port.close()


SHARE_IS_FULL = b"\0is full\0"  # from `fingertip serve` to one program too many (share_socket.hpp)


class SocketTransport:
    """A Unix socket of `fingertip serve`; other programs have theirs at the same time."""

    _GONE = "its server ended it"
    _socket: socket.socket

    def __init__(self, path: str) -> None:
        self.description = path
        if sys.platform == "win32":
            raise NotSharedError(f"{path}: no program shares a fingertip on Windows")
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            self._socket.connect(path)
        except PermissionError:
            self._socket.close()
            raise PermissionDeniedError(f"{path}: permission denied: it is its owner's and group's") from None
        except OSError:
            self._socket.close()
            raise NotSharedError(f"{path}: no program shares a fingertip there") from None
        self._socket.settimeout(WRITE_TIMEOUT_s)

    def read(self, wait_s: float, settle_s: float) -> bytes:
        try:
            data = _read_descriptor(self._socket.fileno(), wait_s, settle_s)
        except OSError:
            raise GoneError(f"{self.description}: {self._GONE}") from None
        if data == SHARE_IS_FULL:
            raise PortInUseError(f"{self.description}: as many programs use this fingertip as can share it")
        return data

    def write(self, data: bytes) -> None:
        try:
            self._socket.sendall(data)
        except OSError:
            raise GoneError(f"{self.description}: takes nothing") from None

    def close(self) -> None:
        self._socket.close()


class SimulatedTransport(SocketTransport):
    """A simulated port, which is a socket: its name in the abstract namespace is this end's, and keeps out others."""

    _GONE = "vanished"

    def __init__(self, path: str) -> None:
        self.description = path
        if sys.platform == "win32":
            raise NotAPortError(f"{path}: no serial port")
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            self._socket.bind(b"\0" + os.fsencode(os.path.realpath(path)).ljust(ADDRESS_BYTES - 1, b"\0"))
            self._socket.connect(path)
        except OSError as error:
            self._socket.close()
            raise _port_error(path, OSError(errno.EBUSY, "") if error.errno == errno.EADDRINUSE else error) from None
        self._socket.settimeout(WRITE_TIMEOUT_s)


def _is_socket(path: str) -> bool:
    try:
        return stat.S_ISSOCK(os.stat(path).st_mode)
    except OSError:
        return False


def open_endpoint(port: str, share_socket: str) -> Transport:
    """The socket, if it is there."""
    if share_socket:
        return SocketTransport(share_socket)
    return SimulatedTransport(os.fspath(port)) if _is_socket(port) else SerialTransport(os.fspath(port))
