"""Namespaces of modules: each name of a module and its class."""

import difflib
import importlib
import logging
import pkgutil
from collections.abc import Callable, Iterator
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from importlib.util import find_spec
from typing import Any, TypeVar

from webmap.base.errors import ModuleNotFound

log = logging.getLogger("webmap.modules")

Factory = Callable[..., Any]
T = TypeVar("T", bound=Factory)

BUILT_IN = "webmap.features"
"""The package of the built-in modules; each of its folders is a subpackage.

Its ``FILES`` has the file of each module that is not in a file of its own name.
"""

_imported: set[str] = set()
"""The files of built-in modules that were imported, also those without a module."""


class Namespace:
    """The modules that one kind of owner can add, by name.

    A module is registered by :meth:`register`. A built-in module is a class of
    ``webmap.features``, mostly in a file of the same name: ``LaserScanner`` is in
    ``laser_scanner.py``, which is imported when the name is first used. Modules that
    share a file are in ``FILES`` there. Another package has an entry point for each of
    its modules.

    Args:
        kind: The kind of the owner, for error messages.
        group: The group of the entry points; without it there are no entry points and
            no built-in modules.

    """

    def __init__(self, kind: str, group: str | None = None) -> None:
        self.kind = kind
        self._group = group
        self._registered: dict[str, Factory] = {}
        self._entry_points: dict[str, EntryPoint] | None = None
        self._broken: set[str] = set()

    def register(self, factory: T, /, *, name: str | None = None) -> T:
        """Register a module under its class's name, or under ``name`` (decorator).

        Args:
            factory: Called with the owner and the arguments of ``add_module``; returns
                the module. Usually a class.
            name: The module's name, if it differs from the class's.

        Raises:
            ValueError: If the name is already used.

        """
        name = name or factory.__name__
        if not factory.__module__.startswith(f"{BUILT_IN}."):
            self._look_for(name)
            found = self._other_packages().get(name)
            if found is not None and not _provides(found, factory):
                raise ValueError(
                    f"the {self.kind} module {name!r} is already provided by "
                    f"{found.value}: choose another name"
                )
        known = self._registered.get(name)
        if known is not None and not _same_source(known, factory):
            raise ValueError(
                f"the {self.kind} module {name!r} is already registered as "
                f"{known.__module__}.{known.__qualname__}: choose another name"
            )
        self._registered[name] = factory
        return factory

    def names(self) -> list[str]:
        """Return the names of all modules, sorted."""
        for name in _built_in_files():
            self._look_for(name)
        return sorted({*self._registered, *self._other_packages()})

    def __getitem__(self, name: str) -> Factory:
        """Return the factory of the module ``name``.

        Raises:
            ModuleNotFound: If there is none; the message lists all modules.

        """
        if name in self:
            if name not in self._registered:
                self._registered[name] = self._other_packages()[name].load()
            return self._registered[name]
        raise ModuleNotFound(self._not_found(name))

    def __contains__(self, name: object) -> bool:
        self._look_for(name)
        return name in self._registered or name in self._other_packages()

    def __iter__(self) -> Iterator[Factory]:
        """Yield each module's factory; log once each that cannot be loaded."""
        for name in self.names():
            if name in self._broken:
                continue
            try:
                yield self[name]
            except Exception:  # another package may raise anything
                self._broken.add(name)
                log.exception("the %s module %r cannot be loaded", self.kind, name)

    def _not_found(self, name: str) -> str:
        names = self.names()
        near = difflib.get_close_matches(name, names, n=1)
        hint = f" Did you mean {near[0]!r}?" if near else ""
        listed = ", ".join(names) or "none"
        return f"there is no {self.kind} module {name!r}.{hint} There are: {listed}."

    def _look_for(self, name: object) -> None:
        """Import the built-in file of that name, which registers its class."""
        file = None if self._group is None else _built_in_files().get(name)
        if file is None or name in self._registered or file in _imported:
            return
        importlib.import_module(file)
        _imported.add(file)  # only now: another thread may import it too

    def _other_packages(self) -> dict[str, EntryPoint]:
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


@cache
def _built_in_files() -> dict[object, str]:
    """Return the files of the built-in modules in all folders, by class name.

    Some files have no class of that name: a folder has other files too.
    """
    files: dict[object, str] = {}
    folders = find_spec(BUILT_IN)
    assert folders is not None
    for folder in pkgutil.iter_modules(folders.submodule_search_locations):
        spec = find_spec(f"{BUILT_IN}.{folder.name}")
        assert spec is not None
        for file in pkgutil.iter_modules(spec.submodule_search_locations or ()):
            name = "".join(word.capitalize() for word in file.name.split("_"))
            files[name] = f"{BUILT_IN}.{folder.name}.{file.name}"
    for name, path in importlib.import_module(BUILT_IN).FILES.items():
        files[name] = f"{BUILT_IN}.{path}"
    return files


def _provides(found: EntryPoint, factory: Factory) -> bool:
    """Return whether an entry point loads the factory of a module."""
    inside = f"{factory.__module__}.".startswith(f"{found.module}.")
    return inside and found.attr == factory.__qualname__


def _same_source(one: Factory, other: Factory) -> bool:
    """Return whether a name was only defined again, as when a script is reloaded."""
    return (one.__module__, one.__qualname__) == (other.__module__, other.__qualname__)


map_modules = Namespace("map", "webmap.modules.map")
"""The modules of maps: ``webmap.modules.map``."""

robot_modules = Namespace("robot", "webmap.modules.robot")
"""The modules of robots: ``webmap.modules.robot``."""
