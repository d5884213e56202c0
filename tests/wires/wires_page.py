"""A page as a browser opens it: its two sockets and its inputs."""

import contextlib
import json
import threading
import time

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

HELLO = {
    "op": "hello",
    "url": "/",
    "width": 800,
    "height": 600,
    "containers": {"webmap_container": [700, 500]},
}
NEUTRAL = (0.0, 0.0, 0.0)


class Report(dict):
    """A report of a robot; fields without a value are None."""

    def __missing__(self, key):
        return None


class Page:
    """Sends and receives on both sockets like a page.

    Args:
        bench: The bench of the script.
        name: The name of the user.
        role: The role of the user.

    """

    def __init__(self, bench, name, role="operator"):
        self.name = name
        self.reports = {}
        """The newest report of each robot, by its id."""
        self.inputs = None
        """The inputs for a robot that this page controls, as parts of full speed.

        If None, nothing is sent. Zeros are sent until the gate has seen that the
        inputs are released."""
        self.robot = ""
        """The id of the robot that the inputs drive."""
        self.greeted = False
        """Whether the gate has sent hello."""
        self.refusals = []
        """The refusals, newest last."""
        self.ended = ""
        """Why the server closed the socket, once it has."""
        self._bench, self._tap = bench, bench.tap
        self.tick = None
        self._seq = 0
        self._lock = threading.Lock()
        self._over = threading.Event()
        headers = {"x-name": name, "x-role": role}
        port = bench.port

        def opened(socket):
            return connect(
                f"ws://127.0.0.1:{port}/_webmap/{socket}",
                origin=f"http://127.0.0.1:{port}",
                additional_headers=headers,
                compression=None,
                max_size=None,
            )

        id = f"page-{name}"
        self._scene = opened(f"scene?page=/&id={id}")
        self._scene.send(json.dumps({**HELLO, "page": id}))
        self._scene.recv(10)  # then the server knows the limits of the page
        self._drive = opened(f"drive?id={id}")
        self._threads = [
            threading.Thread(target=work, daemon=True)
            for work in (self._listen, self._look, self._stream)
        ]
        for thread in self._threads:
            thread.start()

    # Actions of the user.

    def send_op(self, op, **fields):
        """Send a command."""
        self.send(json.dumps({"op": op, **fields}))

    def send(self, text):
        """Send a text as it is."""
        try:
            message = json.loads(text)
        except ValueError:
            message = {"op": "nonsense", "text": text}
        self._tap.note(f"page {self.name} to server", message)
        self._drive.send(text)

    def report(self, robot):
        """Return the newest report of a robot."""
        return self.reports.get(robot.id, Report())

    def take(self, robot):
        """Wait until a robot is free, and take it."""
        self._bench.until(lambda: self.report(robot)["armable"], "a robot")
        self.send_op("take", robot=robot.id)
        self._bench.until(lambda: self.report(robot)["mine"], "the lease")

    def rest(self, robot):
        """Send neutral inputs until the gate accepts commands."""
        self.robot, self.inputs = robot.id, NEUTRAL
        self._bench.until(lambda: self.report(robot)["armed"], "an armed driver")

    def drive(self, robot, x=0.0, y=0.0, turn=0.0, *, until):
        """Drive on; return when ``until`` returns a true value."""
        self.robot, self.inputs = robot.id, (x, y, turn)
        self._bench.until(until, "a robot that is driven")

    def release_inputs(self, robot):
        """Release all inputs; wait until the robot has stopped."""
        self.inputs = NEUTRAL
        self._bench.until(
            lambda: self.report(robot)["state"] == "held", "a robot at rest"
        )

    def aim(self, op, robot, x=1.0, y=2.0, yaw=0.5):
        """Send a goal, or a pose of the robot."""
        self.send_op(op, **self._licence(robot.id), x=x, y=y, yaw=yaw)

    def reset(self, robot):
        """Reset the STOP that the page shows."""
        stop = self._bench.until(lambda: self.report(robot)["stop"], "a STOP")
        self.send_op("reset", robot=robot.id, stop=stop["id"])

    def close(self):
        """Close both sockets, as a tab that is closed."""
        self.inputs = None
        self._over.set()
        for socket in (self._drive, self._scene):
            socket.close()
        for thread in self._threads:
            thread.join(10)

    # Its threads.

    def _licence(self, robot):
        with self._lock:
            self._seq += 1
            epoch = self.reports[robot]["epoch"] or 0
            return {
                "robot": robot,
                "epoch": epoch,
                "seq": self._seq,
                "tick": self.tick,
            }

    def _listen(self):
        with contextlib.suppress(ConnectionClosed):
            for text in self._drive:
                message = json.loads(text)
                self._tap.note(f"server to page {self.name}", message)
                match message["op"]:
                    case "hello":
                        self.greeted = True
                    case "refused":
                        self.refusals.append(message)
                    case "tick":
                        self.tick = message["tick"]
                    case "robot":
                        self.reports[message["robot"]] = Report(message)
                    case "gone":
                        self.reports.pop(message["robot"], None)
        self.ended = self._drive.close_reason or ""

    def _look(self):
        with contextlib.suppress(ConnectionClosed):
            for _ in self._scene:
                pass

    def _stream(self):
        due = time.monotonic()
        while not self._over.is_set():
            inputs, robot = self.inputs, self.robot
            report = self.reports.get(robot, Report())
            if inputs is not None and report["mine"]:
                x, y, turn = inputs if report["armed"] else NEUTRAL
                with contextlib.suppress(ConnectionClosed):
                    self.send_op("drive", **self._licence(robot), x=x, y=y, turn=turn)
            due = max(due + 0.05, time.monotonic())
            self._over.wait(due - time.monotonic())
