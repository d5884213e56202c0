"""Counts of the refused messages of pages, for administrators.

A refused message does nothing. A large number still points to a problem: a broken page,
a slow connection, or a person who probes WebMap.
"""

import logging
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

from webmap.base.text import counted

log = logging.getLogger("webmap")

MOST = 50
"""How many people are kept; the one whose last refusal is oldest is removed first."""


@dataclass(frozen=True, slots=True)
class RefusedMessages:
    """The refused messages of one person's pages."""

    by: str
    """The person's name."""

    count: int
    """The number of messages since WebMap started."""

    last: str
    """The last message, and why it was refused."""

    at: datetime
    """When that message was counted, with a time zone."""


class Refusals:
    """Counts refused messages by sender; used in the model's thread only."""

    def __init__(self) -> None:
        self.total = 0
        """The number of messages refused since WebMap started."""
        self._rows: OrderedDict[str, RefusedMessages] = OrderedDict()

    @property
    def rows(self) -> Sequence[RefusedMessages]:
        """One entry for each person, the latest refusal first."""
        return tuple(reversed(self._rows.values()))

    def note(self, by: str, count: int, last: str, at: datetime) -> None:
        """Add ``count`` messages of ``by``; ``last`` describes the last one."""
        log.info("refused %s of %s: %s", counted(count, "message"), by, last)
        self.total += count
        before = self._rows.pop(by, None)
        if before is not None:
            count += before.count
        self._rows[by] = RefusedMessages(by, count, last, at)
        if len(self._rows) > MOST:
            self._rows.popitem(last=False)


refusals = Refusals()
"""The refusals of this process."""
