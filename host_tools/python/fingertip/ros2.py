"""Fingertips as topics of ROS 2, from a computer without ROS: DDS by cyclonedds, the messages of MCAP recordings (messages.py).

    fingertip-ros2 [--device SERIAL ...] [--port PORT ...] [--domain N] [--seconds S]

Header stamps are the computer's clock (system time) at the middle of the sensors' conversion. QoS: reliable, volatile, the last 1000
of each topic: readers of sensor data hear it too, and one that stalls for longer than 0.7 s misses what is older, while this goes on.
ROS_DOMAIN_ID, ROS_LOCALHOST_ONLY=1 and ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST act as in ROS 2, CYCLONEDDS_URI as in cyclonedds. Judged by
Fast DDS and rosbags.
"""

import math
import os
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from . import host_time
from .closing import Closing
from .command import Parser, check_range
from .device import Fingertip
from .errors import BadValueError, FingertipError
from .frames import Q10, Frame
from .group import Fingertips
from .messages import DIAGNOSTICS_TYPE, FRAME_TOPICS, FrameMessages, diagnostics, health_status, name_in_ros
from .network import until_ended
from .wire import Contact, Health

if TYPE_CHECKING:
    from .dds import Topic

DOMAIN_MAX = 232  # whose ports are below 65536
POLL_s = 0.1
CLOSING_s = 1.0
_CONTACT_FIELDS = tuple(name.lower() for name in Contact._fields)


def domain_of_environment() -> int:
    """ROS_DOMAIN_ID, or 0. Raises BadValueError."""
    text = os.environ.get("ROS_DOMAIN_ID", "") or "0"
    if not (text.isascii() and text.isdigit() and int(text) <= DOMAIN_MAX):
        raise BadValueError(f"ROS_DOMAIN_ID {text} is out of range; give 0 to {DOMAIN_MAX}")
    return int(text)


def contact_of_frame(frame: Frame) -> dict[str, Any]:
    """fingertip_msgs/Contact, without its header: of no recording, hence of no line."""
    raw, row = frame.raw, dict(zip(_CONTACT_FIELDS, frame.contact))
    row |= {"line": 0, "device": 0, "time_us": math.nan, "t_us": frame.t_us, "frame": frame.frame}
    row |= {"has_contact": frame.has_contact, "sequence": max(frame.sequence, 0), "has_raw": frame.has_raw}
    row |= {"raw_sequence": max(frame.raw_sequence, 0), "raw_flags": raw.flags, "valid": raw.valid, "saturated": raw.saturated}
    row |= {"doubtful": raw.doubtful, "temperature_degc": raw.temperature_cC / 100 if frame.has_raw else math.nan}
    pressures, tares = ([value / Q10 for value in raw.readings[at::2]] for at in (0, 1))
    return row | {"pressure_pa": pressures, "tare_pa": tares}


def _system_minus_host_ns() -> int:
    """Of three samples of both clocks the one in which least time passed: another program may run in between."""
    samples = []
    for _ in range(3):
        before_ns, now_ns, after_ns = host_time.now_ns(), host_time.wall_ns(), host_time.now_ns()
        samples.append((after_ns - before_ns, now_ns - before_ns))
    return min(samples)[1]


def utc_ns(frame: Frame) -> int:
    """When it was measured, ns since 1970; now, if the clocks were not compared yet."""
    host_us = frame.host_us
    return host_time.wall_ns() if math.isnan(host_us) else _system_minus_host_ns() + round(host_us * 1000)


class _Device:
    """One fingertip and its topics."""

    def __init__(self, topic: "Callable[[str, str], Topic]", fingertip: Fingertip) -> None:
        self.fingertip = fingertip
        name, info = name_in_ros(fingertip.serial), fingertip.info
        self.messages = FrameMessages(fingertip.serial)
        self.messages.place_sensors(info.x_mm, info.y_mm, info.sensors)
        self.topics = {kind: topic(f"/fingertip/{name}/{of}", kind) for of, kind in FRAME_TOPICS.items()}
        self.health: Health | None = None
        self.is_gone = False


class Publisher(Closing):
    """The topics of fingertips, and /diagnostics. domain: as ROS_DOMAIN_ID has it, if not given. frame() may be called from a thread for each
    fingertip. Raises BadValueError, InputError."""

    def __init__(self, domain: int | None = None) -> None:
        from . import dds  # whose error names what to install

        localhost = os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "").upper() == "LOCALHOST"
        loopback_only = localhost or os.environ.get("ROS_LOCALHOST_ONLY", "") == "1"
        self.domain = domain_of_environment() if domain is None else domain
        if not 0 <= self.domain <= DOMAIN_MAX:
            raise BadValueError(f"domain {self.domain} is out of range; give 0 to {DOMAIN_MAX}")
        self._participant = dds.participant_of(self.domain, loopback_only)
        self._diagnostics = self._topic("/diagnostics", DIAGNOSTICS_TYPE)
        self._lock = threading.Lock()
        self._devices: dict[str, _Device] = {}

    def close(self) -> None:
        """The topics vanish, once all is acknowledged, or a second later. sent and refused stay."""
        end_s = host_time.now_s() + CLOSING_s
        for topic in self._topics():
            topic.close(max(0.0, end_s - host_time.now_s()))
        self._participant = ()

    def _topic(self, name: str, kind: str) -> "Topic":
        from .dds import Topic

        return Topic(self._participant[0], name, kind)

    def add(self, fingertip: Fingertip) -> None:
        self._devices[fingertip.serial] = _Device(self._topic, fingertip)

    def frame(self, frame: Frame) -> None:
        """Sends it on the topics of its fingertip."""
        device = self._devices[frame.serial]
        time_ns = utc_ns(frame)
        for kind, data in device.messages.of(time_ns, contact_of_frame(frame)):
            if kind == DIAGNOSTICS_TYPE:
                self._diagnose(data, time_ns)
            else:
                device.topics[kind].send(data, time_ns)

    def state(self) -> None:
        """Sends on /diagnostics the health that fingertips reported since the last time, and which have gone or are there again."""
        for serial, device in self._devices.items():
            tip = device.fingertip
            if tip.is_returning != device.is_gone:
                device.is_gone = tip.is_returning
                message = "gone; it is waited for" if device.is_gone else "there again"
                status = {"level": 2 * device.is_gone, "name": f"fingertip {serial} line", "message": message, "hardware_id": serial}
                self._state(status | {"values": []})
            health = tip.health
            if health is not None and health is not device.health:
                device.health = health
                fields = {name: str(0 if value is None else value) for name, value in health._asdict().items()}
                self._state(health_status(serial, tip.info.sensors, fields))

    def _state(self, status: dict[str, Any]) -> None:
        time_ns = host_time.wall_ns()
        self._diagnose(diagnostics(time_ns, status), time_ns)

    def _diagnose(self, data: bytes, time_ns: int) -> None:
        with self._lock:
            self._diagnostics.send(data, time_ns)

    @property
    def sent(self) -> dict[str, int]:
        """Messages by topic."""
        return {topic.name: topic.sent for topic in self._topics()}

    @property
    def listeners(self) -> dict[str, int]:
        """Readers by topic, while this is open: those that get what is sent from now on."""
        return {topic.name: topic.listeners for topic in self._topics()}

    @property
    def refused(self) -> int:
        """Messages that a late reader had no room for."""
        return sum(topic.refused for topic in self._topics())

    def _topics(self) -> "list[Topic]":
        return [*(topic for device in self._devices.values() for topic in device.topics.values()), self._diagnostics]


def _follow(publisher: Publisher, fingertip: Fingertip, failures: list[FingertipError]) -> None:
    try:
        for frame in fingertip:
            publisher.frame(frame)
    except FingertipError as error:
        failures.append(error)


def publish(publisher: Publisher, fingertips: Fingertips, is_over: Callable[[], bool]) -> None:
    """Until it is over. Raises FingertipError if one of them ends before."""
    failures: list[FingertipError] = []
    tips = list(fingertips.by_serial.values())
    for tip in tips:
        publisher.add(tip)
    threads = [host_time.thread(_follow, args=(publisher, tip, failures)) for tip in tips]
    for thread in threads:
        thread.start()
    try:
        while not is_over() and not failures:
            publisher.state()
            host_time.sleep(POLL_s)
    finally:
        fingertips.close()
        for thread in threads:
            thread.join()
    if failures:
        raise failures[0]


def main(argv: list[str]) -> int:
    description = "Publishes what fingertips measure on topics of ROS 2, without ROS."
    parser = Parser(prog="fingertip-ros2", description=description)
    parser.add_argument("--device", action="append", metavar="SERIAL", help="a fingertip; all that are there, if none is named")
    parser.add_argument("--port", action="append", metavar="PORT", help="the same, by its serial port")
    parser.add_argument("--domain", type=int, metavar="N", help="0 to 232; as ROS_DOMAIN_ID has it, if not given")
    parser.add_argument("--seconds", type=float, default=math.inf, metavar="S", help="how long; until Ctrl-C, if not given")
    options = parser.parse_args(argv)
    check_range("seconds", options.seconds, 0, math.inf)
    stop = until_ended()
    with Publisher(options.domain) as publisher:
        fingertips = Fingertips(options.port, serials=options.device, reconnect=True)
        end_s = host_time.now_s() + options.seconds
        names = [f"/fingertip/{name_in_ros(serial)}" for serial in fingertips.by_serial]
        print(f"domain {publisher.domain}: {' '.join(names)}", flush=True)
        publish(publisher, fingertips, lambda: stop.is_set() or host_time.now_s() >= end_s)
        for serial, tip in fingertips.by_serial.items():
            frames = publisher.sent[f"/fingertip/{name_in_ros(serial)}/contact"]
            print(f"{serial}: {frames} frames, lost {tip.statistics.dropped_packets + tip.overrun_frames}")
        print("".join(f"{name}: {count} messages\n" for name, count in publisher.sent.items()) + f"refused: {publisher.refused}")
    return 0
