"""Layers: what is drawn from data once, however many maps show it."""

from collections.abc import Hashable
from typing import Any, ClassVar, TypeVar

from webmap.scene import svg
from webmap.scene.element import Element
from webmap.scene.fragment import Fragment
from webmap.scope import Scope, no_scope

L = TypeVar("L", bound="Layer")


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
        self.scope = Scope(type(self).__name__)
        self._key: Hashable = None

    @classmethod
    def shared(cls: type[L], *args: Any, **options: Any) -> L:
        """Return the layer of this class for these arguments, with one user more.

        Args:
            *args: Hashable; bridges count by identity.
            **options: Hashable.

        """
        key = (cls, args, tuple(sorted(options.items())))
        layer = cls._shared.get(key)
        if layer is None:
            layer = cls(*args, **options)
            layer._key = key
            cls._shared[key] = layer
            with no_scope(), layer.scope.active():
                layer.start()
        layer.users += 1
        assert isinstance(layer, cls)
        return layer

    def start(self) -> None:
        """Subscribe to what the layer shows; called once, in the layer's scope."""

    def release(self) -> None:
        """Have one user less; with none left the layer ends."""
        self.users -= 1
        if self.users == 0:
            self._shared.pop(self._key, None)
            self.scope.close()
