"""Writes the findings as a fleet file to keep and to correct."""

from collections.abc import Sequence
from typing import Any

from webmap.config.checks import KeyPath
from webmap.config.fleet import BridgeConfig, FleetConfig, MapConfig, dump
from webmap.config.robot import ModuleConfig, RobotConfig
from webmap.discovery.findings import Findings, FoundRobot, Layers
from webmap.discovery.layers import TRAIL, drawing, topic_of, with_layers

HEAD = """\
# A fleet file: webmap check FILE reads it, webmap run FILE shows it.
# The comment after each topic is the reason for the choice; correct a wrong topic.
"""

UNSURE = (
    "Set the command timeout, if you know it: the time in seconds after which the base",
    "stops by itself when commands end. Without it, the limits are 0.3 m/s and",
    "0.6 rad/s.",
    "twist.stops_within = 0.25",
)

REMARKED = {
    "odometry": ("odometry",),
    "velocity": ("twist", "topic"),
    "battery": ("battery",),
    "action": ("move", "action"),
    "goal": ("move", "topic"),
    "cancel": ("move", "cancel_topic"),
}
"""Roles with a remark about their rule, and the key of their topic."""


class Remarks:
    """The remarks about a fleet file's values."""

    def __init__(self) -> None:
        self.behind: dict[KeyPath, str] = {}
        self.below: dict[KeyPath, Sequence[str]] = {}


def fleet_toml(found: Sequence[tuple[str, str, Findings]]) -> str:
    """Return a fleet file.

    Args:
        found: The name, the address and the findings of each bridge. The names of all
            robots differ, as :func:`unique_names` makes them.

    """
    remarks = Remarks()
    maps: list[MapConfig] = []
    modules: list[ModuleConfig] = []
    robots: list[dict[str, Any]] = []
    for bridge, _, findings in found:
        _add_shared(bridge, findings, maps, modules, remarks)
        for robot in findings.robots:
            path = ("robots", len(robots))
            robots.append(_robot(robot, bridge, findings, path, remarks))
    bridges = {name: BridgeConfig(url=url) for name, url, _ in found}
    data = FleetConfig(bridges=bridges, map=maps, modules=modules).to_dict()
    data["bridges"] = {name: url for name, url, _ in found}
    data["robots"] = robots
    return dump(data, remarks=remarks.behind, below=remarks.below, head=HEAD)


def _add_shared(
    bridge: str,
    findings: Findings,
    maps: list[MapConfig],
    modules: list[ModuleConfig],
    remarks: Remarks,
) -> None:
    """Add the maps and map modules that robots share, each once for its bridge."""
    taken: set[str] = set()
    for robot in findings.robots:
        for layer in findings.layers.get(robot.namespace, Layers()).drawn:
            drawn = drawing(layer, robot.namespace, None)
            if not drawn.shared or layer.topic in taken:
                continue
            taken.add(layer.topic)
            if drawn.module == "OccupancyGrid":
                remarks.behind["map", len(maps), "topic"] = layer.rule
                grid = MapConfig(bridge=bridge, topic=layer.topic, **drawn.options)
                maps.append(grid)
            else:
                remarks.behind["modules", len(modules), "name"] = layer.rule
                args = [{"bridge": bridge}, layer.topic]
                options = dict(drawn.options)
                modules.append(
                    ModuleConfig(name=drawn.module, args=args, options=options)
                )


def _robot(
    robot: FoundRobot, bridge: str, findings: Findings, path: KeyPath, remarks: Remarks
) -> dict[str, Any]:
    """Return a robot as plain data, and note the rule of each of its topics."""
    config = robot.config(bridge)
    behind = remarks.behind
    for role in ("pose", *REMARKED):
        key = REMARKED.get(role, ("odometry",))
        guess = robot.first(role)  # type: ignore[arg-type]
        if guess is not None:
            behind[(*path, *key)] = guess.rule
    for index, guess in enumerate(robot.guesses.get("camera", ())):
        behind[(*path, "cameras", index)] = guess.rule
    pose = robot.first("initialpose")
    if pose is not None and config.initial_pose is not None:
        framed = ("topic",) if config.initial_pose.frame != "map" else ()
        behind[(*path, "initial_pose", *framed)] = pose.rule
    if config.twist is not None:
        remarks.below[(*path, "twist")] = UNSURE
    behind[(*path, "tf", "quiet")] = (
        "its pose comes from its frames"
        if robot.tf_alone
        else f"drawn in the frame {robot.map_frame}, if frames lead there"
    )
    config = _with_layers(config, robot, findings, path, remarks)
    left_out = findings.layers.get(robot.namespace, Layers()).left_out
    remarks.below[path] = (
        *(f"not drawn, beyond the limit for its kind: {o.topic}" for o in left_out),
        *robot.notes,
    )
    data = config.to_dict()
    # The file states these values even if they are the defaults.
    if "tf" in data:
        data["tf"] = {"quiet": not robot.tf_alone, **data["tf"]}
    if robot.action is not None:
        name, type = robot.action
        data["move"] = {"action": name, "action_type": type, **data["move"]}
    return data


def _with_layers(
    config: RobotConfig,
    robot: FoundRobot,
    findings: Findings,
    path: KeyPath,
    remarks: Remarks,
) -> RobotConfig:
    """Return a robot with all layers that ``webmap view`` draws of it."""
    layers = findings.layers.get(robot.namespace, Layers()).drawn
    config = config.with_part("modules", [TRAIL, *config.modules])
    config = with_layers(config, layers, robot.namespace)
    rules = {layer.topic: layer.rule for layer in layers}
    best = [guess for guess in (robot.first("scan"), robot.first("plan")) if guess]
    rules |= {guess.topic: guess.rule for guess in best}
    if config.scan:
        remarks.behind[(*path, "scan")] = "; ".join(rules[scan] for scan in config.scan)
    for index, module in enumerate(config.modules):
        rule = rules.get(topic_of(module))
        if rule:
            remarks.behind[(*path, "modules", index)] = rule
    return config
