"""Elements as plain data."""

from collections.abc import Mapping
from typing import Any

from webmap.errors import ConfigError
from webmap.scene.element import Element
from webmap.scene.node import Text


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
