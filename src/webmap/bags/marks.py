"""The marks on the time line of a recording: stops, goals, results and alarms."""

import contextlib
import json
import re
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Literal

from webmap.bags.playback import EVENTS, TYPE, Mark, Marks
from webmap.bags.recording import LOGS, Recording
from webmap.bags.times import SECOND
from webmap.base.errors import ConfigError
from webmap.base.text import one_line

MOST = 500
"""The greatest number of marks; further events are only counted."""

LONGEST = 200
"""Characters of a mark's text."""

REPEATED = 10.0
"""Seconds within which an equal log line is no new event."""

REPORT = 0.25
"""Seconds between two reports of the progress."""

STOP = re.compile(r"e_?stop|emergency|(^|[/_])stop([/_]|$)", re.IGNORECASE)
"""Matches topics of type Bool that are true while a robot is stopped."""

DIAGNOSTICS = "diagnostic_msgs/DiagnosticArray"
ERROR = 2
ERRORS = {"rosgraph_msgs/Log": 8, "rcl_interfaces/Log": 40}
"""The level of an error, by the type of the log line; a fatal error has more."""

UNDER_WAY = "accepted"
STATES = {
    "actionlib_msgs/GoalStatusArray": {
        **dict.fromkeys((0, 1, 6, 7), UNDER_WAY),
        **{2: "cancelled", 3: "reached", 4: "failed", 5: "refused", 8: "cancelled"},
        9: "lost",
    },
    "action_msgs/GoalStatusArray": {
        **dict.fromkeys((1, 2, 3), UNDER_WAY),
        **{4: "reached", 5: "cancelled", 6: "failed"},
    },
}
"""The names of the states of a goal, by the type of its status."""

KINDS = ("stop", "goal", "result", "alarm")
"""The kinds of marks."""

STATES_1 = STATES["actionlib_msgs/GoalStatusArray"]


class MarkFinder:
    """Finds the events in messages; pure, takes the times."""

    def __init__(self) -> None:
        self.marks: list[Mark] = []
        self.left_out = 0
        self._before: dict[tuple[object, ...], Any] = {}

    @staticmethod
    def wants(topic: str, type_name: str) -> bool:
        """Return whether a topic may have events."""
        last = topic.rpartition("/")[2]
        return (
            type_name in (DIAGNOSTICS, *LOGS, *STATES)
            or type_name.endswith(("ActionGoal", "ActionResult"))
            or (topic, type_name) == (EVENTS, TYPE)
            or (type_name == "std_msgs/Bool" and STOP.search(topic) is not None)
            or (
                type_name == "geometry_msgs/PoseStamped"
                and last in ("goal", "goal_pose")
            )
        )

    def look(
        self, topic: str, type_name: str, at: float, message: dict[str, Any]
    ) -> None:
        """Add the events of a message.

        Args:
            topic: A topic that :meth:`wants` accepts.
            type_name: Its type.
            at: The time of the message, in seconds since the begin of the recording.
            message: The message.

        """
        # A type of that name may have other fields.
        with contextlib.suppress(KeyError, TypeError, ValueError, IndexError):
            self._look(topic, type_name, at, message)

    def _look(
        self, topic: str, type_name: str, at: float, message: dict[str, Any]
    ) -> None:
        if type_name == DIAGNOSTICS:
            for status in message["status"]:
                key = (topic, status["hardware_id"], status["name"])
                if self._changed(key, _number(status["level"])) == ERROR:
                    self._add(at, "alarm", f"{status['name']}: {status['message']}")
        elif type_name in ERRORS:
            if _number(message["level"]) >= ERRORS[type_name]:
                self._log(at, f"{message['name']}: {message['msg']}")
        elif type_name in STATES:
            known = (topic,) in self._before
            self._before[topic,] = True
            for one in message["status_list"]:
                state = STATES[type_name].get(_number(one["status"]), "")
                self._goal(topic, at, _identity(one), state, quiet=not known)
        elif type_name.endswith("ActionGoal"):
            self._goal(topic, at, message["goal_id"]["id"], UNDER_WAY)
        elif type_name.endswith("ActionResult"):
            status = message["status"]
            state = STATES_1.get(_number(status["status"]), "")
            self._goal(topic, at, _identity(status), state)
        elif type_name == TYPE:
            event = json.loads(message["data"])
            if event["kind"] in KINDS:
                self._add(at, event["kind"], str(event["text"]))
        elif type_name == "std_msgs/Bool":
            if self._changed((topic,), bool(message["data"])):
                self._add(at, "stop", f"Stop on {topic}")
        else:
            place = message["pose"]["position"]
            x, y = float(place["x"]), float(place["y"])
            self._add(at, "goal", f"Goal at {x:.2f}, {y:.2f} m on {topic}")

    def _changed(self, key: tuple[object, ...], value: object) -> object:
        """Return a value, or None if it is the one of before."""
        before = self._before.get(key)
        self._before[key] = value
        return None if value == before else value

    def _log(self, at: float, text: str) -> None:
        before = self._before.get((text,))
        self._before[text,] = at
        if before is None or at - before > REPEATED:
            self._add(at, "alarm", text)

    def _goal(
        self, topic: str, at: float, goal: object, state: str, *, quiet: bool = False
    ) -> None:
        """Add a change of a goal; quiet for a list that begins with old goals."""
        action = re.sub(r"/(_action/)?(status|goal|result)$", "", topic)
        if not state or self._changed((action, goal), state) is None:
            return
        if state == UNDER_WAY:
            self._add(at, "goal", f"Goal {state} by {action}")
        elif not quiet:
            self._add(at, "result", f"Goal {state} by {action}")

    def _add(
        self, at: float, kind: Literal["stop", "goal", "result", "alarm"], text: str
    ) -> None:
        if len(self.marks) >= MOST:
            self.left_out += 1
            return
        self.marks.append(Mark(round(at, 3), kind, one_line(text, LONGEST)))


def _number(value: Any) -> int:
    """Return a number that a dialect may write as one byte."""
    return value[0] if isinstance(value, bytes) else int(value)


def _identity(status: dict[str, Any]) -> object:
    """Return what identifies the goal of a status, in either dialect."""
    if "goal_info" in status:
        return bytes(status["goal_info"]["goal_id"]["uuid"])
    return status["goal_id"]["id"]


def find_marks(
    paths: Sequence[Path],
    report: Callable[[Marks], object],
    go_on: Callable[[], bool] = lambda: True,
) -> None:
    """Read a recording once for its marks; may take long.

    It opens the files itself, because another thread plays them. Of a damaged file it
    reports the marks before the damage.

    Args:
        paths: As for :class:`Recording`.
        report: Called with the marks and the progress now and then, and at the end.
        go_on: Called repeatedly; returns whether to continue.

    """
    finder = MarkFinder()

    def marks(read: float) -> Marks:
        return Marks(list(finder.marks), finder.left_out, read)

    try:
        recording = Recording(paths)
        try:
            soon = time.monotonic() + REPORT
            for recorded in recording.messages_of(finder.wants):
                if not go_on():
                    return
                at = (recorded.time - recording.begin) / SECOND
                message = recording.message(recorded)
                if message is not None:
                    type_name = recording.topics[recorded.topic].type
                    finder.look(recorded.topic, type_name, at, message)
                if time.monotonic() > soon:
                    soon = time.monotonic() + REPORT
                    report(marks(min(at / max(recording.seconds, 1e-9), 1.0)))
        finally:
            recording.close()
    except ConfigError:
        pass  # the player reports the damage where it is
    report(marks(1.0))
