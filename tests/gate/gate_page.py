"""A page of an operator, which drives a robot through a GateClient."""

import json
import threading

from equipment.waiting import wait_for


class Page:
    """Sends the commands of a page at 20 Hz, as over ``/drive``."""

    def __init__(self, client, name="Ann", role="operator"):
        self.on_echo = []
        self.closed = []
        self.robots = {}
        self.tick = self.ack = None
        self.x = None
        """The forward input; ``None`` sends no commands."""
        self._seq = 0
        self._end = threading.Event()
        self.connection = client.connect(name, role, self._receive, self.closed.append)
        self._thread = threading.Thread(target=self._stream, daemon=True)
        self._thread.start()

    def _receive(self, text):
        message = json.loads(text)
        match message["op"]:
            case "tick":
                self.tick, self.ack = message["tick"], message["ack"]
            case "robot":
                self.robots[message["robot"]] = message
                self.on_echo.append(message)
            case _:
                self.on_echo.append(message)

    def send(self, **command):
        if command["op"] == "reset" and "stop" not in command:
            robot = command["robot"]
            stop = wait_for(lambda: self.robot(robot).get("stop"), "a STOP to reset")
            command["stop"] = stop["id"]
        self.connection.receive(json.dumps(command))

    def drive(self, x, robot="r1"):
        self._seq += 1
        self.send(
            op="drive",
            robot=robot,
            epoch=self.robots[robot]["epoch"] or 0,
            seq=self._seq,
            tick=self.tick,
            x=x,
            y=0.0,
            turn=0.0,
        )

    def goal(self, robot="r1", op="goal"):
        self._seq += 1
        self.send(
            op=op,
            robot=robot,
            epoch=self.robots[robot]["epoch"] or 0,
            seq=self._seq,
            tick=self.tick,
            x=1.0,
            y=2.0,
            yaw=0.0,
        )

    def _stream(self):
        while not self._end.wait(0.05):
            if self.x is not None and self.tick is not None and "r1" in self.robots:
                self.drive(self.x)

    def of(self, op):
        return [message for message in self.on_echo if message["op"] == op]

    def robot(self, robot="r1"):
        return self.robots.get(robot, {})

    def take(self, robot="r1"):
        wait_for(lambda: self.robot(robot).get("armable"), "a free robot")
        self.send(op="take", robot=robot)
        wait_for(lambda: self.robot(robot).get("mine"), "the lease")

    def drive_off(self, fake):
        """Take the robot, send released inputs, then drive."""
        self.take()
        moves = len(fake.moving)

        def under_way():
            # A busy computer may delay this thread for longer than the dead-man
            # limit; then the gate must see released inputs again.
            self.x = 1.0 if self.robot()["armed"] else 0.0
            return len(fake.moving) > moves

        wait_for(under_way, "a robot that moves")

    def end(self):
        self._end.set()
        self._thread.join(5)
        self.connection.close()
