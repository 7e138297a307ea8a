"""Finds fingertips: on USB, in the environment variable FINGERTIP_PORT, and those that `fingertip serve` shares. Nothing is opened
but sockets, to see whether somebody serves them."""

import contextlib
import errno
import os
import pathlib
import socket
import stat
import sys
from typing import NamedTuple

from .errors import NoFingertipError, NotSharedError, SeveralFingertipsError

USB_VID, USB_PID = 0x1209, 0x0001
COMMON_SHARE_FOLDER = pathlib.Path("/run/fingertip")
SIMULATED = "sim:"


class Found(NamedTuple):
    """serial: as far as it is known before asking; port: "" where only a socket is known; share_socket: "" where no program shares it."""

    serial: str
    port: str
    share_socket: str = ""


def is_served(path: pathlib.Path) -> bool:
    """Also if this user may not connect."""
    if sys.platform == "win32":
        return False
    with contextlib.closing(socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)) as probe:
        try:
            probe.connect(str(path))
        except OSError as error:
            return error.errno in (errno.EACCES, errno.EPERM, errno.EAGAIN)
    return True


def share_folders() -> list[pathlib.Path]:
    """This user's, and everybody's; none on Windows."""
    if sys.platform == "win32":
        return []
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    if runtime:
        own = pathlib.Path(runtime) / "fingertip"
    elif os.geteuid() == 0:
        own = COMMON_SHARE_FOLDER
    else:
        own = pathlib.Path(f"/tmp/fingertip-{os.geteuid()}")
        with contextlib.suppress(OSError):
            status = own.lstat()
            if not stat.S_ISDIR(status.st_mode) or status.st_uid != os.geteuid():  # where everybody may make folders
                return [COMMON_SHARE_FOLDER]
    return list(dict.fromkeys((own, COMMON_SHARE_FOLDER)))


def find_shared() -> list[Found]:
    """Those that somebody serves now; none on Windows."""
    found: list[Found] = []
    for folder in share_folders():
        with contextlib.suppress(OSError):
            for path in sorted(folder.glob("*.sock")):
                if is_served(path):
                    link = path.with_suffix(".port")
                    found.append(Found(path.stem, os.readlink(link) if link.is_symlink() else "", str(path)))
    return found


def find_usb() -> list[Found]:
    """Serial ports with our USB ids, sorted by serial number."""
    from serial.tools import list_ports

    return sorted(
        Found(port.serial_number or "", port.device) for port in list_ports.comports() if (port.vid, port.pid) == (USB_VID, USB_PID)
    )


def _port_of(name: str) -> str:
    """The port that "sim:left" names: of a fingertip that `fingertip simulate` simulates; "sim:" is the first. Any other name is a port's own."""
    if not name.startswith(SIMULATED):
        return name
    for folder in share_folders():
        port = folder / "simulated" / (name.removeprefix(SIMULATED) or "left")
        if port.exists():
            return str(port)
    raise NoFingertipError(f"{name}: nothing is simulated there; start `fingertip simulate`, with --lift where two are needed")


def _is_of(shared: Found, found: Found) -> bool:
    same_port = bool(found.port) and bool(shared.port) and os.path.realpath(found.port) == os.path.realpath(shared.port)
    return same_port or (bool(found.serial) and shared.serial.lower() == found.serial.lower())


def find() -> list[Found]:
    """Every fingertip that can be opened: those that FINGERTIP_PORT names, if it names any; else those on USB and those shared."""
    # FINGERTIP_PORT: paths, separated by colons, on Windows by semicolons.
    named, shared = [Found("", path) for path in os.environ.get("FINGERTIP_PORT", "").split(os.pathsep) if path], find_shared()
    ports = named or find_usb()
    found = [port._replace(share_socket=next((each.share_socket for each in shared if _is_of(each, port)), "")) for port in ports]
    if not named:
        found += [each for each in shared if not any(_is_of(each, port) for port in ports)]
    return found


def _with_share(found: Found, share: bool | None) -> Found:
    if share is False:
        if not found.port:
            raise NotSharedError(f"{found.serial}: only its socket is known, {found.share_socket}")
        return found._replace(share_socket="")
    if share and not found.share_socket:
        raise NotSharedError(f"{found.serial or found.port}: no program shares it")
    return found


def choose(port: str | None, serial: str | None, share: bool | None) -> list[Found]:
    """Where the wanted fingertip may be: one way, or several that have to be asked for their serial number."""
    if port is not None:
        port = _port_of(port)
        shared = next((each.share_socket for each in find_shared() if _is_of(each, Found("", port))), "") if share is not False else ""
        return [_with_share(Found("", port, shared), share)]
    found = find()
    if serial is not None:
        certain = [each for each in found if each.serial.lower() == serial.lower()]
        possible = certain or [each for each in found if not each.serial]
        if not possible:
            others = ", there are: " + ", ".join(each.serial for each in found) if found else ""
            raise NoFingertipError(f"no fingertip {serial} here{others}")
        return [_with_share(each, share) for each in possible]
    if not found:
        raise NoFingertipError("no fingertip found; plug one in, name its port, or start `fingertip simulate`")
    if len(found) > 1:
        raise SeveralFingertipsError("several fingertips found, choose one: " + ", ".join(each.serial or each.port for each in found))
    return [_with_share(found[0], share)]
