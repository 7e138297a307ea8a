"""So much of LeRobot 0.6's robots as a plugin meets: the registry, and how a robot is found by its options' name."""

import dataclasses
import importlib


@dataclasses.dataclass(kw_only=True)
class RobotConfig:
    id: str | None = None
    calibration_dir: str | None = None

    def __post_init__(self):
        pass

    known = {}

    @classmethod
    def register_subclass(cls, name):
        def register(subclass):
            cls.known[name] = subclass
            return subclass

        return register

    @classmethod
    def get_choice_class(cls, name):
        return cls.known[name]


class Robot:
    def __init__(self, config):
        self.id = config.id

    def __str__(self):
        return f"{self.id} {type(self).__name__}"


def make_robot_from_config(config):
    package = importlib.import_module(type(config).__module__.rpartition(".")[0])
    return getattr(package, type(config).__name__.removesuffix("Config"))(config)
