"""Layers: drawings of data that all maps share."""

import logging
from collections.abc import Hashable
from typing import Any, ClassVar, Self

from webmap.base.scope import Removal, Scope, keep, no_scope
from webmap.core.problems import Problems
from webmap.core.world_view import WorldView
from webmap.scene import svg
from webmap.scene.element import Element
from webmap.scene.node import Fragment

log = logging.getLogger("webmap.layer")


class Layer:
    """A part of the scene that maps share, kept while at least one map shows it.

    A subclass subscribes in :meth:`start` and draws into :attr:`svg`. Two maps that ask
    for a layer of the same class with the same arguments share one layer, so its data
    is received, decoded and encoded once.
    """

    _shared: ClassVar[dict[Hashable, "Layer"]] = {}

    def __init__(self, *args: Any, **options: Any) -> None:
        del args, options
        self.svg: Element = svg.g(class_="layer")
        self.fragment = Fragment(self.svg)
        self.users = 0
        self.scope = Scope(type(self).__name__, self._failed, self.clear_problem)
        self._shown_problems = Problems(log)
        self.maps = self._shown_problems.maps
        """The maps that show the layer's failures; see :meth:`show_on`."""
        self.problems: dict[object, str] = self._shown_problems.current
        """Current failures, as sentences, by subject."""
        self._key: Hashable = None

    @classmethod
    def shared(cls, *args: Any, **options: Any) -> Self:
        """Return the layer of this class for these arguments, and add a user to it.

        Args:
            *args: Hashable; bridges are compared by identity.
            **options: Hashable.

        """
        key = (cls, args, tuple(sorted(options.items())))
        layer = cls._shared.get(key)
        if layer is None:
            layer = cls._made(*args, **options)
            layer._key = key
            try:
                with no_scope(), layer.scope.active():
                    layer.start()
            except BaseException:
                layer.scope.close()
                raise
            cls._shared[key] = layer
        layer.users += 1
        assert isinstance(layer, cls)
        return layer

    @classmethod
    def _made(cls, *args: Any, **options: Any) -> Self:
        return cls(*args, **options)

    def start(self) -> None:
        """Subscribe to the layer's data; called once, in the layer's scope."""

    def show_on(self, map: WorldView, *, order: float) -> Removal:
        """Show the layer on a map, and its failures on the map's page.

        Args:
            map: The map. It counts as one user of the layer until it is removed.
            order: The drawing order: a greater one is drawn above; robots have 100.

        Returns:
            The removal that takes the layer off the map; the end of the current scope
            does the same.

        """
        mounted = self.mount_on(map, order=order)
        self._shown_problems.join(map)

        def undo() -> None:
            self._shown_problems.leave(map)
            mounted.remove()

        return keep(Removal(undo))

    def mount_on(self, map: WorldView, *, order: float) -> Removal:
        """Show the layer on a map without its failures; see ``Map.add_layer``."""
        try:
            map.mount(self.fragment, order=order)
        except BaseException:
            self.release()
            raise

        def undo() -> None:
            map.unmount(self.fragment)
            self.release()

        return keep(Removal(undo))

    def set_problem(self, about: object, text: str) -> None:
        """Show a failure until :meth:`clear_problem`, also to pages opened later.

        Args:
            about: The subject of the failure; a new sentence replaces the old one.
            text: A sentence for people.

        """
        self._shown_problems.set(about, text)

    def clear_problem(self, about: object) -> None:
        """Remove the failure shown for ``about``."""
        self._shown_problems.clear(about)

    def release(self) -> None:
        """Remove one user; without users the layer ends."""
        self.users -= 1
        if self.users == 0:
            self._shared.pop(self._key, None)
            self.scope.close()

    def _failed(self, text: str, about: object) -> None:
        if about is None:
            self._shown_problems.report(text)
        else:
            self.set_problem(about, text)
