"""The panel with the shift log: its entries, notes of people, and the hand-over."""

import time
from collections.abc import Iterable, Mapping
from typing import Any, ClassVar

from webmap.base.roles import Role
from webmap.core.map import Map
from webmap.core.shift_choice import KINDS, Choice, may_see
from webmap.core.shift_files import Entry
from webmap.core.shift_log import RobotName, shift_log

MOST_ROWS = 200
"""Entries that the panel lists; the CSV has more."""

MOST_NAMES = 200
"""Robots and people that can be chosen."""

LONGEST_NOTE = 300
"""Characters of a note."""


class ShiftPanel:
    """A panel that unfolds into the shift log; a module of maps.

    Everybody sees the entries, except those about sign-ins and refusals, which only
    admins see. Operators add notes.

    Args:
        map: The map.
        hand_over: The path of the page that hands over a shift.
    """

    MAY_SEND: ClassVar[Mapping[str, Role]] = {
        "show": "viewer",
        "note": "operator",
        "about": "operator",
        "shift": "operator",
    }

    def __init__(self, map: Map, hand_over: str) -> None:
        self.map = map
        self._viewer = map.page.viewer
        self._choice: Choice | None = None
        """What the page shows; None while the panel is folded."""
        self._sent = 0, 0, ""
        self._offered: set[str] = set()
        """The robots, people and kinds that the page can choose."""
        self.browser_part = map.add_browser_part(
            self,
            "features/shift_log/shift_panel.js",
            {
                "kinds": KINDS,
                "rows": MOST_ROWS,
                "note": LONGEST_NOTE,
                "page": hand_over.removeprefix("/"),
                "may": self._viewer.role != "viewer",
            },
            "features/shift_log/shift_panel.css",
        )

    def on_ready(self) -> None:
        """Forget what a page that was loaded again showed."""
        self._choice, self._sent = None, (0, 0, "")

    def on_message(self, message: dict[str, Any]) -> None:
        """Show entries, add a note, or begin another shift."""
        if "show" in message:
            show = message["show"]
            self._choice = Choice.of(show) if isinstance(show, dict) else None
            self._send_all()
        if "note" in message:
            self._note(message["note"], message.get("about"))
        if message.get("shift") is True:
            by = self._viewer.operator
            shift_log.note("shift", "handed over the shift", person=by)

    def poll(self) -> None:
        """Send the page the new entries."""
        total, restored, trouble = _state()
        if self._sent == (total, restored, trouble):
            return
        if self._choice is None:
            if trouble != self._sent[2]:
                self._send({"new": []})
            return
        new, role = shift_log.since(self._sent[0]), self._viewer.role
        names = {
            name for entry in new if may_see(entry, role) for name in _names(entry)
        }
        if restored != self._sent[1] or not names <= self._offered:
            self._send_all()
            return
        chosen = [entry for entry in new if self._choice.has(entry, role)]
        self._send({"new": _rows(chosen)})

    def _send_all(self) -> None:
        if self._choice is None:
            return
        entries, role = shift_log.entries(), self._viewer.role
        chosen = self._choice.chosen(entries, role, time.time())
        seen = [entry for entry in entries if may_see(entry, role)]
        robots = {e.robot: e.robot_name for e in seen if e.robot}
        self._offered = {name for entry in seen for name in _names(entry)}
        self._send(
            {
                "all": _rows(chosen[-MOST_ROWS:]),
                "count": len(chosen),
                "robots": sorted(robots.items(), key=lambda each: each[1])[:MOST_NAMES],
                "people": sorted({e.person for e in seen if e.person})[:MOST_NAMES],
                "has": sorted({e.kind for e in seen}),
            }
        )

    def _send(self, message: dict[str, Any]) -> None:
        self._sent = _state()
        trouble = shift_log.trouble
        if trouble and shift_log.lost:
            trouble = f"{trouble} Missing entries: {shift_log.lost}"
        self.browser_part.send({**message, "trouble": trouble})

    def _note(self, note: object, about: object) -> None:
        text = note.strip() if isinstance(note, str) else ""
        robot = self.map.find_robot(about) if about else None
        named = None if robot is None else RobotName(robot.id, robot.name)
        person = self._viewer.operator
        if not text or len(text) > LONGEST_NOTE:
            problem = f"A note has 1 to {LONGEST_NOTE} characters."
        elif shift_log.note("note", text, robot=named, person=person):
            problem = ""
        else:
            problem = "Too many notes in a short time: try again in a minute."
        self.browser_part.send({"problem": problem})


def _names(entry: Entry) -> tuple[str, ...]:
    return entry.robot, entry.person, entry.kind


def _state() -> tuple[int, int, str]:
    return shift_log.total, shift_log.restored, shift_log.trouble


def _rows(entries: Iterable[Entry]) -> list[list[Any]]:
    return [
        [
            entry.unix,
            entry.kind,
            entry.robot_name,
            entry.person,
            entry.place,
            entry.verified is False,
            entry.text,
        ]
        for entry in entries
    ]
