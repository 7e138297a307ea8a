"""Who judges the topics of ROS 2: Fast DDS, which ROS 2 has as its default, and rosbags. Needs rosbags (tests/requirements.txt)."""

# real time: discovery and delivery by DDS on a network
import contextlib
import os
import struct
import subprocess
import time

from fingertip import ros2
from fingertip.ros_messages import schema_of
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

PATIENCE_s = 60
DOMAIN = 1 + os.getpid() % 200
LOCAL = {"ROS_LOCALHOST_ONLY": "1", "ROS_DOMAIN_ID": str(DOMAIN)}  # an environment whose DDS stays on the loopback interface
SERIAL = "E660583883265A2C"  # of the fake device where none is said
KINDS = {f"/fingertip/{SERIAL}/{topic}": kind for topic, kind in ros2.FRAME_TOPICS.items()} | {"/diagnostics": ros2.DIAGNOSTICS_TYPE}


def wait_for(what, condition):
    end_s = time.monotonic() + PATIENCE_s
    while not condition():
        if time.monotonic() > end_s:
            raise AssertionError(f"waited in vain for {what}")
        time.sleep(0.02)


def _dds_name(kind):
    package, name = kind.split("/")
    return f"{package}::msg::dds_::{name}_"


class Ears:
    """Fast DDS on all topics of that fingertip. program: fast_dds_listener; folder: for what it hears."""

    def __init__(self, program, folder):
        self.folder = folder
        self.said = open(folder / "said", "w", encoding="utf-8")
        wanted = [f"rt{topic}={_dds_name(kind)}" for topic, kind in KINDS.items()]
        self.process = subprocess.Popen([program, str(DOMAIN), folder, *wanted], stdin=subprocess.PIPE, stdout=self.said)

    def wait_until_they_hear(self, publisher):
        """All that is published from then on."""
        self.wait_for("matched")
        wait_for("listeners", lambda: all(publisher.listeners.values()))

    def wait_for(self, word):
        """matched: it knows of all topics; gone: of none any more."""
        wanted = {f"{word} rt{topic}" for topic in KINDS}
        wait_for(wanted, lambda: wanted <= set((self.folder / "said").read_text(encoding="utf-8").splitlines()))

    def wait_for_all(self, publisher):
        """It has heard what was published, or hears no more of it."""
        with contextlib.suppress(AssertionError):
            wait_for("messages", lambda: {topic: len(self.messages(topic)) for topic in KINDS} == publisher.sent)

    def file_of(self, topic):
        return self.folder / f"{list(KINDS).index(topic)}.bin"

    def close(self):
        """Topic -> its messages, as they came."""
        self.process.stdin.close()
        if self.process.wait(PATIENCE_s) != 0:
            raise AssertionError("the listener failed")
        self.said.close()
        return {topic: self.messages(topic) for topic in KINDS}

    def messages(self, topic):
        """Those that are there in whole."""
        data, at, found = self.file_of(topic).read_bytes(), 0, []
        while at + 4 <= len(data):
            (length,) = struct.unpack_from("<I", data, at)
            at += 4 + length
            if at <= len(data):
                found.append(data[at - length : at])
        return found


class Rosbags:
    """With its own definitions of ROS 2 Humble, beside which there is only what is ours."""

    def __init__(self):
        self.store = get_typestore(Stores.ROS2_HUMBLE)
        own = "fingertip_msgs/msg/Contact"
        self.store.register({own: get_types_from_msg(schema_of("fingertip_msgs/Contact"), own)[own]})

    def writes_the_same(self, kind, data):
        """Whether it writes what it read in these bytes as they were; DDS pads to four."""
        name = kind.replace("/", "/msg/")
        again = bytes(self.store.serialize_cdr(self.store.deserialize_cdr(data, name), name))
        return data == again + bytes(-len(again) % 4)
