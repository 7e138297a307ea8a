"""Fingertips as observations of any LeRobot robot; LeRobot imports this by itself."""

from .config_fingertip_robot import FingertipRobotConfig
from .fingertip_robot import FingertipRobot

__all__ = ["FingertipRobot", "FingertipRobotConfig"]
