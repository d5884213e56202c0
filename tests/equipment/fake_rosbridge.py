"""A rosbridge server that a test controls; it records what it receives."""

import asyncio
import json
from contextlib import asynccontextmanager

from websockets.asyncio.server import serve

from equipment.waiting import until
from webmap.ros.bridge import Bridge


class FakeRosbridge:
    def __init__(self):
        self.links = []
        self.received = []
        self.answer = {}
        self._server = None
        self.port = 0

    @property
    def url(self):
        return f"ws://127.0.0.1:{self.port}"

    async def start(self):
        self._server = await serve(
            self._serve, "127.0.0.1", self.port, compression=None, ping_interval=None
        )
        self.port = self._server.sockets[0].getsockname()[1]

    async def stop(self):
        self._server.close()
        for link in self.links:
            link.transport.abort()
        await self._server.wait_closed()

    async def _serve(self, link):
        self.links.append(link)
        try:
            async for text in link:
                assert isinstance(text, str)
                message = {**json.loads(text), "link": link}
                self.received.append(message)
                if message["op"] == "call_service":
                    await self._respond(link, message)
        finally:
            self.links.remove(link)

    async def _respond(self, link, call):
        answer = self.answer.get(call["service"], "no such service")
        if answer is None:
            return
        reply = {"op": "service_response", "service": call["service"], "values": answer}
        result = not isinstance(answer, str)
        await link.send(json.dumps({**reply, "id": call["id"], "result": result}))

    def ops(self, op, **fields):
        """Return the received messages with this operation and these fields."""
        return [
            message
            for message in self.received
            if message["op"] == op
            and all(message.get(name) == value for name, value in fields.items())
        ]

    async def wait_for(self, op, count=1, **fields):
        await until(lambda: len(self.ops(op, **fields)) >= count)
        return self.ops(op, **fields)

    async def publish(self, topic, message):
        text = json.dumps({"op": "publish", "topic": topic, "msg": message})
        await self.send(text)

    async def send(self, frame):
        for link in list(self.links):
            await link.send(frame)

    def drop(self):
        for link in list(self.links):
            link.transport.abort()


@asynccontextmanager
async def bridged(*, opened=True, **answers):
    """Run a fake rosbridge and a bridge that is connected to it."""
    server = FakeRosbridge()
    server.answer = {f"/rosapi/{name}": values for name, values in answers.items()}
    await server.start()
    bridge = Bridge(server.url)
    bridge.start(asyncio.get_running_loop())
    try:
        if opened:
            await until(lambda: bridge.state == "open")
        yield server, bridge
    finally:
        await bridge.stop()
        await server.stop()
