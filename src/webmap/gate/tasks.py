"""The tasks lane: goals and their cancelling, which may hang.

Some bridges do nothing else for a socket until the action goal that came through it
has ended. So a goal of an action uses up a socket: it is kept for the result, and the
lane opens another for what comes next. For the same reason, and because the handle of
an action goal belongs to the socket that sent it, the cancel service is called on a
socket of its own.
"""

import asyncio
import logging
from collections.abc import Callable, Iterable

from webmap.errors import BridgeClosed
from webmap.gate import words
from webmap.gate.actions import SendGoal
from webmap.gate.events import Event, GoalEnded, LinkDown, LinkUp
from webmap.gate.lanes import Lane
from webmap.gate.messages import RobotSpec
from webmap.gate.sockets import Ears, Socket, open_socket
from webmap.identifiers import generate_id
from webmap.ros import ops

log = logging.getLogger("webmap.gate")

MAX_SPENT = 8
"""How many sockets of action goals are kept for their results at most."""

CALL_TIMEOUT = 2.0
"""How long a service is given to answer, in seconds."""

Topic = tuple[str, str]
"""The name of a topic and its type."""


class TasksLane:
    """The socket of one bridge that goals go through.

    Args:
        url: The bridge's address.
        tell: Takes the events.

    """

    def __init__(self, url: str, tell: Callable[[Event], None]) -> None:
        self._url = url
        self._tell = tell
        self._spent: list[Socket] = []
        self._calling: set[asyncio.Task[None]] = set()
        self.lane = Lane(
            url,
            up=lambda: tell(LinkUp(url, "tasks")),
            down=lambda: tell(LinkDown(url, "tasks")),
            text=lambda _: None,
        )

    def attach(self, topics: Iterable[Topic]) -> None:
        """Announce the topics that a robot needs here."""
        for topic, type in topics:
            id = _advertisement(topic, type)
            hello = ops.advertise(topic, type, id=id)
            self.lane.hold(id, hello, ops.unadvertise(topic, id=id))

    def detach(self, topics: Iterable[Topic]) -> None:
        """Undo one :meth:`attach`."""
        for topic, type in topics:
            self.lane.let_go(_advertisement(topic, type))

    def send(self, spec: RobotSpec, goal: SendGoal) -> bool:
        """Write a goal now or drop it; return whether it went out."""
        done = self.lane.write(words.goal(spec, goal), only_if_clear=True)
        if done and spec.goal_topic is None:
            self._keep_for_result(goal)
        return done

    def cancel(self, spec: RobotSpec) -> None:
        """Cancel every goal of the robot, by every way that it has."""
        if spec.cancel_topic is not None:
            self.lane.write(
                words.cancel_by_topic(spec.cancel_topic), only_if_clear=False
            )
        if spec.action is not None:
            id, what = generate_id(), f"cancelling the goals of {spec.action}"
            self._call(words.cancel_by_service(spec.action, id), id, what)

    def run_hook(self, hook: dict[str, str], stopped: bool) -> None:
        """Publish the Bool of a stop hook, or call its service."""
        if "topic" in hook:
            self.lane.write(words.flag(hook["topic"], stopped), only_if_clear=False)
        else:
            id, service = generate_id(), hook["service"]
            self._call(words.trigger(service, hook["type"], id), id, service)

    def _call(self, request: bytes, id: str, what: str) -> None:
        """Call a service without waiting for its answer."""
        task = asyncio.get_running_loop().create_task(
            self._call_and_wait(request, id, what)
        )
        self._calling.add(task)
        task.add_done_callback(self._calling.discard)

    async def settle(self) -> None:
        """Wait until what was to be cancelled is, or cannot be."""
        if self._calling:
            await asyncio.wait(self._calling)

    def close(self) -> None:
        """End for good."""
        self.lane.close()
        for task in self._calling:
            task.cancel()
        for link in self._spent:
            link.close()
        self._spent.clear()

    def _keep_for_result(self, goal: SendGoal) -> None:
        def hear(data: bytes) -> None:
            heard = words.hear(data)
            if heard is not None and (heard.op, heard.id) == ("action_result", goal.id):
                link.close()
                forget("the goal has ended")
                self._tell(GoalEnded(goal.robot, goal.id))

        def forget(why: str) -> None:
            if link in self._spent:
                self._spent.remove(link)

        found = self.lane.spend(Ears(text=hear, pong=lambda _: None, lost=forget))
        assert found is not None  # it has just been written to
        link = found
        self._spent.append(link)
        if len(self._spent) > MAX_SPENT:
            self._spent.pop(0).close()

    async def _call_and_wait(self, request: bytes, id: str, what: str) -> None:
        """Call a service on a socket of its own."""
        answered = asyncio.Event()

        def hear(data: bytes) -> None:
            heard = words.hear(data)
            if heard is not None and heard.id == id:
                answered.set()

        ears = Ears(text=hear, pong=lambda _: None, lost=lambda why: answered.set())
        try:
            async with asyncio.timeout(CALL_TIMEOUT):
                link = await open_socket(self._url, ears)
                try:
                    link.send(request)
                    await answered.wait()
                finally:
                    link.close()
        except BridgeClosed as error:
            log.error("%s failed: %s", what, error)
        except TimeoutError:
            log.warning("%s: no answer", what)


def hook_topics(spec: RobotSpec) -> list[Topic]:
    """Return the topics of a robot's stop hooks."""
    hooks = spec.stop_hooks
    return [(hook["topic"], hook["type"]) for hook in hooks if "topic" in hook]


def goal_topics(spec: RobotSpec) -> list[Topic]:
    """Return the topics of a robot's goals."""
    topics = []
    if spec.goal_topic is not None:
        topics.append((spec.goal_topic, spec.goal_type))
    if spec.cancel_topic is not None:
        topics.append((spec.cancel_topic, "actionlib_msgs/GoalID"))
    return topics


def _advertisement(topic: str, type: str) -> str:
    return f"webmap-gate advertise {topic} {type}"
