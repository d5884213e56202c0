"""A client of the protocol of Foxglove, written from its description."""

import json
import struct
from contextlib import asynccontextmanager

import websockets

from equipment.waiting import until


@asynccontextmanager
async def connected(url, **options):
    """Connect to a server; yield the client."""
    async with websockets.connect(
        url, subprotocols=["foxglove.sdk.v1"], **options
    ) as socket:
        client = FoxgloveClient(socket)
        client.info = json.loads(await socket.recv())
        yield client


class FoxgloveClient:
    def __init__(self, socket):
        self.socket = socket
        self.info = None
        self.channels, self.messages, self.times = {}, [], []
        self.states, self.status = [], []

    async def read(self):
        """Read until the connection ends."""
        async for frame in self.socket:
            if isinstance(frame, str):
                operation = json.loads(frame)
                if operation["op"] == "advertise":
                    for channel in operation["channels"]:
                        self.channels[channel["topic"]] = channel
                elif operation["op"] == "status":
                    self.status.append(operation["message"])
            elif frame[0] == 1:
                subscription, time = struct.unpack_from("<IQ", frame, 1)
                self.messages.append((subscription, time, frame[13:]))
            elif frame[0] == 2:
                self.times.append(struct.unpack_from("<Q", frame, 1)[0])
            elif frame[0] == 5:
                self.states.append(state_of(frame[1:]))

    async def subscribe(self, *topics):
        """Subscribe to topics, each with its own identifier as subscription."""
        await until(lambda: set(topics) <= self.channels.keys())
        wanted = [self.channels[topic]["id"] for topic in topics]
        subscriptions = [{"id": each, "channelId": each} for each in wanted]
        await self.socket.send(
            json.dumps({"op": "subscribe", "subscriptions": subscriptions})
        )

    async def control(self, *, play, speed=1.0, seek=None, request="r"):
        """Send what a person wants of the playback."""
        identifier = request.encode()
        head = struct.pack(
            "<BBfBQI",
            *(3, 0 if play else 1, speed, seek is not None),
            *(seek or 0, len(identifier)),
        )
        await self.socket.send(head + identifier)

    def received(self, topic):
        """Return times and bytes of the messages of a topic."""
        number = self.channels[topic]["id"]
        return [(time, data) for each, time, data in self.messages if each == number]


def state_of(data):
    """Return status, time, speed, whether it jumped, and the request."""
    status, time, speed, jumped, size = struct.unpack_from("<BQfBI", data)
    names = {0: "playing", 1: "paused", 2: "buffering", 3: "ended"}
    return names[status], time, speed, bool(jumped), data[18 : 18 + size].decode()
