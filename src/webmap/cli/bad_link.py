"""A link that is as bad as the options of a command ask for, to train on it."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TypeVar
from urllib.parse import urlsplit

import click

from webmap.cli.options import Finite

if TYPE_CHECKING:
    from webmap.testing.fault_proxy import FaultProxy

F = TypeVar("F", bound=Callable[..., Any])

STALL_EVERY = 20.0
"""Seconds from the start of a stall to the start of the next one."""

LONGEST_DELAY = 5000.0
"""Greatest delay and greatest jitter, in milliseconds."""

LONGEST_STALL = 10.0
"""Greatest length of a stall, in seconds."""


def bad_link_options(command: F) -> F:
    """Add the options of a bad link to a command."""
    for option in (
        click.option(
            "--stall",
            type=Finite(0.0, LONGEST_STALL),
            default=0.0,
            metavar="SECONDS",
            help=f"Every {STALL_EVERY:g} s, let the link to the robots carry nothing "
            f"for this long; at most {LONGEST_STALL:g}.",
        ),
        click.option(
            "--jitter",
            type=Finite(0.0, LONGEST_DELAY),
            default=0.0,
            metavar="MS",
            help="Delay messages by up to this many milliseconds more, at random.",
        ),
        click.option(
            "--delay",
            type=Finite(0.0, LONGEST_DELAY),
            default=0.0,
            metavar="MS",
            help="Delay the link to the robots by this many milliseconds each way.",
        ),
    ):
        command = option(command)
    return command


@contextmanager
def bad_link(url: str, delay: float, jitter: float, stall: float) -> Iterator[str]:
    """Yield the address of a bad link to a server; its own address without faults.

    Args:
        url: Address of the server, on the loopback address.
        delay: Milliseconds by which every byte is delayed, each way.
        jitter: Most milliseconds that are added to the delay at random.
        stall: Seconds for which the link carries nothing, every ``STALL_EVERY``
            seconds.

    """
    port = urlsplit(url).port
    if port is None or not (delay or jitter or stall):
        yield url
        return
    from webmap.testing.fault_proxy import FaultProxy, Shape

    with FaultProxy(port) as proxy:
        proxy.shape(Shape(latency=delay / 1000, jitter=jitter / 1000))
        with _stalls(proxy, stall):
            yield f"ws://127.0.0.1:{proxy.port}"


@contextmanager
def _stalls(proxy: "FaultProxy", seconds: float) -> Iterator[None]:
    """Stall a link every ``STALL_EVERY`` seconds until the block ends."""
    if not seconds:
        yield
        return
    ended = threading.Event()

    def stall() -> None:
        while not ended.wait(STALL_EVERY - seconds):
            proxy.hold()
            ended.wait(seconds)
            proxy.release()

    thread = threading.Thread(target=stall, name="stalls")
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
