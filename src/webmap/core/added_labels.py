"""Labels that people added on pages, kept over restarts."""

import asyncio
from pathlib import Path
from typing import Any, ClassVar, Protocol

from webmap.core.labels import Label, LabelStore, moved_label
from webmap.core.tasks import spawn
from webmap.errors import ConfigError
from webmap.gate.kept.locks import state_folder
from webmap.scope import Removal, keep


class ShowsLabels(Protocol):
    """Who draws added labels: a layer."""

    def draw(self, label: Label) -> None:
        """Draw a label, also one that is drawn already and is elsewhere now."""

    def erase(self, id: str) -> None:
        """Draw a label no more."""

    def set_problem(self, about: object, text: str) -> None:
        """Note what fails."""

    def clear_problem(self, about: object) -> None:
        """Note that it fails no more."""


class AddedLabels:
    """The added labels of one file: the same object for everybody who shows them.

    So none of them writes the file without what others added. It is read whenever
    somebody shows its labels and nobody did before.

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
        self._shown_by: list[ShowsLabels] = []
        self._unsaved = False
        self._saving: asyncio.Task[None] | None = None

    @classmethod
    def of(cls, name: str) -> "AddedLabels":
        """Return those that the state folder keeps under a name.

        Raises:
            ConfigError: If the name cannot be a file's.

        """
        store = LabelStore(state_folder(), name)
        return cls._of.setdefault(store.file, cls(store))

    def show_on(self, layer: ShowsLabels) -> Removal:
        """Draw them on a layer, now and as they change, until the removal."""
        if not self._shown_by and self._saving is None:
            self._load()
        self._shown_by.append(layer)
        for label in self.labels.values():
            layer.draw(label)
        if self._problem:
            layer.set_problem(self, self._problem)
        return keep(Removal(lambda: self._shown_by.remove(layer)))

    def add(self, label: Label) -> None:
        """Show one more, and keep it.

        Raises:
            ConfigError: If it cannot be kept.

        """
        self._check_writable()
        self._draw(label)

    def remove(self, id: str) -> None:
        """Take one away.

        Raises:
            ConfigError: If there is none, or that cannot be kept.

        """
        del self.labels[self._found(id).id]
        for layer in self._shown_by:
            layer.erase(id)
        self._save()

    def move(self, id: str, place: Any) -> None:
        """Put one elsewhere.

        Args:
            id: Which one.
            place: A table with ``x`` and ``y`` in metres.

        Raises:
            ConfigError: If there is none, that cannot be kept, or the place makes no
                sense.

        """
        self._draw(moved_label(self._found(id), place))

    def _found(self, id: str) -> Label:
        self._check_writable()
        label = self.labels.get(id)
        if label is None:
            raise ConfigError("this label is gone already")
        return label

    def _draw(self, label: Label) -> None:
        self.labels[label.id] = label
        for layer in self._shown_by:
            layer.draw(label)
        self._save()

    def _check_writable(self) -> None:
        if not self.readable:
            raise ConfigError(
                f"{self.store.file} could not be read and is left alone: mend or "
                "remove it, and start again"
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
                    self._say("")
                except OSError as error:
                    file, why = self.store.file, error.strerror
                    self._say(f"labels are not kept: {file}: {why}")
        finally:
            self._saving = None

    def _say(self, problem: str) -> None:
        self._problem = problem
        for layer in self._shown_by:
            if problem:
                layer.set_problem(self, problem)
            else:
                layer.clear_problem(self)
