"""Base class of maps and robots: owner of modules."""

import inspect
import logging
from collections.abc import Callable
from functools import partial
from typing import Any

from webmap.base.errors import ConfigError
from webmap.base.scope import Scope, enter_scope, leave_scope
from webmap.base.tasks import begin
from webmap.core.module_arguments import check_arguments
from webmap.core.registry import Namespace

log = logging.getLogger("webmap.modules")


class Extendable:
    """An object that modules extend and that fires triggers on them.

    Any object can be a module. :meth:`add_module` constructs a module with its owner as
    the first argument. A method named like a trigger is called when the trigger fires.
    The method may be a coroutine function; the other modules do not wait for it.
    """

    def __init__(self, namespace: Namespace) -> None:
        self.namespace = namespace
        self.modules: list[Any] = []
        self._scopes: dict[int, Scope] = {}
        self._made: dict[int, tuple[str, tuple[Any, ...], dict[str, Any]]] = {}
        self._destroyed = False
        """Whether it was destroyed; modules added later would never be removed."""

    def add_module(
        self, name: str | Callable[..., Any], /, *args: Any, **kwargs: Any
    ) -> Any:
        """Construct a module and add it.

        Args:
            name: The module's name in the owner's namespace, or its factory.
            *args: Positional arguments for the module's constructor, after its owner.
            **kwargs: Keyword arguments for the module's constructor.

        Returns:
            The module, to keep for :meth:`remove_module`.

        Raises:
            ModuleNotFound: If the namespace has no module of that name.
            ConfigError: If an argument has not the type of the module's annotation (the
                error is also a ``TypeError``), or if the owner was destroyed.

        """
        if self._destroyed:
            raise ConfigError(
                f"{self!r} was destroyed, so no module can be added to it: nothing "
                "would ever end it"
            )
        factory = self.namespace[name] if isinstance(name, str) else name
        check_arguments(factory, args, kwargs)
        scope = Scope(f"{factory}", self._failed, self.clear_problem)
        try:
            with scope.active():
                module = factory(self, *args, **kwargs)
        except BaseException:
            scope.close()
            raise
        self.modules.append(module)
        self._scopes[id(module)] = scope
        if isinstance(name, str):
            self._made[id(module)] = (name, args, kwargs)
        return module

    def module_arguments(self) -> list[tuple[str, tuple[Any, ...], dict[str, Any]]]:
        """Return name and arguments of every module that was added by name."""
        made = (self._made.get(id(module)) for module in self.modules)
        return [arguments for arguments in made if arguments is not None]

    def find_module(self, name: str) -> Any:
        """Return the first module that was added by this name, or None."""
        for module in self.modules:
            if self._made.get(id(module), ("",))[0] == name:
                return module
        return None

    def arguments_of(
        self, module: Any
    ) -> tuple[str, tuple[Any, ...], dict[str, Any]] | None:
        """Return name and arguments of a module; None if it was not added by name."""
        return self._made.get(id(module))

    def remove_module(self, module: Any) -> None:
        """Remove a module: call its ``destroy()`` and release its resources.

        Raises:
            ValueError: If the module does not belong to this owner.

        """
        for index, known in enumerate(self.modules):
            if known is module:
                del self.modules[index]
                break
        else:
            raise ValueError(f"{module!r} is not a module of {self!r}")
        scope = self._scopes.pop(id(module))
        self._made.pop(id(module), None)
        try:
            self._call(module, "destroy", ())
        finally:
            scope.close()

    def remove_modules(self) -> None:
        """Remove every module, in reverse order."""
        while self.modules:
            self.remove_module(self.modules[-1])

    def notify_modules(self, trigger: str, /, *args: Any) -> None:
        """Call the method ``trigger`` on every module that has it.

        An exception of one module is reported; the other modules are still called.
        """
        for module in tuple(self.modules):
            self._call(module, trigger, args)

    def report_error(self, text: str) -> None:
        """Show a failure of this owner to people; the log already has it."""

    def set_problem(self, about: object, text: str) -> None:
        """Show a failure until :meth:`clear_problem`."""
        self.report_error(text)

    def clear_problem(self, about: object) -> None:
        """Remove the failure shown for ``about``."""

    def _failed(self, text: str, about: object) -> None:
        if about is None:
            self.report_error(text)
        else:
            self.set_problem(about, text)

    def _call(self, module: Any, name: str, args: tuple[Any, ...]) -> None:
        method = getattr(module, name, None)
        if method is None:
            return
        before = enter_scope(self._scopes.get(id(module)))
        try:
            result = method(*args)
            if result is not None and inspect.isawaitable(result):
                begin(result, partial(self._report, module, name))
        except Exception as error:
            self._report(module, name, error)
        finally:
            leave_scope(before)

    def _report(self, module: Any, name: str, error: Exception) -> None:
        what = f"{type(module).__name__}.{name}"
        log.error("module %s of %r failed", what, self, exc_info=error)
        self.report_error(f"{what} failed: {type(error).__name__}: {error}")
