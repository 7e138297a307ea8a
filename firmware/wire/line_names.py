"""Names that the programs of line.toml share."""

MADE_BY = "written by firmware/wire/line.py from line.toml; change it there"
SETS = {"flags": "Flag", "streams": "Streams", "capabilities": "Capability", "stored": "Stored"}
