"""What else a robot is told on STOP: a Bool is published, a service called. No I/O."""

from webmap.gate.actions import Emit, RunHook
from webmap.gate.events import HookEnded, Key
from webmap.gate.hookspecs import place_of
from webmap.gate.messages import RobotSpec
from webmap.gate.rules.health import Health

NO_LINK = "not sent yet: no connection"


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
        self._stopped = False
        """What was said last, or is to be said as soon as there is a link."""
        self._number = 0
        """How often something was said: of an earlier time no answer counts."""
        self._owes_reset = False
        self._failed: dict[tuple[str, str], str] = {}
        """Why what was said last did not arrive, by hook."""

    @property
    def failures(self) -> tuple[str, ...]:
        """Which hooks the robot does not follow, and why, in words."""
        what = "stop hook" if self._stopped else "reset of stop hook"
        return tuple(f"{what} {name}: {why}" for (_, name), why in self._failed.items())

    def say(self, stopped: bool) -> None:
        """Tell the robot that STOP stands, or does so no longer."""
        if stopped != self._stopped:
            self._failed.clear()
        self._stopped, self._number = stopped, self._number + 1
        self._owes_reset = not stopped and not self.link.up
        for hook in self.spec.stop_hooks:
            # A service of type Trigger knows no way back: who has an emergency stop
            # of its own resets it there.
            if not stopped and "service" in hook:
                continue
            if self.link.up:
                # What failed before is known to have done so until this is answered.
                run = RunHook(self._key, self.spec.id, hook, stopped, self._number)
                self._emit(run)
            else:
                self._failed[place_of(hook)] = NO_LINK

    def ended(self, event: HookEnded) -> None:
        """Note what became of a hook that was said."""
        if event.number != self._number:
            return
        if event.why is None:
            self._failed.pop(place_of(event.hook), None)
        else:
            self._failed[place_of(event.hook)] = event.why
            self._owes_reset = not self._stopped

    def link_up(self) -> None:
        """Say that STOP stands no longer, if that could not be said before."""
        if self._owes_reset:
            self.say(stopped=False)

    def drop(self) -> None:
        """Have nothing to say any more: another gate has the machine, and its STOP."""
        self._number += 1
        self._failed.clear()
