"""The robots that are declared for one machine, and their stop hooks. No I/O."""

from operator import attrgetter

from webmap.config.motion import StopHook, TwistConfig
from webmap.gate.actions import Detach, Emit, RunHook, SendToDisplay
from webmap.gate.events import HookEnded, Key
from webmap.gate.protocol import Refused, RobotSpec
from webmap.gate.rules.goals import Goals
from webmap.gate.rules.health import LinkHealth
from webmap.gate.specs import Axes, axes_of

NO_LINK = "not sent yet: no connection"


class StopHooks:
    """The stop hooks of one robot: sent on STOP and reset, at once or with a new link.

    Args:
        key: The machine.
        spec: The robot.
        link: The link that carries the hooks.
        emit: Called with each action.

    """

    def __init__(self, key: Key, spec: RobotSpec, link: LinkHealth, emit: Emit) -> None:
        self.spec = spec
        self.link = link
        self._key = key
        self._emit = emit
        self._stopped = False
        """Whether the last message is that STOP is active; it may wait for a link."""
        self._number = 0
        """How often the hooks were sent: an answer to an earlier time is ignored."""
        self._owes_reset = False
        self._failed: dict[StopHook, str] = {}
        """Why the last message did not arrive, by hook."""
        self._unanswered: set[StopHook] = set()
        """The hooks that were sent and whose result is not known yet."""

    @property
    def failures(self) -> tuple[str, ...]:
        """The failed hooks and why each failed, as text for people."""
        what = "stop hook" if self._stopped else "reset of stop hook"
        return tuple(f"{what} {hook.name}: {why}" for hook, why in self._failed.items())

    @property
    def done(self) -> bool:
        """Whether every hook of the last message arrived."""
        return not self._failed and not self._unanswered

    def send(self, stopped: bool) -> None:
        """Send the robot that STOP is active, or that it was reset."""
        if stopped != self._stopped:
            self._failed.clear()
        self._stopped, self._number = stopped, self._number + 1
        self._owes_reset = not stopped and not self.link.up
        self._unanswered.clear()
        for hook in self.spec.base.stop_hooks:
            # A service of type Trigger cannot be undone: an emergency stop of the
            # robot itself is reset at the robot.
            if not stopped and hook.service:
                continue
            if self.link.up:
                # An earlier failure of this hook stays known until the answer.
                run = RunHook(self._key, self.spec.id, hook, stopped, self._number)
                self._unanswered.add(hook)
                self._emit(run)
            else:
                self._failed[hook] = NO_LINK

    def ended(self, event: HookEnded) -> None:
        """Note the result of a hook, if the hooks were not sent again since."""
        if event.number != self._number:
            return
        self._unanswered.discard(event.hook)
        if event.why is None:
            self._failed.pop(event.hook, None)
        else:
            self._failed[event.hook] = event.why
            self._owes_reset = not self._stopped

    def link_up(self) -> None:
        """Send the reset that could not be sent before."""
        if self._owes_reset:
            self.send(stopped=False)

    def drop(self) -> None:
        """Send nothing more: another gate has the machine and its STOP."""
        self._number += 1
        self._failed.clear()


_terms = attrgetter("twist", "scan_assist", "odometry_url", "odometry_topic")
"""The part of a robot's declaration that applies to the whole machine."""


class Aliases:
    """All robots that are declared for one machine.

    Args:
        key: The machine.
        emit: Called with each action.

    """

    def __init__(self, key: Key, emit: Emit) -> None:
        self.specs: dict[str, RobotSpec] = {}
        """By the display's id of each robot; the newest is the last."""
        self.goals: dict[str, Goals] = {}
        self.hooks: dict[str, StopHooks] = {}
        self.leaving: set[str] = set()
        """The forgotten robots that stay until the machine has stopped."""
        self._key = key
        self._emit = emit

    @property
    def newest(self) -> RobotSpec:
        """The robot that was declared last."""
        return next(reversed(self.specs.values()))

    @property
    def bases(self) -> list[TwistConfig]:
        """The base of each robot: its velocity topic, limits and stop hooks."""
        return [spec.base for spec in self.specs.values()]

    @property
    def drivable(self) -> bool:
        """Whether the machine has a velocity topic, and not only goals."""
        return self.newest.twist is not None

    @property
    def has_odometry(self) -> bool:
        """Whether a topic of odometry is known."""
        return any(spec.odometry_topic is not None for spec in self.specs.values())

    @property
    def holonomic(self) -> bool:
        """Whether every robot is declared to move sideways."""
        return all(base.holonomic for base in self.bases)

    @property
    def axes(self) -> Axes:
        """The axes out of the plane along which it moves, and their speed limits."""
        return axes_of(self.bases)

    @property
    def a_max(self) -> float | None:
        """The greatest acceleration in m/s², if one is declared."""
        return min((b.a_max for b in self.bases if b.a_max), default=None)

    @property
    def check_every(self) -> float | None:
        """Seconds after a check until the next one is due, if a robot demands it."""
        return min((b.check_every for b in self.bases if b.check_every), default=None)

    @property
    def stops_within(self) -> float | None:
        """The seconds until it stops by itself; ``None`` unless every robot has them.

        If they differ, the largest counts.
        """
        stated = [base.stops_within for base in self.bases]
        known = [seconds for seconds in stated if seconds is not None]
        return max(known) if len(known) == len(stated) else None

    @property
    def drive_without_proof(self) -> bool:
        """Whether every robot accepts that nothing but echoes shows what arrived."""
        return all(base.drive_without_proof for base in self.bases)

    @property
    def follow_goals(self) -> bool:
        """Whether a goal is active whose end the gate would notice."""
        return any(
            goals.following
            and not goals.unknown
            and (goals.can_cancel or goals.method != "topic")
            for goals in self.goals.values()
        )

    @property
    def hook_failures(self) -> tuple[str, ...]:
        """The failed stop hooks of all robots, and why each failed."""
        failures = [text for hooks in self.hooks.values() for text in hooks.failures]
        return tuple(dict.fromkeys(failures))

    @property
    def hooks_done(self) -> bool:
        """Whether all stop hooks of all robots arrived."""
        return all(hooks.done for hooks in self.hooks.values())

    def holds_without(self, robot: str) -> bool:
        """Return whether a remaining robot declares the same for the machine."""
        terms = _terms(self.specs[robot])
        staying = [spec for id, spec in self.specs.items() if id not in self.leaving]
        return any(_terms(spec) == terms for spec in staying)

    def declare(
        self, spec: RobotSpec, tasks: LinkHealth, hooks: LinkHealth, now: float
    ) -> None:
        """Add a robot, or update its declaration.

        Args:
            spec: The robot.
            tasks: The link that carries its goals.
            hooks: The link that carries its stop hooks.
            now: Seconds, monotonic.

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
        earlier = self.hooks.get(spec.id)
        if earlier is None or earlier.spec.base.stop_hooks != spec.base.stop_hooks:
            self.hooks[spec.id] = StopHooks(self._key, spec, hooks, self._emit)
        else:  # keep an owed reset and an expected answer
            earlier.spec, earlier.link = spec, hooks

    def drop(self, robot: str) -> None:
        """Remove a robot that is declared, and end its lanes."""
        self.leaving.discard(robot)
        del self.specs[robot], self.goals[robot], self.hooks[robot]
        self._emit(Detach(self._key, robot))

    def cancel_for_driving(self, now: float) -> None:
        """Cancel a goal that may be active, because driving begins."""
        for goals in self.goals.values():
            goals.cancel_for_driving(now)

    def refuse(self, connection: str, what: str, why: str) -> None:
        """Send a refusal to a connection, once for each robot."""
        for robot in self.specs:
            self._emit(SendToDisplay(Refused(connection, robot, what, why)))
