"""A recording that is played at once and without sockets, and its client."""

import asyncio
import json
from contextlib import asynccontextmanager

from webmap.bags.player import Player
from webmap.bags.recording import Recording
from webmap.bags.times import SECOND
from webmap.ros.rosbridge.server.dialect import POLITE
from webmap.ros.rosbridge.server.encode import Encoder
from webmap.ros.rosbridge.server.session import Session

NOW = 1_800_000_000 * SECOND


class Client:
    """One client of a replay, without a socket."""

    def __init__(self, player):
        graph = player.replay.graph
        encoder = Encoder(graph.schema, POLITE)
        self.session = Session(graph, encoder, clock=lambda: 0.0, wake=lambda: None)
        self.received = []

    def send(self, **operation):
        self.session.receive(json.dumps(operation))

    def listen(self, *topics):
        for topic in topics:
            self.send(op="subscribe", topic=topic)
        return self

    def operations(self):
        while frames := self.session.next_frames():
            self.received += [json.loads(frame) for frame in frames]
        return self.received

    def messages(self, topic):
        return [one["msg"] for one in self.operations() if one.get("topic") == topic]

    def call(self, service, **args):
        self.send(op="call_service", service=service, args=args)
        return self.operations()[-1]["values"]


@asynccontextmanager
async def played(bag, **options):
    """Play a bag to its end at once; return the player."""
    recording = Recording([bag])
    player = Player(recording, rate=1000.0, now=lambda: NOW, **options)
    player.replay.start()
    task = asyncio.create_task(player.run())
    try:
        yield player
    finally:
        task.cancel()
        await asyncio.wait([task])
        recording.close()


def xs(client):
    return [
        message["pose"]["pose"]["position"]["x"] for message in client.messages("/odom")
    ]
