"""Fleet files: which bridges, robots and modules there are, in TOML.

A file is read strictly: every mistake in it is named with its line, and a file with
one shows nothing. What its keys mean is in ``docs/howto/fleet-file.md``.
"""

from webmap.cli.fleet.file import read_fleet
from webmap.cli.fleet.schema import Fleet

__all__ = ["Fleet", "read_fleet"]
