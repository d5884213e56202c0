"""Labels on maps, the same for everybody who sees them."""

from typing import Any

from webmap.core.added_labels import AddedLabels
from webmap.core.labels import ICONS, MAX_LABELS, Label
from webmap.core.layer import Layer
from webmap.errors import ConfigError
from webmap.scene import svg
from webmap.scene.element import Element


class LabelLayer(Layer):
    """The labels of a configuration, and those added on pages under one name.

    Args:
        name: Of the file that keeps those that are added.
        configured: Labels that nobody can take away on a page.

    """

    def __init__(self, name: str, configured: tuple[Label, ...]) -> None:
        super().__init__()
        self.configured = {label.id: label for label in configured}
        self.added = AddedLabels.of(name)
        self._drawn: dict[str, Element] = {}
        self.svg.classes.add("labels")

    def start(self) -> None:
        """Draw what is configured, and what was added before."""
        for label in self.configured.values():
            self.draw(label)
        self.added.show_on(self)

    def add(self, label: Label) -> None:
        """Show one more, and keep it.

        Raises:
            ConfigError: If it cannot be kept.

        """
        if len(self._drawn) >= MAX_LABELS:
            raise ConfigError(f"{MAX_LABELS} labels are the most")
        self.added.add(label)

    def remove(self, id: str) -> None:
        """Take one away that was added on a page.

        Raises:
            ConfigError: If it is in the configuration, or there is none.

        """
        self._check_added(id)
        self.added.remove(id)

    def move(self, id: str, place: Any) -> None:
        """Put one elsewhere that was added on a page.

        Args:
            id: Which one.
            place: A table with ``x`` and ``y`` in metres.

        Raises:
            ConfigError: If it is in the configuration, there is none, or the place
                makes no sense.

        """
        self._check_added(id)
        self.added.move(id, place)

    def _check_added(self, id: str) -> None:
        label = self.configured.get(id)
        if label is not None:
            raise ConfigError(f"{label.name} is in the configuration and stays")

    def erase(self, id: str) -> None:
        """Draw a label no more."""
        self._drawn.pop(id).remove()

    def draw(self, label: Label) -> None:
        """Draw a label, also one that is drawn already and is elsewhere now."""
        if label.id in self._drawn:
            self._drawn[label.id].set_pose(label.x, label.y, 0.0)
            return
        name = svg.text(text=label.name, class_="name", y=26)
        icon = svg.path(d=ICONS[label.icon], class_="icon")
        icon.set(transform="translate(-9 -9) scale(0.75)")
        upright = svg.g(svg.circle(r=14, class_="spot"), icon, name, class_="upright")
        title = svg.title(text=label.name)
        drawn = svg.g(title, upright, class_=f"label {label.icon} {label.kind}".strip())
        drawn.set("data-label", label.id).set("data-name", label.name)
        drawn.set("data-kept", "true" if label.kept else None)
        drawn.set("data-yaw", None if label.yaw is None else f"{label.yaw:.6f}")
        drawn.set("tabindex", 0).set("role", "button").set("aria-label", label.name)
        drawn.set_pose(label.x, label.y, 0.0)
        self._drawn[label.id] = drawn
        self.svg.append(drawn)
