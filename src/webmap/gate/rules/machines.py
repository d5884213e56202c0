"""All machines of one display: declarations, and events for them. No I/O."""

import logging
import math
from bisect import bisect_right
from collections.abc import Callable, Iterator
from operator import attrgetter
from typing import Any

import msgspec

from webmap.base.errors import ConfigError
from webmap.gate import events
from webmap.gate.actions import Attach, CutLink, Emit, Lock, SendToDisplay, Unlock
from webmap.gate.commands import Refusal
from webmap.gate.protocol import (
    Forget,
    RobotGone,
    RobotSpec,
    SentGoal,
    SentPose,
    WriterNodes,
)
from webmap.gate.rules.connections import Epochs
from webmap.gate.rules.goals import Goals
from webmap.gate.rules.health import STALL_LIMIT, DisplayPulse, LinkHealth
from webmap.gate.rules.machine import Machine
from webmap.gate.rules.report import INTERVAL, Reporter, report
from webmap.gate.rules.stop import StopLatch, newer_stop
from webmap.gate.specs import check_twist_type, checked, key_of

log = logging.getLogger("webmap.gate")

RESTING_INTERVAL = 0.75 * INTERVAL
"""Seconds between two reports on a machine that rests, if only numbers change. It is
shorter than the time between two of its steps, so that each step may report."""

REPORTS = 3000
"""The most reports a second on all machines that rest, if no verdict changes."""

SLICE, PARTS = 200, 8
"""The most machines that rest in one step, and in how many steps all of them step at
the latest: those of 1,000 within 50 ms, and any number within the time of a zero."""

_due_at = attrgetter("due_at")

Refuse = Callable[[str, str | None, str, str, float], None]


class Machines:
    """The machines, by key and by the robots that the display declares.

    Args:
        pulse: Whether the display is alive.
        epochs: Gives the epochs of leases.
        emit: Called with each action.
        refuse: Sends a refusal to a connection.

    """

    def __init__(
        self, pulse: DisplayPulse, epochs: Epochs, emit: Emit, refuse: Refuse
    ) -> None:
        self._display_pulse = pulse
        self._epochs = epochs
        self._emit = emit
        self._refuse = refuse
        self._by_key: dict[events.Key, Machine] = {}
        self._by_url: dict[str, dict[Machine, None]] = {}
        """The machines that use, or once used, a link to each bridge."""
        self._latches: dict[events.Key, StopLatch] = {}
        self._stopped_as: dict[events.Key, dict[events.Key, str]] = {}
        """For each machine with a STOP: the keys that it had before and under which the
        STOP is active too, each with the identity of its STOP."""
        self._resets: dict[events.Key, tuple[str, str]] = {}
        """Resets whose result on disk is not known yet: by which connection, and of
        which robot."""
        self._by_robot: dict[str, Machine] = {}
        self._links: dict[tuple[str, events.Lane], LinkHealth] = {}
        self._reporters: dict[str, Reporter] = {}
        self._touched: set[events.Key] = set()
        self._later: set[events.Key] = set()
        """Machines with a report that the next step looks at again. After each event
        it would cost a report of every other machine."""
        self._awake: set[Machine] = set()
        """The active machines; only an event changes that, or their own step."""
        self._oldest_answer = float("-inf")
        """No control link that is up was answered before, see :meth:`step`."""
        self.handlers: dict[type, Callable[[Any, float], None]] = {
            RobotSpec: self._declare,
            Forget: self._forget,
            WriterNodes: self._writer_nodes,
            events.LinkUp: self._link_up,
            events.LinkDown: self._link_down,
            events.ActionsOffered: self._actions_offered,
            events.PingAnswered: self._ping_answered,
            events.TwistWritten: self._twist_written,
            events.GoalWritten: self._goal_written,
            events.PoseWritten: self._pose_written,
            events.GoalProgress: self._goal_progress,
            events.GoalLost: self._goal_lost,
            events.GoalEnded: self._goal_ended,
            events.HookEnded: self._hook_ended,
            events.EchoReceived: self._echo_received,
            events.OdometryReceived: self._odometry_received,
            events.ScanReceived: self._scan_received,
            events.LockState: self._lock_reported,
            events.StopSaved: self._stop_saved,
            events.StopFileChanged: self._stop_file_changed,
            events.StopTestSaved: self._stop_test_saved,
            events.CheckSaved: self._check_saved,
        }

    def __iter__(self) -> Iterator[Machine]:
        """Iterate over the machines; each is reported again, as it may change."""
        for machine in list(self._by_key.values()):
            self._touched.add(machine.key)
            yield machine

    def which(self, test: Callable[[Machine], bool]) -> list[Machine]:
        """Return the machines that pass a test, and mark them as possibly changed.

        A report takes much longer than a test: an event must not cause one for each of
        a thousand machines that it does not concern.
        """
        found = [machine for machine in self._by_key.values() if test(machine)]
        self._touched.update(machine.key for machine in found)
        return found

    def touch_all(self) -> None:
        """Mark every machine as possibly changed, so that it is reported."""
        self._touched.update(self._by_key)

    @property
    def busy(self) -> bool:
        """Whether :meth:`step` has anything to do for any machine."""
        return bool(self._awake)

    @property
    def silent(self) -> bool:
        """Whether no machine is driven or being stopped."""
        return all(machine.silent for machine in self._by_key.values())

    def find(self, robot: str) -> Machine:
        """Return the machine of a robot, and mark it as possibly changed.

        Raises:
            Refusal: If there is no such robot.

        """
        self.check_known(robot)
        machine = self._by_robot[robot]
        self._touched.add(machine.key)
        return machine

    def check_known(self, robot: str | None) -> None:
        """Check that a robot is declared; ``None`` means all robots and passes.

        Raises:
            Refusal: If there is no such robot.

        """
        if robot is not None and robot not in self._by_robot:
            raise Refusal(f"there is no robot {robot!r}")

    def reset(self, robot: str, stop: str, by: str, now: float) -> None:
        """End the STOP of a robot, also under the keys that its machine had before.

        Args:
            robot: The robot.
            stop: The identity of the STOP to end.
            by: The connection that resets; refused later if a STOP is left on disk.
            now: Seconds, monotonic.

        Raises:
            Refusal: If no STOP or a newer STOP is active, or another gate has the
                machine.

        """
        machine = self.find(robot)
        machine.reset(stop, now)
        self._resets[machine.key] = by, robot
        for key, earlier in self._stopped_as.pop(machine.key, {}).items():
            # If a machine with that key still has robots, the STOP is theirs too.
            there, latch = self._by_key.get(key), self._latches[key]
            left = there is None or set(there.robots.specs) <= there.robots.leaving
            same = latch.press is not None and latch.press.id in (earlier, stop)
            if left and same:
                latch.reset()
                self._resets[key] = by, robot
                if there is not None:
                    self._sort(there, now)

    def step(self, now: float) -> None:
        """Do what is due for each active machine, and close stalled control links.

        A report takes longer than a step. A machine that rests, as all do after STOP
        ALL, is reported at once when the verdict on the STOP changes, and less often
        when other values of its report change.
        """
        early = now - max(RESTING_INTERVAL, len(self._awake) / REPORTS)
        for machine in self._due(now):
            stop = machine.active_stop.confirmation
            before = machine.rests, stop.confirmed
            machine.step(now)
            if machine.delivery.stalled(now):
                self._cut(machine.key.url, now)
            machine.due_at = math.inf
            calm = machine.rests and before == (True, stop.confirmed)
            is_old = machine.reported_at <= early
            if calm and not (is_old and machine.reported != machine.shown(now)):
                self._sort(machine, now)
            else:
                self._touched.add(machine.key)
            self._drop_if_empty(machine)
        self._touched |= self._later
        self._later.clear()
        if now - self._oldest_answer > STALL_LIMIT:
            self._cut_stalled(now)

    def _due(self, now: float) -> list[Machine]:
        """Return the machines whose step is due: first those that do not rest.

        After STOP ALL the zeros of all machines are due at once. One call returns a
        part of these machines, the most late ones first, so that no step takes long.
        """
        machines = self._by_key.values()
        due = [m for m in machines if m in self._awake and m.due_at <= now]
        due.sort(key=_due_at)
        busy = bisect_right(due, -math.inf, key=_due_at)
        return due[: busy + max(SLICE, len(self._awake) // PARTS)]

    def _cut_stalled(self, now: float) -> None:
        """Close stalled control links, and note the oldest answer of the others.

        Answers only become newer, and a link that opens later counts as answered then.
        So no link is stalled until that answer is too old.
        """
        self._oldest_answer = now
        for (url, lane), link in self._links.items():
            if lane == "control" and link.stalled(now):
                self._cut(url, now)
            elif lane == "control" and link.up:
                self._oldest_answer = min(self._oldest_answer, link.answered_at)

    def _cut(self, url: str, now: float) -> None:
        self._emit(CutLink(url))
        self._link_down(events.LinkDown(url, "control"), now)

    def report(self, now: float) -> None:
        """Send a report on each robot whose machine may have changed."""
        touched, self._touched = self._touched, set()
        resting = 0
        for key in touched:
            machine = self._by_key.get(key)
            if machine is None:
                continue
            self._sort(machine, now)
            resting += machine.rests
            if machine.rests and resting > SLICE:  # first the zeros of STOP ALL
                self._later.add(key)
                continue
            machine.reported, machine.reported_at = machine.shown(now), now
            # Until the shell reports the lock, it is unknown whether STOP is active.
            if machine.known:
                for spec in list(machine.robots.specs.values()):
                    self._report(machine, spec, now)

    def _sort(self, machine: Machine, now: float) -> None:
        """Note whether a machine is active now, and when its next step is due."""
        machine.due_at = machine.next_step(now)
        if machine.active:
            self._awake.add(machine)
        else:
            self._awake.discard(machine)

    def _report(self, machine: Machine, spec: RobotSpec, now: float) -> None:
        reporter = self._reporters.get(spec.id)
        if reporter is None:  # forgotten; it stays only until the machine has stopped
            return
        latest = report(machine, spec, now)
        rests = machine.rests
        due = reporter.is_due(latest, now, RESTING_INTERVAL if rests else INTERVAL)
        if due:
            self._emit(SendToDisplay(latest))
        elif due is None and rests:  # its next step reports it
            machine.reported = None
        elif due is None:
            self._later.add(machine.key)

    # Declarations of the display.

    def _declare(self, spec: RobotSpec, now: float) -> None:
        try:
            spec = checked(spec)
        except ConfigError as error:
            log.error("invalid declaration of a robot: %s", error)
            return
        key, earlier = key_of(spec), self._by_robot.get(spec.id)
        before = earlier.robots.specs[spec.id] if earlier is not None else None
        spec = self._with_one_type(spec, before)
        stopped = None
        if earlier is not None and earlier.key != key:
            stopped = earlier.latch.press
            earlier.robots.goals[spec.id].cancel_unless_reachable(spec, now)
            self._forget(Forget(spec.id), now)
        elif earlier is not None and before is not None:
            if before == spec:
                return
            if before == _assumed(spec, before.twist_type_assumed):
                # The assumed type was right: nothing changes for the operator.
                earlier.robots.specs[spec.id] = spec
                self._emit(Attach(key, spec))
                return
        machine = self._by_key.get(key) or self._new_machine(key)
        for url in (key.url, spec.goal_url, spec.bridge_url):
            self._by_url.setdefault(url, {})[machine] = None
        tasks = self._link(spec.goal_url, "tasks")
        machine.declare(spec, tasks, self._link(spec.bridge_url, "tasks"), now)
        self._emit(Attach(key, spec))
        if not machine.known:
            self._emit(Lock(key))
        if earlier is not None and stopped is not None:
            # It is the same robot under another key: its STOP stays active.
            others = {**self._stopped_as.get(earlier.key, {}), earlier.key: stopped.id}
            self._stopped_as.setdefault(key, {}).update(others)
            machine.stop(stopped, now)
        else:
            machine.attached(now)
        self._by_robot[spec.id] = machine
        self._reporters.setdefault(spec.id, Reporter())
        self._touched.add(key)

    def _with_one_type(self, spec: RobotSpec, before: RobotSpec | None) -> RobotSpec:
        """Return a declaration whose velocity type agrees with those of other robots.

        If another robot is known to have a different type on the same topic, the type
        of this one counts as assumed, so that the robot can still be stopped. A robot
        whose type was known may change it; the other robot will then change it too.
        """
        known = before is not None and not before.twist_type_assumed
        if before is not None and known and key_of(before) == key_of(spec):
            return spec
        try:
            check_twist_type(spec, self._staying())
        except ConfigError as error:
            log.error("%s; WebMap uses that type for both", error)
            return _assumed(spec, True)
        return spec

    def _staying(self) -> list[RobotSpec]:
        """Return the declarations of the robots that are not forgotten."""
        by_robot = self._by_robot.items()
        return [machine.robots.specs[robot] for robot, machine in by_robot]

    def _new_machine(self, key: events.Key) -> Machine:
        if key not in self._latches:
            self._latches[key] = StopLatch(key, self._emit)
        control, latch = self._link(key.url, "control"), self._latches[key]
        machine = Machine(
            key, control, self._display_pulse, latch, self._epochs, self._emit
        )
        self._by_key[key] = machine
        return machine

    def _forget(self, message: Forget, now: float) -> None:
        machine = self._by_robot.pop(message.robot, None)
        if machine is None:
            return
        del self._reporters[message.robot]
        self._emit(SendToDisplay(RobotGone(message.robot)))
        machine.forget(message.robot, now)
        self._touched.add(machine.key)
        self._drop_if_empty(machine)

    def _drop_if_empty(self, machine: Machine) -> None:
        if not machine.robots.specs:
            del self._by_key[machine.key]
            self._awake.discard(machine)
            for machines in self._by_url.values():
                machines.pop(machine, None)
            self._emit(Unlock(machine.key))

    # Events of the shell.

    def _link(self, url: str, lane: events.Lane) -> LinkHealth:
        return self._links.setdefault((url, lane), LinkHealth())

    def _at(self, url: str) -> list[Machine]:
        """Return the machines that may use a link to a bridge, marked as changed."""
        machines = list(self._by_url.get(url, ()))
        self._touched.update(machine.key for machine in machines)
        return machines

    def _link_up(self, event: events.LinkUp, now: float) -> None:
        link = self._link(event.url, event.lane)
        link.opened(now, only_echoes=event.only_echoes)
        for machine in self._at(event.url):
            if machine.control is link:
                machine.link_up(now)
            machine.active_stop.tasks_up(link, now)

    def _link_down(self, event: events.LinkDown, now: float) -> None:
        link = self._link(event.url, event.lane)
        link.closed()
        for machine in self._at(event.url):
            if machine.control is link:
                machine.link_down(now)
            if not event.spent:
                machine.active_stop.tasks_down(link, now)

    def _actions_offered(self, event: events.ActionsOffered, now: float) -> None:
        self._link(event.url, "tasks").actions = event.actions
        self._at(event.url)

    def _ping_answered(self, event: events.PingAnswered, now: float) -> None:
        self._link(event.url, "control").answered(event.asked_at, now)

    def _twist_written(self, event: events.TwistWritten, now: float) -> None:
        machine = self._by_key.get(event.key)
        if machine is None:
            return
        before = machine.motion.sent
        machine.on_written(event, now)
        if before != machine.motion.sent or not machine.rests:
            self._touched.add(event.key)
        if event.by is not None and not event.done:
            why = "the command was not sent: the connection or the gate was too slow"
            self._refuse(event.by, machine.robots.newest.id, "drive", why, now)

    def _goal_written(self, event: events.GoalWritten, now: float) -> None:
        machine = self._by_robot.get(event.robot)
        if machine is None:
            return
        if event.done:
            self._touched.add(machine.key)
            machine.on_goal_written(event, now)
            sent = SentGoal(event.robot, event.x, event.y, event.yaw, event.by)
            self._emit(SendToDisplay(sent))
        else:
            why = "the goal was not sent: the connection or the gate was too slow"
            self._refuse(event.by, event.robot, "goal", why, now)

    def _pose_written(self, event: events.PoseWritten, now: float) -> None:
        if event.done:
            sent = SentPose(event.robot, event.x, event.y, event.yaw, event.by)
            self._emit(SendToDisplay(sent))
        else:
            why = "the pose was not sent: the connection or the gate was too slow"
            self._refuse(event.by, event.robot, "locate", why, now)

    def _goal_progress(self, event: events.GoalProgress, now: float) -> None:
        if goals := self._goals_of(event.robot):
            goals.progress(event, now)
            goals.cancel_again(event, self._by_robot[event.robot].latch.on, now)

    def _goal_ended(self, event: events.GoalEnded, now: float) -> None:
        if goals := self._goals_of(event.robot):
            goals.ended(event, now)

    def _goal_lost(self, event: events.GoalLost, now: float) -> None:
        if goals := self._goals_of(event.robot):
            goals.on_progress_lost(event, now)

    def _hook_ended(self, event: events.HookEnded, now: float) -> None:
        machine = self._by_robot.get(event.robot)
        if machine is not None:
            self._touched.add(machine.key)
            machine.robots.hooks[event.robot].ended(event)

    def _goals_of(self, robot: str) -> Goals | None:
        """Return a robot's goals and mark it as changed; ``None`` if it is gone."""
        machine = self._by_robot.get(robot)
        if machine is None:
            return None
        self._touched.add(machine.key)
        return machine.robots.goals[robot]

    def _echo_received(self, event: events.EchoReceived, now: float) -> None:
        machine = self._by_key.get(event.key)
        if machine is not None:
            machine.on_echo(event.twist, now)
            if not machine.rests:
                self._touched.add(event.key)

    def _odometry_received(self, event: events.OdometryReceived, now: float) -> None:
        machine = self._by_key.get(event.key)
        if machine is not None:
            stop = machine.active_stop.confirmation
            before = stop.confirmed
            machine.observe(event.twist, event.sent_after, now)
            if not machine.rests or before != stop.confirmed:
                self._touched.add(event.key)

    def _scan_received(self, event: events.ScanReceived, now: float) -> None:
        machine = self._of_key(event.key)
        if machine is not None and machine.observation.on:
            machine.scan_assist.observe(event.topic, event.sweep)

    def _lock_reported(self, event: events.LockState, now: float) -> None:
        machine = self._of_key(event.key)
        if machine is not None:
            machine.locked(event, now)

    def _stop_saved(self, event: events.StopSaved, now: float) -> None:
        machine = self._of_key(event.key)
        if machine is not None:
            machine.latch.kept(event)
        else:  # the robot was forgotten in the meantime; its STOP was not
            self._latches[event.key].kept(event)

    def _stop_file_changed(self, event: events.StopFileChanged, now: float) -> None:
        machine = self._of_key(event.key)
        if machine is None:
            return
        latch = machine.latch
        # The first report after the file was to be removed shows the result.
        reset = self._resets.pop(event.key, None) if latch.settled else None
        trouble = latch.trouble
        machine.on_stop_file_changed(event.press, now)
        if reset is not None and event.press is not None and latch.on:
            kept = trouble and f"STOP stays active: {trouble}"
            self._refuse(*reset, "reset", kept or newer_stop(event.press), now)

    def _writer_nodes(self, message: WriterNodes, now: float) -> None:
        machine = self._by_robot.get(message.robot)
        if machine is not None:
            self._touched.add(machine.key)
            machine.other_writer.named(message.nodes)

    def _stop_test_saved(self, event: events.StopTestSaved, now: float) -> None:
        machine = self._of_key(event.key)
        if machine is not None:
            machine.speeds.tested = event.record

    def _check_saved(self, event: events.CheckSaved, now: float) -> None:
        machine = self._of_key(event.key)
        if machine is not None:
            machine.check.take(event.record, now)

    def _of_key(self, key: events.Key) -> Machine | None:
        """Return a machine and mark it as changed; ``None`` if it is gone."""
        self._touched.add(key)
        return self._by_key.get(key)


def _assumed(spec: RobotSpec, assumed: bool) -> RobotSpec:
    """Return the declaration with its velocity type marked as assumed or known."""
    return msgspec.structs.replace(spec, twist_type_assumed=assumed)
