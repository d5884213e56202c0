"""A rosbridge whose messages have a script in each of their texts."""

import contextlib
import itertools
from collections.abc import Iterator
from typing import Any

from fixed_bridge import FixedBridge, fixed_bridge

from equipment.script_strings import SCRIPTS

FRAMES = frozenset({"frame_id", "child_frame_id"})
"""Fields by which messages find their place; a script here means another frame."""

LOGS = {"ros1": "rosgraph_msgs/Log", "ros2": "rcl_interfaces/Log"}

LEVEL = {"ros1": {"level": 8}, "ros2": {"level": 40}}

STRAY = f"/{SCRIPTS[6]}"
"""The namespace of a robot, which no ROS would accept."""


class ScriptedBridge(FixedBridge):
    """Publishes all messages of the fixed site, with another script in each text.

    Robots below ``/stray`` have scripts in the names of their frames too, and another
    has a script as its name.
    """

    def __init__(self, dialect: str) -> None:
        super().__init__(dialect)
        self.texts: set[tuple[str, str]] = set()
        """Type and path of each field that had a script."""
        messages = self._sites[0]
        at = next(v for topic, v in messages.items() if topic.endswith("/odom"))
        stray = {
            topic.replace("/anna/", "/stray/"): value
            for topic, value in messages.items()
            if topic.startswith("/anna/")
        }
        log = (LOGS[dialect], self.schema.conform(LOGS[dialect], LEVEL[dialect]))
        more = {**stray, f"{STRAY}/odom": at, "/rosout": log}
        self._sites = [{**site, **more} for site in self._sites]
        self._turns = itertools.count()
        self._used: dict[str, itertools.count] = {}

    def _publish(self, *, all_of_them: bool) -> None:
        turn = next(self._turns)
        for topic, (type, message) in self._sites[0].items():
            # Large grids have no texts but the names of frames.
            if self.graph.is_wanted(topic) and (turn % 20 == 0 or "Grid" not in type):
                skipped = FRAMES if "stray" not in topic else frozenset()
                fields = self.schema.fields(type)
                made = self._scripted(type, "", fields, message, skipped)
                self.graph.publish(self, topic, made)

    def _scripted(self, type, path, fields, value, skipped) -> Any:
        made = dict(value)
        for field in fields:
            name = f"{path}{field.name}"
            if field.name in skipped or field.name not in value:
                continue
            if field.fields is not None:
                inner = (type, f"{name}.", field.fields)
                each = value[field.name]
                made[field.name] = (
                    [self._scripted(*inner, one, skipped) for one in each]
                    if field.is_array
                    else self._scripted(*inner, each, skipped)
                )
            elif field.type == "string":
                self.texts.add((type, name))
                text = f"{name} {self._next_script(name)}"
                made[field.name] = [text] if field.is_array else text
        return made

    def _next_script(self, name: str) -> str:
        """Return the next script for a field; each field begins with another one."""
        used = self._used.setdefault(name, itertools.count(7 * len(self._used)))
        return SCRIPTS[next(used) % len(SCRIPTS)]


@contextlib.contextmanager
def scripted_bridge(dialect: str) -> Iterator[ScriptedBridge]:
    """Run such a bridge in a separate thread."""
    with fixed_bridge(dialect, ScriptedBridge) as bridge:
        yield bridge
