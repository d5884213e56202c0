"""How the console shows a robot: its drawing, and the symbol and text of its state.

``map.css`` has the colours.
"""

import math
import re
import zlib
from collections.abc import Iterable, Mapping
from typing import NamedTuple

import webmap
from webmap import Bridge, Element, Robot, RobotConfig, svg
from webmap.base import geometry
from webmap.base.audience import audience
from webmap.config.robot import PictureConfig

UNKNOWN = "\N{EN DASH}"
"""Shown in place of an unknown number."""

EMPTY = 0.1
"""The charge below which a low battery is nearly empty."""

NAME = re.compile(r"[\d/_:.]")
"""Characters that occur in a URL, topic or robot name, but not in plain words."""


class Look(NamedTuple):
    """How a state of a robot is shown, besides its text."""

    symbol: str
    """The symbol of console.html."""

    tone: str
    """``bad``, ``warn``, ``active``, or empty: the colour."""

    group: str
    """The words under which the list counts the robots: 2 *lost*."""


LOOKS = {
    "disobeying": Look("state-disobeying", "bad", "not obeying"),
    "unreachable": Look("state-down", "bad", "lost"),
    "no_bridge": Look("state-down", "bad", "lost"),
    "connecting": Look("state-waiting", "", "connecting"),
    "gone": Look("state-old", "", "lost"),
    "lost": Look("state-down", "bad", "lost"),
    "down": Look("state-down", "bad", "lost"),
    "unconfirmed": Look("state-stopped", "bad", "stopped"),
    "stopped": Look("state-stopped", "bad", "stopped"),
    "blocked": Look("state-blocked", "warn", "blocked"),
    "goal_failed": Look("goal-failed", "warn", "goal failed"),
    "battery_low": Look("state-battery", "warn", "battery low"),
    "other": Look("state-moving", "warn", "moved by another program"),
    "moving": Look("state-moving", "warn", "moved by another program"),
    "changing": Look("state-stopping", "warn", "driven"),
    "stopping": Look("state-stopping", "warn", "driven"),
    "driven": Look("state-driving", "active", "driven"),
    "settling": Look("state-stopping", "warn", "driven"),
    "navigating": Look("goal-way", "active", "autonomous"),
    "navigating_held": Look("goal-way", "active", "autonomous"),
    "barred": Look("state-barred", "warn", "cannot be driven"),
    "barred_held": Look("state-barred", "warn", "cannot be driven"),
    "watched": Look("state-watched", "", "view only"),
    "held": Look("state-held", "active", "in control"),
    "free": Look("state-free", "", "free"),
}
"""The look of each state of a robot, in the order of ``STATE_TEXTS``."""

GROUPS = tuple(dict.fromkeys(look.group for look in LOOKS.values()))
"""The groups, the worst first."""

NEED_A_PERSON = (
    "not obeying",
    "lost",
    "stopped",
    "blocked",
    "goal failed",
    "battery low",
)
"""Groups of states that end only when a person does something."""


def icon(symbol: str) -> Element:
    """Return a symbol of console.html as a decorative picture."""
    return svg.svg(svg.use(href=f"#{symbol}"), class_="icon", aria_hidden="true")


def look_of(robot: Robot) -> Look:
    """Return the symbol, the tone and the group of the robot's state."""
    return LOOKS[robot.shown_state.name]


def needs_person(robot: Robot) -> bool:
    """Return whether the robot's state ends only when a person does something."""
    return look_of(robot).group in NEED_A_PERSON


def battery_tone(charge: float, low: float) -> str:
    """Return the tone of a charge that is low below ``low``; both from 0 to 1."""
    if charge >= low:
        return ""
    return "bad" if charge < EMPTY else "warn"


def number(value: float, digits: int = 2) -> str:
    """Return a number as text, and never minus zero."""
    if not math.isfinite(value):
        return UNKNOWN
    text = f"{value:.{digits}f}"
    return text.removeprefix("-") if float(text) == 0 else text


def heading(yaw: float) -> str:
    """Return a yaw in radians as whole degrees from 0 to 359."""
    return str(round(math.degrees(yaw)) % 360)


def sentence(text: str) -> str:
    """Return a text of the gate as a sentence.

    A name at the beginning, such as a URL or a topic, keeps its small letter.
    """
    if not text.strip():
        return ""
    first = text.split(maxsplit=1)[0].rstrip(".,:;")
    start = text[:1] if NAME.search(first) else text[:1].upper()
    return f"{start}{text[1:].rstrip('.')}."


def make_robot(
    config: RobotConfig,
    bridges: Mapping[str, Bridge] | Iterable[Bridge],
    picture: str = "",
) -> Robot:
    """Return a robot with the modules that the console shows.

    Args:
        config: The robot's configuration.
        bridges: The robot's bridges, by their names in the configuration, or in any
            order if the configuration has their addresses.
        picture: The URL from which pages load the robot's picture; empty if none.

    Raises:
        ConfigError: If the configuration is not valid; the error lists every mistake.
    """
    if not isinstance(bridges, Mapping):
        bridges = {bridge.url: bridge for bridge in bridges}
    pictured = config.picture if picture else None
    model = None if config.model is not None else robot_model()
    if pictured is not None:
        model = picture_model(pictured, picture)
    robot = webmap.Robot.from_config(config, bridges, model=model)
    if pictured is not None:  # the name is below the picture
        robot.svg.set_style("--reach", picture_reach(pictured))
    robot.add_module(StateMark)
    return robot


def draw_picture(robot: Robot, picture: PictureConfig | None, href: str) -> None:
    """Draw a robot that the console has made as another picture, or as its usual body.

    Args:
        robot: The robot.
        picture: The position of the picture on the robot; None for the usual body.
        href: The URL from which pages load the picture.
    """
    drawn = robot_model() if picture is None else picture_model(picture, href)
    parts = drawn.children
    drawn.clear()
    robot.model.clear()
    robot.model.append(*parts)
    reach = None if picture is None else picture_reach(picture)
    robot.svg.set_style("--reach", reach)


BODY = (
    "M0.08 -0.19H-0.14A0.08 0.08 0 0 0 -0.22 -0.11V0.11A0.08 0.08 0 0 0 -0.14 0.19"
    "H0.08C0.18 0.19 0.25 0.08 0.25 0C0.25 -0.08 0.18 -0.19 0.08 -0.19Z"
)
HEADING = "M0.19 0L-0.08 0.13L-0.03 0L-0.08 -0.13Z"
HATCH = (
    "M-0.22 0.02L0 0.19M-0.22 -0.12L0.14 0.17M-0.12 -0.19L0.22 0.08"
    "M0.04 -0.19L0.25 -0.02"
)


def robot_model() -> Element:
    """Return a rounded body of half a metre with an arrow that shows the heading."""
    return svg.g(
        svg.circle(r=0.35, class_="hit"),
        svg.g(
            svg.circle(r=0.37, class_="ring"),
            svg.path(d=BODY, class_="body"),
            svg.path(d=HATCH, class_="hatch"),
            svg.path(d=HEADING, class_="heading"),
            class_="model",
        ),
    )


def picture_reach(picture: PictureConfig) -> float:
    """Return the greatest distance from robot origin to picture edge, in metres."""
    half = math.hypot(picture.width, picture.height) / 2
    return half + math.hypot(picture.x, picture.y)


def picture_model(picture: PictureConfig, href: str) -> Element:
    """Return a model made of a picture, with the same marks as any other robot.

    Args:
        picture: The position of the picture on the robot.
        href: The URL from which pages load the picture.
    """
    width, height = picture.width, picture.height
    placed = geometry.Affine.translation(picture.x, picture.y)
    placed @= geometry.Affine.rotation(math.radians(picture.angle))
    image = svg.image(class_="picture", href=href, preserveAspectRatio="none")
    image.set_matrix(placed @ geometry.Affine(1, 0, 0, -1, 0, 0))
    # The hatching that marks stale data on the usual body is drawn over the picture.
    hatch = svg.path(d=HATCH, class_="hatch")
    hatch.set_matrix(placed @ geometry.Affine(width / 0.47, 0, 0, height / 0.38, 0, 0))
    reach = svg.rect(class_="reach", fill="transparent")
    reach.set_matrix(placed)
    for box in (image, reach):
        box.set(x=-width / 2, y=-height / 2, width=width, height=height)
    around = math.hypot(width, height) / 2 + 0.02
    ring = svg.circle(r=around, cx=picture.x, cy=picture.y, class_="ring")
    model = svg.g(ring, image, hatch, class_="model pictured")
    model.set_style("--length", max(width, height))
    return svg.g(svg.circle(r=0.35, class_="hit"), reach, model)


LONGEST = 24
"""The most characters of a name on the map; the title has the whole name."""

ACROSS = 16
"""Size of the symbol in pixels."""


def shortened(name: str) -> str:
    """Return a name that fits on the map, of one line."""
    name = " ".join(name.split())
    if len(name) <= LONGEST:
        return name
    # A joiner or a variation of a character that was cut off would join the dots.
    return name[: LONGEST - 1].rstrip("\u200d\ufe0f ") + "…"


class StateMark:
    """A robot's badge, name and words on the map, always upright; a module of robots.

    ``map.css`` has sizes and places, in pixels.
    """

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        half = -ACROSS / 2
        self._use = svg.use(x=half, y=half, width=ACROSS, height=ACROSS)
        self._words = svg.text(class_="words")
        self.svg = svg.g(
            svg.text(text=shortened(robot.name), class_="label"),
            self._words,
            svg.g(svg.circle(r=ACROSS / 2 + 3), self._use, class_="state-mark"),
            class_="upright",
        )
        # Of the name, so that a robot has the same colour everywhere and always.
        robot.svg.set_style("--hue", zlib.crc32(robot.name.encode()) % 360)
        # Above the body, and below what other modules draw.
        robot.svg.insert(list(robot.svg.children).index(robot.model) + 1, self.svg)
        self.on_odometry_update()
        self.on_state()
        audience.follow(self)

    def destroy(self) -> None:
        """Remove badge, name and words."""
        audience.forget(self)
        self.svg.remove()

    def on_odometry_update(self) -> None:
        """Turn against the robot's heading, so that everything stays upright."""
        if audience.present:
            self.svg.set_pose(0.0, 0.0, -self.robot.yaw)

    audience_changed = on_odometry_update

    def on_state(self, state: object = None) -> None:
        """Show the symbol of the state; its words only if it needs a person."""
        robot, look = self.robot, look_of(self.robot)
        self._use.set(href=f"#{look.symbol}")
        shown = robot.shown_state
        # Who has control is in the list: on the map it would cover other robots.
        held = shown.activity == "held" and shown.conditions
        words = shown.conditions_text if held else shown.text
        self._words.text = words if needs_person(robot) else ""
        robot.svg.set(data_tone=look.tone or None, data_group=look.group)
        title = robot.svg.children[0]
        assert isinstance(title, Element), "a robot's group begins with its title"
        title.text = f"{robot.name}: {shown.text}"
