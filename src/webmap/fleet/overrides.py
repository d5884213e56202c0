"""Settings of a person that replace guesses of discovery, one topic at a time."""

import difflib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import msgspec

from webmap.base.errors import ConfigError
from webmap.config.checks import same_name
from webmap.config.robot import RobotConfig, named_cameras
from webmap.discovery.found import (
    ACTIONS,
    ROLES,
    Findings,
    FoundRobot,
    Guess,
    Layers,
    Role,
)
from webmap.discovery.layers import is_own, role_of
from webmap.discovery.robots import host_name
from webmap.discovery.rules import VELOCITY
from webmap.fleet.stated import Candidate, check_name, set_twice
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

TOLD: tuple[Role, ...] = (
    "odometry",
    "velocity",
    "scan",
    "battery",
    "goal",
    "cancel",
    "initialpose",
    "camera",
)
"""Roles that a robot of ``--robot`` can have."""

MOTION: tuple[Role, ...] = ("velocity", "goal", "action", "cancel", "initialpose")
"""Roles by which a robot is told something."""

MOST_CAMERAS = 4
"""Cameras of one robot that are shown; they are only asked while somebody looks."""


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
    """What a command line says of robots, and the robots that it is about.

    Args:
        settings: What was said of one robot each, in the order in which it was.
        stops_within: Seconds within which every base stops by itself, if known.

    """

    def __init__(
        self, settings: Sequence[Setting] = (), stops_within: float | None = None
    ) -> None:
        self._settings = tuple(settings)
        self._stops_within = stops_within
        self._robots: dict[tuple[str, str], str] = {}

    def config(self, url: str, robot: FoundRobot) -> RobotConfig:
        """Return a robot as it is shown.

        Args:
            url: The bridge that it is behind.
            robot: The robot, with what was said of it.

        """
        config = robot.config(url)
        cameras = named_cameras(config.cameras[:MOST_CAMERAS])
        twist = config.motion.twist
        if twist is not None:
            known = msgspec.structs.replace(twist, stops_within=self._stops_within)
            config = config.with_part("twist", known)
        return config.with_part("cameras", cameras)

    def tell(self, robots: Sequence[Candidate]) -> list[Candidate]:
        """Return robots of ``--robot`` with what else was said of them.

        Raises:
            ConfigError: If such a robot cannot have what was said.

        """
        told: list[Candidate] = []
        for robot in robots:
            settings = self._of(robot.found.name)
            for setting in settings:
                if setting.key not in (*TOLD, "name", "velocity_type"):
                    raise ConfigError(
                        f"--set {setting.text!r}: a robot of --robot has no "
                        f"{setting.key}; leave --robot out, so that it is found, or "
                        "write a fleet file"
                    )
            named = _overruled(robot.found, settings, None)
            if any(same_name(named.name) == same_name(o.found.name) for o in told):
                raise set_twice(named.name)
            told.append(Candidate(robot.bridge, named))
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
        if settings:
            self._robots[place] = known
        return _overruled(robot, settings, dialect)

    def fixed(self, url: str, robot: FoundRobot) -> frozenset[str]:
        """Return the roles of a robot that no topic that comes later may have."""
        known = self._robots.get((url, robot.namespace), robot.name)
        return frozenset(setting.key for setting in self._of(known))

    def layers(self, url: str, findings: Findings, robot: FoundRobot) -> Layers:
        """Return the layers of a robot, without topics that --set gave another role.

        Args:
            url: The bridge that it is behind.
            findings: What was found there.
            robot: As it was found, before anybody said anything.

        """
        fixed = self.fixed(url, robot)
        overruled = {
            (role, guess.topic)
            for role, guesses in robot.guesses.items()
            if role in fixed
            for guess in guesses
        }
        drawn, others = findings.layers[robot.namespace]
        kept = [each for each in drawn if (role_of(each), each.topic) not in overruled]
        return Layers(tuple(kept), others)

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


class Watched(Overruling):
    """Has no settings, so that every robot stays as discovery found it.

    Args:
        name: What a robot is called that has no name of its own.

    """

    def __init__(self, name: str) -> None:
        super().__init__()
        self._name = name

    def apply(
        self, url: str, robot: FoundRobot, dialect: str | None = None
    ) -> FoundRobot:
        """Return a robot that was found without all that would move it.

        Args:
            url: The bridge that it is behind.
            robot: As it was found.
            dialect: That of the bridge.

        """
        guesses = {
            role: found for role, found in robot.guesses.items() if role not in MOTION
        }
        name = self._name if robot.name == host_name(url) else robot.name
        return replace(robot, guesses=guesses, name=name)

    def fixed(self, url: str, robot: FoundRobot) -> frozenset[str]:
        """Return the roles that no topic that comes later may have."""
        return frozenset(MOTION)


def shared_map(found: FoundRobot) -> str:
    """Return the map that robots share, or that --set names; empty if there is none.

    It is shown before anything else of the robot. A map of its own comes with it.
    """
    guess = found.first("map")
    if guess is None:
        return ""
    named = guess.topic.rpartition("/")[2].endswith("map")
    shared = named and not is_own(guess.topic, found.namespace)
    return guess.topic if shared or guess.rule == RULE else ""


def _overruled(
    robot: FoundRobot, settings: Sequence[Setting], dialect: str | None
) -> FoundRobot:
    """Return a robot with what was said of it."""
    guesses = dict(robot.guesses)
    dialect = dialect or _dialect(robot)
    for setting in settings:
        if setting.key == "name":
            robot = replace(robot, name=setting.values[0])
        elif setting.key == "base":
            robot = replace(robot, base_frame=setting.values[0])
        elif setting.key != "velocity_type":
            role = next(role for role in ROLES if role == setting.key)
            said = _guesses(role, setting.values, guesses.get(role, ()), dialect)
            guesses.pop(role, None)
            if said:
                guesses[role] = said
            if role == "odometry":
                # No other source of its place is meant then.
                guesses.pop("pose", None)
    for setting in settings:
        # Of the topic that is used in the end, whatever was said first.
        if setting.key == "velocity_type" and guesses.get("velocity"):
            first, *others = guesses["velocity"]
            rule = f"{first.rule}, its type {RULE}".removeprefix(", ")
            typed = replace(first, type=setting.values[0], rule=rule)
            guesses["velocity"] = (typed, *others)
    return replace(robot, guesses=guesses)


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
