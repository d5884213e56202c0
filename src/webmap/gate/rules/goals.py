"""The goals of one robot: sent, perhaps running, to be cancelled. No I/O."""

import msgspec

from webmap.base.identifiers import generate_id
from webmap.gate.actions import CancelGoals, Emit, SendGoal, SendPose
from webmap.gate.commands import Refusal
from webmap.gate.events import GoalEnded, GoalLost, GoalProgress, GoalWritten, Key
from webmap.gate.protocol import GoalMethod, GoalReport, RobotSpec
from webmap.gate.rules.health import LinkHealth
from webmap.gate.rules.motion import WAIT_LIMIT
from webmap.ros.names import is_type

MOVE_BASE = "move_base_msgs/MoveBaseAction"
"""The type of the action of ROS 1."""

LATELY = 2.0
"""Seconds after such a cancel in which another one is not worth it."""

IN_VAIN = 5.0
"""Seconds within which a cancel may have gone to a link that was dead already, which is
noticed after 4 s; where nobody answers a cancel it is said once more after that."""

INSIST = 1.0
"""Seconds between two cancels of a goal that is said to go on all the same."""

BRAKES = 2.0
"""Seconds after the end of a goal in which a robot may still move because of it."""

OVER = ("reached", "failed", "cancelled")
"""The states of a goal that nothing follows any more."""

ELSEWHERE = "goals now go elsewhere: the state of this goal is unknown"


class Goals:
    """What is known of the goals that one robot follows by itself.

    Args:
        key: The machine.
        spec: The robot.
        link: The link that its goals go to.
        emit: Takes the actions.

    """

    def __init__(self, key: Key, spec: RobotSpec, link: LinkHealth, emit: Emit) -> None:
        self.spec = spec
        self.link = link
        self.report: GoalReport | None = None
        """How it stands with the newest goal."""
        self._key = key
        self._emit = emit
        self._running: str | None = None
        self._by: str | None = None
        # An earlier gate may have sent a goal that still runs.
        self._perhaps = True
        self._cancel_owed = False
        self._cancelled_at = self._insisted_at = float("-inf")
        self._made_way_at: float | None = None
        self._over_at = float("-inf")
        self._no_actions = False
        """Whether the bridge said that it takes no goals of actions."""

    @property
    def way(self) -> GoalMethod | None:
        """How goals are sent to this robot; ``None`` if they cannot be."""
        spec = self.spec
        if spec.action is None or (self._no_actions and spec.goal_topic is not None):
            return None if spec.goal_topic is None else "topic"
        return "move_base" if is_move_base(spec) else "navigate_to_pose"

    @property
    def can_send(self) -> bool:
        """Whether goals can be sent to this robot."""
        return self.way is not None

    @property
    def can_cancel(self) -> bool:
        """Whether its goals can be cancelled."""
        return self.spec.cancel_topic is not None or self.spec.action is not None

    @property
    def _cancels_apart(self) -> bool:
        """Whether that goes by a service, called on a socket of its own."""
        return self.spec.action is not None and not is_move_base(self.spec)

    @property
    def following(self) -> bool:
        """Whether the robot follows a goal, as far as is known."""
        return self.report is not None and self.report.state not in OVER

    def navigates(self, *, moving: bool) -> bool:
        """Return whether the robot follows a goal.

        A plain topic has no feedback: its goal counts while the robot moves.
        """
        report = self.report
        return (
            self.following and report is not None and (report.way != "topic" or moving)
        )

    def may_still_move(self, now: float) -> bool:
        """Return whether motion at ``now`` may come from a goal that has ended."""
        return now - self._over_at < BRAKES

    def send(self, x: float, y: float, yaw: float, by: str, now: float) -> None:
        """Send a goal; metres and radians in the robot's goal frame.

        Raises:
            Refusal: If the robot takes no goals, or its link is down.

        """
        way = self.way
        if way is None:
            raise Refusal("no goal topic and no action is set")
        if not self.link.up:
            raise Refusal("no connection to the bridge of its goals")
        id, until = generate_id(), now + WAIT_LIMIT
        self._emit(SendGoal(self._key, self.spec.id, id, x, y, yaw, by, way, until))

    def locate(self, x: float, y: float, yaw: float, by: str, now: float) -> None:
        """Tell the robot where it is; metres and radians in its goal frame.

        Raises:
            Refusal: If it cannot be told, or follows a goal, which it would then
                follow from another place than it is at.

        """
        if self.spec.pose_topic is None:
            raise Refusal("no topic for the initial pose is set")
        # Of a goal that nobody tells of and nobody can cancel there is no end to see.
        if self.following and (self.can_cancel or self.way != "topic"):
            raise Refusal("the robot is navigating: cancel the goal first")
        if not self.link.up:
            raise Refusal("no connection to the bridge of its initial pose")
        until = now + WAIT_LIMIT
        self._emit(SendPose(self._key, self.spec.id, x, y, yaw, by, until))

    def on_written(self, goal: GoalWritten) -> None:
        """Note that a goal went out."""
        self._running, self._by, self._perhaps = goal.id, goal.by, True
        self._cancelled_at = float("-inf")  # that was of the goals before
        way = self.way or "topic"
        self.report = GoalReport(
            id=goal.id,
            x=goal.x,
            y=goal.y,
            yaw=goal.yaw,
            by=goal.by,
            way=way,
            state="sent",
            why="this robot reports no progress" if way == "topic" else "",
        )

    def progress(self, news: GoalProgress) -> None:
        """Note how a goal goes; only the newest one is of interest."""
        report = self._about(news.id)
        if report is None or report.state in OVER:
            return
        state = "under way" if news.active else "accepted"
        if report.state != "cancelling":
            report = msgspec.structs.replace(report, state=state, why="")
        # What a word does not tell was told by another: status and feedback of
        # actionlib come on two topics.
        told = {
            name: value
            for name in ("left", "time", "eta", "recoveries")
            if (value := getattr(news, name)) is not None
        }
        self.report = msgspec.structs.replace(report, **told)

    def ended(self, end: GoalEnded, now: float) -> None:
        """Note that the action ended a goal; the newest one is what counts."""
        if end.id == self._running:
            self._running, self._by, self._perhaps = None, None, False
        self._no_actions |= end.no_actions
        report = self._about(end.id)
        if report is not None and report.state not in OVER:
            self._cancelled_at = float("-inf")  # if it was, that is answered now
            why = end.why
            if end.no_actions and self.spec.goal_topic is not None:
                why = f"{why}; the next goal goes to {self.spec.goal_topic}"
            if end.outcome == "cancelled":
                why = report.why if report.state == "cancelling" else why
            self._show(end.outcome, why or _OTHERWISE[end.outcome], now)

    def on_progress_lost(self, lost: GoalLost, now: float) -> None:
        """Note that nobody tells any more how a goal goes."""
        report = self._about(lost.id)
        if report is None or report.state in OVER:
            return
        if report.state == "cancelling":  # it may not have heard of that
            self.cancel(now, report.why)
        else:
            self._show("unknown", lost.why, now)

    def cancel(self, now: float, why: str) -> None:
        """Cancel every goal, now or as soon as there is a link.

        Args:
            now: The time.
            why: By whom or for what reason, in words.

        Raises:
            Refusal: If the robot has no way to do that.

        """
        if not self.can_cancel:
            raise Refusal("no cancel topic and no action is set")
        self._running, self._by, self._perhaps = None, None, False
        self._cancel_owed, self._cancelled_at = not self.link.up, now
        if self.link.up or self._cancels_apart:
            self._emit(CancelGoals(self._key, self.spec.id))
        if self.following:
            assert self.report is not None  # only then does it follow one
            waits = self._cancel_owed or self.report.way != "topic"
            self._show("cancelling" if waits else "cancelled", why, now)

    def cancel_again(self, news: GoalProgress, stopped: bool, now: float) -> None:
        """Cancel again, because a goal is said to go on that should not.

        A cancel may be quicker than the goal that it is meant for, which comes by
        another socket; it then cancels nothing, and the goal begins after it.

        Args:
            news: What is said of the goal.
            stopped: Whether STOP stands: then no goal should go on.
            now: The time.

        """
        report = self._about(news.id)
        cancelled = report is not None and report.state == "cancelling"
        due = now - self._insisted_at >= INSIST
        if due and (stopped or cancelled) and self.can_cancel:
            self._insisted_at = now
            self._emit(CancelGoals(self._key, self.spec.id))

    def cancel_for_driving(self, now: float) -> None:
        """Cancel a goal that may be running, because somebody is going to drive.

        Others send goals to a robot too, and nobody tells the gate. So whoever drives
        off cancels what may run, but not again with each touch of a key.
        """
        lately = self._made_way_at is not None and now - self._made_way_at < LATELY
        if self.can_cancel and (self._perhaps or not lately):
            self._made_way_at = now
            self.cancel(now, "the robot is being driven")

    def stop(self, now: float) -> None:
        """Cancel every goal if there is a way to."""
        if self.can_cancel:
            self.cancel(now, "STOP")

    def lost(self, now: float, connection: str | None = None) -> None:
        """Do what the robot's settings say when whoever sent its goal is lost.

        Args:
            now: The time.
            connection: Who is lost; ``None`` is everybody.

        """
        if self._by is None or connection not in (None, self._by):
            return
        if self.spec.on_operator_loss == "cancel" and self._perhaps and self.can_cancel:
            self.cancel(now, "the sender of the goal is gone")

    def cancel_unless_reachable(self, spec: RobotSpec, now: float) -> None:
        """Call off what is under way, unless that can be done under ``spec`` as well.

        Args:
            spec: What the robot is from now on.
            now: The time.

        """
        if _places(self.spec) <= _places(spec):
            return
        if self.following:
            self.stop(now)
            self._show("failed", ELSEWHERE, now)
        # Of the new place nothing is known.
        self._perhaps, self._cancel_owed, self._no_actions = True, False, False
        self._cancelled_at = float("-inf")

    def link_up(self, now: float) -> None:
        """Send the cancel that could not be sent before, or not be seen to arrive."""
        if self._cancel_owed:
            self.cancel(now, self.report.why if self.report is not None else "")

    def link_down(self, now: float) -> None:
        """Owe a cancel again that the link may not have carried any more."""
        if now - self._cancelled_at >= IN_VAIN:
            return
        self._cancel_owed, report = True, self.report
        if report is not None and (report.state, report.way) == ("cancelled", "topic"):
            self._show("cancelling", report.why, now)

    def _about(self, id: str) -> GoalReport | None:
        report = self.report
        return report if report is not None and report.id == id else None

    def _show(self, state: str, why: str, now: float) -> None:
        assert self.report is not None  # there is something to be said
        if state in OVER:
            self._over_at = now
        self.report = msgspec.structs.replace(self.report, state=state, why=why)


_OTHERWISE = {
    "reached": "",
    "failed": "the robot gave no reason",
    "cancelled": "by the robot, or by another program",
}


def _places(spec: RobotSpec) -> set[tuple[str | None, str, str]]:
    """Return where the goals of a robot go, and where they are called off."""
    action = "move_base" if is_move_base(spec) else "action"
    names = {"goal": spec.goal_topic, "cancel": spec.cancel_topic, action: spec.action}
    return {(spec.goal_url, kind, name) for kind, name in names.items() if name}


def is_move_base(spec: RobotSpec) -> bool:
    """Return whether the robot's action is that of ROS 1."""
    return is_type(spec.action_type, MOVE_BASE)
