"""A person's settings that replace guesses of discovery, one topic at a time."""

import difflib
import logging
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import msgspec

from webmap.base.errors import ConfigError
from webmap.config.checks import same_name
from webmap.config.motion import MotionConfig, TwistConfig
from webmap.config.reading import read_key
from webmap.config.robot import RobotConfig, named_cameras
from webmap.discovery.findings import (
    ACTIONS,
    ROLES,
    Findings,
    FoundRobot,
    Guess,
    Layers,
    TopicRole,
)
from webmap.discovery.layers import is_own, role_of
from webmap.discovery.robots import host_name
from webmap.discovery.rules import VELOCITY
from webmap.fleet.robot_options import Candidate, check_name, same_name_error
from webmap.ros.names import has_gate, is_topic, is_type

log = logging.getLogger("webmap.cli")

FORM = "ROBOT.ROLE=TOPIC, as in robot_1.scan=/robot_1/front/scan"

RULE = "from --set"

USED: tuple[str, ...] = tuple(
    role for role in ROLES if role not in ("pose", "costmap", "cloud")
)
"""Roles that --set can change."""

OTHER_KEYS = ("name", "base", "velocity_type")
"""Keys of settings that are no topics: the robot's name, the frame of its base, and
the type of its velocity topic."""

SETTABLE_ROLES: tuple[TopicRole, ...] = (
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

MOTION: tuple[TopicRole, ...] = ("velocity", "goal", "action", "cancel", "initialpose")
"""Roles by which a robot receives something."""

MOST_CAMERAS = 4
"""Most cameras shown of one robot; they are subscribed only while a page shows
them."""


@dataclass(frozen=True, slots=True)
class Setting:
    """One value of ``--set``."""

    text: str
    """The setting as written."""

    robot: str
    key: str
    """A role, or one of ``OTHER_KEYS``."""

    values: tuple[str, ...]
    """Topics, or one value; empty if the robot has none of that role."""


def parse_setting(text: str) -> Setting:
    """Read a setting from the command line.

    Args:
        text: ``ROBOT.ROLE=TOPIC``. An empty value means that the robot has none;
            several cameras are separated by commas.

    Raises:
        ConfigError: If the text is not of that form.

    """
    left, sign, value = text.partition("=")
    robot, dot, key = (part.strip() for part in left.rpartition("."))
    if not (sign and dot and robot):
        raise ConfigError(f"--set {text!r} is not of the form {FORM}")
    if key not in (*USED, *OTHER_KEYS):
        near = difflib.get_close_matches(key, (*USED, *OTHER_KEYS), n=1)
        hint = f"; did you mean {near[0]!r}?" if near else "."
        raise ConfigError(
            f"--set {text!r}: there is no role {key!r}{hint} The roles are "
            f"{', '.join(USED)}; the other keys are {', '.join(OTHER_KEYS)}"
        )
    if key in OTHER_KEYS:
        if not value.strip():
            raise ConfigError(f"--set {text!r}: a {key} has at least one character")
        if key == "velocity_type" and not is_type(value.strip(), *VELOCITY):
            raise ConfigError(
                f"--set {text!r}: got the type {value.strip()!r}, expected "
                f"{' or '.join(VELOCITY)}"
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
                f"--set {text!r}: {topic!r} is not the name of a topic; a name begins "
                "with a slash, as in /robot_1/scan"
            )
    return Setting(text, robot, key, topics)


class Overrides:
    """The settings of a command line, and the robots that they apply to.

    Args:
        settings: Settings of one robot each, in their order on the command line.
        stops_within: Command timeout of every base, in seconds, if known.
        drive_without_proof: Whether robots may be moved through an old bridge of
            Foxglove.

    Raises:
        ConfigError: If no base can have that timeout.

    """

    def __init__(
        self,
        settings: Sequence[Setting] = (),
        stops_within: float | None = None,
        *,
        drive_without_proof: bool = False,
    ) -> None:
        self._settings = tuple(settings)
        option = "--stops-within"
        self._of_every_base = {
            "stops_within": read_key(TwistConfig, "stops_within", stops_within, option),
            "drive_without_proof": drive_without_proof,
        }
        self._robots: dict[tuple[str, str], str] = {}

    def config(self, url: str, robot: FoundRobot) -> RobotConfig:
        """Return the configuration of a robot as it is shown.

        Args:
            url: The bridge that the robot is behind.
            robot: The robot, with the settings applied.

        """
        config = robot.config(url)
        if not has_gate(url):
            log.warning("%s: no gate can move robots behind %s", robot.name, url)
            nothing = msgspec.structs.asdict(MotionConfig())
            config = msgspec.structs.replace(config, **nothing)
        cameras = named_cameras(config.cameras[:MOST_CAMERAS])
        twist = config.twist
        if twist is not None:
            known = msgspec.structs.replace(twist, **self._of_every_base)
            config = config.with_part("twist", known)
        return config.with_part("cameras", cameras)

    def apply_to_options(self, robots: Sequence[Candidate]) -> list[Candidate]:
        """Return robots of ``--robot`` with their further settings applied.

        Raises:
            ConfigError: If a setting is not possible for such a robot.

        """
        given: list[Candidate] = []
        for robot in robots:
            settings = self._of(robot.found.name)
            for setting in settings:
                if setting.key not in (*SETTABLE_ROLES, "name", "velocity_type"):
                    raise ConfigError(
                        f"--set {setting.text!r}: a robot of --robot has no "
                        f"{setting.key}; leave --robot out, so that it is found, or "
                        "write a fleet file"
                    )
            named = _with_settings(robot.found, settings, None)
            if any(same_name(named.name) == same_name(o.found.name) for o in given):
                raise same_name_error(named.name)
            given.append(Candidate(robot.bridge, named))
        return given

    def apply(
        self, url: str, robot: FoundRobot, dialect: str | None = None
    ) -> FoundRobot:
        """Return a robot that was found with its settings applied.

        Args:
            url: The bridge that the robot is behind.
            robot: The robot as found; it is identified by its namespace.
            dialect: Dialect of the bridge, ``"ros1"`` or ``"ros2"``, if known.

        """
        place = (url, robot.namespace)
        known = self._robots.get(place, robot.name)
        settings = self._of(known)
        if settings:
            self._robots[place] = known
        return _with_settings(robot, settings, dialect)

    def fixed(self, url: str, robot: FoundRobot) -> frozenset[str]:
        """Return the roles of a robot that later topics may not take."""
        known = self._robots.get((url, robot.namespace), robot.name)
        return frozenset(setting.key for setting in self._of(known))

    def layers(self, url: str, findings: Findings, robot: FoundRobot) -> Layers:
        """Return the layers of a robot, without topics that --set gave another role.

        Args:
            url: The bridge that the robot is behind.
            findings: The findings of that bridge.
            robot: The robot as found, before any settings.

        """
        fixed = self.fixed(url, robot)
        overridden = {
            (role, guess.topic)
            for role, guesses in robot.guesses.items()
            if role in fixed
            for guess in guesses
        }
        drawn, others = findings.layers[robot.namespace]
        kept = [each for each in drawn if (role_of(each), each.topic) not in overridden]
        return Layers(tuple(kept), others)

    def names(self, name: str) -> bool:
        """Return whether a setting gives a robot this name."""
        return any(
            setting.key == "name" and same_name(setting.values[0]) == same_name(name)
            for setting in self._settings
        )

    def findings(self, url: str, findings: Findings) -> Findings:
        """Return the findings of a bridge with the settings applied."""
        robots = tuple(
            self.apply(url, robot, findings.dialect) for robot in findings.robots
        )
        return replace(findings, robots=robots)

    def check(self, names: Iterable[str], *, all_known: bool) -> list[str]:
        """Return a sentence for each setting whose robot is not there yet.

        Args:
            names: The robots that were found or given, by their names without any
                setting.
            all_known: Whether every bridge has answered, so that no robot is missing.

        Raises:
            ConfigError: If every bridge has answered and there is no such robot.

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


class ViewOnly(Overrides):
    """No settings: every robot stays as discovery found it.

    Args:
        name: Name of a robot that has no name of its own.

    """

    def __init__(self, name: str) -> None:
        super().__init__()
        self._name = name

    def apply(
        self, url: str, robot: FoundRobot, dialect: str | None = None
    ) -> FoundRobot:
        """Return a robot that was found without everything that could move it.

        Args:
            url: The bridge that the robot is behind.
            robot: The robot as found.
            dialect: Dialect of the bridge.

        """
        guesses = {
            role: found for role, found in robot.guesses.items() if role not in MOTION
        }
        name = self._name if robot.name == host_name(url) else robot.name
        return replace(robot, guesses=guesses, name=name)

    def fixed(self, url: str, robot: FoundRobot) -> frozenset[str]:
        """Return the roles that later topics may not take."""
        return frozenset(MOTION)


def shared_map(found: FoundRobot) -> str:
    """Return the map that robots share, or that --set names; empty if there is none.

    It is shown before anything else of the robot. A robot's own map comes with the
    robot.
    """
    guess = found.first("map")
    if guess is None:
        return ""
    named = guess.topic.rpartition("/")[2].endswith("map")
    shared = named and not is_own(guess.topic, found.namespace)
    return guess.topic if shared or guess.rule == RULE else ""


def _with_settings(
    robot: FoundRobot, settings: Sequence[Setting], dialect: str | None
) -> FoundRobot:
    guesses = dict(robot.guesses)
    dialect = dialect or _dialect(robot)
    for setting in settings:
        if setting.key == "name":
            robot = replace(robot, name=setting.values[0])
        elif setting.key == "base":
            robot = replace(robot, base_frame=setting.values[0])
        elif setting.key != "velocity_type":
            role = next(role for role in ROLES if role == setting.key)
            new = _guesses(role, setting.values, guesses.get(role, ()), dialect)
            guesses.pop(role, None)
            if new:
                guesses[role] = new
            if role == "odometry":
                # The setting excludes every other source of the pose.
                guesses.pop("pose", None)
    for setting in settings:
        # Applies to the final topic, whatever the order of the settings.
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
    role: TopicRole,
    topics: Sequence[str],
    found: Sequence[Guess],
    dialect: str | None,
) -> tuple[Guess, ...]:
    types = {guess.topic: guess.type for guess in found}
    if role == "action":
        # Only the dialect distinguishes the two kinds of actions.
        tail = next(
            tail for tail in ACTIONS if (tail == "/goal") == (dialect == "ros1")
        )
        topics = [topic.removesuffix(tail) + tail for topic in topics]
    if role == "tf":
        topics = [topic.removesuffix("/tf") + "/tf" for topic in topics]
    return tuple(Guess(topic, types.get(topic, ""), RULE) for topic in topics)
