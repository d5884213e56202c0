"""The robots that share one machine, with their stop hooks. No I/O."""

from operator import attrgetter

from webmap.gate.actions import Detach, Emit, RunHook, SendToDisplay
from webmap.gate.events import HookEnded, Key
from webmap.gate.limits import Axes, axes_of
from webmap.gate.protocol import Refused, RobotSpec
from webmap.gate.rules.goals import Goals
from webmap.gate.rules.health import LinkHealth
from webmap.gate.specs import place_of

NO_LINK = "not sent yet: no connection"


class StopHooks:
    """The hooks of one robot: said on STOP and reset, now or when there is a link.

    Args:
        key: The machine.
        spec: The robot.
        link: The link that hooks go to.
        emit: Called with each action.

    """

    def __init__(self, key: Key, spec: RobotSpec, link: LinkHealth, emit: Emit) -> None:
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


_terms = attrgetter(
    "twist_type",
    "holonomic",
    "stops_within",
    "v_max",
    "w_max",
    "z_max",
    "rx_max",
    "ry_max",
    "a_max",
    "odometry_url",
    "odometry_topic",
    "assist",
    "stop_hooks",
)
"""What one robot says for the whole machine."""


class Aliases:
    """Everything that was declared for one machine. No I/O.

    Args:
        key: The machine.
        emit: Called with each action.

    """

    def __init__(self, key: Key, emit: Emit) -> None:
        self.specs: dict[str, RobotSpec] = {}
        """By the name that the display has for each; the newest is the last."""
        self.goals: dict[str, Goals] = {}
        self.hooks: dict[str, StopHooks] = {}
        self.leaving: set[str] = set()
        """Those that were forgotten and are there until the machine has stopped."""
        self._key = key
        self._emit = emit

    @property
    def newest(self) -> RobotSpec:
        """The one that was declared last."""
        return next(reversed(self.specs.values()))

    @property
    def drivable(self) -> bool:
        """Whether velocity can be sent to it at all, not goals only."""
        return self.newest.twist_topic is not None

    @property
    def has_odometry(self) -> bool:
        """Whether its odometry is known."""
        return any(spec.odometry_topic is not None for spec in self.specs.values())

    @property
    def holonomic(self) -> bool:
        """Whether everybody says that it can move sideways."""
        return all(spec.holonomic for spec in self.specs.values())

    @property
    def axes(self) -> Axes:
        """The axes out of the plane that it moves along, and how fast at most."""
        return axes_of(self.specs.values())

    @property
    def a_max(self) -> float | None:
        """The greatest growth of its speed, in m/s², if one was stated."""
        return min((s.a_max for s in self.specs.values() if s.a_max), default=None)

    @property
    def stops_within(self) -> float | None:
        """The seconds within which everybody says that it stops by itself."""
        stated = [spec.stops_within for spec in self.specs.values()]
        known = [seconds for seconds in stated if seconds is not None]
        return max(known) if len(known) == len(stated) else None

    @property
    def follow_goals(self) -> bool:
        """Whether a goal is under way whose end would be known."""
        return any(
            goals.following and (goals.can_cancel or goals.way != "topic")
            for goals in self.goals.values()
        )

    @property
    def hook_failures(self) -> tuple[str, ...]:
        """Which stop hooks it does not follow, under whatever name, and why."""
        said = [words for hooks in self.hooks.values() for words in hooks.failures]
        return tuple(dict.fromkeys(said))

    def holds_without(self, robot: str) -> bool:
        """Return whether all that ``robot`` says is said by one that stays, too."""
        terms = _terms(self.specs[robot])
        staying = [spec for id, spec in self.specs.items() if id not in self.leaving]
        return any(_terms(spec) == terms for spec in staying)

    def declare(
        self, spec: RobotSpec, tasks: LinkHealth, hooks: LinkHealth, now: float
    ) -> None:
        """Take in a robot, or what changed of it.

        Args:
            spec: The robot.
            tasks: The link that its goals go to.
            hooks: The link that its stop hooks go to.
            now: The time.

        """
        self.leaving.discard(spec.id)
        self.specs.pop(spec.id, None)
        self.specs[spec.id] = spec
        goals = self.goals.get(spec.id)
        if goals is None:
            self.goals[spec.id] = Goals(self._key, spec, tasks, self._emit)
        else:
            goals.cancel_unless_reachable(spec, now)
            goals.spec, goals.link = spec, tasks
        said = self.hooks.get(spec.id)
        if said is None or said.spec.stop_hooks != spec.stop_hooks:
            self.hooks[spec.id] = StopHooks(self._key, spec, hooks, self._emit)
        else:  # a reset may be owed, and an answer on its way
            said.spec, said.link = spec, hooks

    def drop(self, robot: str) -> None:
        """Have a robot gone."""
        self.leaving.discard(robot)
        del self.specs[robot], self.goals[robot], self.hooks[robot]
        self._emit(Detach(self._key, robot))

    def cancel_for_driving(self, now: float) -> None:
        """Cancel a goal that may be running: somebody is going to drive."""
        for goals in self.goals.values():
            goals.cancel_for_driving(now)

    def refuse(self, connection: str, what: str, why: str) -> None:
        """Tell somebody what does not happen, under each of the names."""
        for robot in self.specs:
            self._emit(SendToDisplay(Refused(connection, robot, what, why)))
