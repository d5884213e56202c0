"""What is wrong with the link to a bridge: known while it is so, and said once."""

import logging
from collections.abc import Callable

from webmap.errors import BridgeClosed, ProtocolError
from webmap.ros.connection import CLOSED_HERE
from webmap.ros.events import Malformed

log = logging.getLogger("webmap.ros")


class LinkTrouble:
    """Says why a link is not open, and what comes over it that is not rosbridge.

    Args:
        name: What people call the bridge.
        report: Is told of each error that a person might want to know of.

    """

    def __init__(self, name: str, report: Callable[[Exception], object]) -> None:
        self.why: str | None = None
        """Why the link is not open: how the last attempt failed or the link ended."""
        self._name = name
        self._report = report
        self._complained = False
        """Whether this link, or the attempts to open it, were complained of."""

    def opened(self) -> None:
        """Note that the link is open."""
        self._complained = False
        self.why = None
        log.info("%s: the link is open", self._name)

    def lost(self, reason: str) -> None:
        """Note that an open link ended."""
        level = logging.INFO if reason == CLOSED_HERE else logging.WARNING
        log.log(level, "%s: the link ended: %s", self._name, reason)
        self.why = reason

    def not_opened(self, error: BridgeClosed) -> None:
        """Note that an attempt to open it failed."""
        # One line in the log for a bridge that is away, however long.
        level = logging.DEBUG if self._complained else logging.WARNING
        self._complained = True
        self.why = error.why
        log.log(level, "%s", error, extra={"source": self._name})
        self._report(error)

    def malformed(self, event: Malformed) -> ProtocolError | None:
        """Report what is not rosbridge, once for each link; the rest is counted.

        Returns:
            What people are to be told; None if it was said already.

        """
        error = None
        if not self._complained:
            self._complained = True
            error = ProtocolError(
                f"{self._name} sent {event.size} bytes that are not rosbridge: "
                f"{event.reason}"
            )
            log.warning("%s", error, extra={"source": self._name})
            self._report(error)
        return error
