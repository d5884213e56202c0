"""A bench for the gate's decisions: a virtual clock, and a shell that keeps actions."""

import json
from dataclasses import dataclass, field

from equipment.declarations import declared
from webmap.base.geometry import Twist
from webmap.gate import actions, events, protocol
from webmap.gate.events import Key, Press
from webmap.gate.rules.connections import Epochs, Ticks
from webmap.gate.rules.gate import Gate

URL = "ws://robot:9090"
KEY = Key(URL, "/cmd_vel")
ZERO = Twist()


def spec(**changes):
    fields = {
        "id": "r1",
        "name": "Bob",
        "bridge_url": URL,
        "twist_topic": "/cmd_vel",
        "stops_within": 1e-9,  # so that a short loop does not reduce the speed
        "v_max": 1.0,
        "w_max": 1.5,
        "cancel_topic": "/cancel",
        "goal_topic": "/goal",
    }
    return declared(**{**fields, **changes})


@dataclass
class Written:
    at: float
    key: Key
    twist: Twist
    epoch: int | None
    by: str | None


@dataclass
class Bench:
    """Plays the shell and the display; ``written`` has the velocities that are sent."""

    now: float = 1000.0
    beating: bool = True
    """Whether the display sends heartbeats while time passes."""
    answering: bool = True
    """Whether the bridge answers pings while time passes."""
    rtt: float = 0.0
    """Seconds between a ping and its answer."""
    clear: bool = True
    """Whether nothing waits to be sent on the control link."""
    held_up: float = 0.0
    """Seconds for which the process pauses before it writes a decided message."""
    losing_zeros: bool = False
    """Whether the control link drops every zero without a report."""
    up: bool = True
    lock_held: bool = True
    was_driven: bool = False
    disk: dict[Key, Press] = field(default_factory=dict)
    """The active STOPs that are stored on disk."""
    tests: dict[Key, events.StopRecord] = field(default_factory=dict)
    slow_disk: bool = False
    """Whether the disk finishes a write only when the test calls ``keep``."""
    full_disk: bool = False
    depth: int = 0
    to_keep: list[actions.Action] = field(default_factory=list)
    gate: Gate = field(default_factory=lambda: Gate(Ticks(5000), Epochs(0)))
    written: list[Written] = field(default_factory=list)
    dropped: list[Written] = field(default_factory=list)
    attempts: list[Written] = field(default_factory=list)
    """The written and the dropped velocities, in order."""
    done: list[actions.Action] = field(default_factory=list)
    messages: list[protocol.FromGate] = field(default_factory=list)
    reports: dict[str, protocol.RobotReport] = field(default_factory=dict)
    """The newest report of each robot."""
    tick: int = -1
    seq: int = 0

    def handle(self, event):
        self.depth += 1
        self._do(self.gate.handle(event, self.now))
        self.depth -= 1
        while self.to_keep and not self.depth:
            self.keep(self.to_keep.pop(0))

    def run(self, seconds, each=None, step=0.01):
        """Let time pass; ``each`` is called every 50 ms, before the gate's own step."""
        steps = round(seconds / step)
        for n in range(steps):
            self.now += step
            if self.beating:
                self.handle(protocol.Heartbeat())
            if self.answering and self.up:
                self.handle(events.PingAnswered(URL, self.now - self.rtt))
            if each is not None and n % round(0.05 / step) == 0:
                each()
            self._do(self.gate.step(self.now))
            while self.to_keep:
                self.keep(self.to_keep.pop(0))

    def _do(self, todo):
        # Zeros that follow each other are written before the rules get the results.
        zeros = []
        for action in todo:
            self.done.append(action)
            if zeros and not (
                isinstance(action, actions.WriteTwist) and action.twist.is_zero
            ):
                self._report(zeros)
            match action:
                case actions.SendToDisplay(message):
                    self.messages.append(message)
                    if isinstance(message, protocol.Tick):
                        self.tick = message.tick
                    elif isinstance(message, protocol.RobotReport):
                        self.reports[message.robot] = message
                case actions.Lock(key):
                    why = None if self.lock_held else "another has it"
                    self.handle(
                        events.LockState(
                            key,
                            self.lock_held,
                            self.was_driven,
                            why,
                            self.disk.get(key),
                            self.tests.get(key),
                        )
                    )
                case actions.SaveStop() | actions.SaveStopTest() | actions.SaveCheck():
                    # The disk works in a thread: it never answers within an action.
                    if not self.slow_disk:
                        self.to_keep.append(action)
                case actions.WriteTwist(_, twist) if (
                    self.losing_zeros and twist.is_zero
                ):
                    pass
                case actions.WriteTwist(key, twist, epoch, by, until):
                    self.now += self.held_up
                    fresh = self.clear and self.now <= until
                    out = self.up and (fresh or twist.is_zero)
                    log = self.written if out else self.dropped
                    write = Written(self.now, key, twist, epoch, by)
                    log.append(write)
                    self.attempts.append(write)
                    zeros.append(events.TwistWritten(key, twist, epoch, by, out))
                    if not twist.is_zero:
                        self._report(zeros)
                case actions.SendGoal(_, robot, id, x, y, yaw, by, _, until):
                    self.now += self.held_up
                    out = self.clear and self.now <= until
                    self.handle(events.GoalWritten(robot, id, x, y, yaw, by, out))
                case actions.CutLink(url):
                    self.up = False
                    self.handle(events.LinkDown(url, "control"))
        self._report(zeros)

    def _report(self, results):
        while results:
            self.handle(results.pop(0))

    def keep(self, latch):
        """Finish a write to the disk and report the result."""
        if isinstance(latch, actions.SaveStopTest):
            record = events.StopRecord(latch.seconds, "2026-11-21", latch.error)
            self.tests[latch.key] = record
            self.handle(events.StopTestSaved(latch.key, record))
            return
        if isinstance(latch, actions.SaveCheck):
            record = events.CheckRecord(latch.by, 1_790_000_000.0, 0.0)
            self.handle(events.CheckSaved(latch.key, record))
            return
        error = "the disk is full" if self.full_disk else None
        if not self.full_disk and latch.press is not None:
            self.disk[latch.key] = latch.press
        elif not self.full_disk and latch.key in self.disk:
            ours = self.disk[latch.key].id in latch.ids
            if ours:
                del self.disk[latch.key]
        self.handle(events.StopSaved(latch.key, latch.number, error))

    # Events from outside.

    def begin(self, *specs):
        for one in specs or (spec(),):
            self.handle(one)
        self.connect_links()
        self.join("a")
        self.join("b")
        self.run(0.1)
        return self

    def connect_links(self):
        self.up = True
        self.handle(events.LinkUp(URL, "control"))
        self.handle(events.LinkUp(URL, "tasks"))

    def break_links(self):
        self.up = False
        self.handle(events.LinkDown(URL, "control"))
        self.handle(events.LinkDown(URL, "tasks"))

    def join(self, who, role="operator"):
        self.handle(protocol.Connect(who, who.upper(), role))

    def send(self, who, **command):
        if command["op"] == "reset":
            command.setdefault("stop", self.stop_of(command["robot"]))
        self.handle(protocol.FromPage(who, json.dumps(command).encode()))

    def take(self, who="a", robot="r1"):
        """Take the robot; return the epoch, or None without control."""
        self.send(who, op="take", robot=robot)
        report = self.report(robot)
        mine = report.holder is not None and report.holder.connection == who
        return report.epoch if mine else None

    def drive(self, who="a", x=0.0, turn=0.0, robot="r1", **changes):
        self.seq += 1
        fields = {
            "op": "drive",
            "robot": robot,
            "epoch": self.report(robot).epoch or 0,
            "seq": self.seq,
            "tick": self.tick,
            "x": x,
            "y": 0.0,
            "turn": turn,
        }
        self.send(who, **{**fields, **changes})

    def hold(self, seconds, who="a", step=0.01, **axes):
        """Let a page send its inputs at 20 Hz."""
        self.run(seconds, lambda: self.drive(who, **axes), step)

    def drive_off(self, who="a", x=1.0, robot="r1"):
        """Take the robot, send released inputs, then drive."""
        epoch = self.take(who, robot)
        self.hold(0.3, who, robot=robot)
        self.hold(0.3, who, x=x, robot=robot)
        return epoch

    def goal(self, who="a", robot="r1", **changes):
        self.seq += 1
        fields = {
            "op": "goal",
            "robot": robot,
            "epoch": self.report(robot).epoch or 0,
            "seq": self.seq,
            "tick": self.tick,
            "x": 1.0,
            "y": 2.0,
            "yaw": 0.5,
        }
        self.send(who, **{**fields, **changes})

    # Results.

    def of(self, type):
        return [message for message in self.messages if isinstance(message, type)]

    def did(self, type):
        return [action for action in self.done if isinstance(action, type)]

    def report(self, robot="r1"):
        return self.reports[robot]

    def refusals(self, who="a"):
        return [r for r in self.of(protocol.Refused) if r.connection == who]

    def stop_of(self, robot="r1"):
        """Return the identity of the STOP that a page shows for a robot."""
        try:
            stop = self.report(robot).stop
        except KeyError:
            stop = None
        return "none" if stop is None else stop.id

    @property
    def stops(self):
        """The user of each active STOP that is stored on disk."""
        return {key: press.by for key, press in self.disk.items()}

    @property
    def state(self):
        return self.report().state

    def since(self, at):
        return [w for w in self.written if w.at > at]

    def moving_since(self, at):
        return [w for w in self.written if w.at >= at and not w.twist.is_zero]
