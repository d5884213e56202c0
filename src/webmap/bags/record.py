"""The recording of a bridge, from the question for its topics to the summary."""

import asyncio
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import click

from webmap.bags.bag_file import new_bag
from webmap.bags.listening import Listening
from webmap.bags.recorder import Recorder
from webmap.bags.types import Types
from webmap.base.counted import counted
from webmap.base.echo import echo
from webmap.base.errors import BridgeError, ConfigError, ServiceError
from webmap.ros.bridge import Bridge
from webmap.ros.names import split_type
from webmap.ros.rosbridge.server.dialect import DialectName
from webmap.ros.temporary_bridge import ask_topics
from webmap.sim.process import signals_set

EVERY = 10.0
"""Seconds between two progress lines if one cannot replace the other."""


def stated_types(
    names: Sequence[str], types: Sequence[str], topics: Mapping[str, str] | None
) -> dict[str, str] | None:
    """Return the types that a person stated, by topic; None if there are none.

    Args:
        names: The topics of ``--topic``.
        types: The types of ``--type``.
        topics: The topics and types of ``--topics``.

    Raises:
        UsageError: If there are not as many types as topics, or a type is invalid.

    """
    if not types:
        return None if topics is None else dict(topics)
    if len(types) != len(names):
        raise click.UsageError(
            f"--type needs one type for each --topic, in the same order: got "
            f"{len(types)} types for {len(names)} topics"
        )
    for name in types:
        split_type(name)
    return {**(topics or {}), **dict(zip(names, types, strict=True))}


async def record_to(
    url: str,
    out: Path | None,
    *,
    only: Sequence[str],
    stated: Mapping[str, str] | None,
    wait: float,
    duration: float | None,
) -> bool:
    """Record until a signal or for a time; return whether the file failed.

    Args:
        url: The bridge's address.
        out: The bag; None for a name with the time in it.
        only: The topics to record; all if empty.
        stated: Types by topic; None to ask the bridge for them.
        wait: Longest time to wait for an unreachable bridge, in seconds.
        duration: Longest duration of the recording, in seconds.

    Raises:
        BridgeError: If the bridge cannot be reached.
        ConfigError: If there is nothing to record, or nowhere to record to.
        OSError: If the bag cannot be created.

    """
    topics = await _topics(url, stated, wait)
    dialect = _dialect(topics)
    if out is None:
        out = Path(time.strftime("webmap-%Y-%m-%d-%H-%M-%S"))
    bag = new_bag(out, dialect)
    failure: OSError | None = None
    lasted = 0.0
    line = ProgressLine()
    recorder = Recorder(bag, Types(dialect), line.show_text)
    try:
        listening = Listening(
            Bridge(url), recorder, only=only, stated_types=stated, report=line.show_text
        )
        stop = asyncio.Event()

        def ready() -> None:
            echo(f"Recording {url} to {bag.path}")
            if listening.missing:
                line.show_text(f"Waiting for: {', '.join(listening.missing)}")

        with signals_set(stop):
            lasted = await listening.run(
                topics,
                stop,
                duration=duration,
                ready=ready,
                show=lambda seconds: line.show(seconds, recorder),
            )
    except OSError as error:
        failure = error
    finally:
        try:
            bag.close()
        except OSError as error:
            failure = failure or error
    if failure is not None:
        line.show_text(f"Error: {bag.path} cannot be written: {failure}")
    line.show_text(
        f"Recorded {counted(recorder.messages, 'message')} of "
        f"{counted(recorder.topics, 'topic')} in "
        f"{lasted:.1f} s to {bag.path}: {megabytes(recorder)}, "
        f"{recorder.dropped} dropped"
    )
    return failure is not None


class ProgressLine:
    """The progress of a recording, on one line of standard error that is rewritten.

    If standard error is not a terminal, it prints a line from time to time.
    """

    def __init__(self) -> None:
        self._terminal = sys.stderr.isatty()
        self._shown = 0
        self._next = EVERY

    def show(self, seconds: float, recorder: Recorder) -> None:
        """Show the progress.

        Args:
            seconds: Duration of the recording until now.
            recorder: Its counts are shown.

        """
        text = (
            f"{seconds:.0f} s, {recorder.messages} messages, {megabytes(recorder)}, "
            f"{recorder.dropped} dropped"
        )
        if self._terminal:
            click.echo(f"\r{text.ljust(self._shown)}", err=True, nl=False)
            self._shown = len(text)
        elif seconds >= self._next:
            self._next += EVERY
            echo(text, err=True)

    def show_text(self, text: str) -> None:
        """Print another text, on a line of its own."""
        if self._shown:
            echo("", err=True)
        echo(text, err=True)
        self._shown = 0


def megabytes(recorder: Recorder) -> str:
    """Return the recorded size, for people."""
    return f"{recorder.size / 1e6:.1f} MB"


async def _topics(
    url: str, stated: Mapping[str, str] | None, wait: float
) -> dict[str, str]:
    if stated is not None:
        return dict(stated)

    def waiting(why: str) -> None:
        echo(f"Waiting for the rosbridge at {url}: {why}", err=True)

    try:
        return await ask_topics(url, wait=wait, waiting=waiting)
    except ServiceError as error:
        raise BridgeError(
            f"{url} has no rosapi that lists its topics ({error}): name them with "
            f"--topic and --type, or list them with --topics"
        ) from None


def _dialect(topics: Mapping[str, str]) -> DialectName:
    slashes = {type_name.count("/") for type_name in topics.values()}
    if 2 in slashes:
        return "ros2"
    if 1 in slashes:
        return "ros1"
    raise ConfigError(
        "there are no topics: nothing can be recorded, and it is not known whether the "
        "bridge is of ROS 1 or ROS 2"
    )
