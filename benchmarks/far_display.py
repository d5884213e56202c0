"""A display of an agent's robots that draws nothing, with pages that do not drive.

It exchanges the same messages with the agent as a real display: it subscribes to
topics, connects pages to the agent's gate, and answers this gate. It decodes no
messages, so several such displays can run beside an agent on one machine.

Run as ``python -m benchmarks.far_display AGENT PAGES``, with the subscriptions as a
list in JSON on standard input. Prints ``ready`` when messages arrive, and ends when
standard input ends.
"""

import asyncio
import json
import sys
import threading

from webmap.agents.address import agent_in
from webmap.agents.gates import Gates
from webmap.agents.link import AgentConnection
from webmap.agents.peer import close_peers
from webmap.base.tasks import LoopThread
from webmap.config.motion import TwistConfig
from webmap.gate.protocol import RobotSpec


def main(agent: str, pages: int) -> None:
    """Connect to an agent until standard input ends."""
    subscriptions = json.loads(sys.stdin.readline())
    arrived, thread, gates = threading.Event(), LoopThread("data"), Gates()

    def subscribe() -> None:
        for op in subscriptions:
            lane.send(json.dumps(op).encode())

    lane = AgentConnection(
        agent,
        opened=subscribe,
        received=lambda _: arrived.set(),
        closed=lambda why: print(f"the connection ended: {why}", file=sys.stderr),
        failed=lambda error: print(error, file=sys.stderr),
    )

    async def begin() -> None:
        lane.start(asyncio.get_running_loop())

    try:
        robot = f"{agent_in(agent)}/looked-at"
        twist = TwistConfig(topic="/cmd_vel", bridge=agent)
        gates.declare(RobotSpec(id=robot, name="robot", twist=twist))
        for number in range(pages):
            gates.connect(f"viewer {number}", "operator", lambda _: None, print)
        thread.call(begin())
        if not arrived.wait(30):
            raise TimeoutError(f"no message came from {agent}")
        print("ready", flush=True)
        sys.stdin.read()
    finally:
        thread.call(lane.stop())
        thread.end()
        gates.stop()
        close_peers()


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
