"""The health of a robot's parts."""

import binascii
import time
import weakref
from collections import Counter
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Literal, TypeAlias

import msgspec

from webmap.base.errors import ConfigError, ProtocolError
from webmap.base.scope import Removal, keep
from webmap.core.problems import draw_or_report
from webmap.core.registry import robot_modules
from webmap.core.robot import Robot
from webmap.modules.declaration import FoundTopic, TopicKind, layer
from webmap.ros.bridge import Bridge
from webmap.ros.messages import Stamped
from webmap.scene import html, svg
from webmap.scene.element import Element

Owner: TypeAlias = Literal["own", "another", "unknown"]
"""Owner of a part, for one robot: the robot, another robot, or unknown."""


class PartOwners:
    """The robots that follow one topic, by their namespaces.

    In a ``diagnostic_msgs/DiagnosticArray`` only the names of the parts identify the
    robot. Updaters begin a name with the name of their node: in ROS 1 with its
    namespace and without the leading slash (``robot_0/base: Motors``), in ROS 2 by
    default without the namespace (``base: Motors``), on request with it
    (``/robot_0/base: Motors``). Aggregators name groups: ``/Power/base: Battery``.
    """

    def __init__(self) -> None:
        self._followers: Counter[str] = Counter()

    def join(self, namespace: str) -> Removal:
        """Add a robot until the current scope ends, or until the removal.

        Args:
            namespace: The robot's namespace, as :func:`bare` returns it; empty if none.
        """
        self._followers[namespace] += 1
        return keep(Removal(lambda: self._leave(namespace)))

    def owner(self, name: str, namespace: str) -> Owner:
        """Return the owner of a part.

        A single robot owns all parts. With several robots, a part belongs to the
        innermost namespace that its name begins with.

        Args:
            name: The part's name.
            namespace: The namespace of the robot that asks, as :func:`bare` returns it.
        """
        if len(self._followers) < 2:
            return "own"
        # The text after the colon is a task, which may contain slashes too.
        inside = name.strip("/").partition(":")[0]
        while inside and inside not in self._followers:
            inside = inside.rpartition("/")[0]
        if not inside:
            return "unknown"
        return "own" if inside == namespace else "another"

    def _leave(self, namespace: str) -> None:
        self._followers[namespace] -= 1
        if not self._followers[namespace]:
            del self._followers[namespace]


def part_owners(bridge: Bridge, topic: str) -> PartOwners:
    """Return what all robots that follow a topic of a bridge share."""
    return _owners.setdefault(bridge, {}).setdefault(topic, PartOwners())


_owners: weakref.WeakKeyDictionary[Bridge, dict[str, PartOwners]] = (
    weakref.WeakKeyDictionary()
)


OK, WARN, ERROR, STALE = range(4)
LEVELS = ("ok", "warn", "error", "stale")
"""The names of the levels, in the order of their numbers."""

MAX_PARTS = 1000
"""Greatest number of parts of one robot."""

MAX_VALUES = 100
"""Greatest number of values that are kept of one part."""

LONGEST_NAME, LONGEST = 256, 1000
"""Greatest numbers of characters that are kept of a name, and of a message or value."""

NOT_RECEIVED = "unheard"
"""The class of a badge until diagnostics of the robot are received."""

NOT_RECEIVED_TITLE = "no diagnostics of this robot received"
GREY = "#8a8f98"

# An error is worse than a stale part, although its number is smaller.
_WEIGHT = {"ok": 0, "warn": 1, "stale": 2, "error": 3}


class KeyValueMsg(msgspec.Struct, frozen=True, gc=False):
    """``diagnostic_msgs/KeyValue``."""

    key: str
    value: str


class DiagnosticStatusMsg(msgspec.Struct, frozen=True, kw_only=True, gc=False):
    """``diagnostic_msgs/DiagnosticStatus``."""

    name: str
    level_value: int | str = msgspec.field(name="level")
    """The level as received; use :attr:`level` for comparisons."""

    message: str = ""
    hardware_id: str = ""
    values: list[KeyValueMsg] = msgspec.field(default_factory=list)

    @property
    def level(self) -> int:
        """0 ok, 1 warning, 2 error, 3 stale.

        The field is a ``byte``, which some bridges of ROS 2 send as text: the character
        itself, or base64.

        Raises:
            ProtocolError: If the level has any other value.
        """
        value = self.level_value
        level = value if isinstance(value, int) else _byte(value)
        if not 0 <= level < len(LEVELS):
            raise ProtocolError(f"{self.name!r}: a level is 0 to 3, got {value!r}")
        return level


class DiagnosticArrayMsg(Stamped, frozen=True, kw_only=True):
    """``diagnostic_msgs/DiagnosticArray``."""

    separable: ClassVar = True
    status: list[DiagnosticStatusMsg]


@dataclass(frozen=True, slots=True)
class PartReport:
    """The newest ``DiagnosticStatus`` of one part, even if it has become stale."""

    name: str
    level: str
    """``"ok"``, ``"warn"``, ``"error"`` or ``"stale"``."""

    message: str
    hardware_id: str
    values: dict[str, str]
    received_at: float
    """Time of receipt, in monotonic seconds."""

    shared: bool = False
    """Whether several robots follow the topic and the part belongs to none of them."""


@robot_modules.register
@layer(
    "diagnostic_msgs/DiagnosticArray",
    view=DiagnosticArrayMsg,
    kinds=[
        TopicKind(
            "health",
            {
                r"/diagnostics\Z": "the usual name",
                r"/diagnostics_agg\Z": "the topic of an aggregator",
            },
            most=1,
            shared=True,
        )
    ],
    switch="Health",
    rank=140,
)
class Diagnostics:
    """Follows a ``diagnostic_msgs/DiagnosticArray`` and shows the worst level.

    A badge on the robot has the worst level as its class, and its title describes the
    part. Fires ``on_diagnostics_update``.

    A part whose name begins with another robot's namespace is left out. A part that
    belongs to no robot is shown with every robot that follows the topic, so that no
    error is lost; if such a part is well, this counts for none of the robots.

    Style it by CSS: ``.diagnostics.ok``, ``.warn``, ``.error``, ``.stale``, and
    ``.unheard`` until a part of the robot is received; rows of :meth:`show_in` have the
    same classes except ``.unheard``.

    Args:
        robot: The robot.
        bridge: The bridge of the ROS system that has the topic.
        topic: The topic: ``/diagnostics``, or ``/diagnostics_agg``.
        namespace: The robot's namespace, such as ``/robot_0``, where robots share a
            topic.
        prefix: Only parts whose names begin with this prefix are used, and all of them
            belong to the robot. A leading slash is ignored on both sides.
        hold: Seconds without a message after which a part is stale.
        throttle: The least time between two messages, in milliseconds. The default is 0
            because each message may contain other parts.

    Raises:
        ConfigError: If ``hold`` is not above 0, or if both a namespace and a prefix are
            given.
    """

    def __init__(
        self,
        robot: Robot,
        bridge: Bridge,
        topic: str = "/diagnostics",
        *,
        namespace: str = "",
        prefix: str = "",
        hold: float = 10.0,
        throttle: int = 0,
    ) -> None:
        if not hold > 0:
            raise ConfigError(f"hold must be seconds above 0, got {hold}")
        if namespace and prefix:
            raise ConfigError(
                f"give the namespace of the robot or a prefix, not both, got "
                f"{namespace!r} and {prefix!r}"
            )
        self.robot = robot
        self.namespace = namespace.strip("/")
        self.prefix = prefix.lstrip("/")
        self.hold = hold
        self._owners = part_owners(bridge, topic)
        self._joined = None if self.prefix else self._owners.join(self.namespace)
        self._parts: dict[str, PartReport] = {}
        self._lists: list[Element] = []
        self._shown: list[tuple[str, str, str]] = []
        self._title = svg.title(text=NOT_RECEIVED_TITLE)
        self.svg = svg.circle(
            self._title,
            class_=f"diagnostics {NOT_RECEIVED}",
            cx=0.3,
            cy=0.3,
            r=0.08,
            fill="none",
            stroke=GREY,
            stroke_width=0.03,
        )
        robot.svg.append(self.svg)
        self._bridge = bridge
        bridge.subscribe(
            topic,
            draw_or_report(robot, topic, self.on_array),
            "diagnostic_msgs/DiagnosticArray",
            throttle=throttle,
            decode=DiagnosticArrayMsg,
            queue_length=20,
        )

    @staticmethod
    def options_for(found: FoundTopic) -> dict[str, Any]:
        """Return the robot's namespace, which marks its parts on a shared topic."""
        # On its own topic a robot needs no namespace.
        return {"namespace": "" if found.own else found.namespace}

    def destroy(self) -> None:
        """Remove the badge."""
        if self._joined is not None:
            self._joined.remove()
        self.svg.remove()

    @property
    def parts(self) -> list[PartReport]:
        """The last reports of all parts, the worst first."""
        now = time.monotonic()
        parts = []
        for part in self._parts.values():
            # Robots may have been added or removed since the report was received.
            owner = self._owner(part.name)
            if owner == "another":
                continue
            shared = owner == "unknown"
            right = part if part.shared == shared else replace(part, shared=shared)
            parts.append(self._aged(right, now))
        return sorted(parts, key=lambda part: (-_WEIGHT[part.level], part.name))

    @property
    def level(self) -> str | None:
        """The worst level of all parts; None without diagnostics of this robot.

        Parts of unknown robots that are well do not count.
        """
        return _level(self.parts)

    def show_in(self, element: Element) -> None:
        """List the parts in an element of a page until the current scope ends.

        Args:
            element: A ``ul``, or another element that accepts ``li``; its content is
                removed.
        """
        self._lists.append(element)
        keep(Removal(lambda: self._lists.remove(element)))
        self._fill(element)

    def on_array(self, message: DiagnosticArrayMsg) -> None:
        """Store the reports of some parts; the reports of all others stay.

        Raises:
            ProtocolError: If the level of a part is not valid; the other parts are
                stored.
        """
        wrong: ProtocolError | None = None
        for status in message.status:
            if self._owner(status.name) == "another":
                continue
            try:
                self._take(status)
            except ProtocolError as error:
                wrong = wrong or error
        self._show()
        if wrong is not None:
            raise wrong

    def _take(self, status: DiagnosticStatusMsg) -> None:
        name = status.name[:LONGEST_NAME]
        if name not in self._parts and len(self._parts) >= MAX_PARTS:
            raise ProtocolError(f"the limit is {MAX_PARTS} parts")
        health = PartReport(
            name,
            LEVELS[status.level],
            status.message[:LONGEST],
            status.hardware_id[:LONGEST_NAME],
            {
                pair.key[:LONGEST_NAME]: pair.value[:LONGEST]
                for pair in status.values[:MAX_VALUES]
            },
            time.monotonic(),
            self._owner(status.name) == "unknown",
        )
        if not self._hides_worse(health):
            self._parts[name] = health

    def _hides_worse(self, health: PartReport) -> bool:
        """Return whether another part of this name recently reported a worse level.

        In ROS 2 the same nodes of two robots use the same names.
        """
        before = self._parts.get(health.name)
        if before is None or health.received_at - before.received_at > self.hold:
            return False
        another = health.shared or health.hardware_id != before.hardware_id
        return another and _WEIGHT[health.level] < _WEIGHT[before.level]

    def _owner(self, name: str) -> Owner:
        if self.prefix:
            return "own" if name.lstrip("/").startswith(self.prefix) else "another"
        return self._owners.owner(name, self.namespace)

    def _aged(self, part: PartReport, now: float) -> PartReport:
        if now - part.received_at <= self.hold or part.level == LEVELS[STALE]:
            return part
        message = f"no data for {now - part.received_at:.0f} s"
        return replace(part, level=LEVELS[STALE], message=message)

    def _show(self) -> None:
        parts = self.parts
        level = _level(parts) or NOT_RECEIVED
        colours = {"warn": "#e8a317", "error": "#d02f2f", "stale": GREY}
        self.svg.set(
            class_=f"diagnostics {level}",
            fill=colours.get(level, "none"),
            stroke=GREY if level == NOT_RECEIVED else "none",
        )
        self.svg.set_age(self._bridge.lag, limit=self.hold)
        received = level != NOT_RECEIVED
        self._title.text = (
            f"{parts[0].name}: {parts[0].message}" if received else NOT_RECEIVED_TITLE
        )
        shown = [(part.name, part.level, part.message) for part in parts]
        if shown != self._shown:
            self._shown = shown
            for element in self._lists:
                self._fill(element)
        self.robot.notify_modules("on_diagnostics_update", self)

    def _fill(self, element: Element) -> None:
        element.clear()
        for name, level, message in self._shown:
            element.append(
                html.li(
                    html.span(name, class_="name"),
                    html.span(message, class_="message"),
                    class_=level,
                )
            )


def _level(parts: list[PartReport]) -> str | None:
    """Return the worst level of parts that are sorted, the worst first."""
    if not parts:
        return None
    well = parts[0].level == LEVELS[OK]
    return None if well and all(part.shared for part in parts) else parts[0].level


def _byte(text: str) -> int:
    """Return the byte that a text encodes, or -1."""
    if len(text) == 1:
        return ord(text)
    try:
        data = binascii.a2b_base64(text, strict_mode=True)
    except (binascii.Error, ValueError):
        return -1
    return data[0] if len(data) == 1 else -1
