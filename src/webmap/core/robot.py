"""Robots: made from a configuration, changed by one, and converted to one."""

from collections.abc import Callable, Mapping
from typing import Any, Self, TypeAlias

import msgspec

from webmap.base.errors import ConfigError, ModuleNotFound, WebMapError
from webmap.config import checks
from webmap.config.checks import KeyPath, Mistakes
from webmap.config.robot import (
    LINKED,
    OWN_CLASSES,
    ModuleConfig,
    ModuleEntry,
    OdometryConfig,
    RobotConfig,
    TfConfig,
    is_link,
)
from webmap.core.module_arguments import WrongArgument, WrongArguments
from webmap.core.robot_model import element_from_dict, element_to_dict
from webmap.core.visible_robot import KEYS, VisibleRobot
from webmap.poses.alignment import numbers
from webmap.poses.frames import frames_of
from webmap.ros.bridge import Bridge
from webmap.scene.element import Element

NONE = {"none": True}
"""How ``None`` is written among the arguments of a module."""

Link: TypeAlias = Callable[[str], Bridge]
"""Returns the bridge with a name or a URL."""

ModuleCall: TypeAlias = tuple[str, tuple[Any, ...], dict[str, Any]]
"""Name, positional and keyword arguments of an added module."""


class Robot(VisibleRobot):
    """One robot: its name, its pose, its drawing and its motion.

    A robot may be shown on any number of maps, and used without any.

    Args:
        name: The displayed name. It need not be unique.
        model: The drawing from above, in metres, x forward; a plain arrow if not given.
            It becomes part of the robot's own group, :attr:`svg`. An image in it may
            name a file in the page's folder.
        base_link: The robot's own frame in the navigation stack.
        namespace: The namespace of its modules.

    Raises:
        ConfigError: If the model is no element, or another robot's.

    """

    @classmethod
    def from_config(
        cls,
        config: RobotConfig,
        bridges: Mapping[str, Bridge] | None = None,
        *,
        model: Element | None = None,
    ) -> Self:
        """Create a robot with its topics and modules.

        Args:
            config: The robot's configuration; ``RobotConfig.from_dict`` checks its
                values.
            bridges: Bridges by name or URL, to be shared; others are created.
            model: The drawing, in place of the configured one.

        Raises:
            ConfigError: If a value is not valid; the message lists every mistake.

        """
        mistakes = Mistakes()
        if config.picture is not None and model is None:
            text = "only the console shows a picture; give a model instead"
            mistakes.add(("picture",), text)
        if model is None and config.model is not None:
            try:
                model = element_from_dict(config.model)
            except WebMapError as error:
                mistakes.add(("model",), str(error))
        robot = cls(config.name, model, base_link=config.base_link)
        try:
            before = RobotConfig(name=config.name)
            mistakes.take((), apply_config(robot, before, config, bridges))
            mistakes.refuse(f"robot {config.name!r}")
        except BaseException:
            robot.destroy()  # or the gate would get the robot
            raise
        return robot

    @classmethod
    def from_dict(
        cls, data: Mapping[str, Any], bridges: Mapping[str, Bridge] | None = None
    ) -> Self:
        """Create a robot with its topics and modules from plain data.

        Args:
            data: The result of :meth:`to_dict`, or a table of a TOML file.
            bridges: Bridges by name or URL, to be shared; others are created.

        Raises:
            ConfigError: If a key or a value is not valid; the message lists every
                mistake.

        """
        return cls.from_config(RobotConfig.from_dict(data), bridges)

    def to_config(self) -> RobotConfig:
        """Return the configuration of the robot, its topics and its named modules."""
        feed, own = self.feed, self.pose_source.own_alignment
        odometry = None
        if feed is not None:
            odometry = OdometryConfig(
                topic=feed.topic,
                type=feed.type,
                throttle=feed.throttle,
                bridge=feed.bridge.url,
            )
        return RobotConfig(
            name=self.name,
            base_link=self.base_link or "base_link",
            classes=[name for name in self.svg.classes if name not in OWN_CLASSES],
            model=element_to_dict(self.model, self.model_images.names),
            odometry=odometry,
            tf=self.pose_source.tf,
            alignment=None if own is None else numbers(own),
            battery_low=self.battery_low,
            tags=list(self.tags),
            **msgspec.structs.asdict(self.motion.config),
            modules=[
                ModuleConfig(
                    name=name,
                    args=[_plain(value) for value in args],
                    options={key: _plain(value) for key, value in options.items()},
                )
                for name, args, options in self.module_arguments()
            ],
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the robot, its topics and its named modules as plain data.

        The data fits JSON and TOML: ``None`` among a module's arguments is
        ``{"none": True}``, and a bridge is ``{"bridge": URL}``.

        Raises:
            ConfigError: If an argument of a module has no form in such a file.

        """
        try:
            return self.to_config().to_dict()
        except TypeError as error:  # an argument of a module has no form in a file
            raise ConfigError(
                f"robot {self.name!r} is not plain data: {error}"
            ) from error


def apply_config(
    robot: VisibleRobot,
    old: RobotConfig,
    new: RobotConfig,
    bridges: Mapping[str, Bridge] | None = None,
) -> Mistakes:
    """Apply the differences between two configurations to a robot.

    Parts that both have in common stay, and so does everything that neither has, such
    as modules that a program added. Name and model are never changed. New bridges and
    modules belong to the scope in which this is called.

    Args:
        robot: The robot.
        old: The configuration until now.
        new: The configuration to apply.
        bridges: Bridges by name or URL; others are created.

    Returns:
        The mistakes found; each part without a mistake was changed.

    """
    links = dict(bridges or {})

    def link(name: str) -> Bridge:
        if not name:
            raise ConfigError('the key "bridge" is missing')
        if name not in links:
            links[name] = Bridge(name)
        return links[name]

    mistakes = Mistakes()
    for name in old.classes:
        if name not in new.classes:
            robot.svg.classes.remove(name)
    for name in new.classes:
        robot.svg.classes.add(name)
    if old.base_link != new.base_link:
        robot.base_link = robot.motion.base_frame = new.base_link
        robot.motion.declare()
        if new.tf is not None:  # it may name no other base
            old = old.with_part("tf", None)
    before, after = old.resolved(), new.resolved()
    if _changes_bridge_of_goals(before, after):
        robot.set_part("initial_pose", None)  # both must always use the same bridge
    for key in KEYS:
        part = getattr(after, key)
        if part == getattr(before, key):
            continue
        try:
            linked = key in LINKED and part is not None
            bridge = link(part.bridge) if linked else None
            if isinstance(part, TfConfig) and bridge is not None:
                _place(robot, part, bridge)
            else:
                robot.set_part(key, part, bridge)
        except WebMapError as error:
            _note(mistakes, (key,), error, robot.name)
    _set_layers(robot, old, new, link, mistakes)
    return mistakes


def _changes_bridge_of_goals(old: RobotConfig, new: RobotConfig) -> bool:
    """Return whether goals and the initial pose both change to another bridge."""
    parts = [(config.move, config.initial_pose) for config in (old, new)]
    bridges = [part.bridge for pair in parts for part in pair if part is not None]
    return len(bridges) == 4 and bridges[:2] != bridges[2:]


def _place(robot: VisibleRobot, tf: TfConfig, bridge: Bridge) -> None:
    """Place a robot by TF, and move the layers of its map into the same frame."""
    # Keep the received frames until the new subscription is made.
    held = frames_of(bridge, tf.namespace).join(lambda: None)
    try:
        robot.set_part("tf", tf, bridge)
    finally:
        held.remove()
    frame = (robot.tf or {})["map_frame"]
    for module in list(robot.modules):
        made = robot.arguments_of(module)
        if made is not None and made[2].get("map_frame", frame) != frame:
            name, args, options = made
            robot.remove_module(module)
            robot.add_module(name, *args, **{**options, "map_frame": frame})


def _set_layers(
    robot: VisibleRobot,
    old: RobotConfig,
    new: RobotConfig,
    link: Link,
    mistakes: Mistakes,
) -> None:
    """Remove the modules that only the old configuration has, and add the new ones."""
    left = [layer.module for layer in old.layers()]
    added: list[ModuleEntry] = []
    for layer in new.layers():
        if layer.module in left:
            left.remove(layer.module)
        else:
            added.append(layer)
    for module in left:
        made = module_call(module, link)
        for each in list(robot.modules):
            if robot.arguments_of(each) == made:
                robot.remove_module(each)
                break
    for layer in added:
        _add(robot, layer, link, mistakes)


def _add(
    robot: VisibleRobot, layer: ModuleEntry, link: Link, mistakes: Mistakes
) -> None:
    path, module = layer
    try:
        name, args, options = module_call(module, link)
        made = robot.add_module(name, *args, **options)
        if path[0] == "scan":
            robot.svg.insert(1, made.svg)  # after the title, under the body
    except WebMapError as error:
        note_refused(mistakes, path, module, error)
    except Exception as error:  # a module from elsewhere may raise anything
        text = f"{type(error).__name__}: {error}"
        mistakes.add(path, f"{module.name} refused its arguments: {text}")


def note_refused(
    mistakes: Mistakes, path: KeyPath, module: ModuleConfig, error: WebMapError
) -> None:
    """Add the error of a module that was not added.

    Args:
        mistakes: The list for every mistake.
        path: The key that adds the module; only that of a whole module has keys inside.
        module: The module.
        error: The error.

    """
    is_whole = "modules" in path
    if isinstance(error, ModuleNotFound):
        mistakes.add((*path, "name"), str(error))
    elif isinstance(error, WrongArguments):
        for wrong in error.wrong:
            place = wrong.path if is_whole else ()
            mistakes.add((*path, *place), _wrong_argument(module, wrong))
    else:
        # The error of a module begins with the name of the argument.
        key = str(error).partition(" ")[0].rstrip(":")
        inside = ("options", key) if is_whole and key in module.options else ()
        text = f"{module.name}: {error}" if is_whole else str(error)
        mistakes.add((*path, *inside), text)


def _wrong_argument(module: ModuleConfig, wrong: WrongArgument) -> str:
    """Return the error message for a wrong argument, with the expected value."""
    if not wrong.got:
        return f"{module.name}: {wrong.text}"
    expected = wrong.text
    if expected == "a Bridge":
        expected = 'a bridge, such as { bridge = "hall" }'
    of = f", for {wrong.name} of {module.name}"
    return f"got {checks.show(wrong.got[0])}, expected {expected}{of}"


def _note(mistakes: Mistakes, path: KeyPath, error: WebMapError, name: str) -> None:
    """Add the mistakes of a part, each with its path."""
    if isinstance(error, checks.WrongConfig):
        mistakes.take((), error.mistakes)
    else:
        mistakes.add(path, str(error).removeprefix(f"robot {name!r}: "))


def module_call(module: ModuleConfig, link: Link) -> ModuleCall:
    """Return a module's name and arguments for ``add_module``."""
    args = tuple(_argument(value, link) for value in module.args)
    options = {key: _argument(value, link) for key, value in module.options.items()}
    return module.name, args, options


def _argument(value: Any, link: Link) -> Any:
    """Return the value of a module's argument, with bridges resolved."""
    if is_link(value):
        return link(value["bridge"])
    return None if value == NONE else value


def _plain(value: Any) -> Any:
    if value is None:
        return dict(NONE)
    return {"bridge": value.url} if isinstance(value, Bridge) else value
