"""How a robot looks, unless a program says otherwise, and what can be a model."""

from collections.abc import Container
from typing import Any

from webmap.errors import ConfigError
from webmap.scene import svg
from webmap.scene.element import Element


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
