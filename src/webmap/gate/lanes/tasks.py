"""The tasks lane: the socket of one bridge for goals, cancels, poses and stop hooks.

Some rosbridges do nothing else for a socket until the goal that it sent has ended.
So an action goal uses up a socket: the lane keeps it for the result and opens another
for the next messages. For the same reason, and because the handle of an action goal
belongs to the socket that sent it, :class:`ServiceCalls` calls the cancel service on a
socket of its own.

move_base is an action made of topics, which block nothing: its messages come on the
lane itself, its status only while a goal of the gate is followed.
"""

import asyncio
import logging
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import TypeVar

from webmap.base.geometry import Pose
from webmap.config.motion import StopHook
from webmap.gate.actions import SendGoal, SendPose
from webmap.gate.events import (
    ActionsOffered,
    Event,
    GoalEnded,
    GoalLost,
    GoalProgress,
    LinkDown,
    LinkUp,
)
from webmap.gate.lanes import rosbridge
from webmap.gate.lanes.calls import Ended, ServiceCalls
from webmap.gate.lanes.navigation import GoalNews
from webmap.gate.lanes.sockets import Socket, SocketHandlers
from webmap.gate.lanes.wires import ActionGoal, wire_to
from webmap.gate.protocol import RobotSpec
from webmap.gate.rules.goals import is_move_base

Place = TypeVar("Place", SendGoal, SendPose)

_COMMON = (0.0, 0.0, 0.0)


def in_own_map(spec: RobotSpec, at: Place) -> Place:
    """Return a goal or pose in the robot's own map.

    Args:
        spec: The robot.
        at: The goal or pose, in the common map.

    """
    if spec.own_map == _COMMON:
        return at
    own = Pose(*spec.own_map).inverse @ Pose(at.x, at.y, at.yaw)
    return replace(at, x=own.x, y=own.y, yaw=own.yaw)


log = logging.getLogger("webmap.gate")

MAX_SPENT = 8
"""The most sockets of action goals that are kept for their results."""

FEEDBACK_PERIOD = 0.2
"""The least time between two progress events of a goal, in seconds."""

_ACTIONLIB = {
    "status": ("actionlib_msgs/GoalStatusArray", 200),
    "feedback": ("move_base_msgs/MoveBaseActionFeedback", 200),
    "result": ("move_base_msgs/MoveBaseActionResult", 0),
}
"""The topics of a move_base goal: the type, and milliseconds between two messages."""

Topic = tuple[str, str]
"""The name of a topic and its type."""


class TasksLane:
    """The socket of one bridge for goals, cancels, poses and stop hooks.

    Args:
        url: The bridge's address.
        emit: Called with each event.
        calls: Calls the services of the bridge.

    """

    def __init__(
        self, url: str, emit: Callable[[Event], None], calls: ServiceCalls
    ) -> None:
        self._url = url
        self._emit = emit
        self._calls = calls
        self._spent: dict[Socket, SendGoal] = {}
        """The sockets of the action goals that are under way, the oldest first."""
        self._followed: dict[str, tuple[RobotSpec, SendGoal]] = {}
        """The goals of move_base that are under way, by robot."""
        self._spending = False
        self._wire = wire_to(
            url,
            up=lambda: emit(LinkUp(url, "tasks", self._wire.only_echoes)),
            down=self._down,
            text=self._on_message,
            actions=lambda actions: emit(ActionsOffered(url, actions)),
        )
        self.lane = self._wire.lane

    def attach(self, topics: Iterable[Topic]) -> None:
        """Announce topics that a robot needs on this lane."""
        for topic, type in topics:
            self._wire.advertise(_advertisement(topic, type), topic, type)

    def detach(self, topics: Iterable[Topic]) -> None:
        """Undo one :meth:`attach`."""
        for topic, type in topics:
            self._wire.release(_advertisement(topic, type))

    def send(self, spec: RobotSpec, goal: SendGoal) -> bool:
        """Write a goal now or drop it; return whether it was written."""
        goal = in_own_map(spec, goal)
        if goal.method == "move_base":
            # First, to miss no message: they may come at once.
            self._follow(spec, goal)
        if goal.method == "navigate_to_pose":
            done = self._send_to_action(spec, goal)
        else:
            done = self._publish(rosbridge.goal_message(spec, goal), until=goal.until)
        if not done:
            self.forget(goal.robot)
        return done

    def send_pose(self, spec: RobotSpec, at: SendPose) -> bool:
        """Write the robot's pose now or drop it; return whether it was written."""
        estimate = rosbridge.pose_estimate(spec, in_own_map(spec, at))
        return self._publish(estimate, until=at.until)

    def cancel(self, spec: RobotSpec) -> None:
        """Cancel every goal of the robot, by every method that it has."""
        move = spec.navigation
        if move.cancel_topic is not None:
            self._publish(rosbridge.cancel_message(move.cancel_topic))
        if move.action is not None and is_move_base(spec):
            topic = f"{move.action}/cancel"
            if topic != move.cancel_topic:
                self._publish(rosbridge.cancel_message(topic))
        elif move.action is not None:
            what = f"cancelling the goals of {move.action}"
            self._calls.call(self._wire.cancel_call(move.action), what)

    def run_hook(self, hook: StopHook, stopped: bool, ended: Ended) -> None:
        """Publish the Bool of a stop hook, or call its service.

        Args:
            hook: The hook.
            stopped: The value of the Bool.
            ended: Called with the outcome. A Bool has no answer: it succeeds if there
                was a link to write it to.

        """
        if hook.service:
            call = self._wire.trigger_call(hook.service, hook.type)
            self._calls.call(call, f"stop hook {hook.service}", ended)
        elif self._publish(rosbridge.flag(hook.topic, hook.type, stopped)):
            ended(None)
        else:
            why = "not sent: no connection"
            log.warning("stop hook %s: %s", hook.topic, why)
            ended(why)

    def close(self) -> None:
        """Close the lane permanently, but not the calls that are under way."""
        self.lane.close()
        for link in self._spent:
            link.close()
        self._spent.clear()

    def _publish(self, message: rosbridge.Message, until: float | None = None) -> bool:
        """Write a message now or drop it; return whether it was written.

        Args:
            message: The message.
            until: When it is too old; without this it may wait behind other data.

        """
        data = self._wire.message(*message)
        if data is None:
            return False
        if until is None:
            return self.lane.write(data, only_if_clear=False)
        return self.lane.write(data, only_if_clear=True, until=until)

    def _send_to_action(self, spec: RobotSpec, goal: SendGoal) -> bool:
        sent = self._wire.action_goal(spec, goal)
        if sent is None or not self.lane.write(
            sent.hello, only_if_clear=True, until=goal.until
        ):
            return False
        self._keep_for_result(goal, sent)
        return True

    def _keep_for_result(self, goal: SendGoal, sent: ActionGoal) -> None:
        throttle = FeedbackThrottle()

        # A socket is removed once: one that was closed or lost calls nothing.
        def on_text(data: bytes) -> None:
            for found in sent.read(data):
                if isinstance(found, bytes):
                    link.send(found)
                    continue
                if not isinstance(found, GoalProgress):
                    del self._spent[link]
                    link.close()
                if throttle(found):
                    self._emit(found)

        def lost(why: str) -> None:
            del self._spent[link]
            self._emit(GoalLost(goal.robot, goal.id, f"connection lost: {why}"))

        self._spending = True
        link = self.lane.spend(
            SocketHandlers(text=on_text, pong=lambda _: None, lost=lost)
        )
        self._spending = False
        self._spent[link] = goal
        if len(self._spent) > MAX_SPENT:
            oldest, given_up = next(iter(self._spent.items()))
            del self._spent[oldest]
            oldest.close()
            why = f"more than {MAX_SPENT} goals are under way at {self._url}"
            self._emit(GoalLost(given_up.robot, given_up.id, why))

    # move_base.

    def _follow(self, spec: RobotSpec, goal: SendGoal) -> None:
        self.forget(goal.robot)
        self._followed[goal.robot] = (spec, goal)
        for part, (type, throttle) in _ACTIONLIB.items():
            topic = f"{spec.navigation.action}/{part}"
            id = f"webmap-gate follow {topic} {goal.robot}"
            self._wire.subscribe(id, topic, type, throttle)

    def forget(self, robot: str) -> None:
        """Stop following a robot's goal of move_base."""
        found = self._followed.pop(robot, None)
        if found is not None:
            for part in _ACTIONLIB:
                topic = f"{found[0].navigation.action}/{part}"
                self._wire.release(f"webmap-gate follow {topic} {robot}")

    def _on_message(self, data: bytes) -> None:
        for robot, (spec, goal) in list(self._followed.items()):
            news = self._wire.read_news(data, spec, goal)
            if isinstance(news, GoalEnded):
                self.forget(robot)
            if news is not None:
                self._emit(news)

    def _down(self) -> None:
        self._emit(LinkDown(self._url, "tasks", self._spending))
        if self._spending:
            return  # the socket stays open for its action goal
        for _, goal in list(self._followed.values()):
            why = f"no connection to {self._url}"
            self._emit(GoalLost(goal.robot, goal.id, why))


class FeedbackThrottle:
    """Thins out the feedback of a goal, which may come a hundred times a second."""

    def __init__(self) -> None:
        self._at = float("-inf")

    def __call__(self, news: GoalNews | GoalLost) -> bool:
        """Return whether the news should reach the rules."""
        now = asyncio.get_running_loop().time()
        if not isinstance(news, GoalProgress) or not news.active:
            return True
        if now - self._at < FEEDBACK_PERIOD:
            return False
        self._at = now
        return True


def hook_topics(spec: RobotSpec) -> list[Topic]:
    """Return the topics of a robot's stop hooks."""
    return [(hook.topic, hook.type) for hook in spec.base.stop_hooks if hook.topic]


def goal_topics(spec: RobotSpec) -> list[Topic]:
    """Return the topics of a robot's goals, cancels and poses, with their types."""
    topics, move = [], spec.navigation
    if move.topic:
        topics.append((move.topic, spec.goal_type("PoseStamped")))
    if move.cancel_topic is not None:
        topics.append((move.cancel_topic, rosbridge.GOAL_ID))
    if move.action is not None and is_move_base(spec):
        topics.append((f"{move.action}/goal", rosbridge.MOVE_BASE_GOAL))
        if move.cancel_topic != f"{move.action}/cancel":
            topics.append((f"{move.action}/cancel", rosbridge.GOAL_ID))
    if spec.initial_pose is not None:
        type = spec.goal_type("PoseWithCovarianceStamped")
        topics.append((spec.initial_pose.topic, type))
    return topics


def _advertisement(topic: str, type: str) -> str:
    return f"webmap-gate advertise {topic} {type}"
