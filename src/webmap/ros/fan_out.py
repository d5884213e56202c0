"""Delivery of the messages of a topic to its listeners, each with its own throttle."""

import asyncio
import time
from collections.abc import Iterable

import msgspec

from webmap.ros.offload import Offload
from webmap.ros.received_message import ReceivedMessage
from webmap.ros.subscriptions import Subscription


class FanOut:
    """Delivers messages: at once, after the throttle's time, or after the offload.

    A throttle holds back only the newest message, and releases it when its time is
    over.
    """

    def __init__(self) -> None:
        self._offload = Offload()
        self._loop: asyncio.AbstractEventLoop | None = None

    def begin(self, loop: asyncio.AbstractEventLoop) -> None:
        """Use this loop for the timers of throttles; without it they never release."""
        self._loop = loop

    async def stop(self) -> None:
        """Cancel the decoding of large messages; they are not delivered."""
        await self._offload.stop()

    def offer(
        self, message: ReceivedMessage, listeners: Iterable[Subscription]
    ) -> None:
        """Deliver a new message to the listeners whose throttle allows it."""
        due = [
            listener
            for listener in listeners
            if not listener.throttle.period or self._is_due(listener, message)
        ]
        if due:
            self._give(message, due)

    def give_soon(self, message: ReceivedMessage, listener: Subscription) -> None:
        """Deliver an earlier message to a new listener."""
        if self._loop is not None:
            self._loop.call_soon(self._give, message, [listener])

    def _is_due(self, listener: Subscription, message: ReceivedMessage) -> bool:
        if listener.throttle.offer(message, time.monotonic()) is not None:
            return True
        self._hold(listener)
        return False

    def _hold(self, listener: Subscription) -> None:
        if self._loop is not None:
            listener.hold(self._loop, lambda: self._release(listener))

    def _release(self, listener: Subscription) -> None:
        """Deliver the newest message that a listener's throttle held back."""
        listener.forget_timer()
        message = listener.throttle.take(time.monotonic())
        if message is not None:
            self._give(message, [listener])
        else:
            self._hold(listener)

    def _give(self, message: ReceivedMessage, listeners: list[Subscription]) -> None:
        if self._offload.is_needed(message):
            decoding = [each for each in listeners if not each.undecoded]
            if decoding:
                self._decode_elsewhere(message, decoding)
            listeners = [each for each in listeners if each.undecoded]
        for listener in listeners:
            listener.deliver(message)

    def _decode_elsewhere(
        self, message: ReceivedMessage, listeners: list[Subscription]
    ) -> None:
        def deliver(type: type[msgspec.Struct] | None) -> None:
            for listener in listeners:
                if listener.decode is type:
                    listener.deliver(message)

        types = frozenset(listener.decode for listener in listeners)
        counts = any(listener.each_counts for listener in listeners)
        self._offload.decode(message, types, deliver, counts=counts)
