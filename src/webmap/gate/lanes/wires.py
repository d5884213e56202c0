"""How a lane speaks to its bridge: one class for each kind of bridge.

A wire has a lane and fills it with the announcements of one protocol. ``foxglove`` has
the other one.
"""

from collections.abc import Callable, Iterator, Mapping
from typing import Any, Protocol, Unpack

from webmap.base.geometry import Twist
from webmap.base.identifiers import generate_id
from webmap.gate.actions import SendGoal
from webmap.gate.events import GoalLost, Scan
from webmap.gate.lanes import navigation, rosbridge, scans
from webmap.gate.lanes.calls import Call, RosbridgeCall
from webmap.gate.lanes.foxglove import FoxgloveWire
from webmap.gate.lanes.lane import Lane, LaneHandlers
from webmap.gate.lanes.navigation import GoalNews
from webmap.gate.protocol import RobotSpec
from webmap.ros.names import is_foxglove_url
from webmap.ros.rosbridge import ops
from webmap.ros.rosbridge.cbor import looks_like_cbor


class ActionGoal(Protocol):
    """A goal of an action of ROS 2, which has a socket of its own."""

    hello: bytes
    """The message that sends the goal."""

    def read(self, data: bytes) -> Iterator[bytes | GoalNews | GoalLost]:
        """Yield what to send next, and the news of the goal, from a message.

        Raises:
            ProtocolError: If it is invalid in a way that should be logged.

        """


class RosbridgeGoal:
    """A goal of an action at a rosbridge, which answers until the goal has ended.

    Args:
        spec: The robot.
        goal: The goal.

    """

    def __init__(self, spec: RobotSpec, goal: SendGoal) -> None:
        self.hello = rosbridge.action_goal(spec, goal)
        self._goal = goal

    def read(self, data: bytes) -> Iterator[GoalNews]:
        """Yield the news of the goal in a message."""
        news = navigation.of_action(data, self._goal)
        if news is not None:
            yield news


class Wire(Protocol):
    """What the lanes need of each kind of bridge."""

    lane: Lane

    @property
    def only_echoes(self) -> bool:
        """Whether an answered ping does not prove that messages were handled."""

    def advertise(self, id: str, topic: str, type: str) -> None:
        """Announce messages to a topic, now and on each new connection."""

    def subscribe(self, id: str, topic: str, type: str | None, throttle: int) -> None:
        """Receive a topic, at most every ``throttle`` ms if the bridge can do that."""

    def subscribe_scans(self, id: str, topic: str) -> None:
        """Receive the scans of a topic."""

    def release(self, id: str) -> None:
        """Undo what was announced or subscribed under ``id``."""

    def velocity(self, topic: str, type: str, twist: Twist, frame: str) -> bytes | None:
        """Return the frame with a velocity; None if none can be sent now."""

    def message(
        self, topic: str, type: str, message: Mapping[str, Any]
    ) -> bytes | None:
        """Return the frame with a message; None if none can be sent now."""

    def trigger_call(self, service: str, type: str) -> Call:
        """Return the call of a service of type Trigger."""

    def cancel_call(self, action: str) -> Call:
        """Return the call that cancels every goal of a ROS 2 action."""

    def action_goal(self, spec: RobotSpec, goal: SendGoal) -> ActionGoal | None:
        """Return a goal for the robot's action of ROS 2; None if it cannot be sent."""

    def read_news(
        self, data: bytes, spec: RobotSpec, goal: SendGoal
    ) -> GoalNews | None:
        """Return the news of a goal in a message of one of the topics of move_base.

        Raises:
            ProtocolError: If it is invalid in a way that should be logged.

        """

    def read_velocity(self, data: bytes) -> tuple[str, Twist | None] | None:
        """Return the topic of a received message and the velocity in it.

        Raises:
            ProtocolError: If it is invalid in a way that should be logged.

        """

    def is_scan(self, data: bytes) -> bool:
        """Return whether a received frame may have a scan."""

    def read_scan(self, data: bytes, now: float) -> tuple[str, Scan] | None:
        """Return the topic and the scan in a frame.

        Args:
            data: The frame.
            now: When it counts as received.

        Raises:
            ProtocolError: If it is invalid in a way that should be logged.

        """


class RosbridgeWire:
    """How a lane speaks to a rosbridge.

    Args:
        url: The address of the bridge.
        handlers: The callbacks of the lane.

    """

    only_echoes = False

    def __init__(self, url: str, **handlers: Unpack[LaneHandlers]) -> None:
        self.lane = Lane(url, **handlers)

    def advertise(self, id: str, topic: str, type: str) -> None:
        """Announce messages to a topic, now and on each new connection."""
        hello = ops.advertise(topic, type, id=id)
        self.lane.hold(id, hello, ops.unadvertise(topic, id=id))

    def subscribe(self, id: str, topic: str, type: str | None, throttle: int) -> None:
        """Receive a topic in JSON, at most every ``throttle`` milliseconds."""
        hello = ops.subscribe(topic, id=id, type=type, throttle_rate=throttle)
        self.lane.hold(id, hello, ops.unsubscribe(topic, id=id))

    def subscribe_scans(self, id: str, topic: str) -> None:
        """Receive the scans of a topic in CBOR."""
        hello = scans.subscribe(topic, id)
        self.lane.hold(id, hello, ops.unsubscribe(topic, id=id))

    def release(self, id: str) -> None:
        """Undo what was announced or subscribed under ``id``."""
        self.lane.release_hold(id)

    def velocity(self, topic: str, type: str, twist: Twist, frame: str) -> bytes:
        """Return the operation that publishes a velocity."""
        return rosbridge.velocity(topic, type, twist, frame)

    def message(self, topic: str, type: str, message: Mapping[str, Any]) -> bytes:
        """Return the operation that publishes a message."""
        return ops.publish(topic, message)

    def trigger_call(self, service: str, type: str) -> Call:
        """Return the call of a service of type Trigger."""
        return _call(service, {}, type)

    def cancel_call(self, action: str) -> Call:
        """Return the call that cancels every goal of a ROS 2 action."""
        service, type = f"{action}/_action/cancel_goal", "action_msgs/srv/CancelGoal"
        return _call(service, {"goal_info": {}}, type)

    def action_goal(self, spec: RobotSpec, goal: SendGoal) -> ActionGoal:
        """Return a goal for the robot's action of ROS 2."""
        return RosbridgeGoal(spec, goal)

    def read_news(
        self, data: bytes, spec: RobotSpec, goal: SendGoal
    ) -> GoalNews | None:
        """Return the news of a goal in a message of one of the topics of move_base."""
        return navigation.of_topics(data, spec, goal)

    def read_velocity(self, data: bytes) -> tuple[str, Twist | None] | None:
        """Return the topic of a published message and the velocity in it."""
        received = rosbridge.parse_echo(data)
        if received is None or received.op != "publish" or received.topic is None:
            return None
        return received.topic, received.twist

    def is_scan(self, data: bytes) -> bool:
        """Return whether a frame is in CBOR."""
        return looks_like_cbor(data)

    def read_scan(self, data: bytes, now: float) -> tuple[str, Scan] | None:
        """Return the topic and the scan in a frame."""
        return scans.parse_scan(data, now)


def _call(service: str, args: Mapping[str, Any], type: str) -> RosbridgeCall:
    id = generate_id()
    return RosbridgeCall(ops.call_service(service, args, id=id, type=type), id)


def wire_to(
    url: str,
    actions: Callable[[frozenset[str]], None] = lambda _: None,
    **handlers: Unpack[LaneHandlers],
) -> Wire:
    """Return the wire for the kind of bridge at an address.

    Args:
        url: The address.
        actions: Called with the actions that a bridge of Foxglove offers; a rosbridge
            does not list them.
        handlers: The callbacks of the lane.

    """
    if is_foxglove_url(url):
        return FoxgloveWire(url, actions, **handlers)
    return RosbridgeWire(url, **handlers)
