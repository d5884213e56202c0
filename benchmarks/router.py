"""The cost of a message in a router, and the computed cost of large fleets.

The first part measures sessions that send and receive through ``webmap router``. The
second part computes messages, bytes and processors of large fleets from these costs.
"""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from benchmarks.harness import Comparison, Contender, Figures, compare
from benchmarks.processes import started, used
from webmap.agents.address import locator
from webmap.agents.peer import COPIES
from webmap.base.zenoh_sessions import zenoh_config

RATE = 1000
"""Messages a second of the sender."""

READERS = (0, 1, 4, 8)
"""Sessions that receive each message."""

TICK_BYTES, DATA_BYTES = 52, 1300
"""Bytes of a tick, and of a packed scan of 360 points."""

ROUTER, OWN = "cpu of the router (us a message)", "cpu of the sessions (us a message)"
CARRIED = "messages that each session receives (%)"


def client(place: str) -> Any:
    """Return a session that is a client of a router."""
    import zenoh

    transport = {"shared_memory": {"enabled": False}}
    return zenoh.open(
        zenoh_config(mode="client", connect={"endpoints": [place]}, transport=transport)
    )


def passed_on(readers: int, size: int, seconds: float) -> Callable[[], Figures]:
    """Return a run in which one session sends, and some receive."""

    def run() -> Figures:
        import zenoh

        with started("router", "--listen", "tcp/127.0.0.1:0") as (url, router):
            place = locator(url)
            sender, others = client(place), [client(place) for _ in range(readers)]
            received = [0] * readers
            try:
                for number, other in enumerate(others):

                    def count(_sample: object, number: int = number) -> None:
                        received[number] += 1

                    other.declare_subscriber("bench/**", count)
                time.sleep(0.5)
                before, own = used(router), time.process_time()
                begun, sent = time.monotonic(), 0
                while (now := time.monotonic()) - begun < seconds:
                    while sent < (now - begun) * RATE:
                        sender.put(
                            "bench/bay3/gate/out",
                            bytes(size),
                            congestion_control=zenoh.CongestionControl.BLOCK,
                            express=True,
                        )
                        sent += 1
                    time.sleep(0.005)
                time.sleep(0.5)
                spent, own = used(router) - before, time.process_time() - own
            finally:
                for session in (sender, *others):
                    session.close()
        return {
            ROUTER: 1e6 * spent / sent,
            OWN: 1e6 * own / sent,
            CARRIED: 100 * sum(received) / max(1, sent * readers) if readers else 100.0,
        }

    return run


@dataclass(frozen=True, slots=True)
class Costs:
    """Seconds of processor time for each message."""

    into: float
    """In the router, for each message that it receives."""
    out: float
    """In the router, for each session that it sends the message to."""
    put: float
    """In the process that sends the message."""
    take: float
    """In a process that receives the message, until Python calls the function."""


def costs(comparison: Comparison) -> Costs:
    """Return the costs of a message from the runs with few and with many readers."""
    few, many = (f"{count} sessions receive" for count in (READERS[1], READERS[-1]))
    none = f"{READERS[0]} sessions receive"
    more = READERS[-1] - READERS[1]

    def each(figure: str) -> float:
        apart = comparison.median(many, figure) - comparison.median(few, figure)
        return apart / more / 1e6

    return Costs(
        comparison.median(none, ROUTER) / 1e6,
        each(ROUTER),
        comparison.median(none, OWN) / 1e6,
        each(OWN),
    )


@dataclass(frozen=True, slots=True)
class Layout:
    """A fleet, and the agents that each display shows."""

    name: str
    agents: int
    displays: int
    shown: int
    """Agents that each display subscribes to."""
    routers: int = 1
    """Regions, each with a router; agents and displays are spread evenly."""
    crossing: float = 0.0
    """The share of the agents of a display that are in another region."""


UP: dict[str, tuple[float, int]] = {
    "ticks": (20.0 * COPIES, 140),
    "reports": (2.0 * COPIES, 700),
    "beacons": (2.0, 160),
    "poses": (10.0, 290),
    "scans": (10.0, 1370),
    "frames": (20.0, 250),
}
"""Messages that an agent of one robot sends: rate, and bytes of each on the link."""

DOWN: dict[str, tuple[float, int]] = {
    "answers": (1.0, 180),
    "pings": (1.4, 110),
}
"""Messages that a display without control sends to each agent that it shows."""


def flows(layout: Layout, cost: Costs) -> Figures:
    """Return the load of one agent, one display and one router."""
    up = sum(rate for rate, _ in UP.values())
    up_bytes = sum(rate * size for rate, size in UP.values())
    down = sum(rate for rate, _ in DOWN.values())
    down_bytes = sum(rate * size for rate, size in DOWN.values())
    shown_by = layout.displays * layout.shown / layout.agents
    agents, displays = (
        count / layout.routers for count in (layout.agents, layout.displays)
    )
    pairs = displays * layout.shown
    # Both routers handle a message between two regions: one copy for each region that
    # shows it.
    shown_there = min(pairs, layout.agents - agents) if layout.routers > 1 else 0.0
    between = layout.crossing * shown_there
    into = agents * up + pairs * down + between * (up + down)
    out = pairs * (up + down) + between * (up + down)
    return {
        "an agent: sends and gets (messages a second)": up + shown_by * down,
        "an agent: processor (%)": 100 * (up * cost.put + shown_by * down * cost.take),
        "a display: gets and sends (messages a second)": layout.shown * (up + down),
        "a display: link (Mbit/s)": 8e-6 * layout.shown * (up_bytes + down_bytes),
        "a display: processor for Zenoh (%)": 100
        * layout.shown
        * (up * cost.take + down * cost.put),
        "a router: messages in and out (a second)": into + out,
        "a router: links (Mbit/s)": 8e-6
        * (
            agents * up_bytes
            + pairs * (up_bytes + 2 * down_bytes)
            + 2 * between * (up_bytes + down_bytes)
        ),
        "a router: processors": into * cost.into + out * cost.out,
    }


LAYOUTS = (
    Layout("one router, all show all", 1000, 100, 1000),
    Layout("one router, each shows 10", 1000, 100, 10),
    Layout("10 regions, each shows its 100", 1000, 100, 100, routers=10),
    Layout("10 regions, each shows 10", 1000, 100, 10, routers=10),
    Layout("10 regions, each shows 10, half elsewhere", 1000, 100, 10, 10, 0.5),
)


def on_paper(cost: Costs) -> Comparison:
    """Return the load of each layout."""
    return Comparison(
        "1,000 agents and 100 displays, computed",
        {layout.name: [flows(layout, cost)] for layout in LAYOUTS},
    )


def crowd(layout: Layout, cost: Costs, seconds: float) -> Figures:
    """Return the router's cost of a small fleet, computed and measured.

    Each agent and each display is a separate session that sends at the rates of ``UP``
    and ``DOWN``. The sessions run only Zenoh.
    """
    with started("router", "--listen", "tcp/127.0.0.1:0") as (url, router):
        place, ended = locator(url), threading.Event()
        agents = [client(place) for _ in range(layout.agents)]
        displays = [client(place) for _ in range(layout.displays)]
        try:
            for number, display in enumerate(displays):
                for other in range(layout.shown):
                    agent = (number * layout.shown + other) % layout.agents
                    display.declare_subscriber(f"crowd/{agent}/out", _ignore)
            for number, session in enumerate(agents):
                session.declare_subscriber(f"crowd/{number}/in", _ignore)
            thread = threading.Thread(
                target=_send, args=(layout, agents, displays, ended), daemon=True
            )
            thread.start()
            time.sleep(1.0)
            before, begun = used(router), time.monotonic()
            time.sleep(seconds)
            spent = (used(router) - before) / (time.monotonic() - begun)
            ended.set()
            thread.join()
        finally:
            for session in (*agents, *displays):
                session.close()
    expected = flows(layout, cost)["a router: processors"]
    return {"computed (% of a processor)": 100 * expected, "measured": 100 * spent}


def _ignore(_sample: object) -> None:
    pass


def _send(
    layout: Layout, agents: list[Any], displays: list[Any], ended: threading.Event
) -> None:
    """Send at the rates of a fleet, in steps of 50 ms, until the end."""
    due: dict[tuple[str, int], float] = {}
    begun = time.monotonic()
    while not ended.wait(0.05):
        now = time.monotonic() - begun
        for kinds, senders, way in ((UP, agents, "out"), (DOWN, displays, "in")):
            for number, session in enumerate(senders):
                for kind, (rate, size) in kinds.items():
                    while due.get((kind, number), 0.0) < now:
                        due[kind, number] = due.get((kind, number), 0.0) + 1 / rate
                        for key in _keys(layout, number, way):
                            session.put(key, bytes(size - 90), express=True)


def _keys(layout: Layout, number: int, way: str) -> list[str]:
    if way == "out":
        return [f"crowd/{number}/out"]
    first = number * layout.shown
    return [
        f"crowd/{(first + other) % layout.agents}/in" for other in range(layout.shown)
    ]


def bench(rounds: int, quick: bool = False) -> list[Comparison]:
    """Measure the cost of messages, and compute large fleets from it."""
    del quick  # the shortest time that gives a figure
    seconds = 2.0
    small = [
        Contender(f"{count} sessions receive", passed_on(count, TICK_BYTES, seconds))
        for count in READERS
    ]
    large = [
        Contender(f"{count} sessions receive", passed_on(count, DATA_BYTES, seconds))
        for count in READERS[:1] + READERS[-1:]
    ]
    measured = compare(f"a router, {TICK_BYTES} bytes a message", small, rounds)
    cost = costs(measured)
    tried = Layout("tried", 20, 4, 10)
    check = Contender("a fleet of 20 agents", lambda: crowd(tried, cost, seconds))
    return [
        measured,
        compare(f"a router, {DATA_BYTES} bytes a message", large, rounds),
        compare("20 agents, 4 displays that show 10 each", [check], rounds),
        on_paper(cost),
    ]
