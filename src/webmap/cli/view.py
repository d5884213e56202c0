"""``webmap view URL``: shows the robots behind a rosbridge."""

from typing import Any

import click

from webmap.base.echo import echo
from webmap.cli.options import (
    Finite,
    bridge_argument,
    incidents_option,
    one_bridge,
    stops_within_option,
    topics_option,
    web_options,
)


@click.command()
@bridge_argument("url", nargs=-1, required=True)
@click.option(
    "--robot",
    "robots",
    multiple=True,
    metavar="NAME:ODOM:CMD_VEL:SCAN",
    help="A robot and its topics; leave a topic empty if it has none. May be repeated. "
    "With several URLs, write the number of the robot's URL and @ before its name: "
    "2@bob:/odom:/cmd_vel:",
)
@click.option(
    "--only-given",
    "only_given",
    is_flag=True,
    help="Draw only the given topics of robots of --robot. Without it, the costmaps, "
    "clouds, paths and other topics in their namespaces are drawn too, as for robots "
    "that are found.",
)
@click.option(
    "--set",
    "settings",
    multiple=True,
    metavar="ROBOT.ROLE=TOPIC",
    help="Replace a guessed topic, or remove it with an empty value: "
    "robot_1.scan=/scan2, robot_1.battery= . The roles are those that webmap discover "
    "prints, and name, base and velocity_type. May be repeated.",
)
@click.option(
    "--show",
    is_flag=True,
    help="Print the robots, their topics in use and their drawn topics, with reasons, "
    "and end.",
)
@stops_within_option
@click.option(
    "--drive-without-proof",
    is_flag=True,
    help="Dangerous: drive through a foxglove_bridge older than version 3. Any of its "
    "clients can hold back every velocity and STOP, and WebMap may not notice at once.",
)
@click.option(
    "--floor",
    type=click.Path(exists=True, dir_okay=False),
    help="A floor plan in map_server's format (YAML), drawn under the robots.",
)
@click.option(
    "--discover",
    is_flag=True,
    help="Find robots although --robot is given; without --robot they are always "
    "found. A robot of --robot replaces the same robot found.",
)
@click.option(
    "--wait",
    type=Finite(0.0),
    default=10.0,
    show_default=True,
    help="Seconds to wait for a rosbridge that cannot be reached, before the page "
    "opens without its robots. They are added when the rosbridge answers.",
)
@topics_option
@incidents_option
@web_options
def view(
    url: tuple[str, ...],
    robots: tuple[str, ...],
    only_given: bool,
    settings: tuple[str, ...],
    show: bool,
    stops_within: float | None,
    drive_without_proof: bool,
    floor: str | None,
    discover: bool,
    wait: float,
    topics: dict[str, str] | None,
    no_incidents: bool,
    web: dict[str, Any],
) -> None:
    """See and drive the robots behind one bridge or several.

    URL is the address of a rosbridge: ws://robot:9090, of a Foxglove bridge:
    foxglove://robot:8765, of a router with agents: zenoh://host:7447, or of one of
    them: zenoh://host:7447/bay3. A robot with rmw_zenoh can be seen and not driven:
    zenoh-ros2://robot:7447. The robots behind a bridge are found by their topics, also
    those that appear later; --show lists the topics in use. Correct a wrong guess with
    --set, or list a robot's topics with --robot.

    \b
    webmap view ws://robot:9090
    webmap view foxglove://robot:8765
    webmap view ws://robot:9090 --set robot_1.scan=/robot_1/front/scan
    webmap view ws://robot:9090 --robot Bob:/odom:/cmd_vel:/scan
    """
    from pathlib import Path

    import webmap
    from webmap import console
    from webmap.fleet.overrides import Overrides, parse_setting
    from webmap.fleet.remote_robots import find_agents
    from webmap.fleet.robot_options import parse_robots
    from webmap.fleet.search import (
        FleetSearch,
        find_fleet,
        fleet_of_options,
    )
    from webmap.ros.names import is_agent_url

    one_bridge(url, topics)
    overrides = Overrides(
        [parse_setting(text) for text in settings],
        stops_within,
        drive_without_proof=drive_without_proof,
    )
    bridges = [webmap.Bridge(text) for text in url if not is_agent_url(text)]
    given = parse_robots(robots, bridges)
    plan = Path(floor) if floor else None
    if discover or topics is not None or not given:
        fleet = find_fleet(
            bridges,
            given,
            wait=wait,
            topics=topics,
            overrides=overrides,
        )
    else:
        overrides.check([robot.found.name for robot in given], all_known=True)
        given = overrides.apply_to_options(given)
        if show and not only_given:
            fleet = fleet_of_options(bridges, given, wait=wait)
        else:
            fleet = FleetSearch(given, overrides=overrides)
    if show:
        echo(fleet.table(grid=plan is None, only_given=only_given), lines=True)
        return
    configs = [overrides.config(bridge.url, robot) for bridge, robot in fleet.given]
    shown = [*bridges]
    agents = find_agents([text for text in url if is_agent_url(text)], shown)
    opened = console.open_console(
        shown,
        configs,
        floor=plan,
        place="\n".join(sorted(url)) if agents else None,
        incidents=not no_incidents,
    )
    for each in agents:
        each.show_on(opened)
    fleet.show(opened, grid=plan is None, only_given=only_given, topics=topics)
    webmap.run(**web)
