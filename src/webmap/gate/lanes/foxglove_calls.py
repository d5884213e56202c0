"""Service calls and goals of actions at a bridge of Foxglove. No I/O.

An action of ROS 2 is three services and two topics. Their names begin with
``<action>/_action/``, so they are hidden: bridges offer them only with
``include_hidden``.
"""

import uuid
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from webmap.gate.actions import SendGoal
from webmap.gate.events import GoalEnded, GoalLost, GoalProgress
from webmap.gate.lanes import navigation, serialization
from webmap.gate.lanes.foxglove_texts import Services, read_text
from webmap.gate.lanes.navigation import CallResult, GoalNews, because
from webmap.gate.lanes.serialization import Encoding
from webmap.ros.foxglove import protocol

ENCODINGS: tuple[Encoding, ...] = ("cdr", "ros1")
"""The encodings that the gate writes."""


def encoding_of(server: protocol.ServerInfo) -> Encoding | None:
    """Return the encoding for messages of clients, if the gate knows one of them."""
    known = server.supported_encodings or ()
    return next((each for each in ENCODINGS if each in known), None)


class FoxgloveCall:
    """A call at a bridge of Foxglove, which first lists its services.

    Args:
        service: The service.
        request: The fields of its request.
        is_trigger: Whether its answer has a success and a text.

    """

    hello = b""

    def __init__(
        self, service: str, request: Mapping[str, Any], *, is_trigger: bool = False
    ) -> None:
        self._service = service
        self._request = request
        self._is_trigger = is_trigger
        self._encoding: Encoding | None = None
        self._called = False

    @property
    def why_silent(self) -> str | None:
        """That the bridge does not offer the service."""
        return None if self._called else f"the bridge does not offer {self._service}"

    def read(self, data: bytes) -> bytes | CallResult | None:
        """Return what to send next, or the result, if a message leads to one."""
        event = protocol.receive(data) if data[:1] < b" " else read_text(data)
        match event:
            case protocol.ServerInfo() as server:
                self._encoding = encoding_of(server)
            case Services(services) if self._encoding is not None:
                for each in services:
                    if each.name == self._service and not self._called:
                        return self._call(each.id, self._encoding)
            case protocol.ServiceCallFailure(_, text):
                return CallResult(because("refused", text))
            case protocol.ServiceCallResponse() as answer if self._encoding is not None:
                return self._result(answer.payload, self._encoding)
        return None

    def _call(self, number: int, encoding: Encoding) -> bytes:
        self._called = True
        payload = serialization.serialized(self._request, encoding)
        if encoding == "cdr" and not self._request:
            payload += b"\0"  # ROS 2 has no message without a member
        return protocol.call_service(number, 1, encoding, payload)

    def _result(self, payload: bytes, encoding: Encoding) -> CallResult:
        if not self._is_trigger:
            return CallResult(None)
        success, text = serialization.trigger_result(payload, encoding)
        return CallResult(
            None if success else because("the service reported a failure", text)
        )


class ActionNumbers(NamedTuple):
    """The numbers of what a bridge offers of an action, on one connection."""

    send_goal: int
    """The service that receives the goal and accepts or rejects it."""
    get_result: int
    """The service that answers when the goal has ended."""
    feedback: int | None
    """The channel of the feedback, if there is one."""


_SEND_GOAL, _GET_RESULT = 1, 2
"""The numbers of the two calls."""


class FoxgloveGoal:
    """A goal of a ``NavigateToPose`` action, on a connection of its own.

    The goal has an identifier that nothing else has. So neither the feedback for a goal
    of another client nor that for a goal of an earlier gate counts as its own.

    Args:
        goal: The goal.
        fields: The fields of the goal's message.
        numbers: The numbers of the action's services and of its feedback.
        subscription: A number for the subscription to the feedback.

    """

    def __init__(
        self,
        goal: SendGoal,
        fields: Mapping[str, Any],
        numbers: ActionNumbers,
        subscription: int,
    ) -> None:
        self._goal = goal
        self._numbers = numbers
        self._subscription = subscription
        self._id = uuid.uuid4().bytes
        self.hello = self._call(_SEND_GOAL, numbers.send_goal, fields)

    def read(self, data: bytes) -> Iterator[bytes | GoalNews | GoalLost]:
        """Yield what to send next, and the news of the goal, from a message."""
        event = protocol.receive(data) if data[:1] < b" " else read_text(data)
        match event:
            case protocol.MessageData(number) if number == self._subscription:
                id, fields = serialization.action_feedback(data, protocol.PAYLOAD)
                news = navigation.of_feedback(fields, self._goal)
                if id == self._id and news is not None:
                    yield news
            case protocol.ServiceCallResponse(_, call, _, payload):
                if call == _SEND_GOAL:
                    yield from self._answered(payload)
                else:
                    yield self._ended(payload)
            case protocol.ServiceCallFailure(call, text):
                yield self._failed(call, text)
            case protocol.UnadvertiseServices(ids) if self._numbers.get_result in ids:
                yield self._lost("the bridge no longer offers the action")

    def _call(self, call: int, service: int, fields: Mapping[str, Any]) -> bytes:
        request = serialization.serialized({"goal_id": self._id, **fields}, "cdr")
        return protocol.call_service(service, call, "cdr", request)

    def _answered(self, payload: bytes) -> Iterator[bytes | GoalNews]:
        robot, id = self._goal.robot, self._goal.id
        if not serialization.accepted(payload):
            yield GoalEnded(robot, id, "failed", "the robot rejected the goal")
            return
        yield self._call(_GET_RESULT, self._numbers.get_result, {})
        if self._numbers.feedback is not None:
            yield protocol.subscribe({self._subscription: self._numbers.feedback})
        yield GoalProgress(robot, id, active=False)

    def _ended(self, payload: bytes) -> GoalEnded:
        status, fields = serialization.action_result(payload)
        return navigation.of_result(status, fields, self._goal)

    def _failed(self, call: int, text: str) -> GoalEnded | GoalLost:
        if call == _SEND_GOAL:
            why = because("the bridge could not send the goal", text)
            return GoalEnded(self._goal.robot, self._goal.id, "failed", why)
        return self._lost(because("the bridge got no result", text))

    def _lost(self, why: str) -> GoalLost:
        return GoalLost(self._goal.robot, self._goal.id, why)
