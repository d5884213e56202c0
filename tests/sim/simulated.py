"""Small worlds and clients without sockets, for the simulator's tests."""

import contextlib
import json
import signal
import subprocess
import sys

import cbor2
import numpy as np

from webmap.base.geometry import Pose
from webmap.ros.rosbridge.server.dialect import Dialect, dialect_of, parse_quirks
from webmap.ros.rosbridge.server.encode import Encoder
from webmap.ros.rosbridge.server.graph import Graph
from webmap.ros.rosbridge.server.rosapi import Rosapi
from webmap.ros.rosbridge.server.schema import Schema
from webmap.ros.rosbridge.server.session import Session
from webmap.sim.maps import FREE, OCCUPIED, FloorPlan
from webmap.sim.node import STEP, RobotsNode
from webmap.sim.robot import BaseOptions, SimRobot
from webmap.sim.scanner import ScannerOptions
from webmap.sim.world import World, WorldOptions


def room(width=10.0, height=6.0, resolution=0.05, boxes=()):
    """A closed room from (0, 0) on, its wall one cell thick, with solid boxes."""
    columns, rows = round(width / resolution), round(height / resolution)
    cells = np.full((rows, columns), FREE, np.int8)
    cells[[0, -1], :] = OCCUPIED
    cells[:, [0, -1]] = OCCUPIED
    for x0, y0, x1, y1 in boxes:
        low, high = round(y0 / resolution), round(y1 / resolution)
        left, right = round(x0 / resolution), round(x1 / resolution)
        cells[low:high, left:right] = OCCUPIED
    return FloorPlan(cells, resolution, 0.0, 0.0)


ORIGIN = Pose()


def alone(pose=ORIGIN, **options):
    """A robot without obstacles around it."""
    return SimRobot("robot_0", pose, BaseOptions(**options))


def drive(robot, twist, seconds, *, now=0.0, dt=0.025, blocked=lambda x, y: False):
    """Command a twist at every step; return the time after it."""
    for _ in range(round(seconds / dt)):
        robot.command(twist, now)
        now += dt
        robot.step(dt, now, blocked)
    return now


def coast(robot, seconds, *, now, dt=0.025):
    """Advance the time without a command; return the time after it."""
    for _ in range(round(seconds / dt)):
        now += dt
        robot.step(dt, now, lambda x, y: False)
    return now


class Bench:
    """A world, its ROS graph, and clients whose frames are lists.

    The server has a dialect, or is of a version such as ``4.2``.
    """

    def __init__(
        self,
        version="ros1",
        quirks="polite",
        *,
        robots=2,
        twist="Twist",
        plan=None,
        nan=False,
        drift=0.0,
        robot_timeout=0.25,
        tilted=False,
        errands=0,
    ):
        behaviour = parse_quirks(quirks, version)
        self.world = World(
            plan or room(),
            WorldOptions(
                robots=robots,
                base=BaseOptions(timeout=robot_timeout, drift=drift),
                scanner=ScannerOptions(nan=nan),
                errands=errands,
            ),
        )
        schema = Schema(Dialect(dialect_of(version)))
        self.time = 1_700_000_000.25
        self.graph = Graph(schema, clock=lambda: self.time)
        self.rosapi = Rosapi(self.graph, behaviour)
        self.rosapi.start()
        self.node = RobotsNode(self.world, self.graph, twist, behaviour, tilted=tilted)
        self.node.start()
        self.encoder = Encoder(schema, behaviour)

    def client(self):
        return Client(self)

    def run(self, seconds):
        """Advance the time."""
        for _ in range(round(seconds / STEP)):
            self.time += STEP
            self.node.step()


class Client:
    """One client; ``texts`` and ``operations`` return the frames that it received."""

    def __init__(self, bench):
        self.bench = bench
        self.wakes = 0
        self.session = Session(
            bench.graph, bench.encoder, clock=lambda: bench.time, wake=self._wake
        )

    def _wake(self):
        self.wakes += 1

    def send(self, **operation):
        self.session.receive(json.dumps(operation))

    def frames(self):
        """Every waiting frame."""
        self.session.poll()
        found = []
        while frames := self.session.next_frames():
            found += frames
        return found

    def operations(self, op=None, topic=None):
        """Every waiting operation, decoded."""
        decoded = [
            cbor2.loads(frame) if isinstance(frame, bytes) else json.loads(frame)
            for frame in self.frames()
        ]
        return [
            o
            for o in decoded
            if (op is None or o["op"] == op)
            and (topic is None or o.get("topic") == topic)
        ]

    def call(self, service, args=None, **more):
        """Call a service; return its response, None if there is none."""
        operation = {"op": "call_service", "service": service, "id": "call:1", **more}
        if args is not None:
            operation["args"] = args
        self.send(**operation)
        responses = self.operations("service_response")
        return responses[-1] if responses else None


SIMULATOR = ("webmap", "sim", "--port", "0")


@contextlib.contextmanager
def running(*options, module=None, cwd=None):
    """Run the simulator, or a module, as a separate process; yield its URL."""
    command = [sys.executable, "-m", *([module] if module else SIMULATOR), *options]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=cwd)
    try:
        line = process.stdout.readline()
        prefix = "rosbridge is ready at "
        assert line.startswith(prefix), line
        yield line.removeprefix(prefix).strip()
    finally:
        process.send_signal(signal.SIGTERM)
        assert process.wait(10) == 0
        process.stdout.close()
