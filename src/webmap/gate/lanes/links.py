"""All lanes to all bridges, and which lanes each robot needs."""

import asyncio
from collections.abc import Callable, Sequence

from webmap.gate import actions
from webmap.gate.events import (
    Event,
    GoalWritten,
    HookEnded,
    Key,
    LinkDown,
    PoseWritten,
    TwistWritten,
)
from webmap.gate.lanes.calls import ServiceCalls
from webmap.gate.lanes.control import ControlLane
from webmap.gate.lanes.odometry import OdometryLane
from webmap.gate.lanes.tasks import (
    TasksLane,
    Topic,
    goal_topics,
    hook_topics,
)
from webmap.gate.protocol import RobotSpec
from webmap.gate.rules.health import STALL_LIMIT
from webmap.gate.rules.motion import ZERO

NO_ANSWER = f"the bridge answered no ping for {STALL_LIMIT:g} s"


class Links:
    """Performs the actions of the rules that concern the links to the bridges.

    Args:
        emit: Called with each event, also from within :meth:`perform`.

    """

    def __init__(self, emit: Callable[[Event], None]) -> None:
        self._emit = emit
        self._control: dict[str, ControlLane] = {}
        self._odometry: dict[str, OdometryLane] = {}
        self._tasks: dict[str, TasksLane] = {}
        self._calls: dict[str, ServiceCalls] = {}
        """By bridge; a call goes on after the lane that made it has closed."""
        self._robots: dict[Key, dict[str, RobotSpec]] = {}
        self._watched: dict[Key, list[RobotSpec]] = {}

    def write_zeros(self, zeros: Sequence[actions.WriteTwist]) -> list[TwistWritten]:
        """Write zeros to machines, those of one bridge in one piece."""
        frames: dict[str, dict[Key, str]] = {}
        for zero in zeros:
            of_url = frames.setdefault(zero.key.url, {})
            of_url[zero.key] = self._base_frame(zero.key)
        done: set[Key] = set()
        for url, of_url in frames.items():
            if url in self._control:
                done.update(self._control[url].write_zeros(of_url))
        return [
            TwistWritten(zero.key, ZERO, zero.epoch, zero.by, zero.key in done)
            for zero in zeros
        ]

    def perform(self, action: actions.Action) -> Event | None:
        """Perform an action; return the event with its result, if the rules need it."""
        match action:
            case actions.WriteTwist(key, twist, epoch, by, until):
                lane = self._control.get(key.url)
                frame = self._base_frame(key)
                done = lane is not None and lane.write(key.topic, twist, until, frame)
                return TwistWritten(key, twist, epoch, by, done)
            case actions.SendGoal():
                return self._send_goal(action)
            case actions.SendPose(key, robot, x, y, yaw, by):
                spec = self._robots[key][robot]
                done = self._tasks[spec.goal_url].send_pose(spec, action)
                return PoseWritten(robot, x, y, yaw, by, done)
            case actions.CancelGoals(key, robot):
                spec = self._robots[key][robot]
                self._tasks[spec.goal_url].cancel(spec)
            case actions.RunHook():
                self._run_hook(action)
            case actions.Watch(key, on):
                self._unwatch(key)
                if on:
                    self._watch(key)
            case actions.PingOften(key, on):
                self._ping_often(key, on)
            case actions.CutLink(url):
                if url in self._control:
                    self._control[url].lane.cut(NO_ANSWER)
            case actions.Attach(key, spec):
                self._attach(key, spec)
            case actions.Detach(key, robot):
                watched = key in self._watched
                self._unwatch(key)
                spec = self._robots[key].pop(robot)
                self._tasks[spec.goal_url].forget(robot)
                self._detach(key, spec)
                if watched and self._robots[key]:
                    self._watch(key)
                self._close_unwanted()
        return None

    def zero_all(self) -> None:
        """Write zero to every machine that may be driven, without the rules."""
        self.write_zeros(
            [actions.WriteTwist(k, ZERO, None, None) for k in self._watched]
        )

    async def settle(self) -> None:
        """Wait until all service calls, such as cancels, have ended."""
        await asyncio.gather(*(calls.settle() for calls in self._calls.values()))

    def close(self) -> None:
        """Close every link permanently."""
        for tasks in self._tasks.values():
            tasks.close()
        for calls in self._calls.values():
            calls.close()
        for odometry in self._odometry.values():
            odometry.lane.close()
        for control in self._control.values():
            control.lane.close()

    def _send_goal(self, goal: actions.SendGoal) -> GoalWritten:
        spec = self._robots[goal.key][goal.robot]
        done = self._tasks[spec.goal_url].send(spec, goal)
        return GoalWritten(goal.robot, goal.id, goal.x, goal.y, goal.yaw, goal.by, done)

    def _run_hook(self, run: actions.RunHook) -> None:
        def ended(why: str | None) -> None:
            self._emit(HookEnded(run.robot, run.hook, run.number, why))

        spec = self._robots[run.key][run.robot]
        self._tasks[spec.bridge_url].run_hook(run.hook, run.stopped, ended)

    def _base_frame(self, key: Key) -> str:
        """Return the frame of the base, from the newest robot that declares one."""
        frames = [spec.base_frame for spec in self._robots.get(key, {}).values()]
        return next(filter(None, reversed(frames)), "")

    # The lanes that a robot needs.

    def _attach(self, key: Key, spec: RobotSpec) -> None:
        robots = self._robots.setdefault(key, {})
        earlier = robots.pop(spec.id, None)
        watched = key in self._watched
        self._unwatch(key)
        robots[spec.id] = spec
        if spec.twist is not None:
            url, topic = spec.twist.bridge, spec.twist.topic
            control = self._control.get(url)
            if control is None:
                control = self._control[url] = ControlLane(url, self._emit)
            control.attach(topic, spec.twist_type, spec.twist_type_assumed)
        for url in _odometry_urls_of(spec):
            self._odometry_at(url).lane.hold("robots")
        for url, topics in _tasks_of(spec).items():
            tasks = self._tasks.get(url)
            if tasks is None:
                calls = self._calls.setdefault(url, ServiceCalls(url))
                tasks = self._tasks[url] = TasksLane(url, self._emit, calls)
            tasks.lane.hold("robots")
            tasks.attach(topics)
        if earlier is not None:
            if _action_of(earlier) != _action_of(spec):
                self._tasks[earlier.goal_url].forget(spec.id)
            # Only now: what both declarations need stays announced.
            self._detach(key, earlier)
        if watched:
            self._watch(key)
        self._close_unwanted()

    def _detach(self, key: Key, spec: RobotSpec) -> None:
        if spec.twist is not None:
            self._control[spec.twist.bridge].detach(
                spec.twist.topic, spec.twist_type, spec.twist_type_assumed
            )
        for url in _odometry_urls_of(spec):
            self._odometry_at(url).lane.release_hold("robots")
        for url, topics in _tasks_of(spec).items():
            self._tasks[url].detach(topics)
            self._tasks[url].lane.release_hold("robots")

    def _watch(self, key: Key) -> None:
        specs = list(self._robots[key].values())
        self._watched[key] = specs
        if any(spec.twist is not None for spec in specs):
            self._control[key.url].listen(key.topic)
        for spec in specs:
            if spec.odometry_topic is not None:
                self._odometry_at(_odometry_url(spec)).watch(
                    spec.odometry_topic, spec.odometry_type, key
                )
            if spec.scan_assist is not None:
                scans = self._odometry_at(spec.bridge_url)
                scans.watch_scan(spec.scan_assist.topic, key)

    def _unwatch(self, key: Key) -> None:
        specs = self._watched.pop(key, [])
        if any(spec.twist is not None for spec in specs):
            self._control[key.url].ignore(key.topic)
        for spec in specs:
            if spec.odometry_topic is not None:
                odometry = self._odometry_at(_odometry_url(spec))
                odometry.unwatch(spec.odometry_topic, key)
            if spec.scan_assist is not None:
                scans = self._odometry_at(spec.bridge_url)
                scans.unwatch_scan(spec.scan_assist.topic, key)

    def _ping_often(self, key: Key, on: bool) -> None:
        specs = self._watched.get(key, [])
        if any(spec.twist is not None for spec in specs):
            control = self._control[key.url]
            (control.listen if on else control.ignore)(key.topic)
        for url in {url for spec in specs for url in _odometry_urls_of(spec)}:
            self._odometry_at(url).ping_often(key, on)

    def _odometry_at(self, url: str) -> OdometryLane:
        if url not in self._odometry:
            self._odometry[url] = OdometryLane(url, self._emit)
        return self._odometry[url]

    def _close_unwanted(self) -> None:
        for url, control in list(self._control.items()):
            if not control.lane.wanted:
                self._control.pop(url).lane.close()
                self._emit(LinkDown(url, "control"))
        for url, odometry in list(self._odometry.items()):
            if not odometry.lane.wanted:
                self._odometry.pop(url).lane.close()
                self._emit(LinkDown(url, "odometry"))
        for url, tasks in list(self._tasks.items()):
            if not tasks.lane.wanted:
                self._tasks.pop(url).close()
                self._emit(LinkDown(url, "tasks"))


def _odometry_url(spec: RobotSpec) -> str:
    return spec.odometry_url or spec.bridge_url


def _odometry_urls_of(spec: RobotSpec) -> list[str]:
    """Return the bridges that a robot's odometry and scans come from."""
    urls = [] if spec.odometry_topic is None else [_odometry_url(spec)]
    return urls if spec.scan_assist is None else [*urls, spec.bridge_url]


def _action_of(spec: RobotSpec) -> tuple[str, str | None]:
    return spec.goal_url, spec.navigation.action


def _tasks_of(spec: RobotSpec) -> dict[str, list[Topic]]:
    """Return, by bridge, the topics of the tasks lanes that a robot needs."""
    needed = {spec.goal_url: goal_topics(spec)}
    if spec.base.stop_hooks:
        needed.setdefault(spec.bridge_url, []).extend(hook_topics(spec))
    return needed
