"""What a frame is for a policy: floats, none of them NaN. Knows nothing of LeRobot."""

import math

from fingertip import Flag, Frame

STATES = ("contact", "trusted", "tangential")
TRUSTED = ("force_N", "x_mm", "y_mm", "location_sd_mm", "slip_mm")
TANGENTIAL = ("qx_N", "qy_N")


def features(name: str, sensors: int) -> list[str]:
    """Of a fingertip of this name. LeRobot hands policies only what ends in .pos or .vel."""
    return [f"{name}.{quantity}.pos" for quantity in (*STATES, *TRUSTED, *TANGENTIAL, *(f"s{k}_Pa" for k in range(sensors)))]


def observation(name: str, frame: Frame, sensors: int) -> dict[str, float]:
    """By the names of features()."""
    flags = frame.flags
    tangential = frame.trusted and flags & (Flag.TANGENTIAL_VALID | Flag.TANGENTIAL_FROM_TOUCH) == Flag.TANGENTIAL_VALID
    values = [float(bool(flags & Flag.CONTACT)), float(frame.trusted), float(tangential)]
    values += [getattr(frame, quantity) if frame.trusted else 0.0 for quantity in TRUSTED]
    values += [getattr(frame, quantity) if tangential else 0.0 for quantity in TANGENTIAL]
    if sensors:
        above = frame.sensors_Pa - frame.tare_Pa if flags & Flag.TARED else ()
        values += [float(value) for value in above] if len(above) == sensors else [0.0] * sensors
    return {feature: 0.0 if math.isnan(value) else value for feature, value in zip(features(name, sensors), values)}
