"""What a topic says, handed to all who listen: to each as often as it wants."""

import asyncio
import time
from collections.abc import Iterable

from webmap.ros.offload import Offload
from webmap.ros.received import ReceivedMessage
from webmap.ros.subscriptions import Subscription


class FanOut:
    """Hands messages over: at once, after a throttle's time, or once decoded elsewhere.

    A throttle holds back the newest message alone, and gives it when its time is over.
    """

    def __init__(self) -> None:
        self._offload = Offload()
        self._loop: asyncio.AbstractEventLoop | None = None

    def begin(self, loop: asyncio.AbstractEventLoop) -> None:
        """Keep the time of throttles by this loop; without one they hold for good."""
        self._loop = loop

    async def stop(self) -> None:
        """Decode nothing any more."""
        await self._offload.stop()

    def offer(
        self, message: ReceivedMessage, listeners: Iterable[Subscription]
    ) -> None:
        """Take a message that came, for listeners of whom not each may want it yet."""
        now = time.monotonic()
        due = []
        for listener in listeners:
            if listener.throttle.offer(message, now) is not None:
                due.append(listener)
            else:
                self._hold(listener)
        if due:
            self._give(message, due)

    def give_soon(self, message: ReceivedMessage, listener: Subscription) -> None:
        """Give a message that came before there was this listener."""
        if self._loop is not None:
            self._loop.call_soon(self._give, message, [listener])

    def _hold(self, listener: Subscription) -> None:
        if self._loop is not None:
            listener.hold(self._loop, lambda: self._release(listener))

    def _release(self, listener: Subscription) -> None:
        """Hand over the newest message that a listener's throttle held back."""
        listener.forget_timer()
        message = listener.throttle.take(time.monotonic())
        if message is not None:
            self._give(message, [listener])
        else:
            self._hold(listener)

    def _give(self, message: ReceivedMessage, listeners: list[Subscription]) -> None:
        _deliver(message, [each for each in listeners if each.undecoded])
        listeners = [each for each in listeners if not each.undecoded]
        if not listeners:
            return
        if self._offload.wants(message):
            types = frozenset(listener.decode for listener in listeners)
            self._offload.decode(
                message,
                types,
                lambda type: _deliver(
                    message, [each for each in listeners if each.decode is type]
                ),
            )
        else:
            _deliver(message, listeners)


def _deliver(message: ReceivedMessage, listeners: list[Subscription]) -> None:
    for listener in listeners:
        listener.deliver(message)
