"""How old the picture is that a driver goes by (S16). No I/O."""

from webmap.gate.rules.sight import BLIND_LIMIT


class Video:
    """What the holder of the lease says of the camera that they look at.

    The gate sees no pictures. Each command tells how old the newest one was that its
    page had shown, so a camera that freezes, a display that hangs and a page that is
    not sent anything any more are all the same to it.
    """

    def __init__(self) -> None:
        self._taken_at: float | None = None

    def saw(self, age: float | None, now: float) -> None:
        """Note the age of the picture in seconds, or that no camera was chosen."""
        self._taken_at = None if age is None else now - age

    def forget(self) -> None:
        """Nobody drives any more."""
        self._taken_at = None

    def doubt(self, now: float) -> str | None:
        """Return that the driver sees nothing, in words."""
        if self._taken_at is None or now - self._taken_at <= BLIND_LIMIT:
            return None
        return f"no picture from the camera for {BLIND_LIMIT:g} s"
