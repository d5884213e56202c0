"""The option ``--topics``: a list of topics, where a bridge cannot give one."""

from collections.abc import Sequence
from typing import IO

import click

LARGEST = 4 << 20
"""Characters of a list of topics; it may come through a pipe, which may have no end."""


def _read(
    ctx: click.Context, param: click.Parameter, value: IO[str] | None
) -> dict[str, str] | None:
    from webmap.discovery.topic_list import parse_topics

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
