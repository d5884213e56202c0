"""The goals of one robot: sending, progress, cancelling. No I/O."""

import msgspec

from webmap.base.identifiers import generate_id
from webmap.config.motion import MOVE_BASE
from webmap.gate.actions import CancelGoals, Emit, SendGoal, SendPose
from webmap.gate.commands import Refusal
from webmap.gate.events import GoalEnded, GoalLost, GoalProgress, GoalWritten, Key
from webmap.gate.protocol import GoalMethod, GoalReport, RobotSpec
from webmap.gate.rules.delivery import without_proof
from webmap.gate.rules.health import LinkHealth
from webmap.gate.rules.motion import WAIT_LIMIT
from webmap.ros.names import is_foxglove_url, is_type

LATELY = 2.0
"""Seconds after a cancel for driving in which driving causes no further cancel."""

IN_VAIN = 5.0
"""Seconds during which a cancel may have gone into a dead link, which is noticed after
4 s; a cancel without an answer is sent again if the link breaks within this time."""

INSIST = 1.0
"""Seconds between two cancels of a goal that is reported as still running."""

BRAKES = 2.0
"""Seconds after the end of a goal in which a robot may still move because of it."""

ANSWER = 5.0
"""Seconds within which the robot answers a goal or a cancel: by accepting it, by
feedback or by its status. Some bridges never answer a goal that the robot rejects."""

UNANSWERED = f"perhaps rejected: the robot did not answer within {ANSWER:g} s"
"""The reason why the state of such a goal is unknown."""

NOT_STOPPED = f"the robot did not answer the cancel within {ANSWER:g} s"

OVER = ("reached", "failed", "cancelled")
"""The final states of a goal."""

ELSEWHERE = "the goal settings were changed: the result of this goal is unknown"


class Goals:
    """The goals that one robot follows with its own navigation.

    Args:
        key: The machine.
        spec: The robot.
        link: The link for its goals.
        emit: Called with each action.

    """

    def __init__(self, key: Key, spec: RobotSpec, link: LinkHealth, emit: Emit) -> None:
        self.spec = spec
        self.link = link
        self.report: GoalReport | None = None
        """The report on the newest goal."""
        self._key = key
        self._emit = emit
        self._running: str | None = None
        self._by: str | None = None
        # An earlier gate may have sent a goal that is still running.
        self._perhaps = True
        self._cancel_owed = False
        self._cancelled_at = self._insisted_at = float("-inf")
        self._driven_off_at: float | None = None
        self._over_at = float("-inf")
        self._heard_at = float("-inf")
        """When the robot last reported the goal, or a goal or cancel was sent."""
        self._unheard = False
        """Whether the robot has never reported the newest goal."""
        self._no_actions = False
        """Whether the bridge reported that it does not support action goals."""

    @property
    def method(self) -> GoalMethod | None:
        """The method for goals of this robot; ``None`` if goals cannot be sent."""
        move = self.spec.navigation
        if move.action is not None and is_move_base(self.spec):
            return "move_base"
        if move.action is None or self._sends_no_actions:
            return "topic" if move.topic else None
        return "navigate_to_pose"

    @property
    def _sends_no_actions(self) -> bool:
        """Whether goals are not sent to the action of ROS 2 but to a topic, if any."""
        if is_foxglove_url(self.spec.goal_url):
            return self.spec.navigation.action not in self.link.actions
        return self._no_actions and self.spec.navigation.topic != ""

    @property
    def why_not(self) -> str | None:
        """Why goals cannot be sent to the robot, as text, or ``None``."""
        if self.spec.move is None:
            return "no goal topic and no action is set"
        if not self.link.up:
            return "no connection to the bridge that takes goals"
        if self.method is None:
            return (
                f"the Foxglove bridge does not offer {self.spec.move.action} as an "
                "action of type NavigateToPose: start it with include_hidden:=true, or "
                "set a goal topic"
            )
        return None

    @property
    def can_cancel(self) -> bool:
        """Whether the robot has an action, or a topic to cancel goals."""
        move = self.spec.navigation
        return move.cancel_topic is not None or move.action is not None

    @property
    def _cancels_by_service(self) -> bool:
        """Whether a cancel is a service call, on a socket of its own."""
        has_action = self.spec.navigation.action is not None
        return has_action and not is_move_base(self.spec)

    @property
    def following(self) -> bool:
        """Whether the robot follows a goal, as far as is known."""
        return self.report is not None and self.report.state not in OVER

    @property
    def unknown(self) -> bool:
        """Whether it is unknown if the robot follows the newest goal."""
        return self.report is not None and self.report.state == "unknown"

    @property
    def waits(self) -> bool:
        """Whether an answer to a goal or a cancel is expected."""
        report = self.report
        if report is None or report.method == "topic" or self._cancel_owed:
            return False
        return report.state in ("sent", "cancelling")

    def navigates(self, *, moving: bool) -> bool:
        """Return whether the robot follows a goal.

        A plain topic has no feedback: a goal on it counts while the robot moves, as a
        goal of unknown state does.
        """
        report = self.report
        if report is None or report.state in OVER:
            return False
        return moving or not (report.method == "topic" or self.unknown)

    def may_still_move(self, now: float) -> bool:
        """Return whether a goal that has ended may still cause motion at ``now``."""
        return now - self._over_at < BRAKES

    def send(self, x: float, y: float, yaw: float, by: str, now: float) -> None:
        """Send a goal; metres and radians in the robot's goal frame.

        Raises:
            Refusal: If the robot takes no goals, or its link is down.

        """
        if self.why_not is not None:
            raise Refusal(self.why_not)
        method = self.method
        assert method is not None  # without one there is a reason
        if self.link.only_echoes and not self.spec.base.drive_without_proof:
            raise Refusal(without_proof(self.spec.goal_url))
        id, until = generate_id(), now + WAIT_LIMIT
        self._emit(SendGoal(self._key, self.spec.id, id, x, y, yaw, by, method, until))

    def locate(self, x: float, y: float, yaw: float, by: str, now: float) -> None:
        """Send the robot its initial pose; metres and radians in its goal frame.

        Raises:
            Refusal: If the robot takes no initial pose, its link is down, or it
                follows a goal, which it would then follow from a wrong pose.

        """
        if self.spec.initial_pose is None:
            raise Refusal("no topic for the initial pose is set")
        # A goal without feedback and without a cancel would block this for ever, and so
        # would one whose cancel was not answered.
        in_vain = self.unknown and self._cancelled_at > float("-inf")
        cancels = self.can_cancel or self.method != "topic"
        if self.following and cancels and not in_vain:
            raise Refusal("the robot is navigating: cancel the goal first")
        if not self.link.up:
            raise Refusal("no connection to the bridge that takes the initial pose")
        until = now + WAIT_LIMIT
        self._emit(SendPose(self._key, self.spec.id, x, y, yaw, by, until))

    def on_written(self, goal: GoalWritten, now: float) -> None:
        """Note a goal that was written: from now on the robot may follow it."""
        self._running, self._by, self._perhaps = goal.id, goal.by, True
        self._heard_at, self._unheard = now, True
        self._cancelled_at = float("-inf")  # it was for earlier goals
        method = self.method or "topic"
        self.report = GoalReport(
            id=goal.id,
            x=goal.x,
            y=goal.y,
            yaw=goal.yaw,
            by=goal.by,
            method=method,
            state="sent",
            why="this robot reports no progress" if method == "topic" else "",
        )

    def step(self, now: float) -> None:
        """Wait no longer for an answer to a goal or a cancel; see :data:`ANSWER`."""
        if not self.waits or now - self._heard_at < ANSWER:
            return
        assert self.report is not None  # because an answer to it is expected
        if self.report.state == "sent":
            self._show("unknown", UNANSWERED, now)
        elif self._unheard:  # as far as is known, the robot never followed the goal
            self._show("cancelled", f"{self.report.why}; {NOT_STOPPED}", now)
        else:
            self._show("unknown", NOT_STOPPED, now)

    def progress(self, news: GoalProgress, now: float) -> None:
        """Note the progress of a goal; only the newest goal counts."""
        report = self._report_on(news.id)
        if report is None or report.state in OVER:
            return
        self._heard_at, self._unheard = now, False
        state = "under way" if news.active else "accepted"
        if report.state != "cancelling":
            report = msgspec.structs.replace(report, state=state, why="")
        # Keep the values that this message does not have: actionlib sends status and
        # feedback on two topics.
        values = {
            name: value
            for name in ("left", "time", "eta", "recoveries")
            if (value := getattr(news, name)) is not None
        }
        self.report = msgspec.structs.replace(report, **values)

    def ended(self, end: GoalEnded, now: float) -> None:
        """Note that the action ended a goal; only the newest goal is reported."""
        if end.id == self._running:
            self._running, self._by, self._perhaps = None, None, False
        self._no_actions |= end.no_actions
        report = self._report_on(end.id)
        if report is not None and report.state not in OVER:
            self._cancelled_at = float("-inf")  # a cancel is answered by this
            outcome, why = end.outcome, end.why
            topic = self.spec.navigation.topic
            if end.no_actions and topic:
                why = f"{why}; the next goal goes to {topic}"
            # Some robots answer a cancel by giving up the goal as failed.
            if report.state == "cancelling" and outcome != "reached":
                outcome, why = "cancelled", report.why
            self._show(outcome, why or _DEFAULT_REASONS[outcome], now)

    def on_progress_lost(self, lost: GoalLost, now: float) -> None:
        """Note that no progress of a goal is received any more."""
        report = self._report_on(lost.id)
        if report is None or report.state in OVER:
            return
        self._unheard = False  # from now on, silence does not show that it is rejected
        if report.state == "cancelling":  # the cancel may be lost
            self.cancel(now, report.why)
        else:
            self._show("unknown", lost.why, now)

    def cancel(self, now: float, why: str) -> None:
        """Cancel every goal, now or as soon as the link is up.

        Args:
            now: The time.
            why: Who cancels, or the reason, as text.

        Raises:
            Refusal: If goals of the robot cannot be cancelled.

        """
        if not self.can_cancel:
            raise Refusal("no cancel topic and no action is set")
        self._running, self._by, self._perhaps = None, None, False
        self._cancel_owed, self._cancelled_at = not self.link.up, now
        self._heard_at = now
        if self.link.up or self._cancels_by_service:
            self._emit(CancelGoals(self._key, self.spec.id))
        if self.following:
            assert self.report is not None  # because it follows a goal
            waits = self._cancel_owed or self.report.method != "topic"
            self._show("cancelling" if waits else "cancelled", why, now)

    def cancel_again(self, news: GoalProgress, stopped: bool, now: float) -> None:
        """Cancel again if a goal is reported as running that must not run.

        A cancel may arrive before its goal, which uses another socket; it then cancels
        nothing, and the goal begins after it.

        Args:
            news: The reported progress.
            stopped: Whether STOP is active: then no goal may run.
            now: The time.

        """
        report = self._report_on(news.id)
        cancelled = report is not None and report.state in ("cancelling", "cancelled")
        due = now - self._insisted_at >= INSIST
        if due and (stopped or cancelled) and self.can_cancel:
            self._insisted_at = now
            self._emit(CancelGoals(self._key, self.spec.id))

    def cancel_for_driving(self, now: float) -> None:
        """Cancel a goal that may be running, because the operator begins to drive.

        Others send goals to the robot too, without the gate. So driving off cancels
        goals that may be running, but not again at each press of a key.
        """
        lately = self._driven_off_at is not None and now - self._driven_off_at < LATELY
        if self.can_cancel and (self._perhaps or not lately):
            self._driven_off_at = now
            self.cancel(now, "the robot is being driven")

    def stop(self, now: float) -> None:
        """Cancel every goal because of STOP, if goals can be cancelled."""
        if self.can_cancel:
            self.cancel(now, "STOP")

    def is_by(self, connection: str) -> bool:
        """Return whether this connection sent the goal that may be running."""
        return self._by == connection

    def lost(self, now: float, connection: str | None = None) -> None:
        """Apply ``on_operator_loss`` if the sender of the goal is lost.

        Args:
            now: The time.
            connection: The lost connection; ``None`` for all connections.

        """
        if self._by is None or connection not in (None, self._by):
            return
        on_loss = self.spec.navigation.on_operator_loss
        if on_loss == "cancel" and self._perhaps and self.can_cancel:
            self.cancel(now, "the sender of the goal is gone")

    def cancel_unless_reachable(self, spec: RobotSpec, now: float) -> None:
        """Cancel the goal, unless it can be cancelled under ``spec`` as well.

        Args:
            spec: The new declaration of the robot.
            now: The time.

        """
        if _goal_places(self.spec) <= _goal_places(spec):
            return
        if self.following:
            self.stop(now)
            self._show("failed", ELSEWHERE, now)
        # Nothing is known about goals at the new place.
        self._perhaps, self._cancel_owed, self._no_actions = True, False, False
        self._cancelled_at = float("-inf")

    def link_up(self, now: float) -> None:
        """Send a cancel that could not be sent, or may not have arrived."""
        if self._cancel_owed:
            self.cancel(now, self.report.why if self.report is not None else "")

    def link_down(self, now: float) -> None:
        """Mark a recent cancel for sending again: it may not have arrived."""
        if now - self._cancelled_at >= IN_VAIN:
            return
        self._cancel_owed, report = True, self.report
        if report is not None and (report.state, report.method) == (
            "cancelled",
            "topic",
        ):
            self._show("cancelling", report.why, now)

    def _report_on(self, id: str) -> GoalReport | None:
        report = self.report
        return report if report is not None and report.id == id else None

    def _show(self, state: str, why: str, now: float) -> None:
        assert self.report is not None  # callers have a report to change
        if state in OVER:
            self._over_at = now
        self.report = msgspec.structs.replace(self.report, state=state, why=why)


_DEFAULT_REASONS = {
    "reached": "",
    "failed": "the robot gave no reason",
    "cancelled": "by the robot, or by another program",
}


def _goal_places(spec: RobotSpec) -> set[tuple[str, str, str]]:
    """Return the topics and actions that take and cancel the goals of a robot."""
    action, move = "move_base" if is_move_base(spec) else "action", spec.navigation
    names = {"goal": move.topic, "cancel": move.cancel_topic, action: move.action}
    return {(spec.goal_url, kind, name) for kind, name in names.items() if name}


def is_move_base(spec: RobotSpec) -> bool:
    """Return whether the robot's action is that of ROS 1."""
    return is_type(spec.navigation.action_type, MOVE_BASE)
