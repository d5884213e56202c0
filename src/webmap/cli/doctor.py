"""``webmap doctor URL``: shows what prevents driving."""

import asyncio
import sys

import click

from webmap.base.echo import echo
from webmap.cli.options import (
    Finite,
    bridge_argument,
    one_bridge,
    topics_option,
    verbose_option,
    wait_option,
    waiting_for,
)


@click.command(short_help="Diagnose what prevents driving the robots of a bridge.")
@bridge_argument("url", nargs=-1, required=True, metavar="URL...|FILE.toml")
@click.option(
    "--robot",
    "robots",
    multiple=True,
    metavar="NAME:ODOM:CMD_VEL:SCAN",
    help="Check this robot with these topics, as for webmap view, and no robots that "
    "are only found. May be repeated.",
)
@click.option(
    "--set",
    "settings",
    multiple=True,
    metavar="ROBOT.ROLE=TOPIC",
    help="Replace a guessed topic, or remove it, as for webmap view. May be repeated.",
)
@click.option(
    "--seconds",
    type=Finite(0.5, 60.0),
    default=3.0,
    show_default=True,
    help="How long to listen to odometry and scans.",
)
@wait_option
@click.option(
    "--ask-parameters",
    is_flag=True,
    help="Read a parameter of rosbridge through rosapi too, which shows whether a slow "
    "service call blocks its connection.",
)
@click.option(
    "--try-call",
    is_flag=True,
    help="Offer a service that takes a second and call it, to find out whether a slow "
    "service call blocks its connection.",
)
@topics_option
@click.option(
    "--stop-test",
    metavar="ROBOT",
    help="Instead, test whether this robot stops by itself: it MOVES slowly. The exit "
    "code is 0 if it stops, 1 if not, 2 without a result.",
)
@click.option("--yes", is_flag=True, help="With --stop-test: move without a question.")
@verbose_option
def doctor(
    url: tuple[str, ...],
    robots: tuple[str, ...],
    settings: tuple[str, ...],
    seconds: float,
    wait: float,
    ask_parameters: bool,
    try_call: bool,
    topics: dict[str, str] | None,
    stop_test: str | None,
    yes: bool,
) -> None:
    """Diagnose a bridge and the robots behind it, and suggest what to do.

    URL is the address of a rosbridge, of a Foxglove bridge: foxglove://robot:8765, or
    of a robot with rmw_zenoh: zenoh-ros2://robot:7447.
    The address of an agent is that of its rosbridge: zenoh://host:7447/bay3; that of a
    router is that of all its agents.

    The robots are found by their topics, unless --robot, --set or a fleet file in
    place of URL configures them.

    Nothing is moved, published or changed, unless --stop-test is given. The exit code
    is 1 if anything is wrong.
    """
    from webmap.ros.names import is_agent_url

    if stop_test is not None and (robots or settings):
        raise click.UsageError(
            "--stop-test needs a robot's name from webmap discover; leave out --robot "
            "and --set"
        )
    if stop_test is not None and any(is_agent_url(text) for text in url):
        raise click.UsageError(
            "the gate of an agent alone moves its robots: press Run stop test on the "
            "robot's card of webmap view"
        )
    if stop_test is not None:
        from webmap.discovery.doctor.stop_test import find_out

        sys.exit(find_out(url, stop_test, wait=wait, yes=yes))
    from webmap.agents.announcements import agents_behind, one_agent
    from webmap.base.errors import BridgeClosed
    from webmap.discovery.doctor import BridgeFacts, is_ready, judge
    from webmap.discovery.doctor.measure import observe
    from webmap.discovery.doctor.verdict import report
    from webmap.fleet.doctor import Configured, bridges_of

    if len(url) == 1 and (robots or settings) and is_agent_url(url[0]):
        url = (one_agent(url[0], wait=wait, waiting=waiting_for(url[0])),)
    bridges: list[tuple[str, Configured, str]] = []
    for text, configured in bridges_of(url, robots, settings):
        try:
            found = agents_behind(text, wait=wait, waiting=waiting_for(text))
            bridges += [(each, configured, "") for each in found]
        except BridgeClosed as error:
            bridges.append((text, configured, error.why or str(error)))
    one_bridge([address for address, _, _ in bridges], topics)
    ready = True
    for number, (address, configured, trouble) in enumerate(bridges):
        seen = BridgeFacts(address, trouble=trouble)
        if not trouble:
            seen = asyncio.run(
                observe(
                    address,
                    wait=wait,
                    seconds=seconds,
                    ask_parameters=ask_parameters,
                    try_call=try_call,
                    topics=topics,
                    configured=configured,
                    waiting=waiting_for(f"the bridge at {address}"),
                )
            )
        findings = judge(seen)
        ready &= is_ready(findings)
        echo("\n" * bool(number) + report(address, findings), lines=True)
    sys.exit(0 if ready else 1)
