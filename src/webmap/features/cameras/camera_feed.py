"""The base class of cameras: shares the newest picture with all pages that watch."""

import time
from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING

from webmap.base.scope import Removable, Removal, current_scope, keep, no_scope
from webmap.core.pictures import pictures

if TYPE_CHECKING:
    from webmap.core.robot import Robot

AGE_LIMIT = 1.0
"""Seconds after which a picture is stale."""

LEAST_KEPT, MOST_KEPT = 3, 64
"""Pictures that pages may request: slow pages still request earlier ones."""

KEPT_FOR = 5.0
"""Seconds for which pictures beyond the least number are kept."""

KEPT_BYTES = 8 << 20
"""Greatest number of bytes of the pictures beyond the least number."""


class CameraFeed:
    """The newest picture of one camera, and the pages that watch it.

    A derived class starts and stops its pictures in ``begin`` and ``end``, and passes
    each to :meth:`show`. Pictures arrive only while a page watches, and once for all
    pages.

    Args:
        robot: The robot that carries the camera.
        name: The camera's name, for people.
    """

    def __init__(self, robot: "Robot", name: str) -> None:
        self.robot = robot
        self.name = name
        self.url: str | None = None
        """The URL of the newest picture; None until there is one."""
        self.stamp: float | None = None
        """Time when the picture was sent, in monotonic seconds."""
        self._watchers: dict[object, Callable[[], None]] = {}
        self._kept: deque[tuple[str, float, int]] = deque()

    def begin(self) -> None:
        """Start the pictures: a page watches now."""
        raise NotImplementedError

    def end(self) -> None:
        """Stop the pictures: no page watches any more."""
        raise NotImplementedError

    def destroy(self) -> None:
        """Remove the pictures."""
        if self._watchers:
            self._watchers.clear()
            self._finish()

    @property
    def watched(self) -> bool:
        """Whether a page watches, so that pictures arrive."""
        return bool(self._watchers)

    def watch(self, fn: Callable[[], None]) -> Removable:
        """Call ``fn`` whenever there is a new picture.

        Returns:
            A handle that ends the calls; the end of the current scope ends them too.
        """
        key = object()
        first = not self._watchers
        self._watchers[key] = fn
        if first:
            # Outside the scope of the first watcher, because the pictures continue for
            # others.
            try:
                with no_scope():
                    self.begin()
            except BaseException:
                # The next watcher is the first again, and begins.
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
        """Show a picture to all watchers, in place of the last one.

        Args:
            data: The picture.
            media_type: Its type, as in ``image/jpeg``.
            lag: Seconds between sending and receiving.
        """
        # Pictures must not remain on an operator's disk.
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
