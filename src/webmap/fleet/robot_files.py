"""The files and addresses of a robot, and what an agent passes on of them.

Files and addresses of an agent are on its computer and in its network. The agent loads
pictures there and passes them on; a display opens no file and no address that an agent
names.
"""

import hashlib
import io
import re
from collections.abc import Callable, Container, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import msgspec

from webmap.agents.remote_camera import RemoteCamera
from webmap.base.errors import ConfigError, WireError
from webmap.config.buttons import read_buttons
from webmap.config.checks import KeyPath, Mistakes
from webmap.config.fleet import FleetConfig
from webmap.config.robot import (
    CameraConfig,
    ModuleConfig,
    PictureConfig,
    RobotConfig,
    named_cameras,
)
from webmap.ros.image_address import parse_address
from webmap.ros.messages_image import MAX_PIXELS
from webmap.ros.rosbridge.graph import SET_PARAM
from webmap.server.files import MEDIA_TYPES

MOST_PIXELS = 1 << 26
"""Most pixels of a picture: a browser uses four bytes for each."""

FORMATS = ("BMP", "GIF", "ICO", "JPEG", "PNG", "WEBP")
"""Formats of pictures that browsers show, by the names of Pillow."""

LARGEST = 1 << 20
"""Most bytes of the picture of a robot that an agent passes on."""

OPENING = ("HttpCamera", "Labels", "MapFile", "TileLayer")
"""Modules that open the file or the address among their arguments."""

OF_DISPLAYS = ("floor", "image", "modules", "tiles", "labels")
"""Keys of a fleet file for what is under the robots and on the page."""

_SERVED = re.compile(r"[0-9a-f]{32}(\.[a-z]{3,4})")


def check_agent_fleet(fleet: FleetConfig, mistakes: Mistakes) -> None:
    """Note what is in an agent's fleet file and would not reach a display."""
    for key in OF_DISPLAYS:
        if getattr(fleet, key):
            message = "an agent does not pass it on: a display's own fleet file has it"
            mistakes.add((key,), message)
    for index, config in enumerate(fleet.robots):
        path: KeyPath = ("robots", index)
        for number, module in enumerate(config.modules):
            if opens(module):
                message = (
                    "displays open no file and no address of an agent"
                    if module.name != "HttpCamera"
                    else 'an agent passes on the cameras of "cameras"'
                )
                mistakes.add((*path, "modules", number), message)
        if config.model is not None and _has_image(config.model):
            message = 'an agent passes on no images of a model; use "picture"'
            mistakes.add((*path, "model"), message)


def opens(module: ModuleConfig) -> bool:
    """Return whether a module opens a file or an address that it is given."""
    name: Any = module.name
    if name == "OnMaps":
        name = module.options.get("module", next(iter(module.args), None))
    return name in OPENING


def _has_image(element: Any) -> bool:
    if not isinstance(element, Mapping):
        return False
    children = element.get("children", ())
    inside = isinstance(children, list | tuple) and any(map(_has_image, children))
    return element.get("tag") == "image" or inside


def load_pictures(
    robots: list[RobotConfig], folder: Path, mistakes: Mistakes
) -> tuple[list[RobotConfig], dict[str, bytes]]:
    """Return robots whose pictures have the names under which an agent has them.

    Args:
        robots: The robots of a fleet file.
        folder: The file's folder.
        mistakes: Receives the mistakes.

    Returns:
        The robots, and the pictures by name.

    """
    loaded, pictures = [], {}
    for index, config in enumerate(robots):
        picture = config.picture
        if picture is not None:
            file = folder / picture.file
            with mistakes.at(("robots", index, "picture", "file")):
                data, media_type = picture_file(file)
                check_agent_picture(file, data, media_type)
                name = hashlib.sha256(data).hexdigest()[:32] + file.suffix.lower()
                pictures[name] = data
                picture = msgspec.structs.replace(picture, file=name)
                config = config.with_part("picture", picture)
        loaded.append(config)
    return loaded, pictures


def check_agent_picture(file: Path, data: bytes, media_type: str) -> None:
    """Check the picture of a robot that comes from an agent.

    Raises:
        ConfigError: If it is not a picture, or too large.

    """
    if len(data) > LARGEST:
        raise ConfigError(
            f"{str(file)!r} has {len(data)} bytes; an agent passes on pictures of "
            f"{LARGEST} at the most"
        )
    check_picture(file, data, media_type, MAX_PIXELS)
    if media_type.startswith("image/svg") and b"<!ENTITY" in data:
        # Entities of entities fill the memory of a browser.
        raise ConfigError(f"{str(file)!r} has entities; save it without them")


def picture_from_agent(name: str, data: bytes) -> tuple[bytes, str]:
    """Return a picture that an agent gave under a name, and its media type.

    Raises:
        ConfigError: If it is not a picture, or too large.

    """
    media_type = MEDIA_TYPES[Path(name).suffix]
    check_agent_picture(Path(name), data, media_type)
    return data, media_type


def is_picture_name(name: str) -> bool:
    """Return whether an agent may have a picture under this name."""
    found = _SERVED.fullmatch(name)
    return found is not None and MEDIA_TYPES.get(found[1], "").startswith("image/")


def config_for_displays(config: RobotConfig) -> RobotConfig:
    """Return what displays get of a robot: addresses of cameras without secrets."""
    return _with_addresses(config, lambda each: parse_address(each.url).shown)


def _with_addresses(
    config: RobotConfig, address: Callable[[CameraConfig], str]
) -> RobotConfig:
    """Return a robot with other addresses of its cameras, which all have names."""
    cameras = [
        msgspec.structs.replace(each, url=address(each)) if each.url else each
        for each in named_cameras(config.cameras)
    ]
    return config.with_part("cameras", cameras)


def button_actions(config: RobotConfig) -> list[dict[str, str]]:
    """Return the topic or the service, and the parameter, that each button writes."""
    found = []
    for _, module in config.layers():
        if module.name != "Buttons":
            continue
        given = module.args[1] if module.args[1:] else module.options.get("buttons")
        with suppress(ConfigError, TypeError):  # then no display shows the robot
            for spec in read_buttons(given or ()):
                action = {spec.kind: spec.name, "type": spec.type or ""}
                if spec.kind == "parameter":
                    of_node = f"{spec.node}/set_parameters"
                    action["service"] = of_node if spec.node else SET_PARAM
                found.append(action)
    return found


def check_parameters(service: str, args: Any, buttons: list[dict[str, str]]) -> None:
    """Check that a call sets no other parameter of a node than those of buttons.

    Raises:
        WireError: If it does.

    """
    own = {each.get("parameter") for each in buttons if each.get("service") == service}
    if not own or None in own:  # no parameter, or a button that calls the service
        return
    try:
        given = [args] if service == SET_PARAM else args["parameters"]
        is_own = own.issuperset(each["name"] for each in given)
    except (TypeError, KeyError):
        is_own = False
    if not is_own:
        raise WireError("the agent has no button for this parameter")


def config_from_agent(
    config: RobotConfig, agent: str, id: str, bridges: Container[str]
) -> tuple[RobotConfig, PictureConfig | None]:
    """Return what a display shows of a robot of an agent, and its picture.

    Args:
        config: The configuration that the agent gave.
        agent: The address of the agent.
        id: The id of the robot.
        bridges: The names of the agent's own bridge.

    Raises:
        ConfigError: If it has a file or an address that the display would open.

    """
    for _, bridge in config.bridges():
        if bridge not in bridges:
            raise ConfigError(f"{bridge!r} is not the rosbridge of the agent")
    for module in config.modules:
        if opens(module):
            raise ConfigError(
                f"a display does not open what an agent names: the module {module.name}"
            )
    picture = config.picture
    if picture is not None and not is_picture_name(picture.file):
        raise ConfigError(f"{picture.file!r} is not a picture of the agent")
    shown = _with_addresses(
        config, lambda each: RemoteCamera(agent, id, each.name, each.url).url
    )
    return shown.with_part("picture", None), picture


def picture_file(file: Path) -> tuple[bytes, str]:
    """Return the contents of a file that browsers can show, and its media type.

    Raises:
        ConfigError: If there is no such file, or it is not a picture.

    """
    from webmap.server.files import IMAGES, MEDIA_TYPES, Published

    known = [end for end, type in MEDIA_TYPES.items() if type.startswith("image/")]
    if file.is_file() and file.suffix.lower() not in known:
        raise ConfigError(
            f"{str(file)!r} is not a picture: its name must end in {' '.join(known)}"
        )
    published = Published()  # raises errors of the file itself
    found = published.image(published.publish_image(file).removeprefix(IMAGES))
    check_picture(file, found.data, found.media_type)
    return found.data, found.media_type


def check_picture(
    file: Path, data: bytes, media_type: str, most_pixels: int = MOST_PIXELS
) -> None:
    """Check that browsers can show a picture.

    Args:
        file: Its name, for the error.
        data: Its content.
        media_type: Its type, by its suffix.
        most_pixels: The most pixels that it may have.

    Raises:
        ConfigError: If they cannot.

    """
    if media_type.startswith("image/svg"):
        if b"<svg" not in data[: 1 << 16]:
            raise ConfigError(f"{str(file)!r} is not an SVG: it has no element <svg>")
    else:
        _check_pixels(file, data, most_pixels)


def _check_pixels(file: Path, data: bytes, most_pixels: int) -> None:
    from PIL import Image

    try:
        with Image.open(io.BytesIO(data), formats=FORMATS) as image:
            width, height = image.size
            image.verify()
    except Exception as error:  # each picture format has its own errors
        raise ConfigError(
            f"{str(file)!r} cannot be read: expected a complete picture in the format "
            f"of its suffix {file.suffix}, got {_reason(error)}"
        ) from None
    if width * height > most_pixels:
        raise ConfigError(
            f"{str(file)!r} has {width} x {height} pixels; expected {most_pixels} at "
            f"the most"
        )


def _reason(error: Exception) -> str:
    from PIL import UnidentifiedImageError

    if isinstance(error, UnidentifiedImageError):
        return "another format"
    return str(error) or type(error).__name__
