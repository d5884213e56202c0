"""What the nodes behind a bridge log, kept while somebody looks."""

import itertools
import time
import weakref
from collections import deque
from dataclasses import dataclass

from webmap.ros.bridge import Bridge
from webmap.ros.messages_log import LogMsg
from webmap.scope import Removable, Removal, no_scope

TOPIC = "/rosout"

MOST = 200
"""Lines that are kept of one bridge."""

LONGEST = 500
"""Characters of a line that are kept."""


@dataclass(slots=True)
class Said:
    """One thing that a node said, once or several times in a row."""

    number: int
    level: str
    """``"debug"``, ``"info"``, ``"warn"``, ``"error"`` or ``"fatal"``."""

    name: str
    """The node's or the logger's."""

    text: str
    count: int
    heard: float
    """When it came last, in monotonic seconds."""

    version: int
    """Grows with every change of any line."""


class BridgeLog:
    """The newest lines of one bridge; the same for all who look.

    The topic is subscribed to while somebody looks and no longer: logs are many. What
    was heard until then is kept.

    Args:
        bridge: The bridge.

    """

    def __init__(self, bridge: Bridge) -> None:
        self.lines: deque[Said] = deque(maxlen=MOST)
        """What was said, the newest last."""
        self.total = 0
        """Messages that were heard in all."""
        self.version = 0
        self._bridge = weakref.ref(bridge)
        self._numbers = itertools.count(1)
        self._watchers = 0
        self._subscription: Removable | None = None

    def watch(self) -> Removal:
        """Listen; the removal of what is returned ends it, unless others look."""
        self._watchers += 1
        bridge = self._bridge()
        if self._subscription is None and bridge is not None:
            with no_scope():
                # The type is another in each dialect, and the topic is always there.
                self._subscription = bridge.subscribe(
                    TOPIC, self.on_log, decode=LogMsg, queue_length=100
                )
        return Removal(self._leave)

    def on_log(self, message: LogMsg) -> None:
        """Keep a line; one that is said again and again is counted."""
        self.total += 1
        self.version += 1
        level, name = message.level_name, message.name[:LONGEST]
        text, now = message.msg[:LONGEST], time.monotonic()
        last = self.lines[-1] if self.lines else None
        if last is not None and (last.level, last.name, last.text) == (
            level,
            name,
            text,
        ):
            last.count += 1
            last.heard, last.version = now, self.version
            return
        number = next(self._numbers)
        self.lines.append(Said(number, level, name, text, 1, now, self.version))

    def since(self, version: int) -> list[Said]:
        """Return the lines that changed after a version, the newest last."""
        return [line for line in self.lines if line.version > version]

    def _leave(self) -> None:
        self._watchers -= 1
        if self._watchers == 0 and self._subscription is not None:
            self._subscription.remove()
            self._subscription = None


_logs: "weakref.WeakKeyDictionary[Bridge, BridgeLog]" = weakref.WeakKeyDictionary()


def log_of(bridge: Bridge) -> BridgeLog:
    """Return the log of a bridge, which all pages share."""
    found = _logs.get(bridge)
    if found is None:
        found = _logs[bridge] = BridgeLog(bridge)
    return found
