"""What pages sent and nobody took, counted for whoever looks after WebMap.

A message that is refused does nothing. That there are many is worth knowing all the
same: a page that is broken, a link that delivers late, somebody who tries things.
"""

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

MOST = 50
"""How many people are remembered; who was refused longest ago is forgotten first."""


@dataclass(frozen=True, slots=True)
class Refused:
    """What one person's pages sent in vain."""

    by: str
    """Who."""

    count: int
    """How many messages, since WebMap started."""

    last: str
    """What the last one was, and why it was not taken."""

    at: datetime
    """When that was counted, with its time zone."""


class Refusals:
    """Counts refused messages by who sent them. Lives in the model's thread."""

    def __init__(self) -> None:
        self.total = 0
        """How many messages were refused since WebMap started."""
        self._rows: OrderedDict[str, Refused] = OrderedDict()

    @property
    def rows(self) -> Sequence[Refused]:
        """One for each person, who was refused last first."""
        return tuple(reversed(self._rows.values()))

    def note(self, by: str, count: int, last: str, at: datetime) -> None:
        """Count ``count`` more messages of ``by``, of which ``last`` is the last."""
        self.total += count
        before = self._rows.pop(by, None)
        if before is not None:
            count += before.count
        self._rows[by] = Refused(by, count, last, at)
        if len(self._rows) > MOST:
            self._rows.popitem(last=False)


refusals = Refusals()
"""What was refused in this process."""
