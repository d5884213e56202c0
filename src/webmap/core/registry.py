"""Namespaces of modules: which class stands behind a module's name."""

import difflib
from collections.abc import Callable
from importlib.metadata import EntryPoint, entry_points
from typing import Any, TypeVar

from webmap.errors import ModuleNotFound

Factory = Callable[..., Any]
T = TypeVar("T", bound=Factory)


class Namespace:
    """The modules that one kind of owner can add, by name.

    Built-in modules, those of other packages and those of a user's script come
    through the same door: an entry point in ``group``, or :meth:`register`.
    """

    def __init__(self, kind: str, group: str | None = None) -> None:
        self.kind = kind
        self._group = group
        self._registered: dict[str, Factory] = {}
        self._entry_points: dict[str, EntryPoint] | None = None

    def register(self, factory: T, /, *, name: str | None = None) -> T:
        """Add a module under its class's name, or under ``name``; a decorator.

        Args:
            factory: Called with the owner and the arguments of ``add_module``; what
                it returns is the module. A class, as a rule.
            name: The module's name, where it differs from the class's.

        Raises:
            ValueError: If the name is taken by something else.

        """
        name = name or factory.__name__
        known = self._registered.get(name)
        if known is None and name in self._found():
            raise ValueError(
                f"the {self.kind} module {name!r} is already provided by "
                f"{self._found()[name].value}: choose another name"
            )
        if known is not None and not _same_source(known, factory):
            raise ValueError(
                f"the {self.kind} module {name!r} is already registered as "
                f"{known.__module__}.{known.__qualname__}: choose another name"
            )
        self._registered[name] = factory
        return factory

    def names(self) -> list[str]:
        """Return the names of all modules there are, sorted."""
        return sorted({*self._registered, *self._found()})

    def __getitem__(self, name: str) -> Factory:
        """Return what makes the module ``name``.

        Raises:
            ModuleNotFound: If there is none; the message lists what there is.

        """
        if name in self._registered:
            return self._registered[name]
        entry_point = self._found().get(name)
        if entry_point is None:
            raise ModuleNotFound(self._not_found(name))
        factory: Factory = entry_point.load()
        self._registered[name] = factory
        return factory

    def __contains__(self, name: object) -> bool:
        return name in self._registered or name in self._found()

    def _not_found(self, name: str) -> str:
        names = self.names()
        near = difflib.get_close_matches(name, names, n=1)
        hint = f" Did you mean {near[0]!r}?" if near else ""
        listed = ", ".join(names) or "none"
        return f"there is no {self.kind} module {name!r}.{hint} There are: {listed}."

    def _found(self) -> dict[str, EntryPoint]:
        if self._entry_points is None:
            self._entry_points = {}
            for found in entry_points(group=self._group) if self._group else ():
                other = self._entry_points.setdefault(found.name, found)
                if other.value != found.value:
                    raise ValueError(
                        f"two packages provide the {self.kind} module "
                        f"{found.name!r}: {other.value} and {found.value}"
                    )
        return self._entry_points


def _same_source(one: Factory, other: Factory) -> bool:
    """Tell whether a name was only defined again, as when a script is reloaded."""
    return (one.__module__, one.__qualname__) == (other.__module__, other.__qualname__)


map_modules = Namespace("map", "webmap.modules.map")
"""The modules of maps: ``webmap.modules.map``."""

robot_modules = Namespace("robot", "webmap.modules.robot")
"""The modules of robots: ``webmap.modules.robot``."""
