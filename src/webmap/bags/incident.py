"""Makes a recording of a ring: ``python -m webmap.bags.incident FOLDER FILE``.

It runs in a process of its own, with a low priority, so that a long recording
delays neither the page nor a command.
"""

import contextlib
import json
import os
import re
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec

from webmap.bags import need_rosbags
from webmap.bags.playback import EVENTS
from webmap.bags.recorder import Recorder, new_bag
from webmap.bags.ring import (
    BUSY,
    EventRecord,
    Frame,
    Place,
    PoseRecord,
    Record,
    ScanRecord,
    Velocity,
    VelocityRecord,
    frames_in,
    segments,
)
from webmap.bags.times import SECOND
from webmap.bags.types import Types
from webmap.base.errors import ConfigError
from webmap.base.geometry import Twist
from webmap.base.text import one_line

LEVELS = {"alarm": 30, "stop": 30}
"""The levels of the log lines; an error would be a second mark in the player."""

MAP = "map"

Line = tuple[str, str, int, dict[str, Any]]
"""A topic, its type, a time and a message."""

ZERO: Velocity = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class Messages:
    """Turns the records of all robots into messages of ROS 2."""

    def __init__(self) -> None:
        self._spaces: dict[str, str] = {}
        self._mounts: dict[str, Place] = {}

    def of(self, frame: Frame, record: Record) -> Iterator[Line]:
        """Yield the messages of a record."""
        space = self._spaces.get(frame.robot) or self._add(frame)
        match record:
            case PoseRecord():
                yield _odometry(space, record)
                base = f"{space}/base_link"
                times = record.time, record.stamp
                yield _frame("/tf", *times, MAP, base, record.place)
            case VelocityRecord():
                for name in ("sent", "echoed", "measured"):
                    value = getattr(record, name)
                    if value is not None:
                        topic = f"/{space}/velocity_{name}"
                        yield topic, *_twist(record.time, space, value)
            case ScanRecord():
                if self._mounts.get(space) != record.mount:
                    self._mounts[space] = record.mount
                    base, laser = f"{space}/base_link", f"{space}/laser"
                    times = record.time, record.stamp
                    yield _frame("/tf_static", *times, base, laser, record.mount)
                yield _scan(space, record)
            case EventRecord():
                data = {"kind": record.kind, "text": f"{frame.name}: {record.text}"}
                text = {"data": json.dumps(data)}
                yield EVENTS, "std_msgs/String", record.time, text
                yield _log(frame.name, record)

    def _add(self, frame: Frame) -> str:
        """Return the namespace of a new robot, which no other one has."""
        name = re.sub(r"\W+", "_", frame.name, flags=re.ASCII).strip("_").lower()
        if not name[:1].isalpha():
            name = f"robot_{name}".rstrip("_")
        space, number = name, 2
        while space in self._spaces.values():
            space, number = f"{name}_{number}", number + 1
        self._spaces[frame.robot] = space
        return space


def _odometry(space: str, record: PoseRecord) -> Line:
    message = {
        "header": _header(record.stamp, MAP),
        "child_frame_id": f"{space}/base_link",
        "pose": {"pose": _pose(record.place), "covariance": [0.0] * 36},
        "twist": {
            "twist": Twist(*record.measured or ZERO).to_message(),
            "covariance": [0.0] * 36,
        },
    }
    return f"/{space}/odom", "nav_msgs/Odometry", record.time, message


def _twist(time: int, space: str, value: Velocity) -> tuple[str, int, dict[str, Any]]:
    header = _header(time, f"{space}/base_link")
    message = {"header": header, "twist": Twist(*value).to_message()}
    return "geometry_msgs/TwistStamped", time, message


def _scan(space: str, record: ScanRecord) -> Line:
    ranges = list(memoryview(record.ranges).cast("f"))
    message = {
        "header": _header(record.stamp, f"{space}/laser"),
        "angle_min": record.angle_min,
        "angle_max": record.angle_min
        + record.angle_increment * max(len(ranges) - 1, 0),
        "angle_increment": record.angle_increment,
        "time_increment": 0.0,
        "scan_time": 0.0,
        "range_min": record.range_min,
        "range_max": record.range_max,
        "ranges": ranges,
        "intensities": [],
    }
    return f"/{space}/scan", "sensor_msgs/LaserScan", record.time, message


def _frame(
    topic: str, time: int, stamp: int, parent: str, child: str, place: Place
) -> Line:
    pose = _pose(place)
    transform = {
        "header": _header(stamp, parent),
        "child_frame_id": child,
        "transform": {
            "translation": pose["position"],
            "rotation": pose["orientation"],
        },
    }
    return topic, "tf2_msgs/TFMessage", time, {"transforms": [transform]}


def _log(name: str, record: EventRecord) -> Line:
    message = {
        "stamp": _time(record.time),
        "level": LEVELS.get(record.kind, 20),
        "name": name,
        "msg": record.text,
        "file": "",
        "function": "",
        "line": 0,
    }
    return "/rosout", "rcl_interfaces/Log", record.time, message


def _pose(place: Place) -> dict[str, Any]:
    x, y, z, qx, qy, qz, qw = place
    return {
        "position": {"x": x, "y": y, "z": z},
        "orientation": {"x": qx, "y": qy, "z": qz, "w": qw},
    }


def _header(time: int, frame: str) -> dict[str, Any]:
    return {"stamp": _time(time), "frame_id": frame}


def _time(time: int) -> dict[str, int]:
    return {"sec": time // SECOND, "nanosec": time % SECOND}


def make_recording(folder: Path, file: Path) -> int:
    """Write the segments in a folder to an MCAP file; return its messages.

    Args:
        folder: The segments of a ring.
        file: The recording, which must not exist; its folder is created if missing.

    Raises:
        ConfigError: If there is nothing to record, or rosbags is not installed.
        OSError: If the file cannot be written; nothing of it stays.

    """
    need_rosbags()
    file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    if file.exists():
        raise ConfigError(f"{file} exists already, and nothing is overwritten")
    unfinished = file.with_name(f".{file.stem}.new")
    shutil.rmtree(unfinished, ignore_errors=True)
    try:
        bag = new_bag(unfinished, "ros2")
        recorder = Recorder(bag, Types("ros2"), lambda text: print(text, flush=True))
        try:
            _record(folder, recorder)
        finally:
            bag.close()
        if not recorder.messages:
            raise ConfigError("no robot was seen in the last minutes")
        made = next(unfinished.glob("*.mcap"))
        made.chmod(0o600)
        made.replace(file)
    finally:
        shutil.rmtree(unfinished, ignore_errors=True)
    return recorder.messages


def _record(folder: Path, recorder: Recorder) -> None:
    messages, known = Messages(), set()
    for segment in segments(folder):
        frames = list(frames_in(segment.read_bytes()))
        records = [(frame, each) for frame in frames for each in frame.records]
        records.sort(key=lambda pair: pair[1].time)
        for frame, record in records:
            for topic, type_name, time, message in messages.of(frame, record):
                if topic not in known:
                    known.add(topic)
                    recorder.add(topic, type_name)
                recorder.take(topic, message, time)


def is_alone(folder: Path) -> bool:
    """Return whether no other process makes a recording of this folder.

    The lock ends with this process. A display that is started again while the process
    of the earlier one goes on must not begin anew.
    """
    if sys.platform == "win32":
        return True
    import fcntl

    number = os.open(folder, os.O_RDONLY)  # stays open
    try:
        fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(number)
        return False
    return True


def main() -> int:
    """Make a recording, print a sentence if that fails, and delete the segments."""
    folder, file = map(Path, sys.argv[1:3])
    if not folder.is_dir() or not is_alone(folder):
        return BUSY
    with contextlib.suppress(AttributeError, OSError):
        os.nice(5)
    try:
        make_recording(folder, file)
    except (ConfigError, OSError, msgspec.MsgspecError) as error:
        print(one_line(error), flush=True)
        return 2
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
