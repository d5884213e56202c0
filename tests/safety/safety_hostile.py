"""An operator drives a good robot in Chromium, beside robots of hostile bridges.

::

    Chromium ── display ── gate ── witness robot
                   │         │
                   └─────────┴──── hostile bridges, each in a separate process

``with beside(bench, "safety_hostile_peers:pings"): ...`` adds one robot to the
page for each name. Its bridge is the peer of that name: an async function that gets
each connection and sends arbitrary data. ``drive(bench)`` drives the good robot and
measures.
"""

import contextlib
import itertools
import os
import time
from typing import NamedTuple

from safety_bench import pass_time
from safety_load import helper
from safety_waiting import Contention

from equipment.waiting import wait_for

SETTLE = 2.0
"""Seconds for which the peers send before the good robot is driven."""

DRIVE = 3.0
"""Seconds for which the good robot is driven."""

RECORD_TICKS = """{
    const Native = WebSocket;
    window.ticks = [];
    window.WebSocket = class extends Native {
        constructor(...about) {
            super(...about);
            this.addEventListener("message", (event) => {
                const text = event.data;
                if (typeof text === "string" && text.startsWith('{"op":"tick"')) {
                    window.ticks.push(performance.now());
                }
            });
        }
    };
}"""
"""Records the time at which each tick of the gate arrives at the page."""


READY = "document.querySelector('.webmap-teleop-title')?.textContent === 'Free'"
"""Whether the page shows that a key press drives the robot."""


class Driven(NamedTuple):
    """The measurements of the good robot; all times are in seconds."""

    refused: int
    """How often W was pressed and the robot did not move."""

    zeros: int
    """Zeros that the robot received while W was held."""

    velocity_gap: float
    """The longest time between two velocities at the robot while W was held."""

    tick_gap: float
    """The longest time between two ticks of the gate at the page."""

    driving_jitter: float
    """The longest delay of a thread by the machine while W was held."""

    stop: float
    """The time from the press of the space bar to the first zero at the robot."""

    moved_after: int
    """Nonzero velocities in the half second after that zero, with W still held."""

    stop_jitter: float
    """How long the machine delayed a thread from the space bar to that zero."""

    stolen: float
    """The most steal time of all processors in a quarter of a second."""

    waited: float
    """The waits for a processor in a quarter of a second, added over all processes."""


@contextlib.contextmanager
def beside(bench, *peers, shown=False):
    """Show one more robot for each peer; the peer is the bridge of that robot.

    Args:
        bench: The bench of the good robot.
        peers: ``module:function`` of each peer; the module is in this folder.
        shown: Whether the page shows all data of the peers.

    """
    with contextlib.ExitStack() as open:
        helpers = [
            open.enter_context(helper("safety_hostile_peers.py", peer))
            for peer in peers
        ]
        urls = [process.stdout.readline().strip() for process in helpers]
        os.environ["SAFETY_HOSTILE"] = " ".join(urls)
        os.environ["SAFETY_SHOWN"] = "1" * shown
        try:
            bench.close_page()
            bench.end_display()
            bench.start_display()
            bench.open_page(before=RECORD_TICKS)
            pass_time(SETTLE)
            bench.tab.wait(READY)  # first the page shows that it prepares input
            yield urls
        finally:
            del os.environ["SAFETY_HOSTILE"], os.environ["SAFETY_SHOWN"]
            bench.close_page()
            bench.end_display()


def drive(bench, seconds=DRIVE):
    """Hold W, then press STOP with W still held; return the measurements."""
    with Contention(bench.waiting()) as contention:
        driven = _drive(bench, seconds)
    return driven._replace(stolen=contention.stolen, waited=contention.waited)


def _drive(bench, seconds):
    refused = 0
    while True:
        try:
            bench.drive_off(within=3.0)
            break
        except AssertionError:
            refused += 1
            assert refused < 5, "W does not drive the good robot"
            bench.end_repeated_stop()
    begun = time.monotonic()
    pass_time(seconds)
    ended = time.monotonic()
    driven = [
        velocity for velocity in bench.robot.log.twists if begun <= velocity.at <= ended
    ]
    ticks = bench.tab.evaluate(
        f"ticks.filter((t) => t > performance.now() - {seconds * 1000})"
    )
    driving_jitter = bench.sentinel.worst(begun, ended)
    waiting = bench.waiting()
    pressed = time.monotonic()
    bench.space("keyDown")
    zero = wait_for(lambda: bench.robot.log.first_zero(pressed), "a zero")
    waited = waiting.seconds()
    pass_time(0.5)
    moved_after = len(bench.robot.log.moving_since(zero))
    bench.space("keyUp")
    bench.let_go()
    pass_time(0.5)
    bench.reset_stop()
    return Driven(
        refused=refused,
        zeros=sum(velocity.is_zero for velocity in driven),
        velocity_gap=gap([begun, *(velocity.at for velocity in driven), ended]),
        tick_gap=gap([tick / 1000 for tick in ticks]),
        driving_jitter=driving_jitter,
        stop=zero - pressed,
        moved_after=moved_after,
        stop_jitter=max(waited, bench.sentinel.stolen(pressed - 0.1, zero)),
        stolen=0.0,
        waited=0.0,
    )


def gap(times):
    """Return the longest gap between successive times; infinity if there is none."""
    return max(
        (after - before for before, after in itertools.pairwise(times)),
        default=float("inf"),
    )
