"""Namespaces of modules: which class stands behind a module's name."""

import difflib
import logging
import pkgutil
from collections.abc import Callable, Iterator
from importlib.metadata import EntryPoint, entry_points
from importlib.util import find_spec
from typing import Any, TypeVar

from webmap.base.errors import ModuleNotFound

log = logging.getLogger("webmap.modules")

Factory = Callable[..., Any]
T = TypeVar("T", bound=Factory)


class Namespace:
    """The modules that one kind of owner can add, by name.

    A built-in module is the class that its file is named after: ``LaserScanner`` in
    ``laser_scanner.py``. Another package has an entry point for each of its modules,
    and a script calls :meth:`register`. A module is imported when it is first used.

    Args:
        kind: What the owner is, for error messages.
        group: The package of the built-in modules, and the group of the entry points.

    """

    def __init__(self, kind: str, group: str | None = None) -> None:
        self.kind = kind
        self._group = group
        self._registered: dict[str, Factory] = {}
        self._entry_points: dict[str, EntryPoint] | None = None
        self._broken: set[str] = set()

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
        found = None if known is not None else self._found().get(name)
        if found is not None and not _provides(found, factory):
            raise ValueError(
                f"the {self.kind} module {name!r} is already provided by "
                f"{found.value}: choose another name"
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

    def __iter__(self) -> Iterator[Factory]:
        """Yield what makes each module; one that cannot be loaded is logged once."""
        for name in self.names():
            if name in self._broken:
                continue
            try:
                yield self[name]
            except Exception:  # a package of somebody else's may raise anything
                self._broken.add(name)
                log.exception("the %s module %r cannot be loaded", self.kind, name)

    def _not_found(self, name: str) -> str:
        names = self.names()
        near = difflib.get_close_matches(name, names, n=1)
        hint = f" Did you mean {near[0]!r}?" if near else ""
        listed = ", ".join(names) or "none"
        return f"there is no {self.kind} module {name!r}.{hint} There are: {listed}."

    def _found(self) -> dict[str, EntryPoint]:
        if self._entry_points is None:
            self._entry_points = {} if self._group is None else _built_in(self._group)
            own = f"{self._group}."
            for found in entry_points(group=self._group) if self._group else ():
                other = self._entry_points.setdefault(found.name, found)
                if other.value != found.value and not found.value.startswith(own):
                    raise ValueError(
                        f"two packages provide the {self.kind} module "
                        f"{found.name!r}: {other.value} and {found.value}"
                    )
        return self._entry_points


def _built_in(package: str) -> dict[str, EntryPoint]:
    """Return where the modules of a package are, by the names of their classes."""
    spec = find_spec(package)
    found = {}
    folders = None if spec is None else spec.submodule_search_locations
    for file in pkgutil.iter_modules(folders or ()):
        name = "".join(word.capitalize() for word in file.name.split("_"))
        found[name] = EntryPoint(name, f"{package}.{file.name}:{name}", package)
    return found


def _provides(found: EntryPoint, factory: Factory) -> bool:
    """Return whether an entry point loads what makes a module."""
    inside = f"{factory.__module__}.".startswith(f"{found.module}.")
    return inside and found.attr == factory.__qualname__


def _same_source(one: Factory, other: Factory) -> bool:
    """Tell whether a name was only defined again, as when a script is reloaded."""
    return (one.__module__, one.__qualname__) == (other.__module__, other.__qualname__)


map_modules = Namespace("map", "webmap.modules.map")
"""The modules of maps: ``webmap.modules.map``."""

robot_modules = Namespace("robot", "webmap.modules.robot")
"""The modules of robots: ``webmap.modules.robot``."""
