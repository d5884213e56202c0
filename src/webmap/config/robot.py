"""The configuration of one robot, from any source.

A fleet file, the command line, discovery, ``Robot.from_dict`` and ``Robot.to_dict`` all
use this form.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, NamedTuple

import msgspec

from webmap.base.errors import ConfigError
from webmap.config import checks
from webmap.config.buttons import ButtonConfig, check_labels
from webmap.config.checks import KeyPath, Mistakes
from webmap.config.motion import (
    MOTION,
    InitialPoseConfig,
    MotionConfig,
    MoveConfig,
    ScanAssistConfig,
    TopicConfig,
    TwistConfig,
)
from webmap.config.reading import ONE_OR_MORE, Config, read
from webmap.ros.image_address import EXAMPLE, parse_address
from webmap.ros.names import PICTURES, VIDEO, is_topic, is_type

ODOMETRY_TYPES = (
    "nav_msgs/Odometry",
    "geometry_msgs/Pose",
    "geometry_msgs/PoseStamped",
    "geometry_msgs/PoseWithCovarianceStamped",
    "geometry_msgs/Pose2D",
)
"""The message types with a pose."""

LINKED = ("odometry", "tf", "twist", "move", "initial_pose")
"""Keys of the parts that use a bridge."""


class OdometryConfig(TopicConfig, kw_only=True, frozen=True):
    """The topic with the robot's poses."""

    topic: Annotated[str, checks.topic]
    type: Annotated[str, checks.message_type(*ODOMETRY_TYPES)] | None = None
    """If not given, the bridge is queried."""
    throttle: Annotated[int, checks.milliseconds] | None = None
    """The least time between two messages, in milliseconds; if not given, 16 for up to
    6 robots, 33 up to 13, 50 up to 20, 100 up to 1,000 and behind an agent, else 200.
    """
    bridge: str = ""


class TfConfig(Config, kw_only=True, frozen=True):
    """The frames that place the robot."""

    quiet: bool = False
    """Whether to show no problem when poses stay in the odometry's frame."""
    namespace: Annotated[str, checks.topic] = ""
    """``/robot_0`` if the topics are ``/robot_0/tf`` and ``/robot_0/tf_static``."""
    base_frame: Annotated[str, checks.text] | None = None
    """The robot's own frame; ``base_link`` of the robot if not given."""
    map_frame: Annotated[str, checks.text] = "map"
    """The frame that robots are drawn in."""
    bridge: str = ""

    @classmethod
    def expand(cls, value: Any) -> dict[str, Any] | None:
        """Return the table for true, and None for false."""
        if isinstance(value, bool):
            return {} if value else None
        raise ConfigError("true, false or a table")


class PictureConfig(Config, kw_only=True, frozen=True):
    """A picture of the robot from above, its front to the right unless it is turned."""

    file: Annotated[str, checks.text]
    """The path, relative to the folder of the fleet file."""
    width: Annotated[float, checks.above_zero("metres")]
    height: Annotated[float, checks.above_zero("metres")]
    x: Annotated[
        float,
        checks.finite("a number of metres: how far its middle is in front of the base"),
    ] = 0.0
    y: Annotated[
        float,
        checks.finite("a number of metres: how far its middle is left of the base"),
    ] = 0.0
    angle: Annotated[float, checks.finite("a number of degrees, counter-clockwise")] = (
        0.0
    )
    """The rotation about its centre."""


def _address(value: Any) -> str:
    parse_address(value)
    return str(value)


class CameraConfig(Config, kw_only=True, frozen=True):
    """One camera: a topic, or a URL."""

    topic: Annotated[str, checks.topic] = ""
    url: Annotated[
        str,
        checks.expecting(f'the address of a camera, such as "{EXAMPLE}"', _address),
    ] = ""
    name: Annotated[str, checks.text] = ""
    """Numbered if not given."""
    type: Annotated[str, checks.message_type(*PICTURES, *VIDEO)] | None = None
    """If not given, the name of the topic decides, or the bridge is queried."""
    throttle: Annotated[int, checks.milliseconds] | None = None

    @property
    def is_video(self) -> bool:
        """Whether the topic has video, by its type or by the names of image_transport.

        The plugins of image_transport add their own names to that of a camera.
        """
        if self.type is not None:
            return is_type(self.type, *VIDEO)
        return self.topic.endswith(("/ffmpeg", "/foxglove"))

    @classmethod
    def expand(cls, value: Any) -> dict[str, Any]:
        """Return the table for a topic or a URL alone."""
        either = f'a topic, or an address such as "{EXAMPLE}"'
        if not isinstance(value, str):
            raise ConfigError(f"{either}, or a table")
        try:
            if "://" in value:
                return {"url": _address(value)}
            if is_topic(value):
                return {"topic": value}
        except ConfigError:
            pass
        raise ConfigError(either)

    def check(self, path: KeyPath, mistakes: Mistakes) -> None:
        """Add mistakes that concern several fields."""
        if bool(self.topic) == bool(self.url):
            mistakes.add(path, 'a camera has either a "topic" or a "url"')
        if self.url and self.type is not None:
            mistakes.add((*path, "type"), 'only a camera with a "topic" has a type')
        if self.is_video and self.throttle is not None:
            message = "a video has no throttle, because each message counts"
            mistakes.add((*path, "throttle"), message)


class ModuleConfig(Config, kw_only=True, frozen=True):
    """A module by name, with the arguments of ``add_module``.

    A bridge among the arguments is ``{"bridge": NAME}``, and ``None``, which TOML
    lacks, is ``{"none": True}``. The module itself checks its arguments.
    """

    name: Annotated[str, checks.text]
    args: Annotated[list[Any], checks.array] = []
    options: Annotated[dict[str, Any], checks.table] = {}


class ModuleEntry(NamedTuple):
    """A module of a robot, and the configuration key that adds it."""

    path: KeyPath
    module: ModuleConfig


Alignment = Annotated[
    tuple[float, float, float],
    checks.expecting(
        "x and y in metres and an angle in degrees, counter-clockwise, such as "
        "[12.5, -3.0, 90.0]",
        checks.numbers(3, checks.finite("a number")),
    ),
]
"""The pose of a map on the common one: metres, metres, and degrees
counter-clockwise."""


OWN_CLASSES = ("robot", "unplaced", "selected", "stale")
"""CSS classes that WebMap itself gives to a robot."""


BATTERY_LOW = 0.2
"""The usual charge below which a battery is low."""


def _css_class(value: Any) -> str:
    plain = checks.text(value)
    if plain.split() != [plain] or plain in OWN_CLASSES:
        own = ", ".join(OWN_CLASSES)
        raise ConfigError(f"a CSS class without spaces, and none of {own}")
    return plain


class RobotConfig(Config, kw_only=True, frozen=True):
    """A robot; parts that it does not have are left out."""

    name: Annotated[str, checks.any_text]
    """The displayed name."""
    bridge: Annotated[str, checks.bridge] = ""
    """The bridge of every part that names no other: its name, or its URL."""
    base_link: Annotated[str, checks.text] = "base_link"
    """The robot's own frame in the navigation stack."""
    picture: PictureConfig | None = None
    odometry: OdometryConfig | None = None
    tf: TfConfig | None = None
    alignment: Alignment | None = None
    """The pose of the robot's own map on the common one; that of its bridge if not
    given."""
    scan: Annotated[list[Annotated[str, checks.topic]], ONE_OR_MORE] = []
    """Topics of type ``sensor_msgs/LaserScan``, drawn under the robot's body."""
    battery: Annotated[str, checks.topic] = ""
    """A topic of type ``sensor_msgs/BatteryState``."""
    battery_low: Annotated[
        float,
        checks.expecting(
            "a charge from 0 to 1, such as 0.2 for 20 %", checks.between(0, 1, "")
        ),
    ] = BATTERY_LOW
    """The charge below which the battery is low, from 0 to 1."""
    tags: Annotated[list[Annotated[str, checks.name]], ONE_OR_MORE] = []
    """Words by which the list of robots is grouped; the first one is the group."""
    cameras: Annotated[list[CameraConfig], ONE_OR_MORE] = []
    twist: TwistConfig | None = None
    move: MoveConfig | None = None
    initial_pose: InitialPoseConfig | None = None
    scan_assist: ScanAssistConfig | None = None
    buttons: list[ButtonConfig] = []
    modules: list[ModuleConfig] = []
    classes: list[Annotated[str, _css_class]] = []
    """CSS classes."""
    model: (
        Annotated[
            dict[str, Any],
            checks.expecting("a table of keys and values", checks.table),
        ]
        | None
    ) = None
    """The drawing: an element as plain data."""

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> "RobotConfig":
        """Return the configuration in plain data.

        Args:
            data: The result of :meth:`to_dict`, or a table ``[[robots]]`` of a fleet
                file.

        Raises:
            ConfigError: If a value is wrong; the message lists every mistake.

        """
        if not isinstance(data, Mapping):
            raise ConfigError(
                f"a robot's plain data is a table such as {{'name': 'Bob'}}, "
                f"got {data!r}"
            )
        mistakes = Mistakes()
        config = read_robot(data, (), mistakes)
        if config is not None and not mistakes.count:
            config.resolved().motion.check((), mistakes)
        mistakes.refuse(f"robot {data.get('name', '?')!r}")
        assert config is not None, "it is a table, and there is no mistake"
        return config

    def to_dict(self) -> dict[str, Any]:
        """Return the configuration as plain data that fits JSON and TOML."""
        data: dict[str, Any] = msgspec.to_builtins(self)
        return data

    @property
    def motion(self) -> MotionConfig:
        """The parts that move the robot."""
        return MotionConfig(**{key: getattr(self, key) for key in MOTION})

    def check(self, path: KeyPath, mistakes: Mistakes) -> None:
        """Add mistakes that concern several fields."""
        check_labels(self.buttons, (*path, "buttons"), mistakes)
        if self.picture is not None and self.model is not None:
            message = 'a robot has a "picture" or a "model"; remove one of them'
            mistakes.add((*path, "picture"), message)

    def with_part(self, key: str, part: Any) -> "RobotConfig":
        """Return a copy with another part; None removes the part."""
        return msgspec.structs.replace(self, **{key: part})

    def resolved(self) -> "RobotConfig":
        """Return the robot with a bridge in every part that uses one."""
        config = self
        for key in LINKED:
            part = getattr(self, key)
            if part is not None and not part.bridge:
                linked = msgspec.structs.replace(part, bridge=self.bridge)
                config = config.with_part(key, linked)
        return config

    def bridges(self) -> Iterator[tuple[KeyPath, str]]:
        """Yield every named bridge with its path."""
        if self.bridge:
            yield ("bridge",), self.bridge
        for key in LINKED:
            part = getattr(self, key)
            if part is not None and part.bridge:
                yield (key, "bridge"), part.bridge
        for index, module in enumerate(self.modules):
            for path, bridge in bridges_of(module):
                yield ("modules", index, *path), bridge

    def layers(self) -> list[ModuleEntry]:
        """Return every module that draws or shows something of the robot, in order."""
        link = {"bridge": self.bridge}
        layers: list[ModuleEntry] = []
        for number, scan in enumerate(self.scan, 1):
            options: dict[str, Any] = {"max_dots": None, "throttle": 100}
            if number > 1:
                options["name"] = scan_name(number)
            module = ModuleConfig(
                name="LaserScanner", args=[link, scan], options=options
            )
            layers.append(ModuleEntry(("scan", number - 1), module))
        if self.battery:
            battery = ModuleConfig(name="Battery", args=[link, self.battery])
            layers.append(ModuleEntry(("battery",), battery))
        if self.buttons:
            each = msgspec.to_builtins(self.buttons)
            buttons = ModuleConfig(name="Buttons", args=[link, each])
            layers.append(ModuleEntry(("buttons",), buttons))
        for index, camera in enumerate(named_cameras(self.cameras)):
            throttle = camera.throttle
            given = {"throttle": throttle, "type": camera.type}
            options = {key: value for key, value in given.items() if value is not None}
            kind = "VideoCamera" if camera.is_video else "Camera"
            kind = "HttpCamera" if camera.url else kind
            where = [camera.url] if camera.url else [link, camera.topic]
            module = ModuleConfig(
                name=kind, args=[*where, camera.name], options=options
            )
            layers.append(ModuleEntry(("cameras", index), module))
        listed = enumerate(self.modules)
        return layers + [
            ModuleEntry(("modules", index), module) for index, module in listed
        ]


def read_robot(value: Any, path: KeyPath, mistakes: Mistakes) -> RobotConfig | None:
    """Return the robot in plain data; every mistake is added.

    Args:
        value: The plain data.
        path: Its path.
        mistakes: The list for every mistake. If there is one, the result is unusable.

    """
    if not isinstance(value, Mapping):
        mistakes.add(path, f"got {checks.show(value)}, expected a table [[robots]]")
        return None
    config = read(RobotConfig, value, path, mistakes)
    if config is None:
        return None
    taken: set[str] = set()
    for index, camera in enumerate(named_cameras(config.cameras)):
        if checks.same_name(camera.name) in taken:
            message = (
                f'a second camera is called "{camera.name}"; give each its own name'
            )
            mistakes.add((*path, "cameras", index), message)
        taken.add(checks.same_name(camera.name))
    return config


def named_cameras(cameras: Sequence[CameraConfig]) -> list[CameraConfig]:
    """Return the cameras, with names for those without one."""
    many = len(cameras) > 1
    return [
        msgspec.structs.replace(each, name=f"Camera {number}" if many else "Camera")
        if not each.name
        else each
        for number, each in enumerate(cameras, 1)
    ]


def scan_name(number: int) -> str:
    """Return the CSS class that gives one of a robot's scans its own colour."""
    return f"scan-{number}" if number > 1 else ""


def bridges_of(module: ModuleConfig) -> Iterator[tuple[KeyPath, str]]:
    """Yield every bridge among the arguments of a module, with its path."""
    for index, each in enumerate(module.args):
        if is_link(each):
            yield ("args", index, "bridge"), each["bridge"]
    for key, each in module.options.items():
        if is_link(each):
            yield ("options", key, "bridge"), each["bridge"]


def is_link(value: Any) -> bool:
    """Return whether an argument of a module is a bridge."""
    return isinstance(value, Mapping) and set(value) == {"bridge"}
