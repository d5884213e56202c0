"""``webmap agent``: the gate beside a robot; ``webmap router``: where agents meet."""

import sys

import click

from webmap.base.echo import echo
from webmap.cli.options import (
    Finite,
    bridge_argument,
    stops_within_option,
    tls_options,
    verbose_option,
)


@click.command()
@bridge_argument("robot", metavar="URL|FILE")
@click.option(
    "--router",
    required=True,
    metavar="ADDRESS",
    help="The Zenoh router to connect to: zenoh://HOST:7447, or with TLS "
    "zenohs://HOST:7447.",
)
@click.option(
    "--name", required=True, help="The name of this agent; letters, digits, - and _."
)
@click.option(
    "--robot",
    "robots",
    multiple=True,
    metavar="NAME:ODOM:CMD_VEL:SCAN",
    help="A robot and its topics, as in webmap view. May be repeated.",
)
@click.option(
    "--set",
    "settings",
    multiple=True,
    metavar="ROBOT.ROLE=TOPIC",
    help="Replace a guessed topic, as in webmap view. May be repeated.",
)
@stops_within_option
@click.option(
    "--drive-without-proof",
    is_flag=True,
    help="Dangerous: drive through a foxglove_bridge older than version 3, as in "
    "webmap view.",
)
@click.option(
    "--operators",
    metavar="USER,USER",
    help="Users of the router whose pages may drive; pages of all others may only look "
    "and press STOP. Without it, everybody whom the router lets in may drive.",
)
@click.option(
    "--rate",
    "rates",
    multiple=True,
    metavar="TOPIC=HZ",
    help="At most so many messages of a topic per second, for a slow link. May be "
    "repeated.",
)
@click.option(
    "--beams",
    "beams",
    multiple=True,
    metavar="TOPIC=NUMBER",
    help="At most so many beams of a scan, for a slow link; of neighbouring beams the "
    "shortest counts. May be repeated.",
)
@click.option(
    "--wait",
    type=Finite(0.0),
    default=10.0,
    show_default=True,
    help="Seconds to wait for a rosbridge that cannot be reached.",
)
@click.option(
    "--systemd",
    is_flag=True,
    help="Print a systemd unit that runs this command, and end.",
)
@click.option("--with-parent", is_flag=True, hidden=True)
@verbose_option
def agent(
    robot: str,
    router: str,
    name: str,
    robots: tuple[str, ...],
    settings: tuple[str, ...],
    stops_within: float | None,
    drive_without_proof: bool,
    operators: str | None,
    rates: tuple[str, ...],
    beams: tuple[str, ...],
    wait: float,
    systemd: bool,
    with_parent: bool,
) -> None:
    """Hold the gate of a robot, on the robot's computer or beside it.

    URL is the address of the robot's rosbridge or Foxglove bridge; FILE is a fleet file
    with one bridge, for limits, buttons and an alignment. The agent connects to a
    router and listens on nothing. Displays reach its robots with webmap view
    zenoh://HOST:7447. If the network or the display fails, the agent stops the robot.

    \b
    webmap agent ws://localhost:9090 --router zenohs://fleet.example:7447 --name bay3
    """
    import threading
    from pathlib import Path

    from webmap.agents.address import checked_name
    from webmap.core.motion import RobotMotion
    from webmap.fleet.agent import (
        Agent,
        parse_beams,
        parse_operators,
        parse_rates,
        run_agent,
        systemd_unit,
    )
    from webmap.fleet.agent_robots import robots_behind, robots_in_file
    from webmap.fleet.overrides import Overrides, parse_setting

    if systemd:
        echo(systemd_unit(name, sys.argv[1:]), lines=True)
        return
    RobotMotion.agent = checked_name(name)
    overrides = Overrides(
        [parse_setting(text) for text in settings],
        stops_within,
        drive_without_proof=drive_without_proof,
    )
    throttles, most = parse_rates(rates), parse_beams(beams)
    roles = None if operators is None else parse_operators(operators)
    if "://" in robot:
        held = robots_behind(robot, robots, overrides, wait)
    elif robots or settings or stops_within is not None or drive_without_proof:
        raise click.UsageError("the fleet file has all settings of its robots")
    else:
        held = robots_in_file(Path(robot))
    made = Agent(name, router, held, roles=roles, throttles=throttles, beams=most)
    ended = threading.Event()

    def ready() -> None:
        echo(f"The agent {name} is ready at {made.address}")
        sys.stdout.flush()
        if with_parent:
            threading.Thread(target=wait_for_parent, daemon=True).start()

    def wait_for_parent() -> None:
        sys.stdin.read()
        ended.set()

    run_agent(made, ready, ended)


@click.command()
@click.option(
    "--listen",
    help="What to listen on: tcp/HOST:PORT, or with TLS tls/HOST:PORT; port 0 is a "
    "free one. The default is tcp/127.0.0.1:7447, and with --tls tls/0.0.0.0:7447.",
)
@click.option(
    "--users",
    type=click.Path(exists=True, dir_okay=False),
    help="A TOML file of users, who may be agents or reach agents. Without it, "
    "everybody who can connect may do everything.",
)
@tls_options
@click.option(
    "--insecure-lan",
    is_flag=True,
    help="Allow other machines to connect without TLS or without users.",
)
@click.option("--with-parent", is_flag=True, hidden=True)
@verbose_option
def router(
    listen: str | None,
    users: str | None,
    tls: bool,
    tls_cert: str,
    tls_key: str,
    insecure_lan: bool,
    with_parent: bool,
) -> None:
    """Run a router for agents and displays, for those who have none.

    Agents and displays both connect to it: webmap agent --router, webmap view zenoh://.
    It is Zenoh's router; any other Zenoh router serves as well.
    """
    import threading
    from pathlib import Path

    from webmap.agents.address import url
    from webmap.agents.router import open_router, read_users
    from webmap.base.tls import tls_files
    from webmap.gate.locks import state_folder

    known = None if users is None else read_users(Path(users))
    listen = listen or ("tls/0.0.0.0:7447" if tls else "tcp/127.0.0.1:7447")
    host = listen.partition("/")[2].rpartition(":")[0]
    find = tls_files(host, state_folder() / "tls", tls, tls_cert, tls_key)
    certificate = find and find()
    session, place = open_router(
        listen, known, files=certificate, insecure_lan=insecure_lan
    )
    try:
        echo(f"The router is ready at {url(place)}")
        if certificate is not None and certificate.authority is not None:
            echo(
                "Agents and displays trust this router when WEBMAP_ROUTER_CA names a "
                f"copy of {certificate.authority}; its SHA-256 fingerprint is "
                f"{certificate.fingerprint}",
                err=True,
            )
        sys.stdout.flush()
        if with_parent:
            sys.stdin.read()
        else:
            threading.Event().wait()
    finally:
        session.close()  # type: ignore[no-untyped-call]
