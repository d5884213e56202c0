"""What a page needs of others: its socket, its files, and who is looking."""

from pathlib import Path
from typing import Any, Protocol

from webmap.scene.fragment import Fragment


class PageChannel(Protocol):
    """What core asks of the socket to one page; :mod:`webmap.wire` provides it."""

    def mount(
        self,
        fragment: Fragment,
        *,
        under: int,
        order: float = 0,
        within: int | None = None,
    ) -> int:
        """Show a fragment under an element; return the mount's number."""

    def unmount(self, mount: int) -> None:
        """Take a mounted fragment away."""

    def set_class(self, mount: int, name: str, on: bool) -> None:
        """Set a class on the fragment's root in this page only."""

    def listen(
        self, mount: int, element: int, event: str, *, prevent: bool, stop: bool
    ) -> None:
        """Hear of an event on an element, in this page only; again for other flags."""

    def unlisten(self, mount: int, element: int, event: str) -> None:
        """Hear of it no more."""

    def view(self, map_element: int, operation: str, *args: float) -> None:
        """Apply an operation to a map's view."""

    def attach(
        self,
        map_element: int,
        instance: int,
        module_url: str,
        options: dict[str, Any],
        css_url: str | None = None,
    ) -> None:
        """Load the browser half of a module."""

    def detach(self, instance: int) -> None:
        """Take the browser half of a module away."""

    def send(self, instance: int, message: dict[str, Any]) -> None:
        """Send a message to the browser half of a module."""

    def error(self, text: str) -> None:
        """Show a notice."""

    def problem(self, number: int, text: str) -> None:
        """Show what fails until :meth:`mended`; a new text takes its place."""

    def mended(self, number: int) -> None:
        """Take back what was said under that number; it may be unknown."""


class Publisher(Protocol):
    """Where files get URLs by which a page can load them."""

    def publish_file(self, path: Path) -> str:
        """Let pages load an ES module or a style sheet; return its URL."""

    def publish_image(self, image: Path) -> str:
        """Let pages load an image; return the URL of this version of it."""

    def withdraw_image(self, url: str) -> None:
        """Undo one :meth:`publish_image`."""


class Viewer(Protocol):
    """One person's browser, signed in."""

    @property
    def id(self) -> str:
        """Opaque, the same for as long as the browser stays signed in."""

    @property
    def name(self) -> str:
        """What other people read when this viewer drives."""

    @property
    def role(self) -> str:
        """``"viewer"``, ``"operator"`` or ``"admin"``."""
