"""Written by host_tools/grasp/grip_table.cpp; change the tables of host_tools/grasp."""

import dataclasses
import enum

from .flags import Flags


@dataclasses.dataclass(frozen=True)
class Settings:
    """None: the default of the gripper. set_N chooses the mode that holds this force."""

    set_N: float | None = None
    """Hold this force, not as much as the load needs; 0.1 to 100"""
    cap_N: float | None = None
    """The true force stays below, errors of the fingertips included; 0.5 to 100"""
    travel_cap_mm: float | None = None
    """Never close further since the touch; 0.5 to 100"""
    start_N: float | None = None
    """Force before anything pulls; 0.2 to 100"""
    floor_N: float | None = None
    """Least force once the load is known; more where frames come late; 0.2 to 100"""
    blind_N: float | None = None
    """Force where no load can be estimated; 0.2 to 100"""
    friction: float | None = None
    """Friction coefficient to begin with; 0.1 to 1.5"""
    margin: float | None = None
    """Force divided by load / friction; more where frames come late; 1 to 5"""
    slid: float | None = None
    """Factor on that once the object has slid; 1 to 3"""
    decay_1_s: float | None = None
    """How fast an excess of force decays; 0 to 20"""
    rest_s: float | None = None
    """No decay for this time after a slide; 0 to 60"""
    pull_N: float | None = None
    """Hand over when each fingertip is pulled so hard; 0.2 to 20"""
    mass_kg: float | None = None
    """Expected mass, which decides the first grip; 0: unknown; 0 to 20"""
    lift_m_s2: float | None = None
    """With --mass: acceleration of the arm as it lifts; 0 to 20"""
    touch_N: float | None = None
    """Force at which a touch begins; 0.02 to 2"""
    approach_mm_s: float | None = None
    """Speed until the touch; slower where frames come late; 0.5 to 8"""
    release_mm_s: float | None = None
    """Speed of opening; 0.5 to 100"""
    release_width_mm: float | None = None
    """How far to open; 0 to 500"""
    stale_s: float | None = None
    """Ignore a fingertip without a new frame for this time; 0.005 to 1"""
    late_s: float | None = None
    """Report frames that arrive older than this; 0.005 to 0.5"""
    silent_s: float | None = None
    """Timeout of the gripper; 0.02 to 5"""
    differ: float | None = None
    """Warn if the fingertips' forces differ by more at rest; 0.05 to 1"""
    kp_mm_N: float | None = None
    """With --fixed: the published controller's proportional gain; 0 to 10"""
    ki_mm_Ns: float | None = None
    """Its gain of the integral; 0 to 100"""
    kd_mm_s_N: float | None = None
    """Its gain of the derivative; 0 to 10"""
    control_s: float | None = None
    """Time between two of its steps; 0.0005 to 1"""


@dataclasses.dataclass(frozen=True)
class Traits:
    """A gripper of two parallel fingers; lengths and speeds of the width between its pads."""

    stroke_mm: float
    step_mm: float
    """of the commanded width"""
    deadband_mm: float
    """moves shorter than this are not made"""
    speed_min_mm_s: float
    speed_max_mm_s: float
    force_min_N: float
    force_max_N: float
    """of its own limit of force; 0: it has none"""
    latency_s: float
    """from a command to motion"""
    poll_s: float
    """between two answers, at the least"""


TRAITS = {
    "2f85": Traits(85, 0.3744493392, 0.4, 20, 150, 20, 235, 0.025, 0.005),
    "2f140": Traits(140, 0.6167400881, 0.65, 30, 250, 10, 125, 0.025, 0.005),
    "hande": Traits(50, 0.2202643172, 0.23, 20, 150, 20, 185, 0.025, 0.005),
    "sts3215": Traits(95.89875153, 0.1533980788, 0, 1, 470, 0.95, 19, 0.008, 0.001),
}
"""of the models that the tool drives"""


class State(enum.IntEnum):
    IDLE = 0
    """idle, the width stays"""
    ACTIVATING = 1
    """the gripper is being activated"""
    APPROACH = 2
    """closing until both fingertips feel the object"""
    SQUEEZE = 3
    """squeezing up to the first force"""
    READY = 4
    """squeezed; the present load counts as zero"""
    HOLDING = 5
    """holding"""
    SLIPPING = 6
    """holding, the object slides"""
    PLACING = 7
    """holding until a table has the load, then opening"""
    HANDING = 8
    """holding until it is pulled, then opening"""
    STILL = 9
    """the width stays, nothing is controlled"""
    RELEASE = 10
    """opening"""
    OPEN = 11
    """open"""
    DROPPED = 12
    """nothing is between the fingertips any more; the width stays"""
    MISSED = 13
    """closed, and nothing was there"""
    FAULT = 14
    """fault; the width stays"""


class Trouble(Flags):
    FINGER_0_STALE = 0x1
    FINGER_1_STALE = 0x2
    FINGER_0_FROZEN = 0x4
    FINGER_1_FROZEN = 0x8
    FINGER_0_FORCE_ONLY = 0x10
    FINGER_1_FORCE_ONLY = 0x20
    FINGER_0_OVER = 0x40
    FINGER_1_OVER = 0x80
    FINGERS_DIFFER = 0x100
    AT_CAP = 0x200
    AT_TRAVEL_CAP = 0x400
    GRIPPER_SILENT = 0x800
    GRIPPER_FAULT = 0x1000
    GRIPPER_INACTIVE = 0x2000
    NO_LOAD = 0x4000
    FINGER_0_NO_FORCE = 0x8000
    FINGER_1_NO_FORCE = 0x10000
    FINGER_0_LATE = 0x20000
    FINGER_1_LATE = 0x40000
    FINGER_0_EMPTY = 0x80000
    FINGER_1_EMPTY = 0x100000
    NO_GRIP = 0x200000


class Request(enum.IntEnum):
    GRASP = 0
    HOLD = 1
    RELEASE = 2
    PLACE = 3
    HAND_OVER = 4


class Motion(enum.IntEnum):
    STAY = 0
    ACTIVATE = 1
    MOVE = 2
