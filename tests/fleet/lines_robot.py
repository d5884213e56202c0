"""A robot without rosbridge and Foxglove: a line of JSON for each message, over TCP."""

import asyncio
import json
import math


class LinesRobot:
    """Sends odometry, a scan with NaN, a velocity and a map every 50 ms."""

    def __init__(self):
        self.received = []
        self.extra = []
        """Lines that the robot sends to new connections, beside its messages."""
        self._server = None
        self._writers = set()
        self.port = 0

    @property
    def url(self):
        return f"lines://127.0.0.1:{self.port}"

    async def __aenter__(self):
        await self.start()
        return self

    async def __aexit__(self, *exception):
        await self.stop()

    async def start(self):
        self._server = await asyncio.start_server(self._serve, "127.0.0.1", self.port)
        self.port = self._server.sockets[0].getsockname()[1]

    async def stop(self):
        self._server.close()
        for writer in self._writers:
            writer.transport.abort()
        while self._writers:
            await asyncio.sleep(0.005)

    async def _serve(self, reader, writer):
        self._writers.add(writer)
        reading = asyncio.ensure_future(self._read(reader))
        try:
            writer.writelines(self.extra)
            while not reading.done():
                writer.writelines(line(*each) for each in MESSAGES)
                await writer.drain()
                await asyncio.sleep(0.05)
        except OSError:
            pass
        finally:
            reading.cancel()
            writer.close()
            self._writers.discard(writer)

    async def _read(self, reader):
        async for text in reader:
            self.received.append(json.loads(text))


def line(topic, type, msg):
    return json.dumps({"topic": topic, "type": type, "msg": msg}).encode() + b"\n"


def header(frame):
    return {"stamp": {"sec": 1, "nanosec": 0}, "frame_id": frame}


def pose(x):
    turned = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}
    return {"position": {"x": x, "y": 0.0, "z": 0.0}, "orientation": turned}


ZERO = {"x": 0.0, "y": 0.0, "z": 0.0}
TWIST = {"linear": ZERO, "angular": ZERO}
ODOMETRY = {
    "header": header("odom"),
    "child_frame_id": "base_link",
    "pose": {"pose": pose(1.5), "covariance": [0.0] * 36},
    "twist": {"twist": TWIST, "covariance": [0.0] * 36},
}
SCAN = {
    "header": header("base_link"),
    "angle_min": -1.0,
    "angle_max": 1.0,
    "angle_increment": 1.0,
    "time_increment": 0.0,
    "scan_time": 0.1,
    "range_min": 0.1,
    "range_max": 10.0,
    "ranges": [2.0, math.nan, 3.0],
    "intensities": [],
}
GRID = {
    "header": header("map"),
    "info": {
        "map_load_time": {"sec": 0, "nanosec": 0},
        "resolution": 0.5,
        "width": 2,
        "height": 2,
        "origin": pose(0.0),
    },
    "data": [0, 100, -1, 0],
}
MESSAGES = [
    ("/odom", "nav_msgs/Odometry", ODOMETRY),
    ("/scan", "sensor_msgs/LaserScan", SCAN),
    ("/cmd_vel", "geometry_msgs/Twist", TWIST),
    ("/map", "nav_msgs/OccupancyGrid", GRID),
]
