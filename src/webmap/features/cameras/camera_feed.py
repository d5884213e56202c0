"""What everything has that shows the pictures of a camera to whoever watches."""

import time
from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING

from webmap.base.scope import Removable, Removal, current_scope, keep, no_scope
from webmap.core.pictures import pictures

if TYPE_CHECKING:
    from webmap.core.robot import Robot

AGE_LIMIT = 1.0
"""Seconds after which a picture is old."""

LEAST_KEPT, MOST_KEPT = 3, 64
"""Pictures that may be asked for: pages that lag still ask for the ones before."""

KEPT_FOR = 5.0
"""Seconds for which one more than the least is kept."""

KEPT_BYTES = 8 << 20
"""How many bytes more than the least are kept."""


class CameraFeed:
    """The newest picture of one camera, and who watches it.

    One that is derived from this says in ``begin`` and ``end`` how its pictures come,
    and hands each to :meth:`show`. They come only while somebody watches, and once
    for all who do.

    Args:
        robot: The robot that carries the camera.
        name: What people call the camera.

    """

    def __init__(self, robot: "Robot", name: str) -> None:
        self.robot = robot
        self.name = name
        self.url: str | None = None
        """Where pages find the newest picture; None until there is one."""
        self.stamp: float | None = None
        """When it was sent, in monotonic seconds."""
        self._watchers: dict[object, Callable[[], None]] = {}
        self._kept: deque[tuple[str, float, int]] = deque()

    def begin(self) -> None:
        """Have pictures come: somebody watches now."""
        raise NotImplementedError

    def end(self) -> None:
        """Have no more pictures come: nobody watches any more."""
        raise NotImplementedError

    def destroy(self) -> None:
        """Take the pictures away."""
        if self._watchers:
            self._watchers.clear()
            self._finish()

    @property
    def watched(self) -> bool:
        """Whether anybody watches, so that pictures come."""
        return bool(self._watchers)

    def watch(self, fn: Callable[[], None]) -> Removable:
        """Call ``fn`` whenever there is another picture.

        Returns:
            What ends it; the end of the current scope does, too.

        """
        key = object()
        first = not self._watchers
        self._watchers[key] = fn
        if first:
            # Not a thing of the first who watches: it goes on for the others.
            try:
                with no_scope():
                    self.begin()
            except BaseException:
                # Whoever comes next is the first again, and begins.
                self._watchers.pop(key, None)
                raise
        scope = current_scope()

        def undo() -> None:
            if scope is not None:
                scope.discard(watching)
            if self._watchers.pop(key, None) is not None and not self._watchers:
                self._finish()

        watching = keep(Removal(undo))
        return watching

    def show(self, data: bytes, media_type: str, lag: float = 0.0) -> None:
        """Show a picture to everybody who watches, in place of the one before.

        Args:
            data: The picture.
            media_type: Its type, as in ``image/jpeg``.
            lag: How many seconds it was under way.

        """
        # What a camera saw is nothing to be found on an operator's disk later.
        self.url = pictures.publish(data, media_type, fleeting=True)
        now = time.monotonic()
        self.stamp = now - lag
        kept = self._kept
        kept.append((self.url, now, len(data)))
        while len(kept) > LEAST_KEPT and (
            len(kept) > MOST_KEPT
            or now - kept[0][1] > KEPT_FOR
            or sum(size for _, _, size in kept) > KEPT_BYTES
        ):
            pictures.withdraw(kept.popleft()[0])
        for fn in tuple(self._watchers.values()):
            fn()

    def _finish(self) -> None:
        self.end()
        self.robot.clear_problem(self)
        while self._kept:
            pictures.retire(self._kept.popleft()[0])
        self.url = self.stamp = None
