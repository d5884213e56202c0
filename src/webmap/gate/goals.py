"""The goals of one robot: sent, perhaps running, to be cancelled. No I/O."""

from webmap.gate.actions import CancelGoals, Emit, SendGoal
from webmap.gate.events import Key, WroteGoal
from webmap.gate.health import Health
from webmap.gate.messages import RobotSpec
from webmap.gate.refusal import Refusal
from webmap.identifiers import generate_id


class Goals:
    """What is known of the goals that one robot follows by itself.

    Args:
        key: The machine.
        spec: The robot.
        link: The link that its goals go to.
        emit: Takes the actions.

    """

    def __init__(self, key: Key, spec: RobotSpec, link: Health, emit: Emit) -> None:
        self.spec = spec
        self.link = link
        self._key = key
        self._emit = emit
        self._running: str | None = None
        self._by: str | None = None
        # An earlier gate may have sent a goal that still runs.
        self._perhaps = True
        self._cancel_owed = False

    @property
    def can_send(self) -> bool:
        """Whether goals can be sent to this robot."""
        return self.spec.goal_topic is not None or self.spec.action is not None

    @property
    def can_cancel(self) -> bool:
        """Whether its goals can be cancelled."""
        return self.spec.cancel_topic is not None or self.spec.action is not None

    def send(self, x: float, y: float, yaw: float, by: str) -> None:
        """Send a goal; metres and radians in the robot's goal frame.

        Raises:
            Refusal: If the robot takes no goals, or its link is down.

        """
        if not self.can_send:
            raise Refusal("no goal topic is known")
        if not self.link.up:
            raise Refusal("no link to where its goals go")
        self._emit(SendGoal(self._key, self.spec.id, generate_id(), x, y, yaw, by))

    def wrote(self, goal: WroteGoal) -> None:
        """Note that a goal went out."""
        self._running, self._by, self._perhaps = goal.id, goal.by, True

    def ended(self, id: str) -> None:
        """Note that the action ended a goal; the newest one is what counts."""
        if id == self._running:
            self._running, self._by, self._perhaps = None, None, False

    def cancel(self) -> None:
        """Cancel every goal, now or as soon as there is a link.

        Raises:
            Refusal: If the robot has no way to do that.

        """
        if not self.can_cancel:
            raise Refusal("no cancel topic and no action is known")
        self._running, self._by, self._perhaps = None, None, False
        self._cancel_owed = not self.link.up
        if self.link.up:
            self._emit(CancelGoals(self._key, self.spec.id))

    def make_way(self) -> None:
        """Cancel a goal that may be running, because somebody is going to drive."""
        if self._perhaps and self.can_cancel:
            self.cancel()

    def stop(self) -> None:
        """Cancel every goal if there is a way to."""
        if self.can_cancel:
            self.cancel()

    def lost(self, connection: str | None = None) -> None:
        """Do what the robot's settings say when whoever sent its goal is lost.

        Args:
            connection: Who is lost; ``None`` is everybody.

        """
        if self._by is None or connection not in (None, self._by):
            return
        if self.spec.on_operator_loss == "cancel":
            self.make_way()

    def link_up(self) -> None:
        """Send the cancel that could not be sent before."""
        if self._cancel_owed:
            self.cancel()
