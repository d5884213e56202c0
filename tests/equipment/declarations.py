"""Declarations of robots to the gate, written as one table of values.

A test names the few values that matter to it; here each gets its place in a part.
"""

from msgspec import structs

from webmap.config.motion import InitialPoseConfig, MoveConfig, TwistConfig
from webmap.gate.protocol import RobotSpec

BASE = {
    "twist_topic": "topic",
    "twist_type": "type",
    "stops_within": "stops_within",
    "v_max": "v_max",
    "w_max": "w_max",
    "z_max": "z_max",
    "rx_max": "rx_max",
    "ry_max": "ry_max",
    "a_max": "a_max",
    "check_every": "check_every",
    "holonomic": "holonomic",
    "drive_without_proof": "drive_without_proof",
    "stop_hooks": "stop_hooks",
}
NAVIGATION = {
    "goal_topic": "topic",
    "goal_frame": "frame",
    "cancel_topic": "cancel_topic",
    "action": "action",
    "action_type": "action_type",
    "on_operator_loss": "on_operator_loss",
}
POSE = {"pose_topic": "topic", "pose_covariance": "covariance", "goal_frame": "frame"}


def declared(**values) -> RobotSpec:
    """Return a declaration; ``bridge_url`` is the bridge of every part.

    ``goal_url`` is another bridge of goals. A part without a topic is left out, and its
    other values with it.
    """
    url = values.pop("bridge_url", "ws://robot:9090")
    goal_url = values.pop("goal_url", None) or url
    parts = {"scan_assist": values.pop("assist", None)}
    base, move, pose = (
        {key: values[name] for name, key in names.items() if name in values}
        for names in (BASE, NAVIGATION, POSE)
    )
    if base.get("topic"):
        base["stop_hooks"] = list(base.get("stop_hooks", ()))
        parts["twist"] = TwistConfig(**base, bridge=url)
    if move.get("topic") or move.get("action"):
        move["topic"] = move.get("topic") or ""
        parts["move"] = MoveConfig(**move, bridge=goal_url)
    if pose.get("topic"):
        parts["initial_pose"] = InitialPoseConfig(**pose, bridge=goal_url)
    others = {
        name: value
        for name, value in values.items()
        if name not in {*BASE, *NAVIGATION, *POSE}
    }
    return RobotSpec(**{"id": "r1", "name": "Bob", **parts, **others})


def values_of(spec: RobotSpec) -> dict[str, object]:
    """Return the values of a declaration, for another one with some of them changed."""
    values = structs.asdict(spec)
    for part, names in (("twist", BASE), ("move", NAVIGATION), ("initial_pose", POSE)):
        config = values.pop(part)
        if config is not None:
            values |= {name: getattr(config, key) for name, key in names.items()}
    assist = values.pop("scan_assist")
    values |= {"bridge_url": spec.bridge_url, "assist": assist}
    other = spec.goal_url != spec.bridge_url
    return {**values, "goal_url": spec.goal_url} if other else values


def changed(spec: RobotSpec, **values) -> RobotSpec:
    """Return a declaration with some values changed."""
    return declared(**{**values_of(spec), **values})
