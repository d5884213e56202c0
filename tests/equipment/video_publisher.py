"""A camera with video: a client of a rosbridge that repeats the same packets."""

import base64
import json
import threading
import time
from contextlib import ExitStack

from websockets.sync.client import connect

from equipment.videos import packets


class VideoPublisher:
    """Publishes a video on a topic, in a thread of its own, until it is stopped.

    Attributes:
        format: The format that its messages state.
        packets: The packets that it repeats; a test may replace them.
        frozen: While it is set, nothing is published.
        skips: Whether each third packet is lost.
    """

    TYPE = "foxglove_msgs/CompressedVideo"

    def __init__(self, url: str, topic: str, period: float = 1 / 15) -> None:
        self.format = "h264"
        self.packets = packets("h264")
        self.frozen = False
        self.skips = False
        self._topic = topic
        self._period = period
        self._open = ExitStack()
        self._link = self._open.enter_context(connect(url, compression=None))
        self._send(op="advertise", topic=topic, type=self.TYPE)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Stop publishing, and disconnect."""
        self._stop.set()
        self._thread.join(10)
        self._open.close()

    def message(self, data: bytes) -> dict:
        """Return a message of the topic's type."""
        now = time.time_ns()
        stamp = {"sec": now // 10**9, "nanosec": now % 10**9}
        text = base64.b64encode(data).decode()
        return {"timestamp": stamp, "frame_id": "", "data": text, "format": self.format}

    def _run(self) -> None:
        number = 0
        while not self._stop.wait(self._period):
            number += 1
            if self.frozen or (self.skips and number % 3 == 0):
                continue
            message = self.message(self.packets[number % len(self.packets)])
            self._send(op="publish", topic=self._topic, msg=message)

    def _send(self, **op: object) -> None:
        self._link.send(json.dumps(op))
