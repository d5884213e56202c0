"""How a robot looks: its model, also as plain data, and the image files in it."""

import contextlib
from collections.abc import Container, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from webmap.base.errors import ConfigError
from webmap.scene import svg
from webmap.scene.element import Element
from webmap.scene.node import Text

if TYPE_CHECKING:
    from webmap.core.page import Page
    from webmap.core.pictures import Publisher


def default_model() -> Element:
    """Return an arrowhead of 0.5 m that points along x."""
    return svg.path(d="M0.25 0L-0.2 0.18L-0.1 0L-0.2 -0.18Z", class_="model")


def checked_model(name: str, model: Any, robots: Container[str]) -> Element:
    """Return the model that the robot called ``name`` is given, or the default one.

    Args:
        name: The robot, for people.
        model: What it is given.
        robots: The ids of all robots that there are.

    Raises:
        ConfigError: If it is no element, or that of another robot: an element has one
            place, so that the other would lose it.

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


class _Shown(NamedTuple):
    """An image whose file pages can load."""

    name: str
    """The file, as the program has it."""

    file: Path
    url: str
    """The ``href`` that the element has meanwhile."""


class ModelImages:
    """Lets pages load the image files that a robot's elements name.

    A file is looked for in the folder of the page that shows the robot first, as
    :meth:`webmap.Map.add_image` does. The robot is everybody's, so its images can be
    loaded for as long as any map shows it, and not for the time of one page.

    Args:
        root: The robot's own group.

    """

    def __init__(self, root: Element) -> None:
        self._root = root
        self._shown: dict[Element, _Shown] = {}
        self._published: dict[tuple[Publisher, Path], str] = {}

    @property
    def names(self) -> Mapping[Element, str]:
        """What the program wrote as the ``href`` of those that have another now."""
        return {
            image: shown.name
            for image, shown in self._shown.items()
            if image.get("href") == shown.url
        }

    def show(self, page: "Page") -> None:
        """Let a page load them; one that is no file of its folder stays as it is."""
        for image in self._images():
            shown = self._shown.get(image)
            if shown is not None and image.get("href") == shown.url:
                with contextlib.suppress(ConfigError):  # the file is gone since
                    self._publish(page, shown.file)
                continue
            name = image.get("href")
            if not name or name.startswith(("/", "#")):
                continue
            try:
                file = page.image_file(name)
                url = self._publish(page, file)
            except ConfigError:
                continue  # it may be served by others; if not, the page says so
            self._shown[image] = _Shown(name, file, url)
            image.set("href", url)

    def end(self) -> None:
        """Let nobody load them, and have the elements name their files again."""
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

    def _publish(self, page: "Page", file: Path) -> str:
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
        names: What to write as the ``href`` of some, in place of what it is now.

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
    """Make an element with its children from plain data.

    Raises:
        ConfigError: If it is not an element's data.
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
