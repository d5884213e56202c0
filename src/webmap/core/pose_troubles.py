"""What is wrong with where a robot is, said once it has lasted."""

import time
from typing import TYPE_CHECKING

from webmap.core.placing import CLOCKS

if TYPE_CHECKING:
    from webmap.core.frames import Frames
    from webmap.core.jumps import Jumps
    from webmap.core.placing import Placing
    from webmap.core.refusals import Owner

PATIENCE = 1.0
"""Seconds for which something is wrong before that is said: frames come one after
another when a link opens, and that is no trouble."""


class Lasting:
    """Lets trouble through when it has lasted for a while."""

    def __init__(self) -> None:
        self._since: float | None = None

    def look(self, trouble: str, frames: "Frames | None" = None) -> str:
        """Return the trouble if it is worth saying, and nothing while it is not.

        Args:
            trouble: Which kind there is now; empty if there is none.
            frames: Those it is about, if it is about frames. Nothing is said while they
                may still be coming, and they wake who looks when that is over.

        """
        if not trouble:
            self._since = None
            return ""
        now = time.monotonic()
        if self._since is None:
            self._since = now
        due = self._since + PATIENCE
        if frames is not None:
            due = max(due, frames.complete_from)
        if now >= due:
            return trouble
        if frames is not None:
            frames.wake(due - now)
        return ""


class PoseTroubles:
    """Tells what is wrong with a robot's poses, and takes back what is mended.

    Args:
        owner: The robot.

    """

    def __init__(self, owner: "Owner") -> None:
        self._owner = owner
        self._lasting = Lasting()
        self._kind = ""

    def look(
        self,
        placing: "Placing | None",
        frames: "Frames | None",
        jumps: "Jumps",
        *,
        quiet: bool,
    ) -> None:
        """Look at everything that may be wrong.

        Args:
            placing: What takes its poses to the map, if anything does.
            frames: What it does that by.
            jumps: Of its poses.
            quiet: Whether poses that do not get to the map are no trouble.

        """
        quiet = quiet and (placing is None or placing.kind != CLOCKS)
        self._look_at_placing(None if quiet else placing, frames)
        fault = None
        if placing is not None and frames is not None:
            fault = frames.faults.of(placing.base_frame, time.monotonic())
        for about, text in (("frames", fault), ("jumps", jumps.problem)):
            if text is None:
                self._owner.clear_problem(about)
            else:
                self._owner.set_problem(about, text)

    def forget(self) -> None:
        """Take everything back: poses come from somewhere else now."""
        self._lasting, self._kind = Lasting(), ""
        for about in ("tf", "frames", "jumps"):
            self._owner.clear_problem(about)

    def _look_at_placing(
        self, placing: "Placing | None", frames: "Frames | None"
    ) -> None:
        kind = self._lasting.look("" if placing is None else placing.kind, frames)
        if kind == self._kind:
            return
        self._kind = kind
        self._owner.clear_problem("tf")
        if kind and placing is not None and placing.problem is not None:
            self._owner.set_problem("tf", placing.problem)
