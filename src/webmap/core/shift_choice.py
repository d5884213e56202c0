"""Which entries of the shift log a person sees, and the same as CSV. No I/O."""

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from webmap.base.roles import Role
from webmap.core.shift_files import Entry

KINDS = {
    "stop": "STOP",
    "reset": "Reset",
    "drive": "Driving",
    "control": "Control",
    "request": "Request",
    "limits": "Limits",
    "goal": "Goal",
    "pose": "Pose",
    "button": "Button",
    "alert": "Alert",
    "check": "Check",
    "recording": "Recording",
    "note": "Note",
    "shift": "Shift",
    "page": "Page",
    "name": "Name",
    "link": "Connection",
    "webmap": "WebMap",
    "log": "Log",
    "sign-in": "Sign-in",
    "sign-in-failed": "Failed sign-in",
    "refused": "Refused",
}
"""The kinds of entries with their names for people; other kinds are their own name."""

ALL, PAGE = "all", "page"
"""The choice of all kinds, and the kind that is left out otherwise: each page that is
opened and left has an entry."""

FOR_ADMINS = frozenset({"sign-in", "sign-in-failed", "refused"})
"""Kinds that only admins see."""

SINCE = {"shift": None, "12": 12 * 3600.0, "24": 24 * 3600.0, "all": float("inf")}
"""The choices of a period, in seconds; None is this shift."""

SHIFT = 12 * 3600.0
"""How long a shift lasts at most, in seconds."""

SAME_SHIFT = 30 * 60.0
"""Seconds for which a hand-over still shows the shift that it ended: people print the
page again."""


@dataclass(frozen=True, slots=True)
class Choice:
    """The entries that a person wants to see; an empty text means all."""

    since: str = "shift"
    """A key of :data:`SINCE`."""
    robot: str = ""
    """The id of a robot."""
    person: str = ""
    kind: str = ""
    """A kind, or :data:`ALL`; empty for all but :data:`PAGE`."""

    @classmethod
    def of(cls, values: Mapping[str, object]) -> "Choice":
        """Return the choice that a browser states; wrong values mean all."""
        texts = {
            name: str(values.get(name) or "")[:100]
            for name in ("since", "robot", "person", "kind")
        }
        if texts["since"] not in SINCE:
            texts["since"] = "shift"
        return cls(**texts)

    def begins(self, entries: Sequence[Entry], now: float) -> float:
        """Return the time from which on entries are chosen, in seconds since 1970."""
        seconds = SINCE[self.since]
        return shift_began(entries, now) if seconds is None else now - seconds

    def has(self, entry: Entry, role: Role) -> bool:
        """Return whether an entry is chosen, apart from its time."""
        return (
            may_see(entry, role)
            and self.robot in ("", entry.robot)
            and self.person in ("", entry.person)
            and (self.kind in (ALL, entry.kind) or self._is_usual(entry))
        )

    def _is_usual(self, entry: Entry) -> bool:
        return not self.kind and entry.kind != PAGE

    def chosen(self, entries: Sequence[Entry], role: Role, now: float) -> list[Entry]:
        """Return the chosen entries, the oldest first."""
        begins = self.begins(entries, now)
        return [e for e in entries if e.unix >= begins and self.has(e, role)]


def may_see(entry: Entry, role: Role) -> bool:
    """Return whether a person of a role may see an entry."""
    return role == "admin" or entry.kind not in FOR_ADMINS


def shift_began(entries: Iterable[Entry], now: float) -> float:
    """Return when this shift began: at the last hand-over, at most 12 h ago."""
    over = [e.unix for e in entries if e.kind == "shift" and now - e.unix > SAME_SHIFT]
    return max([now - SHIFT, *over])


FORMULA = ("=", "+", "-", "@")

COLUMNS = ("time", "kind", "robot", "person", "verified", "place", "text", "facts")


def csv_of(entries: Iterable[Entry]) -> str:
    """Return entries as CSV, with no cell that a spreadsheet takes for a formula."""
    out = io.StringIO()
    table = csv.writer(out)
    table.writerow(COLUMNS)
    for entry in entries:
        verified = {True: "yes", False: "no", None: ""}[entry.verified]
        facts = "; ".join(f"{name}: {value}" for name, value in entry.facts.items())
        row = [
            entry.time,
            entry.kind,
            entry.robot_name or entry.robot,
            entry.person,
            verified,
            entry.place,
            entry.text,
            facts,
        ]
        table.writerow([_harmless(cell) for cell in row])
    return out.getvalue()


def _harmless(cell: str) -> str:
    # Spreadsheets skip spaces before a formula.
    return f"'{cell}" if cell.lstrip().startswith(FORMULA) else cell
