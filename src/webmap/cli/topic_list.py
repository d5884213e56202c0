"""The option ``--topics``: a list of topics, where a bridge cannot give one."""

from collections.abc import Sequence
from typing import IO

import click


def _read(
    ctx: click.Context, param: click.Parameter, value: IO[str] | None
) -> dict[str, str] | None:
    from webmap.discovery.topic_list import parse_topics

    if value is None:
        return None
    return parse_topics(value.read(), getattr(value, "name", "the list"))


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
