"""Named users: who they are, what they may do, and where they have signed in.

The users are in one file of WebMap's state folder, ``users.toml``, with the hashes of
their passwords. Each sign-in is a file in the folder ``sessions``, so that a program
beside the server lists and ends sessions without a protocol: a session ends when its
file is removed, or when the user is changed.
"""

import contextlib
import hashlib
import json
import logging
import secrets
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import msgspec

from webmap.base.errors import ConfigError
from webmap.base.plain_files import LARGEST_STATE, read_file, write_file
from webmap.base.roles import ALL_ROBOTS, Role, checked_patterns
from webmap.core.operators import (
    MOST_NAME,
    RESERVED,
    Viewer,
    likeness,
    plain_name,
)
from webmap.server.auth import Attempts, new_token

if TYPE_CHECKING:
    from argon2 import PasswordHasher

log = logging.getLogger("webmap.server")

SESSION_S = 7 * 24 * 3600.0
"""How long a session lasts after its sign-in, in seconds."""

MOST_SESSIONS = 1000
"""Sessions that are kept; the oldest ends for a new one."""

SHORTEST, LONGEST = 8, 256
"""Characters of a password."""

_TRIES = 10, 30, 120
"""Wrong passwords a minute: for one name from one address, from one address, and of all
together. A hash costs 0.1 s."""

WRONG = "The name or the password is wrong."


class UserEntry(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One user."""

    password: Annotated[str, msgspec.Meta(max_length=512)]
    """The hash of the password, by Argon2."""
    role: Role = "viewer"
    """What the user may do: look, drive too, or administer too."""
    robots: tuple[str, ...] = ALL_ROBOTS
    """Which robots the user may drive; see :class:`webmap.core.operators.Viewer`."""


class _File(msgspec.Struct, forbid_unknown_fields=True):
    users: dict[str, UserEntry] = {}


class Session(msgspec.Struct, frozen=True):
    """One browser in which a user has signed in."""

    user: str
    since: float
    """The sign-in, in seconds since 1970."""
    address: str
    proof: str
    """Of the user's entry at the sign-in: when the entry changes, the session ends."""


@dataclass(frozen=True, slots=True)
class Denied:
    """A sign-in that was refused."""

    text: str
    wait: int = 0
    """Seconds after which the next one is considered; 0 for none."""


class UserFile:
    """The file of users.

    Args:
        folder: WebMap's state folder.

    """

    def __init__(self, folder: Path) -> None:
        self.path = folder / "users.toml"

    def read(self) -> dict[str, UserEntry]:
        """Return the users by name; none if there is no file.

        Raises:
            ConfigError: If the file has a mistake.
            OSError: If it cannot be read.

        """
        try:
            data = read_file(self.path, LARGEST_STATE, links=False)
        except FileNotFoundError:
            return {}
        try:
            users = msgspec.toml.decode(data, type=_File).users
        except (msgspec.DecodeError, UnicodeDecodeError) as error:
            raise ConfigError(f"{self.path}: {error}") from None
        for name, user in users.items():
            try:
                checked_user(name)
                checked_patterns(user.robots)
            except ConfigError as error:
                raise ConfigError(f"{self.path}: {error}") from None
        return users

    def write(self, users: dict[str, UserEntry]) -> None:
        """Replace the file.

        Raises:
            OSError: If that is not possible; the file is then as before.

        """
        # JSON's texts are texts of TOML too.
        lines = ["# The users of WebMap; webmap user changes this file."]
        for name, user in users.items():
            lines += [
                "",
                f"[users.{json.dumps(name)}]",
                f"role = {json.dumps(user.role)}",
                f"robots = {json.dumps(user.robots)}",
                f"password = {json.dumps(user.password)}",
            ]
        write_file(self.path, "\n".join([*lines, ""]).encode())

    def add(
        self, name: str, role: Role, password: str, robots: Iterable[str] = ALL_ROBOTS
    ) -> None:
        """Add a user.

        Raises:
            ConfigError: If the name, the password or a pattern of robots is not valid,
                or a user has a name that looks like this one.

        """
        users = self.read()
        same = likeness(checked_user(name))
        if found := next((each for each in users if likeness(each) == same), None):
            raise ConfigError(
                f"there is a user {found!r}, whose name looks like {name!r}"
            )
        entry = UserEntry(hash_of(password), role, checked_patterns(robots))
        self.write(users | {name: entry})

    def change(
        self,
        name: str,
        *,
        password: str | None = None,
        role: Role | None = None,
        robots: Iterable[str] = (),
    ) -> None:
        """Change a user, which ends the sessions of the user.

        Args:
            name: The name of the user.
            password: The new password.
            role: The new role.
            robots: Which robots the user may drive from now on.

        Raises:
            ConfigError: If there is no such user, or what is new is not valid.

        """
        users = self.read()
        old = users[self.known(users, name)]
        changed = UserEntry(
            old.password if password is None else hash_of(password),
            role or old.role,
            checked_patterns(robots or old.robots),
        )
        self.write(users | {name: changed})

    def remove(self, name: str) -> None:
        """Remove a user, which ends the sessions of the user.

        Raises:
            ConfigError: If there is no such user.

        """
        users = self.read()
        del users[self.known(users, name)]
        self.write(users)

    def known(self, users: dict[str, UserEntry], name: str) -> str:
        """Return the name.

        Raises:
            ConfigError: If there is no such user.

        """
        if name not in users:
            listed = ", ".join(users) or "none"
            raise ConfigError(f"there is no user {name!r}; there are: {listed}")
        return name


class SessionFiles:
    """The sessions, one file for each.

    Args:
        folder: WebMap's state folder.

    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder / "sessions"
        self._secret = folder / "sessions-secret"

    def secret(self) -> str:
        """Return the secret that signs cookies; made once.

        Raises:
            OSError: If the folder cannot be used.

        """
        if not self._secret.exists():
            write_file(self._secret, new_token().encode())
        return read_file(self._secret, 1024, links=False).decode("ascii", "replace")

    def names(self) -> frozenset[str]:
        """Return the names of all sessions: they are no secret.

        Raises:
            OSError: If the folder cannot be read.

        """
        with contextlib.suppress(FileNotFoundError):  # nobody has signed in yet
            return frozenset(
                file.stem for file in self.folder.iterdir() if file.suffix == ".json"
            )
        return frozenset()

    def read(self, name: str) -> Session | None:
        """Return a session; None if its file is missing or damaged."""
        try:
            data = read_file(self.folder / f"{name}.json", 4096, links=False)
            return msgspec.json.decode(data, type=Session)
        except (OSError, ConfigError, msgspec.DecodeError, UnicodeDecodeError):
            return None

    def write(self, name: str, session: Session) -> None:
        """Keep a session.

        Raises:
            OSError: If that is not possible.

        """
        write_file(self.folder / f"{name}.json", msgspec.json.encode(session))

    def remove(self, name: str) -> None:
        """End a session."""
        (self.folder / f"{name}.json").unlink(missing_ok=True)

    def all(self) -> Iterator[tuple[str, Session]]:
        """Return the names and the sessions, the newest first."""
        found = [(name, self.read(name)) for name in self.names()]
        known = [(name, session) for name, session in found if session is not None]
        yield from sorted(known, key=lambda each: -each[1].since)


class People:
    """The users and sessions of a running server; used by several threads.

    The lock is never held while a disk is read or written: the thread that passes on
    commands asks who has a session.

    Args:
        folder: WebMap's state folder.
        now: Seconds since 1970.

    Raises:
        ConfigError: If the file of users has a mistake, or the package ``argon2-cffi``
            is not installed.

    """

    def __init__(self, folder: Path, now: Callable[[], float] = time.time) -> None:
        self._file = UserFile(folder)
        self._files = SessionFiles(folder)
        self._now = now
        self._users = self._file.read()
        self._stamp = _stamp(self._file.path)
        self._sessions: dict[str, Session] = {}
        self._tries = [Attempts(limit) for limit in _TRIES]
        self._lock = threading.RLock()
        self.secret = self._files.secret()
        """Signs the cookies and keys of sessions."""
        # So that an unknown name takes as long as a known one.
        self._nobody = hash_of(secrets.token_hex(16))
        self.refresh()

    def viewer(self, session: str) -> Viewer | None:
        """Return who has a session; None if it has ended."""
        with self._lock:
            found = self._sessions.get(_name_of(session))
            if found is None or not self._lasts(found):
                return None
            user = self._users[found.user]
            return Viewer(session, found.user, user.role, True, user.robots)

    def sign_in(self, name: str, password: str, address: str) -> str | Denied:
        """Return a new session; takes a tenth of a second and 64 MiB.

        Called by one thread at a time, so that wrong passwords are counted before the
        next one is compared.

        Args:
            name: The name of a user.
            password: The user's password.
            address: The address of the browser.

        """
        now = time.monotonic()
        keys = f"{address} {name[:MOST_NAME]}", address, ""
        tries = [*zip(self._tries, keys, strict=True)]
        with self._lock:
            wait = max(each.wait(key, now) for each, key in tries)
            if wait:
                text = f"Too many wrong passwords: try again after {wait} s."
                return Denied(text, wait)
            user = self._users.get(name)
        right = _fits(user.password if user else self._nobody, password[:LONGEST])
        if not right or user is None:
            with self._lock:
                for each, key in tries:
                    each.failed(key, now)
            return Denied(WRONG)
        session = secrets.token_urlsafe(16)
        made = Session(name, self._now(), address, _proof(user))
        try:
            self._files.write(_name_of(session), made)
        except OSError as error:
            log.error("%s cannot sign in: %s: %s", name, self._files.folder, error)
            return Denied("WebMap cannot keep your sign-in: its disk may be full.")
        with self._lock:
            self._sessions[_name_of(session)] = made
            oldest = sorted(self._sessions, key=lambda each: self._sessions[each].since)
        for ended in oldest[: max(0, len(oldest) - MOST_SESSIONS)]:
            self._files.remove(ended)
        return session

    def end(self, session: str) -> None:
        """End a session: its user signs out."""
        self._files.remove(_name_of(session))
        with self._lock:
            self._sessions.pop(_name_of(session), None)

    def refresh(self) -> None:
        """Read what has changed in the files.

        Raises:
            ConfigError: If the file of users has a mistake; the users stay as before.
            OSError: If it cannot be read; as above.

        """
        with self._lock:
            known = {*self._sessions}
        names = self._files.names()
        read = {name: self._files.read(name) for name in names - known}
        with self._lock:
            # A sign-in of this moment is in neither set.
            for name in known - names:
                self._sessions.pop(name, None)
            self._sessions.update(
                (name, found) for name, found in read.items() if found is not None
            )
        try:
            self._read_users()
        finally:
            with self._lock:
                ended = [
                    n for n, each in self._sessions.items() if not self._lasts(each)
                ]
                for name in ended:
                    del self._sessions[name]
            for name in ended:
                self._files.remove(name)

    def _read_users(self) -> None:
        stamp = _stamp(self._file.path)
        if stamp != self._stamp:
            self._stamp = stamp
            users = self._file.read()
            with self._lock:
                self._users = users

    def _lasts(self, session: Session) -> bool:
        user = self._users.get(session.user)
        age = self._now() - session.since
        return user is not None and session.proof == _proof(user) and age < SESSION_S


def checked_user(name: str) -> str:
    """Return the name of a user.

    Raises:
        ConfigError: If it is not a name on one line, or other people could not tell
            whose name it is.

    """
    if not likeness(name) or plain_name(name, MOST_NAME) != name:
        raise ConfigError(
            f"the name of a user has 1 to {MOST_NAME} characters on one line, with a "
            f"letter or a digit and without parentheses, got {name!r}"
        )
    if likeness(name) in RESERVED:
        raise ConfigError(f"other people could not tell whose name {name!r} is")
    return name


def hash_of(password: str) -> str:
    """Return the hash of a password.

    Raises:
        ConfigError: If the password is too short or too long, or the package
            ``argon2-cffi`` is not installed.

    """
    if not SHORTEST <= len(password) <= LONGEST:
        raise ConfigError(
            f"a password has {SHORTEST} to {LONGEST} characters, got {len(password)}"
        )
    return _hasher().hash(password)


def _hasher() -> "PasswordHasher":
    try:
        from argon2 import PasswordHasher
    except ImportError:
        raise ConfigError(
            "named users need the package argon2-cffi, which is not installed: "
            "pip install 'webmap[auth]'"
        ) from None
    return PasswordHasher()


def _fits(hash: str, password: str) -> bool:
    from argon2.exceptions import InvalidHashError, VerificationError

    try:
        return _hasher().verify(hash, password)
    except (InvalidHashError, VerificationError):
        return False


def _proof(user: UserEntry) -> str:
    # As before there were patterns, so that a new version ends no session.
    robots = "" if user.robots == ALL_ROBOTS else "\n" + json.dumps(user.robots)
    text = f"{user.role}\n{user.password}{robots}"
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def _name_of(session: str) -> str:
    """Return the name of a session's file, which does not reveal the session."""
    return hashlib.sha256(session.encode()).hexdigest()[:16]


def _stamp(file: Path) -> tuple[int, int, int] | None:
    try:
        found = file.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size, found.st_ino
