"""What was found, as a table for a terminal."""

from webmap.discovery.found import ROLES, Findings, FoundRobot, Role

DIALECTS = {"ros1": "ROS 1", "ros2": "ROS 2", None: "a ROS that cannot be told"}

USED: tuple[Role, ...] = (
    "odometry",
    "velocity",
    "scan",
    "battery",
    "goal",
    "plan",
    "map",
)

OVERRULE = (
    "Wrong? Say it with --robot NAME:ODOM:CMD_VEL:SCAN, which takes the place of the "
    "robot of that name, or keep a file: webmap discover URL --toml > fleet.toml"
)


def report(url: str, findings: Findings) -> str:
    """Return all that was found behind a bridge, for people."""
    number = len(findings.robots)
    lines = [
        f"{url}: {DIALECTS[findings.dialect]}, "
        f"{number or 'no'} robot{'' if number == 1 else 's'}"
    ]
    for robot in findings.robots:
        lines += ["", *robot_table(robot)]
    lines += ["", *findings.notes]
    if findings.robots:
        lines.append(OVERRULE)
    return "\n".join(lines)


def robot_table(robot: FoundRobot) -> list[str]:
    """Return one robot's topics, one a line, with the rule that chose each."""
    where = f"in {robot.namespace}" if robot.namespace else "without a namespace"
    rows = [
        ("" if place else role, guess.topic, guess.type, guess.rule)
        for role in ROLES
        for place, guess in enumerate(robot.guesses.get(role, ()))
    ]
    widths = [max((len(row[column]) for row in rows), default=0) for column in (1, 2)]
    lines = [f"{robot.name} ({where})"]
    if robot.base_frame:
        lines.append(f"  {'frames':<9} {robot.base_frame} in {robot.root_frame}")
    lines += [
        f"  {role:<11} {topic:<{widths[0]}}  {type:<{widths[1]}}  {rule}"
        for role, topic, type, rule in rows
    ]
    missing = [role for role in ROLES if role not in robot.guesses]
    if missing:
        lines.append(f"  not found: {', '.join(missing)}")
    lines += [f"  note: {note}" for note in robot.notes]
    return lines


def in_one_line(robot: FoundRobot) -> str:
    """Return a robot with the topics that are used, for a log."""
    said = [f"{role} {robot.topic(role)}" for role in USED if robot.topic(role)]
    if robot.tf_alone and robot.base_frame:
        said.insert(0, f"frame {robot.base_frame}")
    return f"{robot.name}: {', '.join(said)}"
