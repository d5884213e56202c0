"""Labels on maps, the same for everybody who sees them."""

import asyncio
import logging
from typing import Any

from webmap.core.labels import ICONS, MAX_LABELS, Label, LabelStore, moved_label
from webmap.core.layer import Layer
from webmap.core.tasks import spawn
from webmap.errors import ConfigError
from webmap.gate.kept.locks import state_folder
from webmap.scene import svg
from webmap.scene.element import Element

log = logging.getLogger("webmap.labels")


class LabelLayer(Layer):
    """The labels of one name, of a configuration and of those added on pages.

    Args:
        name: Of the file that keeps those that are added.
        configured: Labels that nobody can take away on a page.

    """

    def __init__(self, name: str, configured: tuple[Label, ...]) -> None:
        super().__init__()
        self.store = LabelStore(state_folder(), name)
        self.labels: dict[str, Label] = {label.id: label for label in configured}
        self.readable = True
        """Whether the file was read, so that it may be written again."""
        self._drawn: dict[str, Element] = {}
        self._unsaved = False
        self._saving: asyncio.Task[None] | None = None
        self.svg.classes.add("labels")

    def start(self) -> None:
        """Draw what is known; what was added before is read from the disk."""
        try:
            for label in self.store.load():
                self.labels[label.id] = label
        except ConfigError as error:
            self.readable = False
            self.set_problem(self, f"added labels are not shown: {error}")
        for label in self.labels.values():
            self._draw(label)

    def add(self, label: Label) -> None:
        """Show one more, and keep it.

        Raises:
            ConfigError: If it cannot be kept.

        """
        self._check_writable()
        if len(self.labels) >= MAX_LABELS:
            raise ConfigError(f"{MAX_LABELS} labels are the most")
        self.labels[label.id] = label
        self._draw(label)
        self._save()

    def remove(self, id: str) -> None:
        """Take one away that was added on a page.

        Raises:
            ConfigError: If it is in the configuration, or there is none.

        """
        label = self._kept(id)
        del self.labels[label.id]
        self._drawn.pop(label.id).remove()
        self._save()

    def move(self, id: str, place: Any) -> None:
        """Put one elsewhere that was added on a page.

        Args:
            id: Which one.
            place: A table with ``x`` and ``y`` in metres.

        Raises:
            ConfigError: If it is in the configuration, there is none, or the place
                makes no sense.

        """
        label = moved_label(self._kept(id), place)
        self.labels[label.id] = label
        self._drawn[label.id].set_pose(label.x, label.y, 0.0)
        self._save()

    def _kept(self, id: str) -> Label:
        self._check_writable()
        label = self.labels.get(id)
        if label is None:
            raise ConfigError("this label is gone already")
        if not label.kept:
            raise ConfigError(f"{label.name} is in the configuration and stays")
        return label

    def _check_writable(self) -> None:
        if not self.readable:
            raise ConfigError(
                f"{self.store.file} could not be read and is left alone: mend or "
                "remove it, and start again"
            )

    def _draw(self, label: Label) -> None:
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

    def _save(self) -> None:
        self._unsaved = True
        if self._saving is None:
            self._saving = spawn(self._save_on())

    async def _save_on(self) -> None:
        try:
            while self._unsaved:
                self._unsaved = False
                kept = [label for label in self.labels.values() if label.kept]
                try:
                    await asyncio.to_thread(self.store.save, kept)
                    self.clear_problem(self.store)
                except OSError as error:
                    words = f"labels are not kept: {self.store.file}: {error.strerror}"
                    self.set_problem(self.store, words)
        finally:
            self._saving = None
