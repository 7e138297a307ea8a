"""What can go wrong, each with a type of its own and one line of text.

All of them are FingertipError; anything else that is raised is a mistake in this package or in its caller.
"""


class FingertipError(Exception):
    """Base of all errors of this package."""


class InputError(FingertipError):
    """A file or an argument that the user can mend; the text names file and line and states what to do. Of a long one the middle is left out."""

    def __init__(self, text: str = "") -> None:
        super().__init__(text if len(text) <= 600 else f"{text[:300]} ... {text[-300:]}")


class BadValueError(FingertipError, ValueError):
    """A wrong argument; the text states which values are good. Nothing was sent."""


class NoFingertipError(FingertipError):
    """None is plugged in, named or shared, or none has the wanted serial number."""


class SeveralFingertipsError(FingertipError):
    """None was chosen; the text names those that are there."""


class OtherFingertipError(FingertipError):
    """The port's is not the wanted one, or not the one that was there before."""


class PortError(FingertipError):
    """The port cannot be opened."""


class NoSuchPortError(PortError):
    """Nothing has this name."""


class NotAPortError(PortError):
    """Something has this name, but it is no serial port."""


class PortInUseError(PortError):
    """Another program has it open; `fingertip serve` shares a fingertip between programs."""


class PermissionDeniedError(PortError):
    """This user may not open it; on Linux `fingertip rule` prints the udev rule that allows it."""


class NotSharedError(PortError):
    """No program serves this fingertip to others."""


class GoneError(FingertipError):
    """The port vanished: unplugged, reset, or its server ended."""


class NoAnswerError(FingertipError):
    """No answer to a command, in all the time that it was given."""


class NoFrameError(FingertipError, TimeoutError):
    """No frame came in time, though the port is there."""


class OtherVersionError(FingertipError):
    """It speaks another version of the protocol; `fingertip flash` puts this one's firmware on it."""


class RefusedError(FingertipError):
    """The fingertip refused a command. result: as in the acknowledgement."""

    def __init__(self, text: str, result: int) -> None:
        super().__init__(text)
        self.result = result


class UnknownCommandError(RefusedError):
    """Its firmware does not know the command, or lacks the capability."""


class RefusedValueError(RefusedError):
    """Out of its firmware's range."""


class NotNowError(RefusedError):
    """Not in the state that it is in: tare while something presses, storing while a write is under way."""


class PacketError(FingertipError):
    """Bytes that are no packet. A Decoder counts them instead."""


class CrcError(PacketError):
    """The CRC is wrong: damaged on the way."""


class FormatError(PacketError):
    """No frame of this protocol, or a value that it does not allow."""


class PacketVersionError(PacketError):
    """Undamaged, of another version of the protocol."""

    def __init__(self, version: int) -> None:
        super().__init__(f"protocol version {version}")
        self.version = version


class UnknownTypeError(PacketError):
    """Undamaged, of a type that this package does not know: from a newer firmware."""

    def __init__(self, type: int, sequence: int) -> None:
        super().__init__(f"packet type 0x{type:02x}")
        self.type = type
        self.sequence = sequence
