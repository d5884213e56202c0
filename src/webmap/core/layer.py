"""Layers: what is drawn from data once, however many maps show it."""

import logging
from collections.abc import Hashable
from typing import TYPE_CHECKING, Any, ClassVar, Self

from webmap.base.scope import Removal, Scope, keep, no_scope
from webmap.core.problems import Problems
from webmap.scene import svg
from webmap.scene.element import Element
from webmap.scene.fragment import Fragment

if TYPE_CHECKING:
    from webmap.core.map import Map

log = logging.getLogger("webmap.layer")


class Layer:
    """A part of the scene that maps share, kept while at least one map shows it.

    A subclass draws into :attr:`svg` from what it subscribes to in :meth:`start`.
    Two maps that ask for a layer of the same class with the same arguments get the
    same one, so what it draws is received, decoded and encoded once.
    """

    _shared: ClassVar[dict[Hashable, "Layer"]] = {}

    def __init__(self, *args: Any, **options: Any) -> None:
        del args, options
        self.svg: Element = svg.g(class_="layer")
        self.fragment = Fragment(self.svg)
        self.users = 0
        self.scope = Scope(type(self).__name__, self._failed, self.clear_problem)
        self._told = Problems(log)
        self.maps = self._told.maps
        """Those that hear what fails: see :meth:`show_on`."""
        self.problems: dict[object, str] = self._told.standing
        """What fails for now, in sentences, by what they are about."""
        self._key: Hashable = None

    @classmethod
    def shared(cls, *args: Any, **options: Any) -> Self:
        """Return the layer of this class for these arguments, with one user more.

        Args:
            *args: Hashable; bridges count by identity.
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
        """Subscribe to what the layer shows; called once, in the layer's scope."""

    def show_on(self, map: "Map", *, order: float) -> Removal:
        """Show the layer on a map, and tell the map's page what fails.

        Args:
            map: The map; one of the layer's users is its, and goes with it.
            order: What lies over what: greater is nearer; robots have 100.

        Returns:
            What takes it off the map again; the end of the current scope does, too.

        """
        shown = map.add_layer(self, order=order)
        self._told.join(map)

        def undo() -> None:
            self._told.leave(map)
            shown.remove()

        return keep(Removal(undo))

    def set_problem(self, about: object, text: str) -> None:
        """Note what fails until :meth:`clear_problem`; later viewers see it too.

        Args:
            about: What the sentence is about; a new one takes its place.
            text: A sentence for people.

        """
        self._told.set(about, text)

    def clear_problem(self, about: object) -> None:
        """Note that what was said of ``about`` is true no more."""
        self._told.clear(about)

    def release(self) -> None:
        """Have one user less; with none left the layer ends."""
        self.users -= 1
        if self.users == 0:
            self._shared.pop(self._key, None)
            self.scope.close()

    def _failed(self, text: str, about: object) -> None:
        if about is None:
            self._told.report(text)
        else:
            self.set_problem(about, text)
