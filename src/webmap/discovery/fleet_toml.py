"""What was found, as a fleet file to keep and to correct."""

from collections.abc import Sequence
from typing import Any

import msgspec

from webmap.discovery.drawing import Drawing, drawing
from webmap.discovery.found import Findings, FoundRobot
from webmap.discovery.layers import FoundLayer
from webmap.outside_text import escaped

HEAD = """\
# A fleet file: webmap check FILE reads it, webmap run FILE shows it.
# The words after each topic say why it was chosen; a wrong one is yours to change.
"""

UNSURE = """\
# Say within how many seconds the base stops by itself when velocity ceases, if you
# know it: without it the robot is driven at 0.3 m/s and 0.6 rad/s at the most.
# twist.stops_within = 0.25
"""


def fleet_toml(found: Sequence[tuple[str, str, Findings]]) -> str:
    """Return a fleet file.

    Args:
        found: For each bridge its name, its address and what is behind it. The names
            of all robots differ, as :func:`unique_names` makes them.

    """
    parts = ["[bridges]"]
    parts += [f"{_key(name)} = {_text(url)}" for name, url, _ in found]
    parts += _maps(found)
    for bridge, _, findings in found:
        for robot in findings.robots:
            parts += ["", *_robot(robot, bridge, findings)]
    # Comments hold names of topics, too; a line break in one would begin a table.
    return "\n".join([HEAD, *map(escaped, parts)]) + "\n"


def _robot(robot: FoundRobot, bridge: str, findings: Findings) -> list[str]:
    lines = [
        "[[robots]]",
        f"name = {_text(robot.name)}",
        f"bridge = {_text(bridge)}",
    ]
    where = robot.first("odometry") or robot.first("pose")
    if where is not None:
        lines.append(
            f"odometry = {{ topic = {_text(where.topic)}, type = {_text(where.type)} }}"
            f" # {where.rule}"
        )
    if robot.tf_namespace is not None:
        lines += _frames(robot)
    lines += _scans(robot, findings)
    battery = robot.first("battery")
    if battery is not None:
        lines.append(f"battery = {_text(battery.topic)} # {battery.rule}")
    cameras = robot.guesses.get("camera", ())
    if cameras:
        rows = [f"  {_text(guess.topic)}, # {guess.rule}" for guess in cameras]
        lines += ["cameras = [", *rows, "]"]
    lines += _motion(robot)
    lines += _modules(robot, bridge, findings)
    lines += [
        f"# not drawn, since there are enough of its kind: {layer.topic}"
        for layer in findings.left_out.get(robot.namespace, ())
    ]
    return lines + [f"# {note}" for note in robot.notes]


def _frames(robot: FoundRobot) -> list[str]:
    options = robot.tf_options
    if robot.tf_alone:
        lines = ["tf.quiet = false # drawn where its frames have it"]
    else:
        frame = robot.map_frame
        lines = [f"tf.quiet = true # drawn in the frame {frame}, if frames lead there"]
    return lines + [
        f"tf.{key} = {_text(options[key])}"
        for key in ("namespace", "base_frame", "map_frame")
        if options.get(key)
    ]


def _maps(found: Sequence[tuple[str, str, Findings]]) -> list[str]:
    """Return the maps that robots share, each once for its bridge."""
    lines: list[str] = []
    for bridge, _, findings in found:
        named: dict[str, FoundLayer] = {}
        for robot in findings.robots:
            for layer in findings.layers.get(robot.namespace, ()):
                if drawing(layer, robot.namespace, None).shared:
                    named.setdefault(layer.topic, layer)
        for topic, layer in named.items():
            lines += [
                "",
                "[[map]]",
                f"bridge = {_text(bridge)}",
                f"topic = {_text(topic)} # {layer.rule}",
            ]
            if layer.kind == "grid":
                lines.append('palette = "costmap"')
    return lines


def _scans(robot: FoundRobot, findings: Findings) -> list[str]:
    """Return the scans that are drawn: the best, and what else there is."""
    layers = findings.layers.get(robot.namespace, ())
    best = robot.first("scan")
    topics = {} if best is None else {best.topic: best.rule}
    for layer in layers:
        if layer.kind == "scan":
            topics.setdefault(layer.topic, layer.rule)
    if not topics:
        return []
    listed = ", ".join(_text(topic) for topic in topics)
    return [f"scan = [{listed}] # {'; '.join(topics.values())}"]


def _modules(robot: FoundRobot, bridge: str, findings: Findings) -> list[str]:
    """Return what is shown of a robot besides, as ``webmap view`` does."""
    frames = None
    if robot.tf_namespace is not None:
        frames = {"map_frame": "map", **robot.tf_options}
    link = f"{{ bridge = {_text(bridge)} }}"
    where = robot.topic("odometry") or robot.topic("pose")
    plan = robot.first("plan")
    lines = ['  { name = "Trail", options = { length = 10.0 } },']
    if plan is not None:
        path = FoundLayer("path", plan.topic, plan.type, plan.rule)
        lines.append(_module(drawing(path, "", None), path, link))
    for layer in findings.layers.get(robot.namespace, ()):
        drawn = drawing(layer, robot.namespace, frames)
        if drawn.shared or layer.kind == "scan":
            continue
        if layer.topic not in (where, robot.topic("plan")):
            lines.append(_module(drawn, layer, link))
    return ["modules = [", *lines, "]"]


def _module(drawn: Drawing, layer: FoundLayer, link: str) -> str:
    name = "OnMaps" if drawn.of_maps else drawn.module
    of = f"{_text(drawn.module)}, " if drawn.of_maps else ""
    # What is empty is so unless it is said.
    said = {key: value for key, value in drawn.options.items() if value != ""}
    options = ", ".join(f"{key} = {_value(value)}" for key, value in said.items())
    behind = f", options = {{ {options} }}" if options else ""
    args = f"[{of}{link}, {_text(layer.topic)}]"
    return f'  {{ name = "{name}", args = {args}{behind} }}, # {layer.rule}'


def _motion(robot: FoundRobot) -> list[str]:
    lines = []
    velocity, goal = robot.first("velocity"), robot.first("goal")
    if velocity is not None:
        lines += [
            f"twist.topic = {_text(velocity.topic)} # {velocity.rule}",
            f"twist.type = {_text(velocity.type)}",
            *UNSURE.splitlines(),
        ]
    if robot.action is not None and (guess := robot.first("action")) is not None:
        name, type = robot.action
        lines.append(f"move.action = {_text(name)} # {guess.rule}")
        lines.append(f"move.action_type = {_text(type)}")
    if goal is not None:
        lines.append(f"move.topic = {_text(goal.topic)} # {goal.rule}")
        cancel = robot.first("cancel")
        if cancel is not None:
            lines.append(f"move.cancel_topic = {_text(cancel.topic)} # {cancel.rule}")
    if (goal is not None or robot.action is not None) and robot.map_frame != "map":
        lines.append(f"move.frame = {_text(robot.map_frame)}")
    pose = robot.first("initialpose")
    moves = goal is not None or robot.action is not None
    if pose is not None and (moves or robot.map_frame == "map"):
        lines.append(f"initial_pose = {_text(pose.topic)} # {pose.rule}")
    elif pose is not None:
        lines.append(f"initial_pose.topic = {_text(pose.topic)} # {pose.rule}")
        lines.append(f"initial_pose.frame = {_text(robot.map_frame)}")
    return lines


def _value(value: Any) -> str:
    return _text(value) if isinstance(value, str) else str(value).lower()


def _text(value: str) -> str:
    # A JSON text is a TOML text too, but for the characters that are not printable.
    text = msgspec.json.encode(value).decode()
    return "".join(c if c.isprintable() else f"\\U{ord(c):08x}" for c in text)


def _key(name: str) -> str:
    plain = name.replace("-", "").replace("_", "")
    return name if plain.isascii() and plain.isalnum() else _text(name)
