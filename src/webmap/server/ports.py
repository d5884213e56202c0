"""What the web application asks of the rooms below it.

All of this is called in the web thread unless it says otherwise, and none of it may
block: a viewer's socket waits while it runs.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Protocol

from webmap.server.viewer import Role, Viewer


class PageEntry(Protocol):
    """A URL at which there is a page."""

    @property
    def path(self) -> str:
        """Where the page is, from the application's root: ``"/"``, ``"/lab"``."""

    @property
    def html(self) -> Path | None:
        """The user's own HTML file; a page with one container is made without it."""

    @property
    def folder(self) -> Path | None:
        """The folder whose files a page with its own HTML may load."""

    @property
    def title(self) -> str:
        """The title of a page that is made."""


class Site(Protocol):
    """The pages there are; looked up at each request, so they may change."""

    @property
    def pages(self) -> Mapping[str, PageEntry]:
        """The pages by path."""


class Outbox(Protocol):
    """The way of finished bytes to one page; callable from any thread."""

    def offer(self, data: bytes) -> None:
        """Send one binary frame soon; nothing happens once the page is gone."""

    def close(self, reason: str) -> None:
        """End the socket and tell the page why."""


class SceneHandle(Protocol):
    """The model's side of one open ``/scene`` socket."""

    def receive(self, text: str) -> None:
        """Take one message of the page, of at most 16 KiB and any content."""

    def closed(self) -> None:
        """Note that the socket is gone; called exactly once."""


class DriveConnection(Protocol):
    """The gate's side of one open ``/drive`` socket."""

    def receive(self, text: str | bytes) -> None:
        """Hand one message of the page to the gate unread.

        It has at most 1 KiB, unless it is a STOP that breaks a rule: bytes are one
        that came in a binary frame or is not UTF-8.
        """

    def set_speeds(self, v: float, w: float) -> None:
        """Set the most that this connection's hands may ask for, in m/s and rad/s."""

    def close(self) -> None:
        """Note that the socket is gone: the leases of this connection end."""


class Model(Protocol):
    """What owns the pages' contents, in a thread of its own."""

    def open_scene(
        self, entry_path: str, page_id: str, viewer: Viewer, outbox: Outbox
    ) -> SceneHandle:
        """Take up a page whose socket has opened; return without waiting."""

    def drive_opened(
        self, page_id: str, viewer: Viewer, connection: DriveConnection
    ) -> None:
        """Note by which connection a page drives, to set its speeds."""

    def drive_closed(
        self, page_id: str, viewer: Viewer, connection: DriveConnection
    ) -> None:
        """Note that this connection is gone; another may have replaced it before."""

    def refused(self, viewer: Viewer, why: str) -> None:
        """Count a message whose socket is ended for it."""


class Gate(Protocol):
    """What takes commands to the process that alone may move robots."""

    def connect(
        self,
        name: str,
        role: Role,
        send: Callable[[str], None],
        close: Callable[[str], None],
    ) -> DriveConnection:
        """Open a connection; both callbacks may be called from any thread."""
