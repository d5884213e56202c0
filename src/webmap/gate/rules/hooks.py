"""What else a robot is told on STOP: a Bool is published, a service called. No I/O."""

from webmap.gate.actions import Emit, RunHook
from webmap.gate.events import Key
from webmap.gate.messages import RobotSpec
from webmap.gate.rules.health import Health


class Hooks:
    """The hooks of one robot: said on STOP and reset, now or when there is a link.

    Args:
        key: The machine.
        spec: The robot.
        link: The link that hooks go to.
        emit: Takes the actions.

    """

    def __init__(self, key: Key, spec: RobotSpec, link: Health, emit: Emit) -> None:
        self.spec = spec
        self.link = link
        self._key = key
        self._emit = emit
        self._owed: bool | None = None

    def say(self, stopped: bool) -> None:
        """Tell the robot that STOP stands, or does so no longer."""
        if not self.spec.stop_hooks:
            return
        if not self.link.up:
            self._owed = stopped
            return
        self._owed = None
        for hook in self.spec.stop_hooks:
            # A service of type Trigger knows no way back: who has an emergency stop
            # of its own resets it there.
            if stopped or "topic" in hook:
                self._emit(RunHook(self._key, self.spec.id, hook, stopped))

    def link_up(self) -> None:
        """Say what could not be said before."""
        if self._owed is not None:
            self.say(self._owed)
