"""The results of every source of robots: declarations, modules, plain data, texts.

    python tests/wires/wires_sources.py RESULT MODE

writes the results of each source to the file RESULT as JSON. Each source has a process
of its own, so that no source affects another.
"""

import contextlib
import io
import json
import os
import re
import shutil
import sys
import tempfile
import time
import traceback
from pathlib import Path

import wires_robots as robots
from PIL import Image
from wires_inputs import (
    FLEETS,
    GRAPHS,
    LISTS,
    NOWHERE,
    PLAIN,
    SHOWN,
    TREE,
    VIEWS,
    listed,
)
from wires_mistakes import CALLS, COMMAND_LINES, DATA, FLEET_FILES, made_wrong
from wires_recording import joined, recorded, sections
from wires_robot import Robot, transforms
from wires_tap import settled, unpacked
from wires_words import Names, lines, tree

import webmap
from webmap import cli
from webmap.console.console import Console
from webmap.gate import pipe
from webmap.gate.display.client import GateClient
from webmap.gate.specs import checked
from webmap.server import application

# Loaded here once, and not again in the process of each source.
import webmap.cli.run  # isort: skip
import webmap.cli.discover  # isort: skip
import webmap.fleet.search  # isort: skip
import webmap.fleet.view_robots  # isort: skip
import webmap.cli.run  # isort: skip
import webmap.fleet.fleet_file  # isort: skip
import webmap.cli.view  # isort: skip
import webmap.modules.robot  # isort: skip

AT_ONCE = 8
"""Processes that run at the same time; most of them wait."""

PATIENCE = 30.0
"""Seconds to wait for the recorded text."""

CALM = 2.5
"""Seconds without a change after which a text without a recording is complete."""

_LOG = re.compile(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d,\d+ ")


class Source:
    """The results of one source so far.

    Args:
        expected: The recorded text.

    """

    def __init__(self, expected):
        self.names = Names()
        self.names.call(os.getcwd(), "<folder>")
        self.parts = {}
        self.declared = {}
        self.consoles = []
        self._expected = expected

    def listen(self):
        """Record declarations to the gate, which is not started, and consoles."""
        declared, consoles = self.declared, self.consoles
        made = Console.__init__

        def declare(gate, spec):
            spec = checked(spec)
            declared[spec.id] = unpacked(pipe.pack(spec)[4:])

        def noted(console, *args, **options):
            made(console, *args, **options)
            consoles.append(console)

        GateClient.declare = declare
        GateClient.forget = lambda gate, robot: declared.pop(robot, None)
        GateClient.start = GateClient.stop = lambda gate: None
        Console.__init__ = noted

    def show(self, **ignored):
        """Start WebMap without its gate and its pages, and record the results."""
        webmap.start()
        try:
            text = settled(self._all, self._expected, PATIENCE, CALM)
        finally:
            webmap.stop()
        self.parts = sections(text)

    def _all(self):
        parts = dict(self.parts)
        for robot in robots.all_robots():
            spec = self.declared.get(robot.id, {})
            fields = self.names.plain({k: v for k, v in spec.items() if k != "type"})
            parts[f"{robot.name}: declared"] = tree(fields) or "nothing"
            parts[f"{robot.name}: modules"] = self._modules(robot)
            parts[f"{robot.name}: plain data"] = self._plain_data(robot)
        for console in self.consoles:
            parts["scenery"] = self._scenery(console)
        return joined(parts)

    def _modules(self, robot):
        texts = [
            lines(name, self._plain({"args": list(args), "options": options}))
            for name, args, options in robots.modules_of(robot)
        ]
        return "\n".join(texts)

    def _plain_data(self, robot):
        try:
            data = robots.plain_data(robot)
        except Exception as error:
            return self.names.text(f"{type(error).__name__}: {error}")
        # The model is long and is not tested here.
        model = json.dumps(data.pop("model", None))
        return tree({**self._plain(data), "model": f"{len(model)} characters"})

    def _scenery(self, console):
        kinds = robots.scenery_of(console)
        texts = [
            lines(kind, self._plain({str(n): each}))
            for kind, found in kinds.items()
            for n, each in enumerate(found)
        ]
        return re.sub(r"console-[0-9a-f]{16}", "console-*", "\n".join(texts))

    def _plain(self, value):
        """Return a value as JSON has it; a value unknown to JSON as text."""

        def as_text(value):
            return (
                f"<bridge {value.url}>"
                if isinstance(value, webmap.Bridge)
                else str(value)
            )

        return self.names.plain(json.loads(json.dumps(value, default=as_text)))


# Kinds of sources.


@contextlib.contextmanager
def site(source, graph, label="hall", frames=()):
    """Return the address of a bridge with the topics of a graph, and with frames."""
    with Robot(types=dict(GRAPHS[graph])) as robot:
        source.names.call(f"ws://127.0.0.1:{robot.port}", f"ws://{label}")
        source.names.call(f"127.0.0.1:{robot.port}", label)
        if frames:
            robot.repeated["/tf"] = transforms(frames)
        yield robot.url


def command(source, *arguments):
    """Run a command line and record its output, and its robots if it serves."""

    def serves(**options):
        note()
        source.show()

    def note(code=0):
        received = [
            line for line in out.getvalue().splitlines() if not _LOG.match(line)
        ]
        received += [f"exit code {code}"] if code else []
        text = source.names.text("\n".join(received))
        if text:
            source.parts["said"] = text

    application.run = webmap.run = serves
    out = io.StringIO()
    sys.argv = ["webmap", *arguments]
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
            cli.main()
        code = 0
    except SystemExit as end:
        code = end.code
    if not source.parts:
        note(code)


def fleet(source, name):
    shutil.copy(FLEETS / f"{name}.toml", "fleet.toml")
    command(source, "run", "fleet.toml")


def discovered(source, graph):
    """Print the found robots as a fleet file, and show the robots of the file."""
    Path("topics.list").write_text(listed(GRAPHS[graph]), "utf-8")
    given = ("discover", NOWHERE, "--topics", "topics.list")
    text, report = Source(""), Source("")
    command(text, *given, "--toml")
    command(report, *given)
    toml = text.parts["said"]
    printed = {"fleet file": toml, "report": report.parts["said"]}
    if "[[robots]]" in toml:
        Path("fleet.toml").write_text(toml, "utf-8")
        command(source, "run", "fleet.toml")
    source.parts = {**printed, **source.parts}


def listed_by_hand(source, name):
    Path("topics.list").write_text(LISTS[name], "utf-8")
    command(source, "discover", NOWHERE, "--topics", "topics.list", "--toml")


def viewed(source, name):
    graph, arguments = VIEWS[name]
    Path("by_hand.list").write_text(LISTS["by_hand"], "utf-8")
    frames = TREE if name == "framed" else ()
    with site(source, graph, frames=frames) as url:
        command(source, "view", url, *arguments, "--no-browser")


def shown(source, name):
    graph, arguments = SHOWN[name]
    with site(source, graph) as url:
        command(source, "view", url, *arguments, "--show")


def two_bridges(source, _):
    with (
        site(source, "nav2_bare") as url,
        Robot(types=dict(GRAPHS["rich_bare"])) as two,
    ):
        source.names.call(f"ws://127.0.0.1:{two.port}", "ws://yard")
        source.names.call(f"127.0.0.1:{two.port}", "yard")
        command(
            source, "view", url, two.url, "--robot", "2@Bob:/odom:/cmd_vel:/front/scan"
        )


def plain(source, name):
    bridges = (
        {"hall": robots.bridge_to("ws://hall:9090")} if "by_name" in name else None
    )
    robot = robots.of_plain_data(PLAIN[name], bridges)
    source.show()
    del robot


def programmed(source, name):
    """Show a robot of a program, and a second robot made from its plain data."""
    make = getattr(robots, name)
    bridge = robots.bridge_to("ws://robot:9090")
    if name == "with_everything":
        first = make(bridge, robots.bridge_to("ws://other:9090"), "First")
    else:
        first = make(bridge, "First")
    data = {**robots.plain_data(first), "name": "Second"}
    second = robots.of_plain_data(json.loads(json.dumps(data)))
    source.show()
    del first, second


def wrong_fleet(source, name):
    Path("fleet.toml").write_bytes(made_wrong(FLEET_FILES[name]))
    command(source, "check", "fleet.toml")


def wrong_command(source, name):
    Path("topics.list").write_text("/odom nav_msgs/Odometry\n/odom\n", "utf-8")
    Path("empty.list").write_text("\n", "utf-8")
    Path("good.list").write_text(LISTS["by_hand"], "utf-8")
    Path("fleet.toml").write_text("[bridges]\n", "utf-8")
    command(source, *COMMAND_LINES[name])


def wrong_data(source, name):
    refused(source, lambda: robots.of_plain_data(DATA[name]))


def wrong_call(source, name):
    refused(source, CALLS[name])


def refused(source, act):
    try:
        act()
        text = "it was taken"
    except Exception as error:
        text = f"{type(error).__name__}: {error}"
    source.parts["said"] = source.names.text(text)


def each(source, kind):
    """Record the errors for each wrong input of a kind."""
    wrong, inputs = WRONG[kind]
    for name in inputs:
        one = Source("")
        wrong(one, name)
        for robot in robots.all_robots():
            robots.gone(robot)
        source.parts[name] = one.parts["said"]


SOURCES = {
    **{
        f"fleet_{each.stem}": (fleet, each.stem)
        for each in sorted(FLEETS.glob("*.toml"))
    },
    **{f"discovered_{name}": (discovered, name) for name in GRAPHS},
    **{f"listed_{name}": (listed_by_hand, name) for name in LISTS},
    **{f"viewed_{name}": (viewed, name) for name in VIEWS},
    **{f"shown_{name}": (shown, name) for name in SHOWN},
    "viewed_two_bridges": (two_bridges, ""),
    **{f"plain_{name}": (plain, name) for name in PLAIN},
    **{f"programmed_{name}": (programmed, name) for name in robots.MAKERS},
}
"""The sources by the names of their recordings: a function and its argument."""

WRONG = {
    "wrong_fleet_files": (wrong_fleet, FLEET_FILES),
    "wrong_command_lines": (wrong_command, COMMAND_LINES),
    "wrong_plain_data": (wrong_data, DATA),
    "wrong_calls": (wrong_call, CALLS),
}
"""Wrong inputs by the names of their recordings: a function and its arguments."""


def played(kind, name, expected, folder):
    """Play one source in this process and return its results."""
    os.chdir(folder)
    source = Source(expected)
    source.listen()
    try:
        kind(source, name)
        return joined(source.parts)
    except BaseException:
        return f"it failed:\n{traceback.format_exc()}"


class Crowd:
    """Processes that play sources, a few at a time."""

    def __init__(self):
        self.texts = {}
        self._running = {}

    def play(self, key, kind, name, expected=""):
        """Play a source in a process of its own."""
        while len(self._running) >= AT_ONCE:
            self._wait()
        folder = tempfile.mkdtemp(prefix="wires-")
        result = Path(folder, "result.text")
        pid = os.fork()
        if pid == 0:
            make_files(folder)
            result.write_text(played(kind, name, expected, folder), "utf-8")
            os._exit(0)
        self._running[pid] = (key, result, time.monotonic())

    def end(self):
        """Wait for all processes."""
        while self._running:
            self._wait()

    def _wait(self):
        pid, _ = os.wait()
        key, result, began = self._running.pop(pid)
        took = time.monotonic() - began
        if took > 1.0:
            print(f"{key}: {took:.1f} s", flush=True)
        there = result.exists()
        self.texts[key] = result.read_text("utf-8") if there else "it failed: no result"
        shutil.rmtree(result.parent, ignore_errors=True)


def make_files(folder):
    """Write the files that fleet files name."""
    os.chdir(folder)
    for name, size in (("logo", (6, 2)), ("ann", (7, 5)), ("floor", (4, 4))):
        Image.new("RGB", size).save(f"{name}.png")
    Path("floor.yaml").write_text(
        "image: floor.png\nresolution: 1\norigin: [0, 0, 0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    Path("places.yaml").write_text("- {name: Dock, x: 1, y: 2}\n")
    Path("tiles/3/4").mkdir(parents=True)
    Image.new("RGB", (256, 256)).save("tiles/3/4/2.png")


def main() -> None:
    """Play all sources and write their results."""
    result, mode, *chosen = sys.argv[1:]
    crowd = Crowd()
    for key, (kind, name) in SOURCES.items():
        if not chosen or key in chosen:
            expected = recorded(key) if mode == "compare" else ""
            crowd.play(key, kind, name, expected)
    for key in WRONG:
        if not chosen or key in chosen:
            crowd.play(key, each, key)
    crowd.end()
    Path(result).write_text(json.dumps(crowd.texts), "utf-8")


if __name__ == "__main__":
    main()
