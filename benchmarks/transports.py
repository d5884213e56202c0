"""The share of time in which a robot is driven over a lossy link, by transport.

This is a simulation, because a proxy cannot lose packets below TCP. The real classes of
the gate check ticks and commands; the page is a model of ``web/motion``. The link
delays and loses packets:

- TCP delivers in order. It sends a lost packet again when a later one was answered and
  a quarter of a round trip has passed (RACK, RFC 8985), or when Linux's timer ends.
- Two TCP connections: each message is sent over both, and the first copy counts.
- QUIC on one stream delivers in order too. It sends a lost packet again when a later
  one was answered and an eighth of a round trip has passed, or after three later ones
  (RFC 9002).
- A datagram, of UDP or of QUIC, is lost or arrives; the next one does not wait for it.

The model has no congestion windows, no queues, and no repetitions of a radio link.
"""

import heapq
import itertools
import random
from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from benchmarks.harness import Comparison, Contender, Figures, compare
from benchmarks.plot import Curve, Plot, save
from webmap.gate.commands import Refusal
from webmap.gate.rules.connections import PERIOD, Ticks
from webmap.gate.rules.motion import DeadMan

Transport = Literal["tcp", "two", "quic", "datagrams"]

NAMES: dict[Transport, str] = {
    "tcp": "TCP",
    "two": "TCP, two connections",
    "quic": "QUIC, one stream",
    "datagrams": "datagrams",
}

ROUND_TRIPS = (0.05, 0.15, 0.25, 0.3)
"""Round trips of the whole loop, in seconds."""

LOSSES = (0.0, 0.01, 0.02)
"""Shares of the packets that are lost, in each direction."""

BURST = 0.1
"""Mean seconds without a packet, for losses that come together."""

NEVER = float("inf")

MIN_RTO = 0.2
"""The least seconds that Linux adds to the round trip for the timer of TCP."""

SHOWN: tuple[Transport, ...] = ("tcp", "two", "datagrams")
"""The transports in the plot; QUIC on one stream is like TCP."""

LATE = 0.3
"""Seconds after which a tick or an answer is late; ``LATE`` in loop.js."""

PRESS_AGAIN = 1.0
"""Seconds in which an operator notices a stop, releases the key and presses it."""

COMMAND, TICK, RECEIVED, PAGE = range(4)


@dataclass(frozen=True, slots=True)
class Link:
    """A link that delays and loses packets, independently in each direction."""

    round_trip: float
    """The round trip in seconds, without losses."""

    loss: float = 0.0
    """The share of the packets that are lost."""

    burst: float = 0.0
    """The mean length of a burst of losses in seconds; 0: independent losses."""

    jitter: float = 0.01
    """The greatest random delay of a packet, in seconds."""


def losses(link: Link, rng: random.Random) -> Callable[[float], bool]:
    """Return whether a packet that is sent at a time is lost."""
    if not link.burst or not link.loss:
        return lambda _at: rng.random() < link.loss
    gap = link.burst * (1 - link.loss) / link.loss
    ends = [0.0]  # of a time without losses, then of a burst, and so on

    def lost(at: float) -> bool:
        while ends[-1] <= at:
            ends.append(ends[-1] + rng.expovariate(1 / gap))
            ends.append(ends[-1] + rng.expovariate(1 / link.burst))
        return bisect_right(ends, at) % 2 == 0

    return lost


def arrivals(
    sent: Sequence[float], link: Link, transport: Transport, rng: random.Random
) -> list[float]:
    """Return when each packet is delivered at the other end; ``NEVER`` if it is lost.

    Args:
        sent: When each packet is sent first, in order.
        link: The link.
        transport: The transport of the packets.
        rng: The source of losses and jitter.

    """
    lost, answer_lost = losses(link, rng), losses(link, rng)
    found = _arrivals(sent, link, transport, rng, lost, answer_lost)
    if transport == "two":
        other = _arrivals(sent, link, transport, rng, lost, answer_lost)
        found = [min(pair) for pair in zip(found, other, strict=True)]
    return found


def _arrivals(
    sent: Sequence[float],
    link: Link,
    transport: Transport,
    rng: random.Random,
    lost: Callable[[float], bool],
    answer_lost: Callable[[float], bool],
) -> list[float]:
    way = link.round_trip / 2
    came = [not lost(at) for at in sent]
    answered = [
        at
        for at, there in zip(sent, came, strict=True)
        if there and not answer_lost(at + way)
    ]
    found = []
    newest = 0.0
    for at, there in zip(sent, came, strict=True):
        if not there and transport == "datagrams":
            found.append(NEVER)
            continue
        tries, again = 0, at
        while not there:
            again = sent_again(again, tries, answered, link.round_trip, transport)
            tries, there = tries + 1, not lost(again)
        due = again + way + link.jitter * rng.random()
        newest = due if transport == "datagrams" else max(newest, due)
        found.append(newest)
    return found


def sent_again(
    at: float,
    tries: int,
    answered: Sequence[float],
    round_trip: float,
    transport: Transport,
) -> float:
    """Return when a packet that was sent at ``at`` and lost is sent again.

    Args:
        at: The time at which it was sent last.
        tries: How often it was sent again before.
        answered: The sending times of all packets that are answered.
        round_trip: Seconds.
        transport: The transport of the packets.

    """
    place = bisect_right(answered, at)
    first, third = (
        answered[place + more] + round_trip if place + more < len(answered) else NEVER
        for more in (0, 2)
    )
    if transport == "quic":
        return min(max(first, at + 1.125 * round_trip), third)
    timer = at + (round_trip + MIN_RTO) * 2.0**tries
    return min(max(first, at + 1.25 * round_trip), timer)


@dataclass(slots=True)
class Page:
    """The page of an operator, who holds a key and presses it again after a stop."""

    hold_from: float = PRESS_AGAIN
    tick: int = -1
    tick_at: float = 0.0
    acked: int = -1
    armed: bool = False
    late_at: float = 0.0

    def receive(self, tick: int, acked: int, armed: bool, now: float) -> None:
        """Process a tick of the gate."""
        if tick <= self.tick:
            return
        self.tick, self.tick_at, self.acked = tick, now, max(acked, self.acked)
        if self.armed and not armed:
            self._stop(now)
        self.armed = armed

    def step(self, oldest: float, now: float) -> bool:
        """Return whether the next command holds the key.

        Args:
            oldest: When the oldest command without an answer was sent.
            now: Seconds.

        """
        if now - self.tick_at > LATE or now - oldest > LATE:
            self.late_at = now
            self._stop(now)
        if now >= self.hold_from and not self.armed:
            self._stop(now)
        return now >= self.hold_from

    def _stop(self, now: float) -> None:
        if now >= self.hold_from:
            self.hold_from = now + PRESS_AGAIN


@dataclass(slots=True)
class Driven:
    """The motion that the gate allowed."""

    seconds: float = 0.0
    """How long the robot was driven."""

    stops: int = 0
    """How often it was stopped while the key was held."""


class Gate:
    """The gate's decisions about the commands of one page."""

    def __init__(self) -> None:
        self.driven = Driven()
        self.acked = -1
        self._ticks = Ticks(first=0)
        self._dead_man = DeadMan()
        self._since: float | None = None

    @property
    def armed(self) -> bool:
        """Whether a held key would move the robot."""
        return self._dead_man.armed

    def issue(self, now: float) -> int:
        """Return a new tick."""
        self._look(now)
        tick = self._ticks.issue(now)
        assert tick is not None
        return tick

    def end(self, now: float) -> Driven:
        """Return the motion that was allowed until now."""
        self._look(now)
        self._end(now)
        return self.driven

    def take(self, number: int, tick: int, held: bool, now: float) -> None:
        """Process a command."""
        self._look(now)
        try:
            self._ticks.check(tick, now)
        except Refusal:
            self._stop(now)
            self._dead_man.disarm()
            return
        self.acked = number
        self._dead_man.accept(not held, tick, now)
        if not held or not self._dead_man.armed:
            self._end(now)
        elif self._since is None:
            self._since = now

    def _look(self, now: float) -> None:
        if self._since is not None and self._dead_man.expired(now):
            self._stop(self._dead_man.expires_at)
            self._dead_man.disarm()

    def _stop(self, now: float) -> None:
        if self._since is not None:
            self.driven.stops += 1
        self._end(now)

    def _end(self, now: float) -> None:
        if self._since is not None:
            self.driven.seconds += now - self._since
            self._since = None


def drive(link: Link, transport: Transport, seconds: float, seed: int) -> Driven:
    """Return how long a robot is driven while its operator wants to drive.

    Args:
        link: The link between gate and page.
        transport: The transport of ticks and commands.
        seconds: How long the operator wants to drive.
        seed: The seed of losses, jitter and the phase of the page.

    """
    rng = random.Random(seed)
    count = int(seconds / PERIOD)
    # A nanosecond more than the period, so that no tick is too early by rounding.
    issued = [number * (PERIOD + 1e-9) for number in range(count)]
    phase = rng.random() * PERIOD
    steps = [phase + number * PERIOD * 1.0001 for number in range(count)]
    # Between two commands, the link carries one more packet: the answer to a sample.
    up = sorted(steps + [at + PERIOD / 2 for at in steps])
    down_at = arrivals(issued, link, transport, rng)
    up_at = arrivals(up, link, transport, rng)[::2]
    gate, page = Gate(), Page()
    sent: list[tuple[int, int, bool]] = [(-1, -1, False)] * count
    commands: list[tuple[int, bool]] = [(-1, False)] * count
    for now, kind, number in merged(up_at, issued, down_at, steps):
        if now > seconds:
            break
        if kind == TICK:
            sent[number] = (gate.issue(now), gate.acked, gate.armed)
        elif kind == RECEIVED:
            page.receive(*sent[number], now)
        elif kind == PAGE:
            oldest = steps[page.acked + 1] if page.acked + 1 < number else now
            commands[number] = (page.tick, page.step(oldest, now))
        elif number > gate.acked:
            gate.take(number, *commands[number], now)
    return gate.end(seconds)


def merged(*kinds: Sequence[float]) -> Iterator[tuple[float, int, int]]:
    """Return time, kind and number of all events that happen, in the order of time."""
    return heapq.merge(
        *(
            sorted((at, kind, number) for number, at in enumerate(times) if at < NEVER)
            for kind, times in enumerate(kinds)
        )
    )


def scenes() -> dict[str, Link]:
    """Return the links, by name."""
    found = {
        f"{1000 * trip:.0f} ms, {100 * loss:.0f} %": Link(trip, loss)
        for trip, loss in itertools.product(ROUND_TRIPS, LOSSES)
    }
    for trip in ROUND_TRIPS[:2]:
        name = f"{1000 * trip:.0f} ms, 2 % in bursts of {1000 * BURST:.0f} ms"
        found[name] = Link(trip, 0.02, burst=BURST)
    return found


def over(transport: Transport, seconds: float) -> Callable[[], Figures]:
    """Return a run with one transport; each run uses the next seed."""
    seeds = itertools.count(1)

    def run() -> Figures:
        seed = next(seeds)
        figures = {}
        for name, link in scenes().items():
            driven = drive(link, transport, seconds, seed)
            figures[f"{name}: driven (%)"] = 100 * driven.seconds / seconds
            figures[f"{name}: stops (a minute)"] = 60 * driven.stops / seconds
        return figures

    return run


def bench(rounds: int, quick: bool = False) -> list[Comparison]:
    """Compare the transports on all links."""
    seconds = 60.0 if quick else 600.0
    contenders = [
        Contender(name, over(transport, seconds)) for transport, name in NAMES.items()
    ]
    save("transports", plot(seconds))
    return [compare("driving over a link with losses", contenders, rounds)]


def plot(seconds: float) -> Plot:
    """Return a plot of the share of driven time against the round trip."""
    curves = []
    trips = [0.05 + 0.025 * number for number in range(11)]
    cases: list[tuple[float, Transport]] = [
        (0.0, "tcp"),
        *itertools.product(LOSSES[1:], SHOWN),
    ]
    for loss, transport in cases:
        name = f"{100 * loss:.0f} % lost" + (f", {NAMES[transport]}" if loss else "")
        points = [
            (
                1000 * trip,
                100 * drive(Link(trip, loss), transport, seconds, 1).seconds / seconds,
            )
            for trip in trips
        ]
        curves.append(Curve(name, points))
    x, y = "round trip of the link (ms)", "driven (% of the time)"
    return Plot("Driving over a link with losses", x, y, curves)
