"""Robots as plain data: what JSON or TOML can hold, and back."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, TypeVar

import msgspec

from webmap.core.alignment import numbers
from webmap.core.goal_topics import COVARIANCE, NAVIGATE_TO_POSE
from webmap.core.plain_assist import ScanAssistData, assist_data
from webmap.core.plain_svg import element_from_dict, element_to_dict
from webmap.errors import ConfigError
from webmap.ros.bridge import Bridge

if TYPE_CHECKING:
    from webmap.core.robot import Robot

NONE = {"none": True}
"""What stands for ``None`` among the arguments of a module."""

R = TypeVar("R", bound="Robot")
D = TypeVar("D", bound=msgspec.Struct)


class OdometryData(msgspec.Struct, forbid_unknown_fields=True, omit_defaults=True):
    """The arguments of ``set_odometry_topic``."""

    bridge: str
    topic: str
    throttle: int = 100
    type: str | None = None


class TwistData(msgspec.Struct, forbid_unknown_fields=True, omit_defaults=True):
    """The arguments of ``set_twist_topic``."""

    bridge: str
    topic: str
    type: str | None = None
    stops_within: float | None = None
    v_max: float | None = None
    w_max: float | None = None
    z_max: float | None = None
    rx_max: float | None = None
    ry_max: float | None = None
    a_max: float | None = None
    holonomic: bool = False
    stop_hooks: list[dict[str, str]] = []


class TfData(msgspec.Struct, forbid_unknown_fields=True, omit_defaults=True):
    """The arguments of ``set_tf``."""

    bridge: str
    map_frame: str = "map"
    base_frame: str | None = None
    namespace: str = ""
    quiet: bool = False


class MoveData(msgspec.Struct, forbid_unknown_fields=True, omit_defaults=True):
    """The arguments of ``set_move_topic``."""

    bridge: str
    topic: str = ""
    frame: str = "map"
    cancel_topic: str | None = None
    on_operator_loss: str = "continue"
    action: str | None = None
    action_type: str = NAVIGATE_TO_POSE


class InitialPoseData(msgspec.Struct, forbid_unknown_fields=True, omit_defaults=True):
    """The arguments of ``set_initial_pose_topic``."""

    bridge: str
    topic: str
    covariance: tuple[float, float, float] = COVARIANCE
    frame: str = "map"


class ModuleData(msgspec.Struct, forbid_unknown_fields=True, omit_defaults=True):
    """The arguments of ``add_module``.

    A bridge among them is ``{"bridge": URL}``, and ``None``, for which TOML has no
    word, is ``{"none": True}``.
    """

    name: str
    args: list[Any] = []
    options: dict[str, Any] = {}


class RobotData(msgspec.Struct, forbid_unknown_fields=True, omit_defaults=True):
    """A robot."""

    name: str
    base_link: str = "base_link"
    classes: list[str] = []
    model: dict[str, Any] | None = None
    odometry: OdometryData | None = None
    tf: TfData | None = None
    alignment: tuple[float, float, float] | None = None
    """Of the robot's own: metres, metres and degrees."""

    twist: TwistData | None = None
    move: MoveData | None = None
    initial_pose: InitialPoseData | None = None
    scan_assist: ScanAssistData | None = None
    modules: list[ModuleData] = []


def robot_from_dict(
    cls: type[R], data: Mapping[str, Any], bridges: Mapping[str, Bridge] | None
) -> R:
    """Make a robot from plain data; see :meth:`Robot.from_dict`."""
    if not isinstance(data, Mapping):
        raise ConfigError(
            f"a robot's plain data is a table such as {{'name': 'Bob'}}, got {data!r}"
        )
    try:
        plain = msgspec.convert(dict(data), RobotData)
    except msgspec.ValidationError as error:
        name = data.get("name", "?")
        raise ConfigError(f"robot {name!r}: {error}") from error
    links: dict[str, Bridge] = dict(bridges or {})

    def link(name: str) -> Bridge:
        if name not in links:
            links[name] = Bridge(name)
        return links[name]

    model = None if plain.model is None else element_from_dict(plain.model)
    robot = cls(plain.name, model, base_link=plain.base_link)
    try:
        _set_up(robot, plain, link)
    except BaseException:
        robot.destroy()  # else the gate would be told of it
        raise
    return robot


def _set_up(robot: "Robot", plain: RobotData, link: Callable[[str], Bridge]) -> None:
    for name in plain.classes:
        robot.svg.classes.add(name)
    if plain.odometry is not None:
        o = plain.odometry
        robot.set_odometry_topic(link(o.bridge), o.topic, o.throttle, type=o.type)
    if plain.tf is not None:
        f = msgspec.structs.asdict(plain.tf)
        robot.set_tf(link(f.pop("bridge")), **f)
    if plain.alignment is not None:
        robot.set_alignment(*plain.alignment)
    if plain.twist is not None:
        t = msgspec.structs.asdict(plain.twist)
        robot.set_twist_topic(link(t.pop("bridge")), t.pop("topic"), **t)
    if plain.move is not None:
        m = msgspec.structs.asdict(plain.move)
        robot.set_move_topic(link(m.pop("bridge")), m.pop("topic"), **m)
    if plain.scan_assist is not None:
        robot.set_scan_assist(**msgspec.structs.asdict(plain.scan_assist))
    if plain.initial_pose is not None:
        p = msgspec.structs.asdict(plain.initial_pose)
        robot.set_initial_pose_topic(link(p.pop("bridge")), **p)
    for module in plain.modules:
        args = [_meant(value, link) for value in module.args]
        options = {key: _meant(value, link) for key, value in module.options.items()}
        robot.add_module(module.name, *args, **options)


def robot_to_dict(robot: "Robot") -> dict[str, Any]:
    """Return a robot as plain data; see :meth:`Robot.to_dict`."""
    feed, twist, move = robot.feed, robot.motion.twist_topic, robot.motion.move_topic
    pose = robot.motion.pose_topic
    own = robot.whereabouts.own_alignment
    hooks = [] if twist is None else [dict(hook) for hook in twist.stop_hooks]
    known = {"robot", "unplaced", "selected", "stale"}
    plain = RobotData(
        name=robot.name,
        base_link=robot.base_link,
        classes=[name for name in robot.svg.classes if name not in known],
        model=element_to_dict(robot.model, robot.model_images.names),
        odometry=_arguments(OdometryData, feed),
        tf=None
        if robot.tf is None
        else TfData(**{**robot.tf, "bridge": robot.tf["bridge"].url}),
        alignment=None if own is None else numbers(own),
        twist=_arguments(TwistData, twist, stop_hooks=hooks),
        move=_arguments(MoveData, move),
        initial_pose=_arguments(InitialPoseData, pose),
        scan_assist=assist_data(robot.motion.assist),
        modules=[
            ModuleData(
                name,
                [_plain(value) for value in args],
                {key: _plain(value) for key, value in options.items()},
            )
            for name, args, options in robot.module_arguments()
        ],
    )
    try:
        result: dict[str, Any] = msgspec.to_builtins(plain)
    except TypeError as error:  # a module was given what no file can hold
        raise ConfigError(f"robot {robot.name!r} is no plain data: {error}") from error
    return result


def _arguments(cls: type[D], kept: Any, **others: Any) -> D | None:
    """Return what set something as it is kept; None if nothing is."""
    if kept is None:
        return None
    fields = {name: getattr(kept, name) for name in cls.__struct_fields__}
    return cls(**{**fields, "bridge": kept.bridge.url, **others})


def _meant(value: Any, link: Callable[[str], Bridge]) -> Any:
    """Return what an argument of a module stands for."""
    if isinstance(value, Mapping):
        if set(value) == {"bridge"}:
            return link(value["bridge"])
        if value == NONE:
            return None
    return value


def _plain(value: Any) -> Any:
    if value is None:
        return dict(NONE)
    return {"bridge": value.url} if isinstance(value, Bridge) else value
