"""Who the viewers are for other people: the names that they state, and their places.

A name is not a proof: everybody who has signed in may state any name. No decision
depends on it. What it must not do is look like another one: it is short, on one line,
without characters that cannot be seen or that turn text around, and two people who
state the same name and place get numbers.
"""

import contextlib
import hashlib
import logging
import secrets
import threading
import unicodedata
from collections import OrderedDict
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Protocol

from webmap.base.roles import ALL_ROBOTS, Role, checked_patterns, covers, includes
from webmap.base.text import isolated
from webmap.core.shift_log import shift_log
from webmap.gate.protocol import Identity

log = logging.getLogger("webmap.operators")

named_robots: dict[str, tuple[str, tuple[str, ...]]] = {}
"""The name and the tags of each robot by its id, for the rights of people; read by all
threads."""

MOST_NAME, MOST_PLACE = 34, 24
"""Characters of a name and of a place; the rest is cut.

A name with its place then has 64 at most, which fit everywhere.
"""

MOST_KNOWN = 1000
"""Viewers that are remembered; the one whose last page closed first is forgotten."""

RESERVED = frozenset(
    {"you", "youonanotherpage", "yourotherpage", "program", "webmap", "anoperator"}
)
"""What pages call others than a person with a name, as :func:`likeness` returns it."""

INVISIBLE = frozenset("\u115f\u1160\u2800\u3164\uffa0")
"""Letters and symbols that show nothing."""


@dataclass(frozen=True, slots=True)
class Operator:
    """Who a viewer is for other people."""

    name: str
    """Empty if the viewer has stated none."""

    place: str
    """Where to find this person; empty if not stated."""

    person: str
    """The same as long as WebMap runs, whatever the name is."""

    address: str = ""
    """Where the browser is, for people; used if no place is stated."""

    number: int = 1
    """Larger than 1 if others with open pages have the same name and place."""

    verified: bool = False
    """Whether a sign-in has verified the name."""

    @property
    def label(self) -> str:
        """The name and the place in one text, which no other person has now."""
        number = "" if self.number == 1 else f" {self.number}"
        place = self.place or self.address
        if self.name:
            return f"{self.name}{number} ({place})" if place else self.name + number
        who = f"operator{number}" if number else "an operator"
        return f"{who} at {place} (no name)" if place else f"{who} (no name)"

    @property
    def logged(self) -> str:
        """The label for a log or a file, which states that it is not verified."""
        stated = self.name and not self.verified
        return f"{self.label} [name not verified]" if stated else self.label

    def __str__(self) -> str:
        """Return the label for a page."""
        return isolated(self.label)


@dataclass(frozen=True, slots=True)
class Viewer:
    """One browser that has signed in; all its pages are one viewer."""

    id: str
    """Opaque; the same while the browser stays signed in."""

    name: str = ""
    """The name that a sign-in has verified; empty if the page asks for a name."""

    role: Role = "operator"
    """What the viewer may do: watch, drive, or administer."""

    signs_out: bool = False
    """Whether WebMap has a session of this viewer that the page can end."""

    robots: tuple[str, ...] = ALL_ROBOTS
    """Which robots the viewer may drive, if the role allows it: patterns of their names
    (``"bay2/*"``), or of their tags (``"tag:bay 2"``)."""

    def __post_init__(self) -> None:
        """Check the patterns.

        Raises:
            ConfigError: If one is not valid.

        """
        if self.robots is not ALL_ROBOTS:
            object.__setattr__(self, "robots", checked_patterns(self.robots))

    def may_drive(self, robot: str) -> bool:
        """Return whether this viewer may command a robot, and not only stop it.

        Args:
            robot: The ``id`` of a robot; one that is unknown belongs to those who may
                drive every robot.

        """
        if not covers(self.role, "operator"):
            return False
        name, tags = named_robots.get(robot, ("", ()))
        return "*" in self.robots or includes(self.robots, name, tags)

    @property
    def operator(self) -> Operator:
        """Who this viewer is for other people now."""
        return operators.of(self)

    def rename(self, name: str, place: str = "") -> str:
        """Set what this viewer states; return why that is refused, or an empty text."""
        return operators.rename(self, name, place)

    def calls(self, by: Operator | str) -> str:
        """Return what this viewer's pages call an operator or a program."""
        is_own = isinstance(by, Operator) and by.person == self.operator.person
        return "you" if is_own else str(by)


class Renamed(Protocol):
    """A page's connection to the gates."""

    def rename(self, name: str) -> None:
        """Show the person at the page under another name from now on."""


@dataclass(slots=True)
class _Known:
    """What is known of one viewer."""

    name: str = ""
    verified: bool = False
    place: str = ""
    address: str = ""
    number: int = 1
    pages: int = 0
    """The number of open sockets."""
    connections: list[Renamed] = field(default_factory=list)


class Operators:
    """The names of all viewers; used by the web thread and the model's thread."""

    def __init__(self) -> None:
        self._known: OrderedDict[str, _Known] = OrderedDict()
        self._lock = threading.RLock()
        self._secret = secrets.token_bytes(16)

    def of(self, viewer: Viewer) -> Operator:
        """Return who a viewer is now."""
        with self._lock:
            return self._operator(viewer.id, self._known.get(viewer.id) or _new(viewer))

    def identity(self, viewer: Viewer, page: str) -> Identity:
        """Return what tells this viewer and this page from all others."""
        return Identity(
            self._mark(viewer.id), self._mark(viewer.id, page), bool(viewer.name)
        )

    @contextlib.contextmanager
    def present(self, viewer: Viewer, address: str) -> Iterator[None]:
        """Note that a socket of a viewer is open.

        Args:
            viewer: The viewer.
            address: The place of the browser, if the viewer states none.

        """
        with self._lock:
            known = self._known.setdefault(viewer.id, _new(viewer))
            before, known.address = known.address, plain_name(address, MOST_PLACE)
            if known.pages == 0 or known.address != before:
                self._settle(viewer, known)
            known.pages += 1
        try:
            yield
        finally:
            with self._lock:
                known.pages -= 1
                self._known.move_to_end(viewer.id)
                absent = [id for id, each in self._known.items() if not each.pages]
                for id in absent[: max(0, len(self._known) - MOST_KNOWN)]:
                    del self._known[id]

    @contextlib.contextmanager
    def following(self, viewer: Viewer, connection: Renamed) -> Iterator[None]:
        """Rename a connection whenever its viewer, who is present, is renamed."""
        with self._lock:
            known = self._known[viewer.id]
            known.connections.append(connection)
            connection.rename(self.of(viewer).label)
        try:
            yield
        finally:
            with self._lock:
                known.connections.remove(connection)

    def rename(self, viewer: Viewer, name: str, place: str) -> str:
        """Set what a viewer states; return why that is refused, or an empty text."""
        if viewer.name:
            return "Your name comes from the sign-in of this application."
        name, place = plain_name(name, MOST_NAME), plain_name(place, MOST_PLACE)
        if name and not likeness(name):
            return "A name needs a letter or a digit."
        if likeness(name) in RESERVED:
            return f"Other people could not tell whose name {name} is."
        with self._lock:
            before = self.of(viewer)
            known = self._known.setdefault(viewer.id, _new(viewer))
            known.name, known.place = name, place
            self._settle(viewer, known)
            now = self.of(viewer)
            if now != before:
                log.info("%s is %s from now on", before.logged, now.logged)
                shift_log.note("name", f"was {before.label} before", person=now)
        return ""

    def _settle(self, viewer: Viewer, known: _Known) -> None:
        """Number the viewer so that no present label is like this one, and show it."""
        taken = {
            likeness(self._operator(id, each).label)
            for id, each in self._known.items()
            if each.pages and each is not known
        }
        known.number = 1
        while likeness(self.of(viewer).label) in taken:
            known.number += 1
        for connection in known.connections:
            connection.rename(self.of(viewer).label)

    def _operator(self, id: str, known: _Known) -> Operator:
        return Operator(
            known.name,
            known.place,
            self._mark(id),
            "" if known.verified else known.address,
            known.number,
            known.verified,
        )

    def _mark(self, *parts: str) -> str:
        """Return a text that others may know: it does not reveal the viewer's id."""
        text = "\n".join(parts).encode(errors="replace")
        return hashlib.blake2b(text, key=self._secret, digest_size=5).hexdigest()


def _new(viewer: Viewer) -> _Known:
    return _Known(plain_name(viewer.name, MOST_NAME), bool(viewer.name))


operators = Operators()
"""The operators of this process."""


def plain_name(text: str, most: int) -> str:
    """Return a text as a short name on one line, in which every character shows.

    Parentheses are left out: a name would pretend to have a place.
    """
    text = unicodedata.normalize("NFC", text[: 4 * most])
    shown = "".join(c if c.isspace() or _shows(c) else "" for c in text)
    name = " ".join(shown.split())
    return name if len(name) <= most else f"{name[: most - 1].rstrip()}\u2026"


def _shows(character: str) -> bool:
    if unicodedata.category(character)[0] == "C" or character in INVISIBLE:
        return False
    return unicodedata.normalize("NFKC", character) not in ("(", ")")


def likeness(name: str) -> str:
    """Return what two names that look alike have in common: letters and digits."""
    text = unicodedata.normalize("NFKD", name).casefold()
    return "".join(c for c in text if c.isalnum())
