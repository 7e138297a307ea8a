"""Its options; apart from the robot, as LeRobot's conventions have it."""

from dataclasses import dataclass, field
from typing import Any

from lerobot.robots import RobotConfig


@RobotConfig.register_subclass("fingertip")
@dataclass(kw_only=True)
class FingertipRobotConfig(RobotConfig):
    """robot: type and options of what carries the fingertips, not a RobotConfig, for draccus cannot parse one within itself. fingertips: name ->
    serial number or port. sensors: of each; 0: no pressures."""

    robot: dict[str, Any] = field(default_factory=dict)
    fingertips: dict[str, str] = field(default_factory=dict)
    sensors: int = 15

    def __post_init__(self) -> None:
        super().__post_init__()
        if "type" not in self.robot:
            raise ValueError('no robot; give --robot.robot="{type: so101_follower, port: /dev/ttyACM0}"')
        if not self.fingertips:
            raise ValueError('no fingertips; give --robot.fingertips="{left: SERIAL, right: SERIAL}"')
        if not 0 <= self.sensors <= 32:
            raise ValueError(f"sensors {self.sensors} is out of range; give 0 to 32")
