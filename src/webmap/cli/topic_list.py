"""The option ``--topics``: a list of topics, where a bridge cannot give one."""

import re
from collections.abc import Sequence
from typing import IO

import click

from webmap.base.errors import ConfigError
from webmap.ros.names import is_topic, split_type

LARGEST = 4 << 20
"""Characters of a list of topics; it may come through a pipe, which may have no end."""

_LINE = re.compile(
    r"(?:\*\s+)?(?P<topic>/\S*?):?\s+\[?(?P<type>[A-Za-z]\w*(?:/\w+){1,2})"
    r"(?:\s*,[^\]]*)?\]?(?:\s+\d+ (?:publish|subscrib)ers?)?"
)
_HEADINGS = re.compile(r"(?:Published|Subscribed) topics:")

EXPECTED = (
    "expected a topic and its type, as in /odom nav_msgs/Odometry, or what "
    "'ros2 topic list -t' or 'rostopic list -v' prints"
)


def parse_topics(text: str, source: str = "the list") -> dict[str, str]:
    """Return types by topic.

    Args:
        text: One topic on each line, with its type after it: ``/odom
            nav_msgs/Odometry``. The type may stand in brackets, as ``ros2 topic list
            -t`` and ``rostopic list -v`` print it. Empty lines and what follows a
            ``#`` are left out.
        source: Where it comes from, for errors.

    Raises:
        ConfigError: If a line is none of that, a topic has two types, or there is
            nothing at all.

    """
    topics: dict[str, str] = {}
    for number, line in enumerate(text.splitlines(), 1):
        line = line.partition("#")[0].strip()
        if not line or _HEADINGS.fullmatch(line):
            continue
        where = f"{source}, line {number}"
        match = _LINE.fullmatch(line)
        if match is None or not is_topic(match["topic"]):
            raise ConfigError(f"{where}: got {line[:80]!r}; {EXPECTED}")
        topic, type = match["topic"], match["type"]
        try:
            split_type(type)
        except ConfigError as error:
            raise ConfigError(f"{where}: {error}") from None
        if topics.setdefault(topic, type) != type:
            raise ConfigError(
                f"{where}: {topic} is {type} here and {topics[topic]} further up"
            )
    if not topics:
        raise ConfigError(f"{source} is empty; {EXPECTED}")
    return topics


def _read(
    ctx: click.Context, param: click.Parameter, value: IO[str] | None
) -> dict[str, str] | None:
    if value is None:
        return None
    name = getattr(value, "name", "the list")
    try:
        text = value.read(LARGEST + 1)
    except UnicodeDecodeError:
        raise click.BadParameter(f"{name} is not UTF-8", ctx, param) from None
    if len(text) > LARGEST:
        raise click.BadParameter(
            f"{name} has more than {LARGEST} characters, so it is no list of topics",
            ctx,
            param,
        )
    return parse_topics(text, name)


topics_option = click.option(
    "--topics",
    type=click.File(encoding="utf-8"),
    callback=_read,
    metavar="FILE",
    help="Take the topics and their types from FILE ('-' for standard input) where "
    "the bridge has no rosapi: /odom nav_msgs/Odometry, or what 'ros2 topic list -t' "
    "or 'rostopic list -v' prints.",
)


def one_bridge(urls: Sequence[str], topics: dict[str, str] | None) -> None:
    """Refuse a list of topics for more than one bridge.

    Raises:
        UsageError: If there are several bridges and a list.

    """
    if topics is not None and len(urls) > 1:
        raise click.UsageError(
            f"--topics lists what is behind one bridge, and {len(urls)} were given; "
            f"ask for each by itself"
        )
