"""``webmap router``: Zenoh's router, closed by default."""

import sys

import click

from webmap.base.echo import echo
from webmap.cli.options import verbose_option


@click.command()
@click.option(
    "--listen",
    default="tcp/127.0.0.1:7447",
    show_default=True,
    help="What to listen on: tcp/HOST:PORT, or with TLS tls/HOST:PORT; port 0 is a "
    "free one.",
)
@click.option(
    "--users",
    type=click.Path(exists=True, dir_okay=False),
    help="A TOML file of users, who may be agents or reach agents. Without it, "
    "everybody who can connect may do everything.",
)
@click.option(
    "--certificate",
    type=click.Path(exists=True, dir_okay=False),
    help="The file with the router's certificate, for TLS.",
)
@click.option(
    "--key",
    type=click.Path(exists=True, dir_okay=False),
    help="The file with the router's private key, for TLS.",
)
@click.option(
    "--insecure-lan",
    is_flag=True,
    help="Allow other machines to connect without TLS or without users.",
)
@click.option("--with-parent", is_flag=True, hidden=True)
@verbose_option
def router(
    listen: str,
    users: str | None,
    certificate: str | None,
    key: str | None,
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
    from webmap.agents.router import read_users, router_settings
    from webmap.agents.router_access import zenoh_config
    from webmap.base.errors import ConfigError

    known = None if users is None else read_users(Path(users))
    settings = router_settings(
        listen,
        known,
        certificate=certificate or "",
        key=key or "",
        insecure_lan=insecure_lan,
    )
    config = zenoh_config(**settings)
    import zenoh

    try:
        session = zenoh.open(config)
    except zenoh.ZError as error:
        text = str(error).partition(" at /")[0]
        raise ConfigError(f"the router cannot listen on {listen}: {text}") from None
    try:
        (place,) = settings["listen"]["endpoints"]
        echo(f"The router is ready at {url(place)}")
        sys.stdout.flush()
        if with_parent:
            sys.stdin.read()
        else:
            threading.Event().wait()
    finally:
        session.close()  # type: ignore[no-untyped-call]
        if known is not None:
            Path(settings["transport"]["auth"]["usrpwd"]["dictionary_file"]).unlink()
