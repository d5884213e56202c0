"""The command line; ``COMMANDS`` names the file of each command.

A command reads its options and calls another folder; robots and fleets are made in
``webmap.fleet``. ``options`` has the options of several commands. Open ``view`` first.
"""

import os
import signal
import sys
from types import FrameType

import click

import webmap
from webmap.base.echo import echo
from webmap.base.errors import ConfigError, WebMapError

COMMANDS = {
    "agent": "webmap.cli.agent:agent",
    "check": "webmap.cli.run:check",
    "demo": "webmap.cli.demo:demo",
    "discover": "webmap.cli.discover:discover",
    "doctor": "webmap.cli.doctor:doctor",
    "log": "webmap.cli.log:log",
    "play": "webmap.cli.play:play",
    "record": "webmap.cli.record:record",
    "router": "webmap.cli.agent:router",
    "run": "webmap.cli.run:run",
    "sim": "webmap.cli.sim:sim",
    "user": "webmap.cli.user:user",
    "view": "webmap.cli.view:view",
}

ANSWERING = ("check", "discover", "doctor")
"""Commands whose exit status is an answer; an interrupted one has no answer."""

INTERRUPTED = 128 + signal.SIGINT


class LazyGroup(click.Group):
    """A group whose commands are loaded when they are used."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names in the order of the help, without loading a command."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import the module of a command; None if there is no such command."""
        home = COMMANDS.get(cmd_name)
        if home is None:
            return None
        module, _, name = home.partition(":")
        __import__(module)
        command: click.Command = getattr(sys.modules[module], name)
        return command


@click.group(
    cls=LazyGroup,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 88},
)
@click.version_option(webmap.__version__, "-V", "--version", prog_name="webmap")
def cli() -> None:
    """See and drive robots that run ROS, on a map in the browser.

    Start with webmap demo, which needs no robot. For a robot with a rosbridge, use
    webmap view ws://robot:9090.

    The commands demo, view, play, run, sim, agent and router print one line when they
    are ready, log to standard error, and end on Ctrl+C.
    """


def _named_command() -> str | None:
    return next((text for text in sys.argv[1:] if text in COMMANDS), None)


def _interrupt(number: int, frame: FrameType | None) -> None:
    """Handle SIGTERM like Ctrl+C, until a server installs handlers for both."""
    raise KeyboardInterrupt


def main() -> None:
    """Run the command line; report an error in one sentence, with exit code 2."""
    signal.signal(signal.SIGTERM, _interrupt)
    # A shell makes processes that it starts in the background ignore SIGINT.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    # WebMap multiplies no large matrices. The library that does this for numpy starts a
    # thread for each processor, and each of them waits actively for 0.1 s.
    if _named_command() != "run":  # a user's program may need these threads
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        cli(standalone_mode=False)
    except click.exceptions.Exit as done:
        sys.exit(done.exit_code)
    except click.Abort:
        sys.exit(INTERRUPTED if _named_command() in ANSWERING else 0)
    except click.UsageError as error:
        path = error.ctx.command_path if error.ctx else "webmap"
        message = error.format_message().rstrip(".").replace("\n", " ")
        echo(f"Error: {message} (see '{path} --help').", err=True)
        sys.exit(2)
    except ConfigError as error:  # a fleet file has one line for each mistake
        echo(f"Error: {error}", err=True, lines=True)
        sys.exit(2)
    except (WebMapError, OSError) as error:
        echo(f"Error: {error}", err=True)
        sys.exit(2)
