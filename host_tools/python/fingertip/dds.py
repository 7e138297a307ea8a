"""A participant of a ROS 2 domain without ROS: bytes of ROS 2 messages go out on DDS, under ROS 2's names of topics and types.

Needs the package cyclonedds.
"""

import contextlib
import functools
import os
from typing import Any

from .errors import InputError
from .ros_messages import fields_of

try:
    import cyclonedds.core
    import cyclonedds.domain
    import cyclonedds.idl
    import cyclonedds.idl.types as idl
    import cyclonedds.pub
    import cyclonedds.qos
    import cyclonedds.topic
except ImportError:
    raise InputError("ROS 2 topics need the package cyclonedds; pip install cyclonedds") from None

HISTORY = 1000  # messages that are kept for who has not acknowledged them: 0.8 s at the highest rate
BLOCKING_ns = 5_000_000
LOOPBACK = (
    "<CycloneDDS><Domain><General><Interfaces><NetworkInterface address='127.0.0.1'/></Interfaces><AllowMulticast>false</AllowMulticast></General>"
    "<Discovery><ParticipantIndex>auto</ParticipantIndex><Peers><Peer address='127.0.0.1'/></Peers></Discovery></Domain></CycloneDDS>"
)
# Who is late is waited for no longer than that. A reliable writer is heard by best-effort readers too, the other way round not.
QOS = cyclonedds.qos.Qos(
    cyclonedds.qos.Policy.Reliability.Reliable(BLOCKING_ns),
    cyclonedds.qos.Policy.History.KeepLast(HISTORY),
    cyclonedds.qos.Policy.Durability.Volatile,
    cyclonedds.qos.Policy.DataRepresentation(use_cdrv0_representation=True),
)

_SEQUENCE: Any = idl.sequence


@functools.cache
def _type_of(name: str) -> Any:
    """What "geometry_msgs/WrenchStamped" is for cyclonedds, made of CDR bytes; ROS 2 calls it geometry_msgs::msg::dds_::WrenchStamped_."""
    package, kind = name.split("/")
    fields = {}
    for field, of, is_sequence in fields_of(name):
        inner = _type_of(of) if "/" in of else {"string": str, "bool": bool}.get(of) or getattr(idl, of)
        fields[field] = _SEQUENCE[inner] if is_sequence else inner
    made: Any = cyclonedds.idl.make_idl_struct(kind + "_", f"{package}.msg.dds_.{kind}_", fields, dataclassify=False)
    made.__init__ = lambda self, data: setattr(self, "data", data)
    made.serialize = lambda self, **_: self.data
    return made


def participant_of(domain: int, loopback_only: bool) -> tuple[Any, ...]:
    """domain: 0 to 232; loopback_only: nothing leaves the computer. cyclonedds deletes it with its last reference. Raises InputError."""
    try:
        own = os.environ.get("CYCLONEDDS_URI", "")
        kept = (cyclonedds.domain.Domain(domain, f"{own},{LOOPBACK}" if own else LOOPBACK),) if loopback_only else ()
        return (cyclonedds.domain.DomainParticipant(domain), *kept)
    except cyclonedds.core.DDSException as error:
        raise InputError(f"DDS domain {domain}: {error}; is there a network, and is CYCLONEDDS_URI right?") from None


class Topic:
    """A topic "/fingertip/..." of messages "geometry_msgs/WrenchStamped". sent: messages that went out; refused: those that a late reader had no room for."""

    def __init__(self, participant: Any, name: str, kind: str) -> None:
        self.name = name
        self.sent = self.refused = 0
        self._kind = _type_of(kind)
        self._writer: Any = cyclonedds.pub.DataWriter(participant, cyclonedds.topic.Topic(participant, "rt" + name, self._kind), qos=QOS)

    def send(self, data: bytes, time_ns: int) -> None:
        """time_ns: since 1970, which DDS hands on as the source's time."""
        try:
            self._writer.write(self._kind(data), time_ns)
            self.sent += 1
        except cyclonedds.core.DDSException as error:
            if error.code != cyclonedds.core.DDSException.DDS_RETCODE_TIMEOUT:
                raise InputError(f"DDS: {error}") from None
            self.refused += 1

    @property
    def listeners(self) -> int:
        """How many readers will get what is sent from now on."""
        return len(self._writer.get_matched_subscriptions())

    def close(self, patience_s: float) -> None:
        """Once all is acknowledged, or after that time."""
        if self._writer:
            with contextlib.suppress(AttributeError):  # which cyclonedds 11.0.1 raises when the time is over
                self._writer.wait_for_acks(round(patience_s * 1e9))
            self._writer = None
