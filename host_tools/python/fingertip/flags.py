"""What the sets of flags share."""

import enum


class Flags(enum.IntFlag):
    """A number whose text is the names of its bits: LOW_SIGNAL|FLAT."""

    def __str__(self) -> str:
        return "|".join(each.name or "" for each in type(self) if each and each & self == each) or str(int(self))
