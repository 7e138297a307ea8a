"""A robot with fingertips."""

import contextlib
from functools import cached_property
from typing import Any

import draccus
from fingertip import Fingertip, FingertipError
from lerobot.robots import Robot, RobotConfig, make_robot_from_config
from lerobot.utils.errors import DeviceAlreadyConnectedError, DeviceNotConnectedError

from .config_fingertip_robot import FingertipRobotConfig
from .observation import features, observation

LATEST_s = 0.2


def _way(place: str) -> dict[str, str]:
    return {"port": place} if "/" in place or place.upper().startswith("COM") else {"serial": place}


class FingertipRobot(Robot):
    """The robot of its options, whose observations also hold what fingertips feel (observation.py). Raises DeviceNotConnectedError for a
    fingertip that is not there or is silent."""

    config_class = FingertipRobotConfig
    name = "fingertip"

    def __init__(self, config: FingertipRobotConfig) -> None:
        super().__init__(config)
        self.config = config
        self.robot = make_robot_from_config(draccus.decode(RobotConfig, {"id": config.id, **config.robot}))
        self._fingertips: dict[str, Fingertip] = {}

    @property
    def cameras(self) -> dict[str, Any]:
        return getattr(self.robot, "cameras", {})

    @cached_property
    def observation_features(self) -> dict[str, Any]:
        own = [feature for name in self.config.fingertips for feature in features(name, self.config.sensors)]
        taken = set(own) & set(self.robot.observation_features)
        if taken:
            raise ValueError(f"the robot has {min(taken)} itself; give the fingertip another name")
        return {**self.robot.observation_features, **dict.fromkeys(own, float)}

    @cached_property
    def action_features(self) -> dict[str, Any]:
        return self.robot.action_features

    @property
    def is_connected(self) -> bool:
        return bool(self._fingertips) and self.robot.is_connected

    def connect(self, calibrate: bool = True) -> None:
        if self.is_connected:
            raise DeviceAlreadyConnectedError(f"{self} is connected")
        with contextlib.ExitStack() as opened:
            found = {}
            for name, place in self.config.fingertips.items():
                try:
                    found[name] = opened.enter_context(Fingertip(**_way(place), buffer_frames=1))
                except FingertipError as error:
                    raise DeviceNotConnectedError(f"fingertip {name}: {error}") from None
                if self.config.sensors not in (0, found[name].info.sensors):
                    raise DeviceNotConnectedError(f"fingertip {name} has {found[name].info.sensors} sensors; give --robot.sensors")
            self.robot.connect(calibrate)
            self._fingertips = found
            opened.pop_all()

    @property
    def is_calibrated(self) -> bool:
        return self.robot.is_calibrated

    def calibrate(self) -> None:
        self.robot.calibrate()

    def configure(self) -> None:
        self.robot.configure()

    def get_observation(self) -> dict[str, Any]:
        self._must_be_connected()
        found = dict(self.robot.get_observation())
        for name, fingertip in self._fingertips.items():
            try:
                found |= observation(name, fingertip.latest(LATEST_s), self.config.sensors)
            except FingertipError as error:
                raise DeviceNotConnectedError(f"fingertip {name}: {error}") from None
        return found

    def send_action(self, action: dict[str, Any]) -> dict[str, Any]:
        self._must_be_connected()
        return self.robot.send_action(action)

    def disconnect(self) -> None:
        self._must_be_connected()
        for fingertip in self._fingertips.values():
            fingertip.close()
        self._fingertips = {}
        self.robot.disconnect()

    def _must_be_connected(self) -> None:
        if not self.is_connected:
            raise DeviceNotConnectedError(f"{self} is not connected")
