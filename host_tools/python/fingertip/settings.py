"""What Fingertip.set is given, as commands; line.py lists the settings with their ranges."""

import itertools
import math
from collections.abc import Mapping
from typing import Any

from .errors import BadValueError
from .line import SETTINGS, Setting
from .wire import Body, Info


Given = Mapping[str, float | str | None]


def _number(setting: Setting, value: float | str | None) -> float | None:
    """Of what is given, which may be a word."""
    if value is None or not setting.words:
        assert not isinstance(value, str)
        return value
    if value not in setting.words:
        raise BadValueError(f"{setting.argument} {value!r} is unknown; give {setting.give}")
    return (*setting.choices, 0)[setting.words.index(str(value))]


def _wanted(setting: Setting, given: Given, now: Info) -> float:
    """What is given, else its default, else as it is now."""
    value = _number(setting, given[setting.argument])
    if value is not None and setting.needs and given[setting.needs] is None:
        raise BadValueError(f"{setting.argument} needs {setting.needs}")
    if value is None and setting.default is not None:
        return 0.0 if given[setting.needs] == 0 else setting.default
    if value is None:
        value = getattr(now, setting.info)
        if value is None or math.isnan(value):
            raise BadValueError(f"firmware of scene {now.scene} knows no {setting.of}")
        value /= setting.per
    return value


def setting_commands(given: Given, now: Info) -> list[Body]:
    """Of the arguments of Fingertip.set; None: not given. Raises BadValueError."""
    commands: list[Body] = []
    for command, group in itertools.groupby(SETTINGS, lambda setting: setting.command):
        settings = list(group)
        if all(given[setting.argument] is None for setting in settings):
            continue
        values = [_wanted(setting, given, now) for setting in settings]
        zeros = not any(values)
        for setting, value in zip(settings, values, strict=True):
            in_range = setting.least <= value <= setting.most and (not setting.choices or value in setting.choices)  # NaN is in no range
            if not in_range and not (zeros and setting.zero):
                raise BadValueError(f"{setting.argument} {value:g} is out of range; give {setting.give}")
        fields: dict[str, Any] = {
            setting.field: round(value * setting.per) if setting.whole else value for setting, value in zip(settings, values, strict=True)
        }
        commands.append(command(**fields))
    return commands
