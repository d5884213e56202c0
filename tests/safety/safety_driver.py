"""A display without pages: a gate, one robot, and an operator that follows orders.

Its arguments are the address of the robot's bridge or agent, and the robot's id.

It is a separate process, so that a test can kill it. It reads one order from each line:
``take``, ``x 1.0``, ``stop``, ``reset``, and for its program ``acquire``, ``v 0.5`` and
``silent``. It prints a line of JSON for each report of the gate about the robot.
"""

import json
import sys
import threading

from webmap.agents.gates import Gates
from webmap.agents.peer import close_peers
from webmap.base.errors import NoLease
from webmap.base.geometry import Twist
from webmap.config.motion import TwistConfig
from webmap.gate.protocol import RobotSpec

ROBOT = sys.argv[2] if len(sys.argv) > 2 else "r1"


def write_line(text: str) -> None:
    """Print a whole line at a time, as several threads print."""
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


class Operator:
    """Sends the messages of a page on ``/drive``, at 20 Hz."""

    def __init__(self, client: Gates) -> None:
        self.x: float | None = None
        self._ticks: dict[str, int] = {}
        self._gate = ""
        self._epoch = 0
        self._stop = ""
        self._seq = 0
        self._connection = client.connect("Ann", "operator", self._on_message, print)

    def send(self, text: str) -> None:
        """Send a text unchanged."""
        self._connection.receive(text)

    def reset(self) -> None:
        """End the STOP that the gate reported last."""
        command = {"op": "reset", "robot": ROBOT, "stop": self._stop}
        self.send(json.dumps(command))

    def step(self) -> None:
        """Send a drive command, if a speed is set."""
        if self.x is None or self._gate not in self._ticks:
            return
        self._seq += 1
        command = {
            "op": "drive",
            "robot": ROBOT,
            "epoch": self._epoch,
            "seq": self._seq,
            "tick": self._ticks[self._gate],
            "x": self.x,
            "y": 0.0,
            "turn": 0.0,
        }
        self.send(json.dumps(command))

    def _on_message(self, text: str) -> None:
        message = json.loads(text)
        match message["op"]:
            case "tick":
                self._ticks[message.get("gate", "")] = message["tick"]
            case "robot":
                self._epoch = message["epoch"] or 0
                self._gate = message.get("gate", "")
                self._stop = (message["stop"] or {}).get("id", "")
                write_line(text)
            case "refused":
                write_line(text)


class Program:
    """Sends a velocity at 20 Hz while it has control, as a program in Python does."""

    def __init__(self, client: Gates) -> None:
        self.v: float | None = None
        self._client = client

    def acquire(self) -> None:
        """Take control of the robot, and print the result."""
        try:
            answer = {"op": "acquired", "epoch": self._client.take(ROBOT).result(10)}
        except NoLease as error:
            answer = {"op": "acquired", "why": str(error)}
        write_line(json.dumps(answer))

    def step(self) -> None:
        """Send the velocity, if one is set."""
        if self.v is None:
            return
        try:
            self._client.twist(ROBOT, Twist(self.v))
        except NoLease as error:
            self.v = None
            answer = {"op": "lost", "why": str(error)}
            write_line(json.dumps(answer))


def main() -> None:
    """Follow the orders on standard input until it ends."""
    client = Gates()
    client.start()
    spec = RobotSpec(
        id=ROBOT,
        name="Bob",
        twist=TwistConfig(
            bridge=sys.argv[1],
            topic="/cmd_vel",
            stops_within=0.5,
            v_max=1.0,
            w_max=1.5,
            drive_without_proof=True,
        ),
        odometry_topic="/odom",
        odometry_type="nav_msgs/Odometry",
    )
    client.declare(spec)
    operator, ended = Operator(client), threading.Event()
    program = Program(client)

    def stream() -> None:
        while not ended.wait(0.05):
            operator.step()
            program.step()

    thread = threading.Thread(target=stream)
    thread.start()
    for line in sys.stdin:
        match line.split(maxsplit=1):
            case ["take"]:
                operator.send(json.dumps({"op": "take", "robot": ROBOT}))
            case ["x", value]:
                operator.x = float(value)
            case ["acquire"]:
                program.acquire()
            case ["silent"]:
                program.v = None
            case ["v", value]:
                program.v = float(value)
            case ["stop"]:
                operator.send(
                    json.dumps({"op": "stop", "robot": ROBOT}, separators=(",", ":"))
                )
            case ["reset"]:
                operator.reset()
    ended.set()
    thread.join()
    client.stop()
    close_peers()


if __name__ == "__main__":
    main()
