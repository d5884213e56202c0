"""Frames captured from a real rosbridge, found again by topic and by service."""

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cbor2

from webmap.errors import ConfigError


@dataclass(slots=True)
class Recording:
    """The frames of a directory."""

    texts: dict[str, str] = field(default_factory=dict)
    """A publication of each topic, as it came."""

    binaries: dict[tuple[str, str], bytes] = field(default_factory=dict)
    """The same by topic and compression, where it was taken."""

    answers: dict[str, Any] = field(default_factory=dict)
    """The values of rosapi's responses, by service."""

    @property
    def types(self) -> dict[str, str]:
        """The type of each topic that rosapi named."""
        topics = self.answers.get("/rosapi/topics", {"topics": [], "types": []})
        return dict(zip(topics["topics"], topics["types"], strict=True))


def load_recording(folder: Path) -> Recording:
    """Return the frames of a directory.

    Raises:
        ConfigError: If it holds none.

    """
    recording = Recording()
    for path in sorted(folder.glob("*.json")):
        _add_text(recording, path.read_text(encoding="utf-8"))
    for path in sorted(folder.glob("*.bin")):
        _add_binary(recording, path.read_bytes())
    if not recording.texts:
        raise ConfigError(f"{folder}: no captured publications there")
    for robot, pose in _recorded_poses(recording).items():
        _give_voice(recording, robot, pose)
    return recording


def _add_text(recording: Recording, text: str) -> None:
    operation = _operation(text)
    if operation.get("op") == "publish":
        recording.texts.setdefault(operation["topic"], text)
    elif operation.get("op") == "service_response" and operation["result"] is True:
        recording.answers.setdefault(operation["service"], operation["values"])


def _operation(text: str) -> dict[str, Any]:
    """Return what a file holds; nothing if it is no frame but notes beside them."""
    try:
        # Not msgspec: a real server writes the bare token NaN.
        operation = json.loads(text)
    except ValueError:
        return {}
    return operation if isinstance(operation, dict) else {}


def _add_binary(recording: Recording, frame: bytes) -> None:
    if not frame:
        return  # nothing came, and that was what had to be recorded
    operation = cbor2.loads(frame)
    is_raw = set(operation["msg"]) == {"secs", "nsecs", "bytes"}
    key = (operation["topic"], "cbor-raw" if is_raw else "cbor")
    recording.binaries.setdefault(key, frame)


def _recorded_poses(recording: Recording) -> dict[str, dict[str, Any]]:
    """Return where ``/tf`` has each robot in its odometry's frame."""
    frame = recording.texts.get("/tf")
    transforms = json.loads(frame)["msg"]["transforms"] if frame else []
    poses = {}
    for transform in transforms:
        robot, _, child = transform["child_frame_id"].partition("/")
        if child == "base_link":
            at = transform["transform"]
            pose = {"position": at["translation"], "orientation": at["rotation"]}
            poses[robot] = pose
    return poses


def _give_voice(recording: Recording, robot: str, pose: dict[str, Any]) -> None:
    """Let a robot of which ``/tf`` alone was taken say what the recorded one said.

    Its name takes the other's place in the bytes, and its own pose in odometry.
    """
    speaker = "robot_0"
    if len(robot) != len(speaker) or f"/{robot}/odom" in recording.texts:
        return
    old, new = speaker.encode(), robot.encode()
    for topic, text in tuple(recording.texts.items()):
        if topic.startswith(f"/{speaker}/"):
            text = _with_pose(text.replace(speaker, robot), pose)
            recording.texts[topic.replace(speaker, robot)] = text
    for (topic, compression), frame in tuple(recording.binaries.items()):
        if topic.startswith(f"/{speaker}/") and not topic.endswith("/odom"):
            key = (topic.replace(speaker, robot), compression)
            recording.binaries[key] = frame.replace(old, new)


def _with_pose(text: str, pose: dict[str, Any]) -> str:
    operation = json.loads(text)
    if "covariance" not in (operation["msg"].get("pose") or ()):
        return text
    operation["msg"]["pose"]["pose"] = pose
    # As the recorded servers write it.
    return json.dumps(operation, separators=(",", ":")).replace("/", "\\/")
