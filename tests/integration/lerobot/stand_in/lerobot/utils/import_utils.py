import importlib
import importlib.metadata


def register_third_party_plugins():
    for distribution in importlib.metadata.distributions():
        if (distribution.metadata.get("Name") or "").startswith("lerobot_robot_"):
            importlib.import_module(distribution.metadata["Name"])
