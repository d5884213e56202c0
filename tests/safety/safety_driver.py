"""A display without pages: a gate, one robot, and a hand that says what it is told to.

A process of its own, so that it can be killed. It reads orders, one a line (``take``,
``x 1.0``, ``stop``), and writes a line of JSON whenever the gate tells the hand of the
robot something new.
"""

import json
import sys
import threading

from webmap.gate.display.client import GateClient
from webmap.gate.protocol import RobotSpec


class Hand:
    """Speaks a page's side of ``/drive`` at 20 Hz."""

    def __init__(self, client: GateClient) -> None:
        self.x: float | None = None
        self._tick: int | None = None
        self._epoch = 0
        self._seq = 0
        self._connection = client.connect("Ann", "operator", self._hear, print)

    def say(self, text: str) -> None:
        """Send a text as it is."""
        self._connection.receive(text)

    def step(self) -> None:
        """Send how the hand is, if it is anyhow."""
        if self.x is None or self._tick is None:
            return
        self._seq += 1
        command = {
            "op": "drive",
            "robot": "r1",
            "epoch": self._epoch,
            "seq": self._seq,
            "tick": self._tick,
            "x": self.x,
            "y": 0.0,
            "turn": 0.0,
        }
        self.say(json.dumps(command))

    def _hear(self, text: str) -> None:
        message = json.loads(text)
        match message["op"]:
            case "tick":
                self._tick = message["tick"]
            case "robot":
                self._epoch = message["epoch"] or 0
                print(text, flush=True)
            case "refused":
                print(text, flush=True)


def main() -> None:
    """Do as standard input says, until it ends."""
    client = GateClient()
    client.start()
    spec = RobotSpec(
        id="r1",
        name="Bob",
        bridge_url=sys.argv[1],
        twist_topic="/cmd_vel",
        stops_within=0.5,
        v_max=1.0,
        w_max=1.5,
        odometry_topic="/odom",
        odometry_type="nav_msgs/Odometry",
    )
    client.declare(spec)
    hand, ended = Hand(client), threading.Event()

    def stream() -> None:
        while not ended.wait(0.05):
            hand.step()

    thread = threading.Thread(target=stream)
    thread.start()
    for line in sys.stdin:
        match line.split(maxsplit=1):
            case ["take"]:
                hand.say('{"op":"take","robot":"r1"}')
            case ["x", value]:
                hand.x = float(value)
            case ["stop"]:
                hand.say('{"op":"stop","robot":"r1"}')
    ended.set()
    thread.join()
    client.stop()


if __name__ == "__main__":
    main()
