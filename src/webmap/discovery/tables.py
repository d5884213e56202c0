"""The findings as a table for a terminal."""

from webmap.base.text import counted, escaped
from webmap.discovery.findings import ROLES, Findings, FoundRobot, Layers, TopicRole
from webmap.discovery.layers import drawing

DIALECTS = {"ros1": "ROS 1", "ros2": "ROS 2", None: "unknown ROS version"}

USED: tuple[TopicRole, ...] = (
    "odometry",
    "velocity",
    "scan",
    "battery",
    "goal",
    "plan",
    "map",
)

ONE: tuple[TopicRole, ...] = (
    "odometry",
    "pose",
    "velocity",
    "battery",
    "goal",
    "action",
    "cancel",
    "initialpose",
    "tf",
)
"""Roles with one topic in use, the best; all topics of other roles are drawn."""

OVERRULE = (
    "Wrong? Correct one topic with webmap view --set ROBOT.ROLE=TOPIC or a robot with "
    "--robot NAME:ODOM:CMD_VEL:SCAN, or write a fleet file: "
    "webmap discover URL --toml > fleet.toml"
)


OFF = "; off under Layers at first where several robots have one"
"""Follows the rule of a layer that the console may not show at first."""


def report(url: str, findings: Findings) -> str:
    """Return all findings of a bridge, for people."""
    number = len(findings.robots)
    robots = counted(number, "robot") if number else "no robots"
    lines = [f"{url}: {DIALECTS[findings.dialect]}, {robots}"]
    for robot in findings.robots:
        layers = findings.layers.get(robot.namespace, Layers())
        lines += ["", *robot_table(robot), *drawn_table(robot.namespace, layers)]
    lines += ["", *findings.notes]
    if findings.robots:
        lines.append(OVERRULE)
    return "\n".join(map(escaped, lines))


def robot_table(robot: FoundRobot) -> list[str]:
    """Return one robot's topics, one on each line, with their rules."""
    where = f"in {robot.namespace}" if robot.namespace else "without a namespace"
    rows = [
        (
            "" if place else role,
            guess.topic,
            guess.type,
            guess.rule + _use(robot, role, place),
        )
        for role in ROLES
        for place, guess in enumerate(robot.guesses.get(role, ()))
    ]
    widths = [max((len(row[column]) for row in rows), default=0) for column in (1, 2)]
    lines = [f"{robot.name} ({where})"]
    if robot.base_frame:
        lines.append(f"  {'frames':<11} {robot.base_frame} in {robot.root_frame}")
    lines += [
        f"  {role:<11} {topic:<{widths[0]}}  {type:<{widths[1]}}  {rule}"
        for role, topic, type, rule in rows
    ]
    missing = [role for role in ROLES if role not in robot.guesses]
    if robot.action is not None and "cancel" in missing:
        missing.remove("cancel")  # an action receives cancels itself
    if missing:
        lines.append(f"  not found: {', '.join(missing)}")
    lines += [f"  note: {note}" for note in robot.notes]
    return lines


def drawn_table(namespace: str, layers: Layers) -> list[str]:
    """Return the layers of a robot, one topic on each line, with module and rule.

    Args:
        namespace: The robot's namespace.
        layers: The layers drawn and left out.

    """
    rows = []
    for layer in layers.drawn:
        drawn = drawing(layer, namespace, None)
        off = OFF if drawn.options.get("palette") == "costmap" else ""
        rows.append((layer.topic, drawn.module, layer.rule + off))
    if not rows:
        return []
    widths = [max(len(row[column]) for row in rows) for column in (0, 1)]
    lines = ["  drawn by webmap view:"]
    lines += [
        f"    {topic:<{widths[0]}}  {module:<{widths[1]}}  {rule}"
        for topic, module, rule in rows
    ]
    if layers.left_out:
        listed = ", ".join(layer.topic for layer in layers.left_out)
        lines.append(f"  not drawn, beyond the limit for their kind: {listed}")
    return lines


def _use(robot: FoundRobot, role: TopicRole, place: int) -> str:
    """Return whether one of several topics of a role is used."""
    if role not in ONE or len(robot.guesses[role]) == 1:
        return ""
    if role == "pose" and robot.first("odometry") is not None:
        return ""  # a note explains it
    return ", not used" if place else ", used"


def summary_line(robot: FoundRobot) -> str:
    """Return a robot with the topics in use, for a log."""
    used = [f"{role} {robot.topic(role)}" for role in USED if robot.topic(role)]
    if robot.tf_alone and robot.base_frame:
        used.insert(0, f"frame {robot.base_frame}")
    return f"{robot.name}: {', '.join(used)}"
