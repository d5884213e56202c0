"""A bare server between a rosbridge and a browser, which forwards the messages.

Run as ``python -m benchmarks.relay ROSBRIDGE``; prints the address of a page. The page
draws a robot at the poses of its odometry, and sends a velocity for each key.
"""

import asyncio
import sys
from http import HTTPStatus

from websockets.asyncio.client import ClientConnection, connect
from websockets.asyncio.server import ServerConnection, serve
from websockets.http11 import Request, Response

from benchmarks.stamped import topics
from webmap.ros.rosbridge import ops

ODOMETRY, VELOCITY, _ = topics(0)

HTML = """<!doctype html><meta charset="utf-8"><title>Bare</title>
<svg width="1200" height="900"><g class="robot selected"><circle r="3"/></g></svg>
<script>
const robot = document.querySelector("g");
const matrix = document.querySelector("svg").createSVGMatrix();
const transform = robot.transform.baseVal.initialize(
  document.querySelector("svg").createSVGTransformFromMatrix(matrix));
const socket = new WebSocket(`ws://${location.host}/socket`);
socket.onmessage = ({ data }) => {
  const { msg } = JSON.parse(data);
  matrix.e = msg.pose.pose.position.x;
  matrix.f = msg.pose.pose.position.y;
  transform.setMatrix(matrix);
};
const drive = (x) => socket.send(JSON.stringify({ op: "publish", topic: "VELOCITY",
  msg: { linear: { x, y: 0, z: 0 }, angular: { x: 0, y: 0, z: 0 } } }));
addEventListener("keydown", ({ repeat }) => repeat || drive(1));
addEventListener("keyup", () => drive(0));
</script>""".replace("VELOCITY", VELOCITY)


def page(connection: ServerConnection, request: Request) -> Response | None:
    """Answer the request for the page; the socket has another path."""
    if request.path != "/":
        return None
    response = connection.respond(HTTPStatus.OK, HTML)
    del response.headers["Content-Type"]
    response.headers["Content-Type"] = "text/html"
    return response


async def pass_on(source: ClientConnection, target: ServerConnection) -> None:
    """Forward the poses."""
    async for frame in source:
        await target.send(frame, text=True)


async def main(url: str) -> None:
    """Serve until killed."""

    async def handle(browser: ServerConnection) -> None:
        async with connect(url, compression=None, ping_interval=None) as robot:
            await robot.send(ops.subscribe(ODOMETRY, id="1"), text=True)
            task = asyncio.create_task(pass_on(robot, browser))
            async for frame in browser:
                await robot.send(frame)
            task.cancel()

    async with serve(
        handle, "127.0.0.1", 0, compression=None, process_request=page
    ) as server:
        port = next(iter(server.sockets)).getsockname()[1]
        print(f"http://127.0.0.1:{port}/", flush=True)
        await server.serve_forever()


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1]))
