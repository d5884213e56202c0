"""The drawing of a robot: its model, also as plain data, and its image files."""

import contextlib
from collections.abc import Container, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from webmap.base.errors import ConfigError
from webmap.core.base_page import BasePage
from webmap.core.pictures import Publisher
from webmap.scene import svg
from webmap.scene.element import Element
from webmap.scene.node import Text


def default_model() -> Element:
    """Return an arrowhead of 0.5 m that points along x."""
    return svg.path(d="M0.25 0L-0.2 0.18L-0.1 0L-0.2 -0.18Z", class_="model")


def checked_model(name: str, model: Any, robots: Container[str]) -> Element:
    """Return the given model of the robot called ``name``, or the default one.

    Args:
        name: The robot's name, for error messages.
        model: The given model; None for the default one.
        robots: The ids of all robots.

    Raises:
        ConfigError: If it is no element, or the model of another robot: an element has
            one place, so the other robot would lose it.

    """
    if model is None:
        return default_model()
    if not isinstance(model, Element):
        raise ConfigError(
            f"robot {name!r}: a model is an element such as webmap.svg.circle(r=0.2), "
            f"got {model!r}"
        )
    holder = model.parent
    if holder is not None and holder.get("data-robot") in robots:
        other = holder.get("data-name")
        raise ConfigError(
            f"robot {name!r}: its model {model!r} is that of the robot {other!r}: make "
            "an element for each robot"
        )
    return model


class _ModelImage(NamedTuple):
    """An image whose file pages can load."""

    name: str
    """The file name that the program gave."""

    file: Path
    url: str
    """The current ``href`` of the element."""


class ModelImages:
    """Publishes the image files that a robot's elements name.

    A file is first looked for in the folder of the page that shows the robot, as by
    :meth:`webmap.Map.add_image`. A robot is not bound to one page, so its images can be
    loaded while any map shows it.

    Args:
        root: The robot's own group.

    """

    def __init__(self, root: Element) -> None:
        self._root = root
        self._shown: dict[Element, _ModelImage] = {}
        self._published: dict[tuple[Publisher, Path], str] = {}

    @property
    def names(self) -> Mapping[Element, str]:
        """The original ``href`` of each image whose ``href`` was replaced."""
        return {
            image: shown.name
            for image, shown in self._shown.items()
            if image.get("href") == shown.url
        }

    def show(self, page: BasePage) -> None:
        """Publish the images for a page; names that are no file of its folder stay."""
        for image in self._images():
            shown = self._shown.get(image)
            if shown is not None and image.get("href") == shown.url:
                with contextlib.suppress(ConfigError):  # the file was deleted meanwhile
                    self._publish(page, shown.file)
                continue
            name = image.get("href")
            if not name or name.startswith(("/", "#")):
                continue
            try:
                file = page.image_file(name)
                url = self._publish(page, file)
            except ConfigError:
                continue  # another server may have it; if not, the page shows an error
            self._shown[image] = _ModelImage(name, file, url)
            image.set("href", url)

    def end(self) -> None:
        """Withdraw the images and restore the file names of the elements."""
        for image, name in self.names.items():
            image.set("href", name)
        for (publisher, _), url in self._published.items():
            publisher.withdraw_image(url)
        self._shown.clear()
        self._published.clear()

    def _images(self) -> Iterator[Element]:
        for node in self._root.walk():
            if isinstance(node, Element) and node.tag == "image":
                yield node

    def _publish(self, page: BasePage, file: Path) -> str:
        key = (page.publisher, file)
        if key not in self._published:
            self._published[key] = page.publisher.publish_image(file)
        return self._published[key]


def element_to_dict(
    element: Element, names: Mapping[Element, str] | None = None
) -> dict[str, Any]:
    """Return an element with its children as a tag, attributes and children.

    Args:
        element: The element.
        names: The ``href`` to write for some elements, in place of the current one.

    """
    names = names or {}
    data: dict[str, Any] = {"tag": element.tag}
    attributes = dict(element.attributes)
    if element in names:
        attributes["href"] = names[element]
    if attributes:
        data["attributes"] = attributes
    children = [
        child.data if isinstance(child, Text) else element_to_dict(child, names)
        for child in element.children
        if isinstance(child, Text | Element)
    ]
    if children:
        data["children"] = children
    return data


def element_from_dict(data: Mapping[str, Any]) -> Element:
    """Create an element with its children from plain data.

    Raises:
        ConfigError: If the data is not that of an element.
        SceneError: If a tag or an attribute is not allowed.

    """
    unknown = set(data) - {"tag", "attributes", "children"}
    if unknown or not isinstance(data.get("tag"), str):
        raise ConfigError(
            "an element is {tag, attributes, children}, with a tag: "
            f"got {sorted(map(str, data))}"
        )
    children = [
        child if isinstance(child, str) else element_from_dict(child)
        for child in data.get("children", ())
    ]
    element = Element(data["tag"], *children)
    for name, value in data.get("attributes", {}).items():
        element.set(name, value)
    return element
