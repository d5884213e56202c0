"""Records all messages between page, display, gate and robot, as text."""

import json
import re
import threading
import time
from collections.abc import Callable, Iterable
from textwrap import wrap
from typing import Any

import msgspec
from wires_words import ANY, Names, goal_number, is_zero, lines, thinned, tree

from webmap.gate import pipe
from webmap.gate.display.supervisor import GateProcess

PERIODIC = ("drive", "program-twist", "robot", "sent-twist", "tick", "writer-nodes")
"""Messages that are repeated: each distinct one is shown once."""

SILENT: tuple[Any, ...] = (None, False, "", [], [0.0] * 6)
"""Values of a report that are not shown; its fields are recorded separately."""

HASTY = ("drive", "stop-test")
"""Commands that may be refused while a robot or a busy computer is not ready yet."""

TO_GATE = "display to gate"
FROM_GATE = "gate to display"

_SECONDS = re.compile(r"\b\d+\.\d+ s\b")

Entry = tuple[str, dict[str, Any]]


class Tap:
    """Notes messages by the channel that they pass; may be called from any thread.

    The pipe is tapped only in this process: at the packing of messages to the gate, and
    at the unpacking of messages from the gate.
    """

    def __init__(self) -> None:
        self.names = Names()
        self.entries: list[Entry] = []
        self.reports: dict[str, dict[str, Any]] = {}
        """The gate's newest report about each robot, by the robot's id."""
        self.each_declaration = False
        """Whether each declaration of a robot is shown, or only the last of several in
        a row: a program may configure a robot in several steps or at once."""
        self._lock = threading.RLock()
        self._child_send = GateProcess.send
        self._unpacker_read = pipe.Unpacker._read

    def begin(self) -> None:
        """Forget the noted messages and the names."""
        with self._lock:
            self.names = Names()
            self.entries = []
            self.reports = {}
            self.each_declaration = False

    def tap_the_pipe(self) -> None:
        """Note the messages on the pipe from now on."""
        tap, send, read = self, self._child_send, self._unpacker_read

        def noted_send(child: GateProcess, *messages: msgspec.Struct) -> None:
            for message in messages:
                tap.note(TO_GATE, unpacked(pipe.pack(message)[4:]))
            send(child, *messages)

        def noted_read(unpacker: Any, body: bytes, messages: list[Any]) -> None:
            tap.note(FROM_GATE, unpacked(body))
            read(unpacker, body, messages)

        GateProcess.send = noted_send  # type: ignore[method-assign]
        pipe.Unpacker._read = noted_read  # type: ignore[method-assign]

    def note(self, channel: str, message: dict[str, Any]) -> None:
        """Note a message."""
        with self._lock:
            self._learn(message)
            self.entries.append((channel, message))

    def _learn(self, message: dict[str, Any]) -> None:
        """Give names to the values of a message."""
        match message:
            case {"type": "connect", "connection": connection, "name": name}:
                self.names.call(connection, f"<{name}>")
                if identity := message.get("identity"):
                    self.names.call(identity["person"], f"<person {name}>")
                    self.names.call(identity["page"], f"<page {name}>")
            case {"type": "declare", "id": id, "name": name}:
                self.names.call(id, f"<{name}>")
            case {"type": "gone", "robot": robot}:
                self.reports.pop(robot, None)
            case {"type": "robot", "robot": robot}:
                self.reports[robot] = message
                if message["epoch"] is not None:
                    self.names.grow("epoch", message["epoch"])
                if message["stop"] is not None:
                    self.names.meet("stop", message["stop"]["id"])
                goal = message["goal"] and goal_number(message["goal"]["id"])
                if goal is not None:
                    self.names.grow("goal", goal)
            case {"type": "from_program", "request": request}:
                self.names.grow("request", request)
            case {"type": "take-reply", "epoch": int(epoch)}:
                self.names.grow("epoch", epoch)

    # As text.

    def channels(self) -> dict[str, str]:
        """Return the messages of each channel as text."""
        with self._lock:
            entries = list(self.entries)
            names = [TO_GATE, FROM_GATE, *sorted({name for name, _ in entries})]
            return {
                name: "\n".join(
                    self._lines_of(name, [m for n, m in entries if n == name])
                )
                for name in dict.fromkeys(names)
            }

    def report(self, report: dict[str, Any]) -> str:
        """Return a report of a robot as text, without values that vary."""
        with self._lock:
            plain = self.names.plain(report)
        if plain["asker"] is not None:
            plain["asker"]["left"] = ANY
        plain["why"] = [
            why for why in plain["why"] if not why.startswith("slow connection")
        ]
        if plain["test"] is not None:
            plain["test"]["text"] = _SECONDS.sub(f"{ANY} s", plain["test"]["text"])
        if plain["stop_source"] == "tested":
            plain["stop_time"] = plain["stop_date"] = ANY
        shown = {key: value for key, value in plain.items() if value not in SILENT}
        return tree({key: shown[key] for key in shown if key not in ("op", "type")})

    def _lines_of(self, channel: str, messages: Iterable[dict[str, Any]]) -> list[str]:
        texts: list[tuple[str, str, str]] = []
        before: dict[str, Any] = {}
        for message in messages:
            kind, text = self._line(message)
            if text is None:
                continue
            stays = "once" if kind in PERIODIC else ""
            if kind == "sent-twist" and is_zero(message):
                stays = "last"
            again = kind == "declare" and message.get("id") == before.get("id")
            if again and not self.each_declaration:
                texts.pop()
            texts.append((kind, text, stays))
            before = message
        if channel == FROM_GATE or channel.startswith("server to page"):
            # The order of two kinds of messages may vary.
            texts.sort(key=lambda each: each[0])
        return thinned((text, stays) for _, text, stays in texts)

    def _line(self, message: dict[str, Any]) -> tuple[str, str | None]:
        """Return the kind of a message and its line; None if it is not shown."""
        fields = dict(message)
        kind = str(fields.pop("type", None) or fields.pop("op", "?"))
        match kind:
            case "beat":
                return kind, None
            case "robot":
                return kind, lines(kind, {"fields": wrap(", ".join(sorted(fields)))})
            case "refused" if fields["what"] in HASTY:
                return kind, None
            case "refused-count":
                if fields["last"].startswith(HASTY):
                    return kind, None
                fields["count"] = ANY
            case "declare":
                return kind, self._declared(fields)
            case "from_page":
                return self._sent_by_page(fields)
        return kind, lines(kind, self.names.plain(fields))

    def _declared(self, fields: dict[str, Any]) -> str:
        # The id is recorded as it is, without a token.
        id = fields.pop("id")
        return lines("declare", {"id": id, **self.names.plain(fields)})

    def _sent_by_page(self, fields: dict[str, Any]) -> tuple[str, str]:
        try:
            command = json.loads(fields["text"])
            op = command.pop("op")
        except (ValueError, AttributeError, KeyError):
            return "from_page", lines("from_page", self.names.plain(fields))
        who = self.names.text(fields["connection"])
        return op, lines(f"browser {who}: {op}", self.names.plain(command))


def unpacked(body: bytes) -> dict[str, Any]:
    """Return the fields of a packed message of the pipe."""
    found: dict[str, Any] = msgspec.msgpack.decode(body)
    return found


def lanes_of(names: Names, label: str, robot: Any) -> dict[str, str]:
    """Return the messages that a robot received, by lane.

    A lane may have several sockets: after a reconnection, and one for each goal.
    """
    received: dict[str, list[tuple[str, str]]] = {}
    for link in list(robot.links):
        texts = received.setdefault(link.lane, [])
        for message in list(link.received):
            zero = message["op"] == "publish" and is_zero(message["msg"])
            text = _operation(names, message, link.lane)
            if text is not None:
                texts.append((text, "last" if zero else "once"))
    if "display" in received:
        received["display"].sort()
    order = ("control", "witness", "tasks", "call", "display")
    return {
        f"bridge {label}: {lane}": "\n".join(thinned(received[lane]))
        for lane in order
        if received.get(lane)
    }


def _operation(names: Names, message: dict[str, Any], lane: str) -> str | None:
    fields = dict(message)
    op = fields.pop("op")
    if lane == "display":
        if op in ("call_service", "unsubscribe"):
            return None  # sent at times that vary
        fields.pop("id", None)  # it depends on earlier messages of the process
    return lines(op, names.plain(fields))


def settled(
    current: Callable[[], str],
    expected: str,
    seconds: float,
    calm: float,
    still: float = 0.0,
    good: Callable[[], bool] = lambda: True,
) -> str:
    """Return the text when it no longer changes.

    Args:
        current: Returns the text so far.
        expected: The recorded text.
        seconds: The longest time to wait for it.
        calm: Seconds for which the text must stay the same if nothing is recorded.
        still: Seconds for which the text must stay the same if it is the recorded text.
        good: Returns whether the text may be complete.

    """
    deadline = time.monotonic() + seconds
    last, since = current(), time.monotonic()
    while True:
        now = time.monotonic()
        text = current()
        if text != last or not good():
            last, since = text, now
        quiet = still if text == expected else seconds if expected else calm
        if now > deadline or now - since >= quiet:
            return text
        time.sleep(0.02)
