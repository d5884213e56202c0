"""A display shows why a router is unreachable and which agents are connected."""

import msgspec

from webmap.agents.announcements import PROTOCOL, Beacon
from webmap.agents.router_access import RouterUser
from webmap.base.lifecycle import lifecycle
from webmap.console import Console
from webmap.fleet import remote_robots
from webmap.fleet.remote_robots import AWAY, RemoteAgents


class FakePeer:
    """A router that may be unreachable, and the signs of its agents."""

    def __init__(self):
        self.user = RouterUser()
        self.trouble = "cannot reach the router: nothing listens there"

    def listen(self, key, fn):
        self.key, self._fn = key, fn

    def sign_of(self, name):
        beacon = msgspec.json.encode(Beacon(PROTOCOL, "s", "a"))
        self._fn(f"webmap/{name}/here", beacon)


class Clock:
    now = 100.0

    def monotonic(self):
        return self.now


def test_a_display_says_what_is_wrong_with_a_router_and_which_agents_are_away(
    monkeypatch,
):
    peer, clock = FakePeer(), Clock()
    monkeypatch.setattr(remote_robots, "peer_of", lambda _: peer)
    monkeypatch.setattr(remote_robots, "time", clock)
    agents, console = RemoteAgents("zenoh://hall:7447"), Console()
    try:
        agents.show_on(console)
        (describe,) = console.routers.values()
        assert list(console.routers) == ["zenoh://hall:7447"]
        assert describe() == (
            "lost",
            "cannot reach the router: nothing listens there; reconnecting",
        )
        peer.trouble = None
        assert describe() == ("connecting", "no agent is at zenoh://hall:7447 yet")
        peer.sign_of("bay2")
        peer.sign_of("bay1")
        assert describe() == ("open", "2 agents connected")
        clock.now += AWAY
        peer.sign_of("bay1")
        assert describe() == ("open", "1 agent connected; away: bay2")
        peer.sign_of("bay2")
        assert describe() == ("open", "2 agents connected")
    finally:
        lifecycle.discard(agents)
