"""What a person says better than discovery guessed, one topic at a time."""

import difflib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from webmap.cli.names import check_name, set_twice
from webmap.console import RobotDescription
from webmap.discovery.found import ACTIONS, ROLES, Findings, FoundRobot, Guess, Role
from webmap.discovery.naming import same_name
from webmap.discovery.rules import VELOCITY
from webmap.errors import ConfigError
from webmap.ros.names import is_topic, is_type

FORM = "ROBOT.ROLE=TOPIC, as in robot_1.scan=/robot_1/front/scan"

RULE = "said with --set"

USED: tuple[str, ...] = tuple(
    role for role in ROLES if role not in ("pose", "costmap", "cloud")
)
"""Roles of which a robot on the page uses the best topic."""

WORDS = ("name", "base", "velocity_type")
"""What is said of a robot besides its topics: its name, the frame of its base, and the
type of what drives it."""

TOLD = {
    "odometry": "odometry",
    "velocity": "twist",
    "scan": "scan",
    "battery": "battery",
    "goal": "goal",
    "cancel": "cancel",
    "initialpose": "initial_pose",
    "camera": "cameras",
}
"""Roles that a robot of ``--robot`` can have, and what its description calls them."""


@dataclass(frozen=True, slots=True)
class Setting:
    """One thing that a person says of a robot."""

    text: str
    """As it was written."""

    robot: str
    key: str
    """A role, or one of ``WORDS``."""

    values: tuple[str, ...]
    """Topics, or the one word; none if the robot does without."""


def parse_setting(text: str) -> Setting:
    """Read a setting as a person writes it on the command line.

    Args:
        text: ``ROBOT.ROLE=TOPIC``. Nothing behind the sign says that the robot does
            without; several cameras stand with commas between them.

    Raises:
        ConfigError: If the text is not of that form.

    """
    left, sign, value = text.partition("=")
    robot, dot, key = (part.strip() for part in left.rpartition("."))
    if not (sign and dot and robot):
        raise ConfigError(f"--set {text!r} is not of the form {FORM}")
    if key not in (*USED, *WORDS):
        near = difflib.get_close_matches(key, (*USED, *WORDS), n=1)
        hint = f"; did you mean {near[0]!r}?" if near else "."
        raise ConfigError(
            f"--set {text!r}: there is no role {key!r}{hint} The roles are "
            f"{', '.join(USED)}; and there are {', '.join(WORDS)}"
        )
    if key in WORDS:
        if not value.strip():
            raise ConfigError(f"--set {text!r}: a {key} has at least one character")
        if key == "velocity_type" and not is_type(value.strip(), *VELOCITY):
            raise ConfigError(
                f"--set {text!r}: {value.strip()!r} is no type that drives a base; "
                f"there are {' and '.join(VELOCITY)}"
            )
        check_name(value.strip(), f"--set {text!r}")
        return Setting(text, robot, key, (value.strip(),))
    topics = tuple(part.strip() for part in value.split(",") if part.strip())
    if len(topics) > 1 and key != "camera":
        raise ConfigError(
            f"--set {text!r}: a robot uses one topic of that role, got {len(topics)}"
        )
    for topic in topics:
        if not (topic.startswith("/") and is_topic(topic)):
            raise ConfigError(
                f"--set {text!r}: {topic!r} is no name of a topic; it begins with a "
                "slash, as in /robot_1/scan"
            )
    return Setting(text, robot, key, topics)


class Overruling:
    """The settings of a command line, and the robots that they are about.

    Args:
        settings: What was said, in the order in which it was.

    """

    def __init__(self, settings: Sequence[Setting] = ()) -> None:
        self._settings = tuple(settings)
        self._robots: dict[tuple[str, str], str] = {}

    def tell(self, robots: Sequence[RobotDescription]) -> list[RobotDescription]:
        """Return robots of ``--robot`` with what else was said of them.

        Raises:
            ConfigError: If such a robot cannot have what was said.

        """
        told: list[RobotDescription] = []
        for robot in robots:
            changes: dict[str, Any] = {}
            for setting in self._of(robot.name):
                changes.update(_described(setting))
            named = replace(robot, **changes)
            if any(same_name(named.name) == same_name(one.name) for one in told):
                raise set_twice(named.name)
            told.append(named)
        return told

    def apply(
        self, url: str, robot: FoundRobot, dialect: str | None = None
    ) -> FoundRobot:
        """Return a robot that was found with what was said of it.

        Args:
            url: The bridge that it is behind.
            robot: As it was found; it is known again by its namespace.
            dialect: That of the bridge, ``"ros1"`` or ``"ros2"``, if it is known.

        """
        place = (url, robot.namespace)
        known = self._robots.get(place, robot.name)
        settings = self._of(known)
        if not settings:
            return robot
        self._robots[place] = known
        guesses = dict(robot.guesses)
        dialect = dialect or _dialect(robot)
        for setting in settings:
            if setting.key == "name":
                robot = replace(robot, name=setting.values[0])
                continue
            if setting.key == "base":
                robot = replace(robot, base_frame=setting.values[0])
                continue
            if setting.key == "velocity_type":
                continue
            role = _role(setting)
            said = _guesses(role, setting.values, guesses.get(role, ()), dialect)
            if said:
                guesses[role] = said
            else:
                guesses.pop(role, None)
            if role == "odometry":
                # No other source of its place is meant then.
                guesses.pop("pose", None)
        for setting in settings:
            # Of the topic that is used in the end, whatever was said first.
            if setting.key == "velocity_type" and guesses.get("velocity"):
                first, *others = guesses["velocity"]
                rule = f"{first.rule}, its type {RULE}"
                typed = replace(first, type=setting.values[0], rule=rule)
                guesses["velocity"] = (typed, *others)
        return replace(robot, guesses=guesses)

    def fixed(self, url: str, robot: FoundRobot) -> frozenset[str]:
        """Return the roles of a robot that no topic that comes later may have."""
        known = self._robots.get((url, robot.namespace), robot.name)
        return frozenset(setting.key for setting in self._of(known))

    def names(self, name: str) -> bool:
        """Tell whether a person said that a robot is called so."""
        return any(
            setting.key == "name" and same_name(setting.values[0]) == same_name(name)
            for setting in self._settings
        )

    def findings(self, url: str, findings: Findings) -> Findings:
        """Return what is behind a bridge with what was said of it."""
        robots = tuple(
            self.apply(url, robot, findings.dialect) for robot in findings.robots
        )
        return replace(findings, robots=robots)

    def check(self, names: Iterable[str], *, all_known: bool) -> list[str]:
        """Return a sentence for each setting whose robot is not there yet.

        Args:
            names: The robots that were found or told, as they are called without
                any setting.
            all_known: Whether every bridge was asked, so that nobody is missing.

        Raises:
            ConfigError: If nobody is missing, and still there is no such robot.

        """
        known = list(names)
        waiting = []
        for setting in self._settings:
            if setting.robot in known:
                continue
            if not all_known:
                waiting.append(f"--set {setting.text} waits for a robot of that name.")
                continue
            near = difflib.get_close_matches(setting.robot, known, n=1)
            hint = f"; did you mean {near[0]!r}?" if near else "."
            listed = ", ".join(known) or "none"
            raise ConfigError(
                f"--set {setting.text!r}: there is no robot {setting.robot!r}{hint} "
                f"Found: {listed}"
            )
        return waiting

    def _of(self, name: str) -> list[Setting]:
        return [setting for setting in self._settings if setting.robot == name]


def _role(setting: Setting) -> Role:
    return next(role for role in ROLES if role == setting.key)


def _dialect(robot: FoundRobot) -> str:
    types = [guess.type for found in robot.guesses.values() for guess in found]
    return "ros2" if not types or any("/msg/" in type for type in types) else "ros1"


def _guesses(
    role: Role,
    topics: Sequence[str],
    found: Sequence[Guess],
    dialect: str | None,
) -> tuple[Guess, ...]:
    types = {guess.topic: guess.type for guess in found}
    if role == "action":
        # The dialect tells which of the actions it is, as nothing else does.
        tail = next(
            tail for tail in ACTIONS if (tail == "/goal") == (dialect == "ros1")
        )
        topics = [topic.removesuffix(tail) + tail for topic in topics]
    if role == "tf":
        topics = [topic.removesuffix("/tf") + "/tf" for topic in topics]
    return tuple(Guess(topic, types.get(topic, ""), RULE) for topic in topics)


def _described(setting: Setting) -> Mapping[str, Any]:
    if setting.key == "name":
        return {"name": setting.values[0]}
    if setting.key == "velocity_type":
        return {"twist_type": setting.values[0]}
    if setting.key not in TOLD:
        raise ConfigError(
            f"--set {setting.text!r}: a robot of --robot has no {setting.key}; leave "
            "--robot out, so that it is found, or write a fleet file"
        )
    if setting.key == "camera":
        return {"cameras": setting.values}
    return {TOLD[setting.key]: setting.values[0] if setting.values else ""}
