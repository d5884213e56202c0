"""The time of a velocity through a gate, and through an agent and a router.

The reference is a bare relay, which forwards a velocity from a WebSocket to a
rosbridge. The operator, the display, the relay, the gate, the router, the agent and the
robot are on one computer, so the figures contain the cost of the processes and no cost
of a network.
"""

import json
import math
import statistics
import tempfile
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack

from websockets.sync.client import connect

from benchmarks.harness import Comparison, Contender, Figures, compare
from benchmarks.latency import relayed, socket_of
from benchmarks.processes import started
from webmap.agents.gates import Gates
from webmap.agents.peer import close_peers
from webmap.config.motion import TwistConfig
from webmap.core.motion import id_at_agent
from webmap.gate.protocol import RobotSpec
from webmap.ros.rosbridge import ops
from webmap.testing import WitnessRobot

VELOCITIES = 100
PERIOD = 0.05
FULL = 1.0
"""The robot's highest speed, in m/s."""


class Operator:
    """An operator that sends drive commands and measures their acknowledgements."""

    def __init__(self, gates: Gates, robot: str) -> None:
        self._robot = robot
        self._ticks: dict[str, int] = {}
        self._gate = ""
        self._epoch: int | None = None
        self._mine = False
        self._seq = 0
        self._from = 0
        self._waiting: dict[int, float] = {}
        self.trips: list[float] = []
        """Milliseconds from each command to the tick that acknowledged it."""
        self.refused: list[str] = []
        """Why requests were refused."""
        self.armable = threading.Event()
        self.armed = threading.Event()
        self._connection = gates.connect("Ann", "operator", self._receive, print)
        self._connection.set_speeds(FULL, FULL)

    @property
    def holds(self) -> bool:
        """Whether the gate has reported that the operator has control."""
        return self._mine

    def take(self) -> None:
        """Take control of the robot."""
        self._send(op="take")

    def drive(self, x: float) -> None:
        """Send one command; ``x`` is a fraction of the full speed."""
        if self._epoch is None or self._gate not in self._ticks:
            return
        self._seq += 1
        self._waiting[self._seq] = time.monotonic()
        stamp = {"seq": self._seq, "tick": self._ticks[self._gate]}
        self._send(op="drive", epoch=self._epoch, x=x, y=0.0, turn=0.0, **stamp)

    def forget(self) -> None:
        """Count commands and their acknowledgements from now on."""
        self._waiting.clear()
        self.trips.clear()
        self._from = self._seq

    @property
    def sent(self) -> int:
        """How many commands were sent since :meth:`forget`."""
        return self._seq - self._from

    def _acknowledged(self, ack: int) -> None:
        now = time.monotonic()
        for seq in [seq for seq in self._waiting if seq <= ack]:
            self.trips.append(1000 * (now - self._waiting.pop(seq)))

    def _send(self, **fields: object) -> None:
        self._connection.receive(json.dumps({**fields, "robot": self._robot}))

    def _receive(self, text: str) -> None:
        message = json.loads(text)
        if message["op"] == "tick":
            gate = message.get("gate", "")
            self._ticks[gate] = message["tick"]
            if gate == self._gate:
                self._acknowledged(message["ack"])
        elif message["op"] == "refused":
            self.refused.append(message["why"])
        elif message["op"] == "robot" and message["robot"] == self._robot:
            self._gate, self._epoch = message.get("gate", ""), message["epoch"]
            self._mine = self._epoch is not None
            if message["armable"]:
                self.armable.set()
            if message["armed"]:
                self.armed.set()


def take_control(operator: Operator) -> None:
    """Take control, with retries, until the commands can move the robot."""
    deadline, asked = time.monotonic() + 20, -math.inf
    while not operator.armed.is_set():
        now = time.monotonic()
        if now > deadline:
            raise RuntimeError(f"no control of the robot; refused: {operator.refused}")
        if now > asked + 2:
            operator.take()
            asked = now
        operator.drive(0.0)
        time.sleep(PERIOD)


def delays(url: str, id: str, robot: WitnessRobot) -> list[float]:
    """Return the times of velocities from the operator to the robot, in ms."""
    gates = Gates()
    gates.start()
    try:
        gates.declare(
            RobotSpec(
                id=id,
                name="Bob",
                twist=TwistConfig(topic="/cmd_vel", stops_within=0.5, bridge=url),
                odometry_topic="/odom",
                odometry_type="nav_msgs/Odometry",
            )
        )
        operator = Operator(gates, id)
        if not operator.armable.wait(20):
            raise RuntimeError("the robot cannot be driven")
        take_control(operator)
        sent: dict[int, float] = {}
        for number in range(VELOCITIES):
            sent[number] = time.monotonic()
            operator.drive(velocity(number) / FULL)
            time.sleep(PERIOD)
        operator.drive(0.0)
    finally:
        gates.stop()
        close_peers()
    return arrived_after(sent, robot)


def relay_delays(robot: WitnessRobot) -> list[float]:
    """Return the times of velocities through a bare relay to the robot, in ms."""
    zero = {"x": 0.0, "y": 0.0, "z": 0.0}
    sent: dict[int, float] = {}
    with relayed(robot.url) as url, connect(socket_of(url), compression=None) as relay:
        time.sleep(0.5)  # until the relay has opened its own socket
        for number in range(VELOCITIES):
            twist = {"linear": {**zero, "x": velocity(number)}, "angular": zero}
            sent[number] = time.monotonic()
            relay.send(ops.publish(robot.TWIST_TOPIC, twist), text=True)
            time.sleep(PERIOD)
    return arrived_after(sent, robot)


def velocity(number: int) -> float:
    """Return a velocity in m/s by which the robot's log shows its number."""
    return FULL * (0.2 + 0.001 * number)


def arrived_after(sent: Mapping[int, float], robot: WitnessRobot) -> list[float]:
    """Return the milliseconds from the times of sending to those in the robot's log."""
    arrived: dict[int, float] = {}
    for twist in robot.log.twists:
        number = round((twist.twist.vx / FULL - 0.2) / 0.001)
        arrived.setdefault(number, twist.at)
    found = [
        1000 * (arrived[number] - at)
        for number, at in sent.items()
        if number in arrived
    ]
    if len(found) < VELOCITIES / 2:
        raise RuntimeError(f"only {len(found)} of {VELOCITIES} velocities arrived")
    return found


def figures(found: list[float]) -> Figures:
    """Return the figures of the times of velocities, in ms."""
    return {
        "velocity to the robot, median (ms)": statistics.median(found),
        "velocity to the robot, 99 % (ms)": statistics.quantiles(found, n=100)[-1],
    }


def bare() -> Figures:
    """Run the bare relay."""
    with WitnessRobot(timeout=0.5) as robot:
        return figures(relay_delays(robot))


def way(*, agent: bool) -> Callable[[], Figures]:
    """Return a run through a gate here, or through a router and an agent's gate."""

    def run() -> Figures:
        with ExitStack() as running, tempfile.TemporaryDirectory() as _state:
            robot = running.enter_context(WitnessRobot(timeout=0.5))
            url, id = robot.url, "r1"
            if agent:
                router, _ = running.enter_context(
                    started("router", "--listen", "tcp/127.0.0.1:0")
                )
                topics = "Bob:/odom:/cmd_vel:"
                options = ("--name", "bay3", "--robot", topics, "--stops-within", "0.5")
                url, _ = running.enter_context(
                    started("agent", robot.url, "--router", router, *options)
                )
                id = id_at_agent("bay3", "Bob")
            return figures(delays(url, id, robot))

    return run


def bench(rounds: int, quick: bool = False) -> list[Comparison]:
    """Compare the time through a gate and through an agent with a bare relay."""
    contenders = [
        Contender("bare relay", bare),
        Contender("gate", way(agent=False)),
        Contender("router and agent", way(agent=True)),
    ]
    return [compare("the way of a velocity", contenders, 1 if quick else rounds)]
