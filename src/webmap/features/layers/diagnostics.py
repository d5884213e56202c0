"""What the parts of a robot say of their health."""

import binascii
import time
import weakref
from collections import Counter
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar, Literal, TypeAlias

import msgspec

from webmap.base.errors import ConfigError, ProtocolError
from webmap.base.scope import Removal, keep
from webmap.core.problems import refusing
from webmap.core.registry import robot_modules
from webmap.modules.declaration import FoundTopic, TopicKind, layer
from webmap.ros.bridge import Bridge
from webmap.ros.messages import Stamped
from webmap.scene import html, svg
from webmap.scene.element import Element

if TYPE_CHECKING:
    from webmap.core.robot import Robot

Whose: TypeAlias = Literal["own", "another", "nobody"]
"""Of a robot, a part is its own, another robot's, or by its name of nobody."""


class PartOwners:
    """The robots that follow one topic, by their namespaces.

    Nothing in a ``diagnostic_msgs/DiagnosticArray`` says which robot it is about but
    the names of the parts. Updaters put the name of their node in front: in ROS 1 with
    its namespace and without the slash that it begins with (``robot_0/base: Motors``),
    in ROS 2 without the namespace (``base: Motors``) unless they are told otherwise
    (``/robot_0/base: Motors``). Aggregators name groups: ``/Power/base: Battery``.
    """

    def __init__(self) -> None:
        self._followers: Counter[str] = Counter()

    def join(self, namespace: str) -> Removal:
        """Count a robot in until the current scope ends, or this is removed.

        Args:
            namespace: The robot's, as :func:`bare` has it; empty if it has none.

        """
        self._followers[namespace] += 1
        return keep(Removal(lambda: self._leave(namespace)))

    def whose(self, name: str, namespace: str) -> Whose:
        """Return whose a part is.

        All parts are those of the only robot. With several, a part is that of the
        innermost namespace that its name begins with.

        Args:
            name: The part's name.
            namespace: The namespace of the robot that asks, as :func:`bare` has it.

        """
        if len(self._followers) < 2:
            return "own"
        # What stands behind the colon is a task, which may have slashes too.
        inside = bare(name).partition(":")[0]
        while inside and inside not in self._followers:
            inside = inside.rpartition("/")[0]
        if not inside:
            return "nobody"
        return "own" if inside == namespace else "another"

    def _leave(self, namespace: str) -> None:
        self._followers[namespace] -= 1
        if not self._followers[namespace]:
            del self._followers[namespace]


def bare(name: str) -> str:
    """Return a name of a part, or a namespace, without slashes in front and behind."""
    return name.strip("/")


def part_owners(bridge: Bridge, topic: str) -> PartOwners:
    """Return the robots that follow a topic behind a bridge."""
    return _owners.setdefault(bridge, {}).setdefault(topic, PartOwners())


_owners: weakref.WeakKeyDictionary[Bridge, dict[str, PartOwners]] = (
    weakref.WeakKeyDictionary()
)


OK, WARN, ERROR, STALE = range(4)
LEVELS = ("ok", "warn", "error", "stale")
"""The names of the levels, by their numbers."""

MAX_PARTS = 1000
"""The most parts that one robot may have."""

MAX_VALUES = 100
"""The most values that are kept of one part."""

LONGEST_NAME, LONGEST = 256, 1000
"""The most characters that are kept of a name, and of a message or a value."""

UNHEARD = "unheard"
"""The class of a badge while nothing was heard that tells how the robot is."""

UNSAID = "no diagnostics of this robot received"
GREY = "#8a8f98"

# An error weighs more than a part that has gone silent, though its number is less.
_WEIGHT = {"ok": 0, "warn": 1, "stale": 2, "error": 3}


class KeyValueMsg(msgspec.Struct, frozen=True, gc=False):
    """``diagnostic_msgs/KeyValue``."""

    key: str
    value: str


class DiagnosticStatusMsg(msgspec.Struct, frozen=True, kw_only=True, gc=False):
    """``diagnostic_msgs/DiagnosticStatus``."""

    name: str
    level_value: int | str = msgspec.field(name="level")
    """The level as it came; :attr:`level` is what to count with."""

    message: str = ""
    hardware_id: str = ""
    values: list[KeyValueMsg] = msgspec.field(default_factory=list)

    @property
    def level(self) -> int:
        """0 ok, 1 warning, 2 error, 3 stale.

        It is a ``byte``, which some bridges of ROS 2 write as text: the character
        itself, or base64.

        Raises:
            ProtocolError: If it is none of them.

        """
        said = self.level_value
        level = said if isinstance(said, int) else _byte(said)
        if not 0 <= level < len(LEVELS):
            raise ProtocolError(f"{self.name!r}: a level is 0 to 3, got {said!r}")
        return level


class DiagnosticArrayMsg(Stamped, frozen=True, kw_only=True):
    """``diagnostic_msgs/DiagnosticArray``."""

    separable: ClassVar = True
    status: list[DiagnosticStatusMsg]


@dataclass(frozen=True, slots=True)
class Health:
    """What one part said last."""

    name: str
    level: str
    """``"ok"``, ``"warn"``, ``"error"`` or ``"stale"``."""

    message: str
    hardware_id: str
    values: dict[str, str]
    heard: float
    """When, in monotonic seconds."""

    shared: bool = False
    """Whether several robots follow the topic and its name is of none of them."""


@robot_modules.register
@layer(
    "diagnostic_msgs/DiagnosticArray",
    view=DiagnosticArrayMsg,
    kinds=[
        TopicKind(
            "health",
            {
                r"/diagnostics\Z": "the usual name",
                r"/diagnostics_agg\Z": "what an aggregator says",
            },
            most=1,
            shared=True,
        )
    ],
    switch="Health",
    rank=140,
)
class Diagnostics:
    """Follows a ``diagnostic_msgs/DiagnosticArray`` and says what is worst.

    On the robot there is a badge, whose class is the worst level and whose title says
    what it is. Fires ``on_diagnostics_update``.

    A part whose name begins with another robot's namespace is left out. One that begins
    with nobody's is shown with every robot that follows the topic, so that no error is
    lost; that it is well says nothing of any of them.

    Style it by CSS: ``.diagnostics.ok``, ``.warn``, ``.error``, ``.stale``, and
    ``.unheard`` while no part of the robot was heard; rows of :meth:`show_in` have
    these classes too, but for the last.

    Args:
        robot: The robot.
        bridge: The link to the ROS system that has the topic.
        topic: The topic: ``/diagnostics``, or ``/diagnostics_agg``.
        namespace: The robot's, such as ``/robot_0``, where robots share a topic.
        prefix: Only parts whose names begin with this are taken, and all of them are
            the robot's. A slash in front counts neither here nor there.
        hold: Seconds after which a part that says nothing counts as stale.
        throttle: The least time between two messages, in milliseconds. It is 0
            since each message tells of other parts.

    Raises:
        ConfigError: If ``hold`` is not above 0, or there are both a namespace and a
            prefix.

    """

    def __init__(
        self,
        robot: "Robot",
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
        self.namespace = bare(namespace)
        self.prefix = prefix.lstrip("/")
        self.hold = hold
        self._owners = part_owners(bridge, topic)
        self._joined = None if self.prefix else self._owners.join(self.namespace)
        self._parts: dict[str, Health] = {}
        self._lists: list[Element] = []
        self._shown: list[tuple[str, str, str]] = []
        self._title = svg.title(text=UNSAID)
        self.svg = svg.circle(
            self._title,
            class_=f"diagnostics {UNHEARD}",
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
            refusing(robot, topic, self.on_array),
            "diagnostic_msgs/DiagnosticArray",
            throttle=throttle,
            decode=DiagnosticArrayMsg,
            queue_length=20,
        )

    @staticmethod
    def options_for(found: FoundTopic) -> dict[str, Any]:
        """Return the robot's namespace, by which parts of a shared topic are told."""
        # On a topic of its own there is nobody to tell it from.
        return {"namespace": "" if found.own else found.namespace}

    def destroy(self) -> None:
        """Take the badge away."""
        if self._joined is not None:
            self._joined.remove()
        self.svg.remove()

    @property
    def parts(self) -> list[Health]:
        """What all parts said last, the worst first."""
        now = time.monotonic()
        parts = []
        for part in self._parts.values():
            # Since it was taken, robots may have come and gone.
            whose = self._whose(part.name)
            if whose == "another":
                continue
            shared = whose == "nobody"
            right = part if part.shared == shared else replace(part, shared=shared)
            parts.append(self._aged(right, now))
        return sorted(parts, key=lambda part: (-_WEIGHT[part.level], part.name))

    @property
    def level(self) -> str | None:
        """The worst level of all parts; None if nothing was heard of this robot.

        That parts of nobody are well does not count.
        """
        return _level(self.parts)

    def show_in(self, element: Element) -> None:
        """List the parts in an element of a page until the current scope ends.

        Args:
            element: A ``ul``, or whatever takes ``li``; what is in it goes.

        """
        self._lists.append(element)
        keep(Removal(lambda: self._lists.remove(element)))
        self._fill(element)

    def on_array(self, message: DiagnosticArrayMsg) -> None:
        """Take what some parts say; what others said stays.

        Raises:
            ProtocolError: If a part says a level that there is not; the others count.

        """
        wrong: ProtocolError | None = None
        for status in message.status:
            if self._whose(status.name) == "another":
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
            raise ProtocolError(f"{MAX_PARTS} parts are the limit")
        said = Health(
            name,
            LEVELS[status.level],
            status.message[:LONGEST],
            status.hardware_id[:LONGEST_NAME],
            {
                pair.key[:LONGEST_NAME]: pair.value[:LONGEST]
                for pair in status.values[:MAX_VALUES]
            },
            time.monotonic(),
            self._whose(status.name) == "nobody",
        )
        if not self._hides_worse(said):
            self._parts[name] = said

    def _hides_worse(self, said: Health) -> bool:
        """Tell whether another part of this name said worse just now.

        In ROS 2 the same nodes of two robots say the same names, one after the other.
        """
        before = self._parts.get(said.name)
        if before is None or said.heard - before.heard > self.hold:
            return False
        another = said.shared or said.hardware_id != before.hardware_id
        return another and _WEIGHT[said.level] < _WEIGHT[before.level]

    def _whose(self, name: str) -> Whose:
        if self.prefix:
            return "own" if name.lstrip("/").startswith(self.prefix) else "another"
        return self._owners.whose(name, self.namespace)

    def _aged(self, part: Health, now: float) -> Health:
        if now - part.heard <= self.hold or part.level == LEVELS[STALE]:
            return part
        said = f"no data for {now - part.heard:.0f} s"
        return replace(part, level=LEVELS[STALE], message=said)

    def _show(self) -> None:
        parts = self.parts
        level = _level(parts) or UNHEARD
        colours = {"warn": "#e8a317", "error": "#d02f2f", "stale": GREY}
        self.svg.set(
            class_=f"diagnostics {level}",
            fill=colours.get(level, "none"),
            stroke=GREY if level == UNHEARD else "none",
        )
        self.svg.set_age(self._bridge.lag, limit=self.hold)
        heard = level != UNHEARD
        self._title.text = f"{parts[0].name}: {parts[0].message}" if heard else UNSAID
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


def _level(parts: list[Health]) -> str | None:
    """Return the worst level, of parts of which the worst is first."""
    if not parts:
        return None
    well = parts[0].level == LEVELS[OK]
    return None if well and all(part.shared for part in parts) else parts[0].level


def _byte(text: str) -> int:
    """Return the byte that a text stands for, or -1."""
    if len(text) == 1:
        return ord(text)
    try:
        data = binascii.a2b_base64(text, strict_mode=True)
    except (binascii.Error, ValueError):
        return -1
    return data[0] if len(data) == 1 else -1
