"""What was found, as a fleet file to keep and to correct."""

from collections.abc import Sequence

import msgspec

from webmap.discovery.found import Findings, FoundRobot, Role

HEAD = """\
# A fleet file: webmap check FILE reads it, webmap run FILE shows it.
# The words after each topic say why it was chosen; a wrong one is yours to change.
"""

UNSURE = """\
# Say within how many seconds the base stops by itself when velocity ceases, if you
# know it: without it the robot is driven at 0.3 m/s and 0.6 rad/s at the most.
# twist.stops_within = 0.25
"""

ALSO: tuple[Role, ...] = ("pose", "map", "costmap", "cloud")
"""Roles that stay out of a page; modules show most of them."""


def fleet_toml(found: Sequence[tuple[str, str, Findings]]) -> str:
    """Return a fleet file.

    Args:
        found: For each bridge its name, its address and what is behind it. The names
            of all robots differ, as :func:`unique_names` makes them.

    """
    parts = [HEAD, "[bridges]"]
    parts += [f"{_key(name)} = {_text(url)}" for name, url, _ in found]
    parts += _map(found)
    for bridge, _, findings in found:
        for robot in findings.robots:
            parts += ["", *_robot(robot, bridge)]
    return "\n".join(parts) + "\n"


def _robot(robot: FoundRobot, bridge: str) -> list[str]:
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
    scans = robot.guesses.get("scan", ())
    if scans:
        listed = ", ".join(_text(guess.topic) for guess in scans)
        why = "; ".join(guess.rule for guess in scans)
        lines.append(f"scan = [{listed}] # {why}")
    battery = robot.first("battery")
    if battery is not None:
        lines.append(f"battery = {_text(battery.topic)} # {battery.rule}")
    cameras = robot.guesses.get("camera", ())
    if cameras:
        rows = [f"  {_text(guess.topic)}, # {guess.rule}" for guess in cameras]
        lines += ["cameras = [", *rows, "]"]
    lines += _motion(robot)
    lines += _modules(robot, bridge)
    for role in ALSO:
        if where in robot.guesses.get(role, ()):
            continue
        lines += [
            f"# found too: {role} {guess.topic} ({guess.rule})"
            for guess in robot.guesses.get(role, ())
        ]
    return lines + [f"# {note}" for note in robot.notes]


def _frames(robot: FoundRobot) -> list[str]:
    options = robot.tf_options
    if robot.tf_alone:
        lines = ["tf.quiet = false # drawn where its frames have it"]
    else:
        lines = ["tf.quiet = true # drawn in the frame map, if frames lead there"]
    return lines + [
        f"tf.{key} = {_text(options[key])}"
        for key in ("namespace", "base_frame", "map_frame")
        if options.get(key)
    ]


def _map(found: Sequence[tuple[str, str, Findings]]) -> list[str]:
    """Return the first map that there is."""
    for bridge, _, findings in found:
        for robot in findings.robots:
            guess = robot.first("map")
            if guess is not None:
                return [
                    "",
                    "[map]",
                    f"bridge = {_text(bridge)}",
                    f"topic = {_text(guess.topic)} # {guess.rule}",
                ]
    return []


def _modules(robot: FoundRobot, bridge: str) -> list[str]:
    """Return what is shown of a robot besides."""
    wanted = [("Path", guess) for guess in robot.guesses.get("plan", ())[:1]]
    link = f"{{ bridge = {_text(bridge)} }}"
    lines = [
        f'  {{ name = "{module}", args = [{link}, {_text(guess.topic)}] }}, '
        f"# {guess.rule}"
        for module, guess in wanted
    ]
    return ["modules = [", *lines, "]"] if lines else []


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
    pose = robot.first("initialpose")
    if pose is not None:
        lines.append(f"initial_pose = {_text(pose.topic)} # {pose.rule}")
    return lines


def _text(value: str) -> str:
    # A JSON text without characters outside ASCII is a TOML text too.
    return msgspec.json.encode(value).decode()


def _key(name: str) -> str:
    plain = name.replace("-", "").replace("_", "")
    return name if plain.isascii() and plain.isalnum() else _text(name)
