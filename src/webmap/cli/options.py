"""Options of several commands."""

import asyncio
import functools
import inspect
import logging
import math
import re
from collections.abc import Callable, Sequence
from typing import IO, Any, TypeVar, cast

import click

from webmap.base.echo import echo
from webmap.base.errors import ConfigError
from webmap.base.logs import set_up_logging
from webmap.ros.names import is_topic, split_type

F = TypeVar("F", bound=Callable[..., Any])

PORT = click.IntRange(0, 65535)


class Finite(click.FloatRange):
    """Type of an option: a finite number within a range."""

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> Any:
        """Return the number; NaN and infinity end the command with an error."""
        number = super().convert(value, param, ctx)
        if not math.isfinite(number):
            self.fail(f"{value} is not a finite number.", param, ctx)
        return number


def _recognise(_ctx: click.Context, _param: click.Parameter, value: Any) -> Any:
    from webmap.ros.foxglove.address import recognised

    given: list[str] = [value] if isinstance(value, str) else list(value)
    found = asyncio.run(recognised(given))
    for before, now in zip(given, found, strict=True):
        if now != before:
            echo(f"{before} is a Foxglove bridge: its address is {now}", err=True)
    return found[0] if isinstance(value, str) else tuple(found)


bridge_argument = functools.partial(click.argument, callback=_recognise)
"""The address of a bridge, as an argument; that of a Foxglove bridge may be ``ws://``."""

wait_option = click.option(
    "--wait",
    type=Finite(0.0),
    default=5.0,
    show_default=True,
    help="Seconds to wait for a rosbridge that cannot be reached.",
)
"""How long a command waits for a rosbridge, as an option."""


def together(*options: Callable[[Any], Any]) -> Callable[[F], F]:
    """Return a decorator that adds several options; help lists the last one first."""

    def add(command: F) -> F:
        return functools.reduce(lambda made, option: option(made), options, command)

    return add


tls_options = together(
    click.option(
        "--tls-key",
        type=click.Path(dir_okay=False),
        default="",
        help="The file with the private key of --tls-cert.",
    ),
    click.option(
        "--tls-cert",
        type=click.Path(dir_okay=False),
        default="",
        help="Use TLS with the certificate in this file.",
    ),
    click.option(
        "--tls",
        is_flag=True,
        help="Use TLS with a certificate that WebMap makes.",
    ),
)
"""The options of a server with TLS: its own certificate, or a given one."""


proxy_options = together(
    click.option(
        "--embed-driving",
        is_flag=True,
        help="Let people drive there, not only look and stop.",
    ),
    click.option(
        "--embed-from",
        multiple=True,
        metavar="ORIGIN",
        help="Let pages of ORIGIN show WebMap in a frame; may be repeated.",
    ),
    click.option(
        "--sign-out-url",
        default="",
        metavar="URL",
        help="Where people sign out at the proxy.",
    ),
    click.option(
        "--proxy-role",
        "proxy_roles",
        multiple=True,
        metavar="GROUP=ROLE[:ROBOTS]",
        help="What a group of the proxy may do, as 'drivers=operator:bay2/*' or "
        "'*=viewer'; may be repeated, and a person's first one counts.",
    ),
    click.option(
        "--proxy-groups-header",
        default="",
        metavar="NAME",
        help="The header with the person's groups, with commas in between.",
    ),
    click.option(
        "--proxy-user-header",
        default="",
        metavar="NAME",
        help="The header in which a trusted proxy names who has signed in there.",
    ),
    click.option(
        "--trusted-proxy",
        "trusted_proxies",
        multiple=True,
        metavar="ADDRESS",
        help="A proxy whose headers count; may be repeated.",
    ),
    click.option(
        "--public-url",
        default="",
        metavar="URL",
        help="The address of WebMap for browsers, behind a proxy.",
    ),
)
"""The options of a server behind a proxy, or in a frame of another page."""


def web_options(command: F) -> F:
    """Add the options of the web interface: its address, TLS and the browser.

    The command gets them as ``web``, which are arguments of :func:`webmap.run`: all
    options that are no parameters of its own.
    """
    own = inspect.signature(command).parameters

    @functools.wraps(command)
    def with_web(*, no_browser: bool, **given: Any) -> Any:
        mine = {name: given.pop(name) for name in own.keys() & given.keys()}
        return command(**mine, web=given | {"open_browser": not no_browser})

    return cast(F, _web_options(with_web))


stops_within_option = click.option(
    "--stops-within",
    type=Finite(0.0, min_open=True),
    help="Command timeout: seconds after which every base stops by itself when "
    "commands end. Without it, the limits are 0.3 m/s and 0.6 rad/s.",
)
"""The command timeout of the bases, as an option."""

incidents_option = click.option(
    "--no-incidents",
    is_flag=True,
    help="Do not record the last ten minutes of the robots, which are otherwise kept "
    "after a STOP or an alarm.",
)
"""Whether incidents are recorded, as an option."""


def _set_up_log(ctx: click.Context, param: click.Parameter, value: bool) -> None:
    set_up_logging(logging.DEBUG if value else logging.INFO)


verbose_option = click.option(
    "--verbose",
    "-v",
    is_flag=True,
    expose_value=False,
    callback=_set_up_log,
    help="Log more, to standard error.",
)


_web_options = together(
    click.option(
        "--insecure-lan",
        is_flag=True,
        help="Allow a --host that other machines reach, without TLS.",
    ),
    proxy_options,
    tls_options,
    click.option(
        "--host",
        default="127.0.0.1",
        show_default=True,
        help="Address that the web interface listens on.",
    ),
    click.option(
        "--port",
        "-p",
        type=PORT,
        default=8080,
        show_default=True,
        help="Port of the web interface; 0 lets the system choose.",
    ),
    click.option(
        "--no-browser", is_flag=True, help="Do not open the page in a browser."
    ),
    verbose_option,
)


def simulator_options(*, robots: str, dialect: str) -> Callable[[F], F]:
    """Return a decorator that adds the number of robots, their start and the ROS.

    Args:
        robots: Help text of ``--robots``, which is None if the option is not given.
        dialect: Help text of ``--dialect``.

    """
    return together(
        click.option(
            "--dialect",
            type=click.Choice(["ros1", "ros2"]),
            default="ros1",
            show_default=True,
            help=dialect,
        ),
        click.option(
            "--seed",
            type=int,
            default=1,
            show_default=True,
            help="Random seed of the start poses.",
        ),
        click.option("--robots", "-n", type=click.IntRange(1, 500), help=robots),
    )


# The option --topics.

LARGEST = 4 << 20
"""Most characters of a list of topics; input from a pipe may never end."""


def waiting_for(url: str) -> Callable[[str], None]:
    """Return a function that prints why a command waits for an address."""

    def waiting(why: str) -> None:
        echo(f"Waiting for {url}: {why}", err=True)

    return waiting


_LINE = re.compile(
    r"(?:\*\s+)?(?P<topic>/\S*?):?\s+\[?(?P<type>[A-Za-z]\w*(?:/\w+){1,2})"
    r"(?:\s*,[^\]]*)?\]?(?:\s+\d+ (?:publish|subscrib)ers?)?"
)
_HEADINGS = re.compile(r"(?:Published|Subscribed) topics:")

EXPECTED = (
    "expected a topic and its type, as in /odom nav_msgs/Odometry, or the output of "
    "'ros2 topic list -t' or 'rostopic list -v'"
)


def parse_topics(text: str, source: str = "the list") -> dict[str, str]:
    """Return types by topic.

    Args:
        text: One topic on each line, followed by its type: ``/odom
            nav_msgs/Odometry``. The type may be in brackets, as ``ros2 topic list
            -t`` and ``rostopic list -v`` print it. Empty lines and text after a
            ``#`` are ignored.
        source: Where the list comes from, for errors.

    Raises:
        ConfigError: If a line has another form, a topic has two types, or the list
            is empty.

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
                f"{where}: {topic} has the type {type} here and {topics[topic]} above"
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
            f"{name} has more than {LARGEST} characters, expected a list of topics",
            ctx,
            param,
        )
    return parse_topics(text, name)


topics_option = click.option(
    "--topics",
    type=click.File(encoding="utf-8"),
    callback=_read,
    metavar="FILE",
    help="Read the topics and their types from FILE ('-' for standard input) if the "
    "bridge has no rosapi: /odom nav_msgs/Odometry, or the output of 'ros2 topic list "
    "-t' or 'rostopic list -v'.",
)


def one_bridge(urls: Sequence[str], topics: dict[str, str] | None) -> None:
    """Refuse a list of topics for several bridges.

    Raises:
        UsageError: If there are several bridges and a list.

    """
    if topics is not None and len(urls) > 1:
        raise click.UsageError(
            f"--topics lists the topics of one bridge, got {len(urls)} bridges; run "
            f"the command once for each bridge"
        )
