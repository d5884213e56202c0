"""``webmap discover URL``: lists the robots behind a rosbridge, with reasons."""

import asyncio
import sys

import click

from webmap.base.echo import echo
from webmap.cli.options import (
    bridge_argument,
    one_bridge,
    topics_option,
    verbose_option,
    wait_option,
    waiting_for,
)


@click.command(
    short_help="List the robots behind a bridge, their topics, and the reasons."
)
@bridge_argument("url", nargs=-1, required=True)
@click.option("--toml", is_flag=True, help="Print a fleet file.")
@wait_option
@topics_option
@verbose_option
def discover(
    url: tuple[str, ...], toml: bool, wait: float, topics: dict[str, str] | None
) -> None:
    """List the robots behind bridges, their topics, and the rule for each topic.

    URL is the address of a rosbridge, of a Foxglove bridge: foxglove://robot:8765, or
    of a robot with rmw_zenoh: zenoh-ros2://robot:7447.
    The address of a router is that of all its agents: zenoh://host:7447. Nothing is
    moved or changed. The exit code is 1 if no robot is found.

    \b
    webmap discover ws://robot:9090
    webmap discover ws://robot:9090 --toml > fleet.toml
    ros2 topic list -t | webmap discover ws://robot:9090 --topics -
    """
    from webmap.agents.announcements import agents_behind
    from webmap.base.errors import BridgeClosed
    from webmap.discovery.fleet_toml import fleet_toml
    from webmap.discovery.tables import report
    from webmap.fleet.search import search_bridges
    from webmap.ros.names import is_agent_url

    one_bridge(url, topics)
    if toml and any(is_agent_url(text) for text in url):
        raise click.UsageError(
            "the fleet file of an agent has the address of its rosbridge: run webmap "
            "discover --toml on the robot with that address, such as "
            "ws://localhost:9090"
        )
    urls: list[str] = []
    for text in url:
        try:
            urls += agents_behind(text, wait=wait, waiting=waiting_for(text))
        except BridgeClosed as error:
            echo(f"{error}.", err=True)
    found = asyncio.run(search_bridges(urls, wait=wait, topics=topics))
    if toml:
        text = fleet_toml([(one.label, one.url, one.findings) for one in found])
        click.echo(text, nl=False)  # not shortened, and escaped as TOML requires
    for one in found:
        if one.trouble is not None or one.twin:
            echo(one.why, err=True)
        elif not toml:
            echo(report(one.url, one.findings), lines=True)
        elif not one.findings.robots:
            echo(report(one.url, one.findings), err=True, lines=True)
    if not any(one.findings.robots for one in found):
        sys.exit(1)
