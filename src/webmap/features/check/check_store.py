"""The last check of each robot, kept over restarts with its lines and the person."""

import hashlib
import logging
import time
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from webmap.base.errors import ConfigError
from webmap.base.plain_files import read_file, write_file
from webmap.core.alignment_store import name_of
from webmap.features.check.check import Check, Line
from webmap.gate.locks import state_folder

if TYPE_CHECKING:
    from webmap.core.robot import Robot

log = logging.getLogger("webmap.check")

LARGEST = 1 << 16
"""Most bytes of a file."""


class Result(msgspec.Struct, frozen=True):
    """A check that is over."""

    robot: str
    at: float
    """When, in seconds since 1970."""
    by: str
    passed: bool
    lines: list[Line]
    why: str = ""


_known: dict[str, Result | None] = {}


def last_of(robot: "Robot") -> Result | None:
    """Return the last check of a robot; its file is read once."""
    file = _file_of(robot)
    if file.name not in _known:
        _known[file.name] = _read(file)
    return _known[file.name]


def keep(robot: "Robot", check: Check, by: str) -> Result:
    """Remember a check that is over, and return its result for the file."""
    result = Result(robot.name, time.time(), by, check.passed, check.lines, check.why)
    _known[_file_of(robot).name] = result
    # The place where the shift log notes a check, with the person and the lines.
    passed = "passed" if check.passed else "failed"
    log.info("%s: the check before driving by %s has %s", robot.name, by, passed)
    return result


def write(robot: "Robot", result: Result) -> None:
    """Write a result to the disk; may take long, and logs an error."""
    file = _file_of(robot)
    try:
        write_file(file, msgspec.json.encode(result))
    except OSError as error:
        log.error("%s: the check of %s is not kept: %s", file, robot.name, error)


def _file_of(robot: "Robot") -> Path:
    bridge = robot.pose_source.bridge
    name = robot.id if bridge is None else name_of(bridge, robot.name)
    digest = hashlib.sha256(name.encode()).hexdigest()[:24]
    return state_folder() / "checks" / f"{digest}.json"


def _read(file: Path) -> Result | None:
    try:
        data = read_file(file, LARGEST, links=False)
        return msgspec.json.decode(data, type=Result)
    except FileNotFoundError:
        return None
    except (OSError, ConfigError, msgspec.DecodeError, RecursionError) as error:
        log.warning("%s cannot be read (%s): no check is shown", file, error)
        return None
