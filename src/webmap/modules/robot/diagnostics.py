"""What the parts of a robot say of their health."""

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

from webmap.core.refusals import refusing
from webmap.errors import ConfigError, ProtocolError
from webmap.ros.bridge import Bridge
from webmap.ros.messages_diagnostics import (
    LEVELS,
    OK,
    STALE,
    DiagnosticArrayMsg,
    DiagnosticStatusMsg,
)
from webmap.scene import html, svg
from webmap.scene.element import Element
from webmap.scope import Removal, keep

if TYPE_CHECKING:
    from webmap.core.robot import Robot

MAX_PARTS = 1000
"""The most parts that one robot may have."""

# An error weighs more than a part that has gone silent, though its number is less.
_WEIGHT = {"ok": 0, "warn": 1, "stale": 2, "error": 3}


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


class Diagnostics:
    """Follows a ``diagnostic_msgs/DiagnosticArray`` and says what is worst.

    On the robot there is a badge, whose class is the worst level and whose title says
    what it is. Fires ``on_diagnostics_update``.

    Style it by CSS: ``.diagnostics.ok``, ``.warn``, ``.error`` and ``.stale``; rows of
    :meth:`show_in` have these classes too.

    Args:
        robot: The robot.
        bridge: The link to the ROS system that has the topic.
        topic: The topic: ``/diagnostics``, or ``/diagnostics_agg``.
        prefix: Only parts whose names begin with this are taken, where robots share
            a topic.
        hold: Seconds after which a part that says nothing counts as stale.
        throttle: The least time between two messages, in milliseconds. It is 0
            since each message tells of other parts.

    Raises:
        ConfigError: If ``hold`` is not above 0.

    """

    def __init__(
        self,
        robot: "Robot",
        bridge: Bridge,
        topic: str = "/diagnostics",
        *,
        prefix: str = "",
        hold: float = 10.0,
        throttle: int = 0,
    ) -> None:
        if not hold > 0:
            raise ConfigError(f"hold must be seconds above 0, got {hold}")
        self.robot = robot
        self.prefix = prefix
        self.hold = hold
        self._parts: dict[str, Health] = {}
        self._lists: list[Element] = []
        self._shown: list[tuple[str, str, str]] = []
        self._title = svg.title(text="")
        self.svg = svg.circle(
            self._title, class_="diagnostics ok", cx=0.3, cy=0.3, r=0.08, fill="none"
        )
        robot.svg.append(self.svg)
        bridge.subscribe(
            topic,
            refusing(robot, topic, self.on_array),
            "diagnostic_msgs/DiagnosticArray",
            throttle=throttle,
            decode=DiagnosticArrayMsg,
            queue_length=20,
        )

    def destroy(self) -> None:
        """Take the badge away."""
        self.svg.remove()

    @property
    def parts(self) -> list[Health]:
        """What all parts said last, the worst first."""
        now = time.monotonic()
        return sorted(
            (self._aged(part, now) for part in self._parts.values()),
            key=lambda part: (-_WEIGHT[part.level], part.name),
        )

    @property
    def level(self) -> str | None:
        """The worst level of all parts; None if nothing was heard."""
        parts = self.parts
        return parts[0].level if parts else None

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
            if not status.name.startswith(self.prefix):
                continue
            try:
                self._take(status)
            except ProtocolError as error:
                wrong = wrong or error
        self._show()
        if wrong is not None:
            raise wrong

    def _take(self, status: DiagnosticStatusMsg) -> None:
        if status.name not in self._parts and len(self._parts) >= MAX_PARTS:
            raise ProtocolError(f"{MAX_PARTS} parts are the limit")
        self._parts[status.name] = Health(
            status.name,
            LEVELS[status.level],
            status.message,
            status.hardware_id,
            {pair.key: pair.value for pair in status.values},
            time.monotonic(),
        )

    def _aged(self, part: Health, now: float) -> Health:
        if now - part.heard <= self.hold or part.level == LEVELS[STALE]:
            return part
        said = f"silent for {now - part.heard:.0f} s"
        return Health(
            part.name, LEVELS[STALE], said, part.hardware_id, part.values, part.heard
        )

    def _show(self) -> None:
        parts = self.parts
        worst = parts[0] if parts else None
        level = worst.level if worst else LEVELS[OK]
        colours = {"ok": "none", "warn": "#e8a317", "error": "#d02f2f"}
        self.svg.set(class_=f"diagnostics {level}", fill=colours.get(level, "#8a8f98"))
        self.svg.set_age(0.0, limit=self.hold)
        self._title.text = f"{worst.name}: {worst.message}" if worst else ""
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
