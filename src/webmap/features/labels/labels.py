"""Labels: named places on the map."""

import asyncio
import logging
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, ClassVar

from webmap.base.errors import ConfigError
from webmap.base.roles import Role
from webmap.base.scope import Removal, keep
from webmap.base.tasks import spawn
from webmap.core.map import Layer, Map, robot_and_pose
from webmap.core.registry import map_modules
from webmap.features.labels.label_store import (
    ICONS,
    MAX_LABELS,
    MAX_NAME,
    Label,
    LabelStore,
    given_labels,
    label_file,
    moved_label,
    new_label,
)
from webmap.gate.locks import state_folder
from webmap.scene import svg
from webmap.scene.element import Element

log = logging.getLogger("webmap.modules.labels")


class LabelLayer(Layer):
    """The labels of a configuration, and those added on pages under one name.

    Args:
        name: The name of the file that stores the added labels.
        configured: Labels that cannot be removed on a page.
    """

    def __init__(self, name: str, configured: tuple[Label, ...]) -> None:
        super().__init__()
        self.configured = {label.id: label for label in configured}
        self.added = AddedLabels.of(name)
        self._drawn: dict[str, Element] = {}
        self.svg.classes.add("labels")

    def start(self) -> None:
        """Draw the configured labels, and the labels added before."""
        for label in self.configured.values():
            self.draw(label)
        self.added.show_on(self)

    def add(self, label: Label) -> None:
        """Show and store a new label.

        Raises:
            ConfigError: If the label cannot be stored.
        """
        if len(self._drawn) >= MAX_LABELS:
            raise ConfigError(f"already {MAX_LABELS} labels: delete one first")
        self.added.add(label)

    def remove(self, id: str) -> None:
        """Remove a label that was added on a page.

        Raises:
            ConfigError: If the label is in the configuration, or does not exist.
        """
        self._check_added(id)
        self.added.remove(id)

    def move(self, id: str, place: Any) -> None:
        """Move a label that was added on a page.

        Args:
            id: The label's id.
            place: A table with ``x`` and ``y`` in metres.

        Raises:
            ConfigError: If the label is in the configuration or does not exist, or the
                place is not valid.
        """
        self._check_added(id)
        self.added.move(id, place)

    def _check_added(self, id: str) -> None:
        label = self.configured.get(id)
        if label is not None:
            raise ConfigError(
                f"{label.name} is in the configuration and cannot be deleted"
            )

    def erase(self, id: str) -> None:
        """Remove a label's drawing."""
        self._drawn.pop(id).remove()

    def draw(self, label: Label) -> None:
        """Draw a label; a label drawn before is moved."""
        if label.id in self._drawn:
            self._drawn[label.id].set_pose(label.x, label.y, 0.0)
            return
        name = svg.text(text=label.name, class_="name", y=26)
        icon = svg.path(d=ICONS[label.icon], class_="webmap-symbol icon")
        icon.set(transform="translate(-9 -9) scale(0.75)")
        upright = svg.g(svg.circle(r=14, class_="spot"), icon, name, class_="upright")
        title = svg.title(text=label.name)
        drawn = svg.g(title, upright, class_=f"label {label.icon} {label.kind}".strip())
        kept, yaw = "true" if label.kept else None, label.yaw
        drawn.set(data_label=label.id, data_name=label.name, data_kept=kept)
        drawn.set(data_yaw=None if yaw is None else f"{yaw:.6f}")
        drawn.set(tabindex=0, role="button", aria_label=label.name)
        drawn.set_pose(label.x, label.y, 0.0)
        self._drawn[label.id] = drawn
        self.svg.append(drawn)


class AddedLabels:
    """The added labels of one file: one object, shared by all layers that show them.

    Because the object is shared, the file always contains the labels of all layers. The
    file is read when the first layer shows its labels.

    Args:
        store: The file.
    """

    _of: ClassVar[dict[Path, "AddedLabels"]] = {}

    def __init__(self, store: LabelStore) -> None:
        self.store = store
        self.labels: dict[str, Label] = {}
        self.readable = True
        """Whether the file was read, so that it may be written again."""
        self._problem = ""
        self._shown_by: list[LabelLayer] = []
        self._unsaved = False
        self._saving: asyncio.Task[None] | None = None

    @classmethod
    def of(cls, name: str) -> "AddedLabels":
        """Return the labels that the state folder has under a name.

        Raises:
            ConfigError: If the name is not valid as a file name.
        """
        store = LabelStore(state_folder(), name)
        return cls._of.setdefault(store.file, cls(store))

    def show_on(self, layer: LabelLayer) -> Removal:
        """Draw the labels on a layer, with all later changes, until the removal."""
        if not self._shown_by and self._saving is None:
            self._load()
        self._shown_by.append(layer)
        for label in self.labels.values():
            layer.draw(label)
        if self._problem:
            layer.set_problem(self, self._problem)
        return keep(Removal(lambda: self._shown_by.remove(layer)))

    def add(self, label: Label) -> None:
        """Show and store a new label.

        Raises:
            ConfigError: If the label cannot be stored.
        """
        self._check_writable()
        self._draw(label)

    def remove(self, id: str) -> None:
        """Remove a label.

        Raises:
            ConfigError: If the label does not exist, or the change cannot be stored.
        """
        del self.labels[self._found(id).id]
        for layer in self._shown_by:
            layer.erase(id)
        self._save()

    def move(self, id: str, place: Any) -> None:
        """Move a label.

        Args:
            id: The label's id.
            place: A table with ``x`` and ``y`` in metres.

        Raises:
            ConfigError: If the label does not exist, the change cannot be stored, or
                the place is not valid.
        """
        self._draw(moved_label(self._found(id), place))

    def _found(self, id: str) -> Label:
        self._check_writable()
        label = self.labels.get(id)
        if label is None:
            raise ConfigError("this label was already deleted")
        return label

    def _draw(self, label: Label) -> None:
        self.labels[label.id] = label
        for layer in self._shown_by:
            layer.draw(label)
        self._save()

    def _check_writable(self) -> None:
        if not self.readable:
            raise ConfigError(
                f"{self.store.file} cannot be read and is left unchanged: repair or "
                "remove it, then start WebMap again"
            )

    def _load(self) -> None:
        try:
            self.labels = {label.id: label for label in self.store.load()}
            self.readable, self._problem = True, ""
        except ConfigError as error:
            self.labels, self.readable = {}, False
            self._problem = f"added labels are not shown: {error}"

    def _save(self) -> None:
        self._unsaved = True
        if self._saving is None:
            self._saving = spawn(self._save_on())

    async def _save_on(self) -> None:
        try:
            while self._unsaved:
                self._unsaved = False
                try:
                    await asyncio.to_thread(self.store.save, list(self.labels.values()))
                    self._show_trouble("")
                except OSError as error:
                    file, why = self.store.file, error.strerror
                    self._show_trouble(f"labels are not kept: {file}: {why}")
        finally:
            self._saving = None

    def _show_trouble(self, problem: str) -> None:
        self._problem = problem
        for layer in self._shown_by:
            if problem:
                layer.set_problem(self, problem)
            else:
                layer.clear_problem(self)


ORDER = 90.0
"""Below the robots, above everything else."""


@map_modules.register
class Labels:
    """Shows named places, upright and at a constant size at every zoom.

    Labels come from the program, from a file, and from pages, where admins add them;
    added labels are stored on this machine and appear on every page that has labels of
    the same name. A press on a label offers to send the selected robot there.

    Style them by CSS: ``.label``, with the icon's name and ``kind`` as further classes.

    Args:
        map: The map.
        labels: Tables with ``name``, ``x`` and ``y`` in metres, and optionally
            ``icon``, ``kind`` (a class) and ``yaw`` in radians.
        file: A YAML or JSON file with such a list.
        name: The name of the file in the state folder for added labels.
        editable: Whether admins can add, move and remove labels on the page.
        key: The key that begins to add a label.

    Raises:
        ConfigError: If a label is not valid; the error has its number and its key.
    """

    MAY_SEND: ClassVar[Mapping[str, Role]] = {
        "goal": "operator",
        "add": "admin",
        "move": "admin",
        "to": "admin",
        "remove": "admin",
    }

    def __init__(
        self,
        map: Map,
        labels: Iterable[Mapping[str, Any] | Label] = (),
        *,
        file: str | Path | None = None,
        name: str = "labels",
        editable: bool = True,
        key: str = "l",
    ) -> None:
        if len(key) != 1:
            raise ConfigError(f"Labels: key must be one character, got {key!r}")
        LabelStore(Path(), name)
        configured = given_labels(labels, "labels")
        if file is not None:
            configured = given_labels((*configured, *label_file(file)), "labels")
        self.map = map
        self.may_edit = editable and map.page.viewer.role == "admin"
        self.layer = LabelLayer.shared(name, configured)
        self.layer.show_on(map, order=ORDER)
        self.browser_part = map.add_browser_part(
            self,
            "features/labels/labels.js",
            {
                "editable": self.may_edit,
                "key": key,
                "icons": list(ICONS),
                "longest": MAX_NAME,
            },
            "features/labels/labels.css",
        )

    def find(self, name: str) -> Label | None:
        """Return the label of a name, or None.

        Of several labels with the name, the first one is returned: labels of the
        program and of files come before those that were added on pages.
        """
        every = (*self.layer.configured.values(), *self.layer.added.labels.values())
        return next((label for label in every if label.name == name), None)

    def on_message(self, message: dict[str, Any]) -> None:
        """Add, move or remove a label, or record where a robot was sent."""
        try:
            if "goal" in message:
                sent = robot_and_pose(self.map, message["goal"])
                if sent is not None:
                    self.map.notify_modules("on_goal_sent", *sent)
            elif not self.may_edit:
                raise ConfigError("only admins can add, move and delete labels")
            elif "add" in message:
                self.layer.add(new_label(message["add"]))
                self.browser_part.send({"done": True})
            elif "move" in message:
                self.layer.move(str(message["move"]), message.get("to"))
                self.browser_part.send({"done": True})
            elif "remove" in message:
                self.layer.remove(str(message["remove"]))
                self.browser_part.send({"done": True})
        except ConfigError as error:
            self.browser_part.send({"refused": str(error)})
