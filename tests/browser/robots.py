"""Messages of a robot's ROS, received by a client that this project did not write."""

import threading
from urllib.parse import urlsplit

import roslibpy

from equipment.waiting import wait_for


class Witness:
    """Subscribes to the topics of a robot through roslibpy."""

    def __init__(self, url: str) -> None:
        parts = urlsplit(url)
        self.ros = roslibpy.Ros(parts.hostname, parts.port)
        self.ros.run(timeout=10)
        self._newest: dict[str, dict] = {}
        self._count: dict[str, int] = {}
        self._lock = threading.Lock()

    def follow(self, topic: str, type_name: str) -> None:
        """Keep the newest message of a topic."""

        def on_message(message) -> None:
            with self._lock:
                self._newest[topic] = message
                self._count[topic] = self._count.get(topic, 0) + 1

        roslibpy.Topic(self.ros, topic, type_name).subscribe(on_message)

    def count(self, topic: str) -> int:
        """The number of messages received on a topic."""
        with self._lock:
            return self._count.get(topic, 0)

    def newest(self, topic: str, within: float = 10.0) -> dict:
        """Return the newest message of a topic; wait for the first."""
        wait_for(lambda: self.count(topic), f"a message on {topic}", within)
        with self._lock:
            return self._newest[topic]

    def place(self, topic: str) -> tuple[float, float]:
        """The pose of the robot in odometry."""
        position = self.newest(topic)["pose"]["pose"]["position"]
        return position["x"], position["y"]

    def speed(self, topic: str) -> tuple[float, float]:
        """The velocity of the robot in odometry: forward, turning."""
        twist = self.newest(topic)["twist"]["twist"]
        return twist["linear"]["x"], twist["angular"]["z"]

    def close(self) -> None:
        """Disconnect."""
        self.ros.close()
