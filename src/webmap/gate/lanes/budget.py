"""How much a bridge may send, and when its link is dropped for too much. No I/O.

One number holds what a link has used: each piece of data adds the time for which the
rates below would last for it, and a second takes one second away. So a burst is taken
at once, and a link that sends more than its rate has to wait.
"""

FRAMES = 4000
"""Frames that are taken from a link each second: four times an odometry of 1 kHz, which
itself is fifty times what a bridge sends that heeds the throttle rate."""

BYTES = 16 << 20
"""Bytes that are taken from a link each second: sixteen scans of the longest message,
where a bridge that heeds the throttle rate sends ten."""

WORK = 0.25
"""Seconds of a processor that a link may take each second. An odometry of 1 kHz takes
about 0.1; the rest of the gate needs what remains."""

BURST = 1.0
"""For how long these rates may be saved up, in seconds. A link that stalls is cut after
3 s: an odometry of 1 kHz has kept back no more than this when it goes on."""

PAUSE = 0.05
"""Seconds for which a link is not read when it has used up everything."""

PATIENCE = 1.0
"""A link that has been close to its limit for so long is dropped, in seconds.

After a burst a link that sends at less than 3/4 of these rates gets further away from
the limit than :data:`CLOSE` in this time.
"""

BEHIND = 2.0
"""A link of which something has waited all the time for so long is dropped, in seconds:
on a busy computer the gate may take less of it than these rates."""

CLOSE = 0.25
"""How close to :data:`BURST` is close, in seconds."""


class Budget:
    """What one link has used; it outlives the sockets of the link."""

    def __init__(self) -> None:
        self._used = 0.0
        self._at = 0.0
        self._close_since: float | None = None
        self._behind_since: float | None = None
        self._frames = self._bytes = 0
        self._work = 0.0

    def spend(self, frames: int, size: int, work: float, now: float) -> None:
        """Note what was taken from the link.

        Args:
            frames: How many pieces of data.
            size: How many bytes.
            work: Seconds of a processor.
            now: The time, in seconds that only grow.

        """
        self._pass_time(now)
        self._used += max(frames / FRAMES, size / BYTES, work / WORK)
        if self._used <= BURST - CLOSE:
            return
        if self._close_since is None:
            self._close_since = now
            self._frames = self._bytes = 0
            self._work = 0.0
        self._frames += frames
        self._bytes += size
        self._work += work

    def note(self, now: float, *, behind: bool) -> None:
        """Note whether more of the link waits than was taken."""
        if not behind:
            self._behind_since = None
        elif self._behind_since is None:
            self._behind_since = now

    def wait(self, now: float) -> float:
        """Return for how many seconds nothing may be taken; 0.0 if it may be now."""
        self._pass_time(now)
        return 0.0 if self._used < BURST else self._used - BURST + PAUSE

    def flood(self, now: float) -> str | None:
        """Return in words why the link is to be dropped; None if it is not."""
        self._pass_time(now)
        if self._behind_since is not None and now - self._behind_since > BEHIND:
            return f"the bridge sends too much: data was waiting for {BEHIND:g} s"
        if self._close_since is None or now - self._close_since < PATIENCE:
            return None
        seconds = now - self._close_since
        return (
            f"the bridge sends too much: {self._frames} frames, {self._bytes} bytes "
            f"and {self._work:.2f} s of work were taken in {seconds:.1f} s, and more "
            f"waits (at most {FRAMES} frames, {BYTES} bytes and {WORK:g} s of work a "
            f"second)"
        )

    def _pass_time(self, now: float) -> None:
        self._used = max(0.0, self._used - (now - self._at))
        self._at = now
        if self._used <= BURST - CLOSE:
            self._close_since = None
