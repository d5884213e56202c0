"""``webmap user``: the people who may sign in, and where they have signed in."""

import sys
import time
from typing import Any, get_args

import click

from webmap.base.echo import echo
from webmap.base.roles import Role
from webmap.gate.locks import state_folder


def _password(from_input: bool, name: str) -> str:
    if from_input:
        return sys.stdin.readline().rstrip("\r\n")
    text: str = click.prompt(
        f"Password for {name}", hide_input=True, confirmation_prompt=True, err=True
    )
    return text


_from_input = click.option(
    "--password-stdin",
    is_flag=True,
    help="Read the password from a line of standard input, and do not ask for it.",
)

_ROLES = click.Choice(get_args(Role))

_robots = click.option(
    "--robots",
    metavar="PATTERN",
    multiple=True,
    help="A robot that NAME may drive, by name ('bay2/*') or tag ('tag:bay 2'); "
    "may be repeated. Everybody sees all robots, and can stop them.",
)


def _rights(user: Any) -> str:
    """Return what a user may do, in words."""
    every = user.role == "viewer" or "*" in user.robots
    return user.role if every else f"{user.role} of {', '.join(user.robots)}"


@click.group()
def user() -> None:
    """Add and remove the people who may sign in.

    While there are users, people sign in to every page of this machine's user with
    name and password, and the printed address has no token. Viewers look; operators
    drive too; admins align maps too. Everybody can press STOP. Changes take effect
    within a second, also on pages that are open.
    """


@user.command()
@click.argument("name")
@click.option(
    "--role",
    type=_ROLES,
    default="operator",
    show_default=True,
    help="What NAME may do.",
)
@_robots
@_from_input
def add(name: str, role: Any, robots: tuple[str, ...], password_stdin: bool) -> None:
    """Add a user, and ask for the password; without --robots for every robot."""
    from webmap.base.roles import checked_patterns
    from webmap.server.people import UserFile, checked_user

    checked_user(name)
    checked_patterns(robots)
    file = UserFile(state_folder())
    first = not file.read()
    file.add(name, role, _password(password_stdin, name), robots)
    echo(f"{name} may sign in as {_rights(file.read()[name])}")
    if first:
        echo("Start WebMap again: from now on people sign in with name and password")


@user.command()
@click.argument("name")
@_from_input
def passwd(name: str, password_stdin: bool) -> None:
    """Change the password of a user, who must then sign in again."""
    from webmap.server.people import UserFile

    file = UserFile(state_folder())
    file.known(file.read(), name)
    file.change(name, password=_password(password_stdin, name))
    echo(f"{name} has a new password")


@user.command()
@click.argument("name")
@click.argument("role", type=_ROLES)
@_robots
def role(name: str, role: Any, robots: tuple[str, ...]) -> None:
    """Change what a user may do, and with which robots.

    Without --robots these stay as they are; --robots '*' is every robot. What the user
    drives stops, and the user must sign in again.
    """
    from webmap.server.people import UserFile

    file = UserFile(state_folder())
    file.change(name, role=role, robots=robots)
    echo(f"{name} may sign in as {_rights(file.read()[name])}")


@user.command()
@click.argument("name")
def remove(name: str) -> None:
    """Remove a user, and stop what the user drives."""
    from webmap.server.people import UserFile

    UserFile(state_folder()).remove(name)
    echo(f"{name} may not sign in any more")


@user.command(name="list")
def list_users() -> None:
    """List the users with their roles."""
    from webmap.server.people import UserFile

    users = UserFile(state_folder()).read()
    for name in sorted(users):
        rights = _rights(users[name]).partition(" ")
        echo(f"{rights[0]:<9} {name}{' ' * bool(rights[2])}{rights[2]}")
    if not users:
        echo("There are no users: everybody with the printed address is an operator")


@user.command()
def sessions() -> None:
    """List the browsers that are signed in, the newest first."""
    from webmap.server.people import SESSION_S, SessionFiles

    for name, session in SessionFiles(state_folder()).all():
        age = time.time() - session.since
        if age < SESSION_S:
            since = time.strftime("%Y-%m-%d %H:%M", time.localtime(session.since))
            echo(f"{name}  {since}  {session.user}  from {session.address}")


@user.command()
@click.argument("session", metavar="SESSION|NAME")
def end(session: str) -> None:
    """End a session, or all sessions of a user: whoever drives there stops.

    SESSION is the first column of webmap user sessions.
    """
    from webmap.base.errors import ConfigError
    from webmap.base.text import counted
    from webmap.server.people import SessionFiles

    files = SessionFiles(state_folder())
    ended = [name for name, each in files.all() if session in (name, each.user)]
    if not ended:
        raise ConfigError(
            f"there is no session {session!r}, and no session of a user of this name; "
            "webmap user sessions lists them"
        )
    for name in ended:
        files.remove(name)
    echo(f"{counted(len(ended), 'session')} ended")
