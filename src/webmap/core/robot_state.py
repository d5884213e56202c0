"""What a robot is doing, with the texts of pages, and regular looks at all robots."""

import asyncio
import logging
from collections import deque
from collections.abc import Callable, Sequence
from datetime import datetime, timedelta
from typing import NamedTuple

from webmap.base.audience import RARELY, audience
from webmap.base.geometry import Twist
from webmap.base.text import isolated
from webmap.config.robot import BATTERY_LOW
from webmap.gate.protocol import MAY_MOVE, RobotReport
from webmap.gate.rules.goals import BRAKES, OVER
from webmap.gate.rules.health import moves
from webmap.gate.rules.obedience import MOVES, TURNS
from webmap.poses.silence import LIMIT, PERIODS
from webmap.ros.bridge import Bridge

log = logging.getLogger("webmap.robot")

STATE_TEXTS = {
    "disobeying": "Does not obey: still moving",
    "unreachable": "No connection: may still be moving",
    "no_bridge": "No connection to the bridge",
    "connecting": "Connecting",
    "gone": "No pose since {since}",
    "lost": "Lost: no new pose",
    "down": "No connection for commands",
    "unconfirmed": "STOP NOT CONFIRMED",
    "stopped": "STOP active",
    "blocked": "Not moving: blocked?",
    "goal_failed": "Goal failed",
    "battery_low": "Battery low",
    "other": "Moved by {program}",
    "moving": "Moved by another program",
    "changing": "Handing over",
    "stopping": "Stopping",
    "driven": "{who} is driving",
    "driven_by_you": "You are driving",
    "settling": "Still moving",
    "navigating": "Autonomous",
    "navigating_held": "Autonomous ({who} has control)",
    "navigating_held_by_you": "Autonomous (you have control)",
    "barred": "Cannot be driven",
    "barred_held": "Cannot be driven ({who} has control)",
    "barred_held_by_you": "Cannot be driven (you have control)",
    "watched": "View only",
    "held": "{who} has control",
    "held_by_you": "You have control",
    "free": "Free",
}
"""The text of each activity and each condition, the worst first. The page has the same
table, generated from this one."""

YOUR_OTHER = "your other page"
"""Who has control, on the other pages of the same person."""

PRECEDENCE = {name: place for place, name in enumerate(STATE_TEXTS)}
"""The place of each state in the table; the least one has priority."""

SEEN = (
    "disobeying",
    "unreachable",
    "no_bridge",
    "connecting",
    "gone",
    "lost",
    "down",
    "other",
    "moving",
    "settling",
    "navigating",
)
"""Activities that the display finds besides the one that the gate reports. The page has
the same list, generated from this one."""

UNKNOWN = SEEN[:7]
"""Conditions in which nothing is known about a robot, unless the gate moves or stops
it. Only the first is shown."""

SEPARATOR = " \N{MIDDLE DOT} "
"""Between the activity and the conditions."""

LOST = LIMIT
"""Seconds without a pose, over an open connection, after which a robot is lost."""

GONE = 30.0
"""Seconds after which a lost robot that no operator has control of is gone."""

FRESH = 1.0
"""Seconds for which the velocity of a pose is used."""

QUIET = ("free", "barred", "down")
"""States of a robot that nobody has control of and that the gate does not move."""


class RobotState(NamedTuple):
    """What a robot is doing, and what needs attention besides."""

    name: str
    """The worst of the activity and the conditions: a key of ``STATE_TEXTS``."""

    activity: str
    """What the robot does: a key of ``STATE_TEXTS``."""

    conditions: tuple[str, ...]
    """What needs attention, the worst first: keys of ``STATE_TEXTS``."""

    activity_text: str
    """The text of the activity."""

    own_text: str
    """The text of the activity for the page that has control of the robot."""

    elsewhere_text: str
    """The text of the activity for other pages of the person who has control."""

    conditions_text: str
    """The text of the conditions; empty if there are none."""

    person: str = ""
    """The person who has control of the robot; empty for none and for a program."""

    @property
    def text(self) -> str:
        """The activity and the conditions, such as "Autonomous · battery low"."""
        return beside(self.activity_text, self.conditions_text)

    @property
    def mine(self) -> str:
        """That text for the page that has control of the robot."""
        return beside(self.own_text, self.conditions_text)

    @property
    def besides_text(self) -> str:
        """The text of the conditions, to follow that of the activity."""
        return beside("", self.conditions_text)

    def activity_for(self, person: str) -> str:
        """Return the text of the activity for pages of a person without control."""
        return self.elsewhere_text if person == self.person else self.activity_text


class Facts(NamedTuple):
    """The facts that determine the state of a robot."""

    report: RobotReport | None
    """The newest report of the gate; None if the gate does not know the robot."""

    bridge: Bridge | None
    """The bridge of the topic with poses; None if there is no such topic."""

    period: float
    """The least time between two poses when the newest one came, in seconds."""

    silent_for: float | None
    """Seconds since the newest pose from a source that also sends while the robot is at
    rest; None if there was none."""

    pose_age: float | None
    """Seconds since the newest pose was sent; None if there was none."""

    twist: Twist | None
    """The velocity of that pose, in the axes that the robot moves along."""

    goal_over_for: float | None
    """Seconds since the newest goal ended; None if there is no goal or it has not
    ended."""

    goal_failed: bool = False
    """Whether the newest goal failed and nobody has driven the robot since."""

    charge: float | None = None
    """The charge of the battery, from 0 to 1; None if unknown."""

    battery_low: float = BATTERY_LOW
    """The charge below which the battery is low."""

    has_own_goal: bool = False
    """Whether a goal or plan of the robot's own navigation is active."""

    writers: tuple[str, ...] = ()
    """The nodes that publish its velocity, as far as they are known."""


def state_of(facts: Facts) -> RobotState:
    """Return what a robot is doing, with all conditions that are true.

    Stale data is left out: the page detects it by itself, even when it cannot reach
    this process.
    """
    activity = _activity(facts)
    found = [_link_state(facts), _pose_state(facts), *_reported(facts, activity)]
    names = sorted({name for name in found if name}, key=PRECEDENCE.__getitem__)
    unknown = [name for name in names if name in UNKNOWN]
    if unknown and activity in (*QUIET, "watched", "settling"):
        activity = unknown[0]
    left_out = (activity, *unknown[1:])
    names = [name for name in names if name not in left_out]
    first = min((activity, *names), key=PRECEDENCE.__getitem__)
    conditions = tuple(names)
    who, person = _holder(facts)
    besides = [_text(name, facts, who) for name in conditions]
    return RobotState(
        first,
        activity,
        conditions,
        _text(activity, facts, who),
        _text(f"{activity}_by_you", facts, who) or _text(activity, facts, who),
        _text(activity, facts, YOUR_OTHER),
        SEPARATOR.join(text[:1].lower() + text[1:] for text in besides),
        person,
    )


def beside(activity: str, conditions: str) -> str:
    """Return the text of an activity with the text of conditions, if there are any."""
    return f"{activity}{SEPARATOR}{conditions}" if conditions else activity


def since_when(silent_for: float | None) -> str:
    """Return when the poses of a robot ended, by the clock of this computer.

    Args:
        silent_for: Seconds since then; None for now.

    """
    return f"{datetime.now() - timedelta(seconds=silent_for or 0.0):%H:%M}"


def _link_state(facts: Facts) -> str | None:
    """Return the state of a robot without a connection to the bridge of its poses."""
    bridge = facts.bridge
    if bridge is None or bridge.state == "open":
        return None
    return "no_bridge" if bridge.lost else "connecting"


def _pose_state(facts: Facts) -> str | None:
    """Return the state of a robot whose expected poses are missing."""
    silent, bridge = facts.silent_for, facts.bridge
    if silent is None or silent <= LOST:
        return None
    if bridge is not None and (
        bridge.replays or silent <= PERIODS * facts.period or bridge.state != "open"
    ):
        return None
    return "gone" if silent > GONE and _is_quiet(facts) else "lost"


def _activity(facts: Facts) -> str:
    """Return the gate's state of a robot, or what the display knows better."""
    report = facts.report
    if report is None:
        return "watched"
    doing = report.doing
    if doing in ("moving", "other"):
        if facts.has_own_goal:
            return "navigating" if report.holder is None else "navigating_held"
        return doing if report.other_writer is None else "other"
    return _own_motion(facts) or ("driven" if doing == "blocked" else doing)


def _reported(facts: Facts, activity: str) -> list[str]:
    """Return the conditions of a robot by reports, beside its activity."""
    names = []
    if facts.goal_failed:
        names.append("goal_failed")
    if facts.charge is not None and facts.charge < facts.battery_low:
        names.append("battery_low")
    report = facts.report
    if report is None:
        return names
    if report.alarm is not None:
        names.append("unreachable" if report.alarm == MAY_MOVE else "disobeying")
    if report.link == "down":
        names.append("down")
    if report.doing == "blocked":
        names.append("blocked")
    by_own_goal = facts.has_own_goal and activity.startswith("navigating")
    if report.other_writer is not None and not by_own_goal:
        names.append("other")
    return names


def _own_motion(facts: Facts) -> str | None:
    """Return the activity of a moving robot whose odometry the gate does not have."""
    report = facts.report
    if report is None or not _is_quiet(facts) or report.measured is not None:
        return None
    if report.link == "down" or not _moves(facts):
        return None
    goes = report.goal is not None and report.goal.state not in OVER
    if goes or facts.has_own_goal:
        return "navigating"
    over = facts.goal_over_for
    return "settling" if over is not None and over < BRAKES else "moving"


def _holder(facts: Facts) -> tuple[str, str]:
    """Return the name of who has control, and the person; empty for a program."""
    holder = facts.report.holder if facts.report is not None else None
    if holder is None:
        return "Another operator", ""
    person = holder.identity.person if holder.identity else ""
    return isolated(holder.name or holder.connection), person


def _text(name: str, facts: Facts, who: str) -> str:
    """Return the text of a state; empty if the table does not have it."""
    text = STATE_TEXTS.get(name, "")
    since = since_when(facts.silent_for) if "{since}" in text else ""
    text = text.format(who=who, since=since, program=named(facts.writers))
    return f"{text[:1].upper()}{text[1:]}"


def named(nodes: Sequence[str]) -> str:
    """Return the words for another program, with its nodes as far as they are known."""
    return f"another program: {', '.join(nodes)}" if nodes else "another program"


def _is_quiet(facts: Facts) -> bool:
    """Return whether nobody has control of the robot."""
    return facts.report is None or facts.report.doing in QUIET


def _moves(facts: Facts) -> bool:
    """Return whether fresh odometry shows a robot in motion."""
    age, twist = facts.pose_age, facts.twist
    if age is None or age > max(FRESH, PERIODS * facts.period) or twist is None:
        return False
    return moves(twist, MOVES, TURNS)


EVERY = 0.25
"""Seconds between two looks at a robot while somebody looks at the pages."""

AT_ONCE = 50
"""Most robots at which it looks at once: more would delay a frame."""


class StateRounds:
    """Looks at all robots in turn.

    A lost robot sends no message, so its state is found by looking. With a timer for
    each of a thousand robots, waking up would cost more than the looks.
    """

    def __init__(self) -> None:
        self._loop: asyncio.AbstractEventLoop
        self._looks: deque[Callable[[], None]] = deque()
        """A function that looks at a robot, for each; the next one first."""
        self._timer: asyncio.TimerHandle | None = None
        audience.follow(self)

    def join(self, look: Callable[[], None]) -> asyncio.AbstractEventLoop | None:
        """Call ``look`` regularly in the running event loop.

        Returns:
            That loop; None if no loop runs, and nothing was done.

        """
        try:
            loop = asyncio.get_running_loop()
        except RuntimeError:
            return None
        if self._looks and loop is not self._loop:  # WebMap was started again
            self._looks.clear()
            self._timer = None
        self._loop = loop
        self._looks.append(look)
        if self._timer is None:
            self._wait(loop, 1)
        return loop

    def leave(self, look: Callable[[], None]) -> None:
        """Call ``look`` no more; does nothing if it is not called."""
        if look in self._looks:
            self._looks.remove(look)
        if not self._looks and self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def audience_changed(self) -> None:
        """Look more often for who begins to look."""
        timer = self._timer
        if audience.present and timer is not None and not self._loop.is_closed():
            timer.cancel()
            self._wait(self._loop, AT_ONCE)

    def _wait(self, loop: asyncio.AbstractEventLoop, count: int) -> None:
        """Set the timer, after the looks at some robots."""
        every = EVERY if audience.present else RARELY / 1000
        part = min(1.0, count / len(self._looks))
        self._timer = loop.call_later(every * part, self._look, loop)

    def _look(self, loop: asyncio.AbstractEventLoop) -> None:
        self._timer = None
        count = min(AT_ONCE, len(self._looks))
        for _ in range(count):
            if self._looks:  # a module may have destroyed robots
                look = self._looks.popleft()
                self._looks.append(look)
                try:
                    look()
                except Exception:
                    log.exception("the state of a robot was not updated")
        if self._looks and self._timer is None:
            self._wait(loop, count)


state_rounds = StateRounds()
"""The rounds of this process."""
