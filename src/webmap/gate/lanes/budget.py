"""How much a bridge may send, and when its link is dropped for too much. No I/O.

One number is the use of a link, in seconds: each piece of data adds the time that it
would take at the rates below, and each second subtracts one. So a burst is read at
once, and a link that sends faster than these rates has to wait.
"""

FRAMES = 4000
"""Frames that are read from a link per second: four times an odometry of 1 kHz, which
itself is fifty times the rate of a bridge that obeys the throttle rate."""

BYTES = 16 << 20
"""Bytes that are read from a link per second: sixteen scans of the longest message,
where a bridge that obeys the throttle rate sends ten."""

WORK = 0.25
"""Seconds of processor time that a link may use per second. An odometry of 1 kHz uses
about 0.1; the rest of the gate needs the remainder."""

BURST = 1.0
"""The largest use, in seconds, before a link has to wait. A link that stalls is cut
after 3 s: when it goes on, an odometry of 1 kHz has kept back no more than this."""

TOPICS = 100
"""A link with more topics than this may send more frames and bytes in proportion: 40
messages of 160 KiB a second for each topic. The processor time stays the same."""

PAUSE = 0.05
"""Seconds for which a link is not read after it has used its whole budget."""

PATIENCE = 1.0
"""A link that stays close to its limit for longer than this is dropped, in seconds.

After a burst, a link that sends at less than 3/4 of these rates gets further from the
limit than :data:`CLOSE` in this time.
"""

BEHIND = 2.0
"""A link whose data has been waiting without a break for longer than this is dropped,
in seconds: on a busy computer the gate may read less from it than these rates."""

CLOSE = 0.25
"""How near to :data:`BURST` counts as close to the limit, in seconds."""


class Budget:
    """The use of one link; it outlives the sockets of the link.

    An agent also has one for each display and user, with other rates.

    Args:
        frames: Frames per second.
        size: Bytes per second.
        burst: The largest use, in seconds, before the link has to wait.

    """

    def __init__(
        self, frames: float = FRAMES, size: float = BYTES, burst: float = BURST
    ) -> None:
        self._frame_rate, self._byte_rate, self._burst = frames, size, burst
        self.topics = 0
        """From how many topics the link may send messages."""
        self._used = 0.0
        self._at = 0.0
        self._close_since: float | None = None
        self._behind_since: float | None = None
        self._frames = self._bytes = 0
        self._work = 0.0

    def spend(self, frames: int, size: int, work: float, now: float) -> None:
        """Add what was read from the link.

        Args:
            frames: The number of pieces of data.
            size: The number of bytes.
            work: Seconds of processor time.
            now: The time, in monotonic seconds.

        """
        self._pass_time(now)
        part = max(frames / self._frame_rate, size / self._byte_rate)
        self._used += max(part / self._share, work / WORK)
        if self._used <= self._burst - CLOSE:
            return
        if self._close_since is None:
            self._close_since = now
            self._frames = self._bytes = 0
            self._work = 0.0
        self._frames += frames
        self._bytes += size
        self._work += work

    def note(self, now: float, *, behind: bool) -> None:
        """Note whether data of the link is still waiting after its turn."""
        if not behind:
            self._behind_since = None
        elif self._behind_since is None:
            self._behind_since = now

    def wait(self, now: float) -> float:
        """Return for how many seconds the link must not be read; 0.0 if it may be."""
        self._pass_time(now)
        return 0.0 if self._used < self._burst else self._used - self._burst + PAUSE

    def flood(self, now: float) -> str | None:
        """Return why the link must be dropped; None if it need not be."""
        self._pass_time(now)
        if self._behind_since is not None and now - self._behind_since > BEHIND:
            return f"the bridge sends too much: data was waiting for {BEHIND:g} s"
        if self._close_since is None or now - self._close_since < PATIENCE:
            return None
        seconds = now - self._close_since
        return (
            f"the bridge sends too much: {self._frames} frames, {self._bytes} bytes "
            f"and {self._work:.2f} s of work were taken in {seconds:.1f} s, and more "
            f"waits (at most {FRAMES * self._share:.0f} frames, "
            f"{BYTES * self._share:.0f} bytes and {WORK:g} s of work a second)"
        )

    @property
    def _share(self) -> float:
        """How many times the rates of a link with few topics apply."""
        return max(1.0, self.topics / TOPICS)

    def _pass_time(self, now: float) -> None:
        self._used = max(0.0, self._used - (now - self._at))
        self._at = now
        if self._used <= self._burst - CLOSE:
            self._close_since = None
