"""The listeners of topics, their throttles, and the reports of failures."""

import time
from asyncio import AbstractEventLoop, TimerHandle
from collections.abc import Callable
from functools import lru_cache
from typing import Any, Generic, Literal, NamedTuple, TypeAlias, TypeVar

import msgspec

from webmap.base.audience import audience
from webmap.base.errors import BridgeError, ConfigError, ProtocolError
from webmap.base.scope import Scope, current_scope
from webmap.ros.callbacks import Callback
from webmap.ros.limits import GENERAL, LARGE, TooLarge, check_size, limit_of
from webmap.ros.names import VIDEO, is_type, same_type
from webmap.ros.received_message import ReceivedMessage

Encoding: TypeAlias = Literal["text", "binary", "raw"]

T = TypeVar("T")

EARLY = 0.1
"""Part of its period by which a throttle lets a message through early, so that a topic
at this rate waits for no timer."""

_ENCODINGS = ("text", "binary", "raw")
_LATCHED_TYPES = ("nav_msgs/OccupancyGrid",)
_LATCHED_TOPICS = ("/tf_static", "/robot_description")

CHANGES = (
    "map_msgs/OccupancyGridUpdate",
    "visualization_msgs/Marker",
    "visualization_msgs/MarkerArray",
    "diagnostic_msgs/DiagnosticArray",
    *VIDEO,
)
"""Types whose messages change what earlier messages showed, without repeating them."""


@lru_cache(maxsize=4096)  # an agent asks for each message
def each_counts(topic: str, type: str | None) -> bool:
    """Return whether no message of a topic may be left out in favour of a newer one."""
    changes = type is not None and is_type(type, *CHANGES)
    return changes or topic.endswith("/tf_static")


class SubscriptionOptions(NamedTuple):
    """The options of one listener, or of all listeners of a topic."""

    type: str | None = None
    throttle: int = 0
    """Least time between two messages, in milliseconds."""

    queue_length: int = 1
    encoding: Encoding | None = None
    unwatched: int = 0
    """The same as ``throttle`` while nobody looks, if that is longer."""

    @property
    def least(self) -> int:
        """The least time between two messages now, in milliseconds."""
        if audience.present or not self.throttle:
            return self.throttle
        return max(self.throttle, self.unwatched)


def checked(
    options: SubscriptionOptions, callback: object, decode: object
) -> SubscriptionOptions:
    """Return the options of a subscription after a check of its arguments.

    Raises:
        ConfigError: If an argument is invalid.

    """
    if not callable(callback):
        raise ConfigError(f"a subscription needs a function, got {callback!r}")
    for name in ("throttle", "unwatched", "queue_length"):
        value = getattr(options, name)
        if not isinstance(value, int) or value < 0:
            raise ConfigError(f"{name} is a whole number from 0 up, got {value!r}")
    if options.encoding is not None and options.encoding not in _ENCODINGS:
        known = ", ".join(_ENCODINGS)
        raise ConfigError(f"encoding is one of {known}, got {options.encoding!r}")
    if decode is not None and not _is_struct(decode):
        raise ConfigError(f"decode is a msgspec.Struct type, got {decode!r}")
    return options


def _is_struct(decode: Any) -> bool:
    return isinstance(decode, type) and issubclass(decode, msgspec.Struct)


class Throttle(Generic[T]):
    """Lets one message through in each period, and always the newest in the end.

    Args:
        period: Least time between two messages, in seconds; 0 lets all through.

    """

    __slots__ = ("_came", "_due", "_held", "_waited", "period")

    def __init__(self, period: float) -> None:
        self.period = period
        self._due = -float("inf")
        self._held: T | None = None
        self._came: float | None = None
        """When the held message came, if no other came since the last release."""
        self._waited: float | None = None
        """How long the last message waited, if it was alone."""

    def offer(self, thing: T, now: float) -> T | None:
        """Return ``thing`` if it is due; else keep it in place of an older one."""
        if not self.period:
            return thing
        if now < self._due - EARLY * self.period:
            self._came = now if self._held is None else None
            self._held = thing
            return None
        self._waited = None
        return self._release(thing, now)

    @property
    def due(self) -> float | None:
        """When the held message is due, or None if none is held."""
        return None if self._held is None else self._due

    def take(self, now: float) -> T | None:
        """Return the held message if it is due."""
        held = self._held
        if held is None or now < self._due:
            return None
        before = self._waited
        waited = None if self._came is None else self._due - self._came
        self._release(held, now)
        if (
            before is not None
            and waited is not None
            and abs(before - waited) <= EARLY * self.period
        ):  # the topic comes at this rate: the next message need not wait
            self._due -= waited
            waited = None
        self._waited = waited
        return held

    def change(self, period: float, now: float) -> None:
        """Use another period; what waits for a longer one is due at once."""
        if period < self.period:
            self._due = min(self._due, now)
        self.period = period

    def drop(self) -> None:
        """Forget the held message: its connection has ended."""
        self._held = None

    def _release(self, thing: T, now: float) -> T:
        # Half a period of slack: a topic at exactly this rate has jitter, and a message
        # that comes 1 ms early must not delay every second one.
        self._due = max(self._due + self.period, now + self.period / 2)
        self._held = None
        return thing


class _Silence(ProtocolError):
    """No messages come."""


class Subscription:
    """One listener of a topic; created by :meth:`webmap.Bridge.subscribe`.

    It ends when :meth:`remove` is called, or with the scope in which it was created.
    """

    def __init__(
        self,
        topic: "Topic",
        callback: Callback,
        options: SubscriptionOptions,
        decode: type[msgspec.Struct] | None,
    ) -> None:
        self.topic = topic.name
        """The resolved name of the topic."""
        self.options = options
        self.decode = decode
        self.removed = False
        self.undecoded = False
        """Whether the callback gets each message at once, without decoding."""
        self.throttle: Throttle[ReceivedMessage] = Throttle(options.least / 1000)
        self._of = topic
        self._callback = callback
        self._timer: TimerHandle | None = None
        self._releasing: tuple[AbstractEventLoop, Callable[[], None]] | None = None
        self._reported = False
        self._scope: Scope | None = current_scope()
        if self._scope is not None:
            self._scope.add(self)

    @property
    def each_counts(self) -> bool:
        """Whether no message may be left out in favour of a newer one."""
        return each_counts(self.topic, self._of.message_type)

    def remove(self) -> None:
        """End this subscription and no other; the second call has no effect."""
        if self.removed:
            return
        self.removed = True
        self._callback.end()
        self.hush()
        self.take_back()
        if self._scope is not None:
            self._scope.discard(self)
        self._of.remove(self)

    def set_pace(self, throttle: int, unwatched: int) -> None:
        """Change how often messages come; see ``subscribe``."""
        self.options = self.options._replace(throttle=throttle, unwatched=unwatched)
        self._of.change_pace()

    def change_pace(self) -> bool:
        """Use the throttle of now; return whether it has changed."""
        period = self.options.least / 1000
        if period == self.throttle.period:
            return False
        self.throttle.change(period, time.monotonic())
        if self._timer is not None and self._releasing is not None:
            self.forget_timer()
            self.hold(*self._releasing)
        return True

    def deliver(self, message: ReceivedMessage) -> None:
        """Decode the message as the listener's type and call the callback."""
        if self.removed:
            return
        if self.undecoded:
            self._callback(message)
            return
        try:
            value = message.decode(self.decode)
        except ProtocolError as error:
            self._of.complain(error, self.decode)
            return
        if self._of.failing:
            self._of.understood(self.decode)
        self._callback(value)

    def report(self, fault: BridgeError) -> None:
        """Show to the listener's scope why its messages cannot be used."""
        if self._scope is not None and self._scope.report is not None:
            self._reported = True
            self._scope.report(str(fault), self)

    def take_back(self) -> None:
        """Withdraw the fault that :meth:`report` showed, if any."""
        if self._reported and self._scope is not None:
            self._reported = False
            if self._scope.mended is not None:
                self._scope.mended(self)

    def mention(self, fault: ProtocolError) -> bool:
        """Show a fault once, without keeping it; return whether it could be shown."""
        if self._scope is None or self._scope.report is None:
            return False
        self._scope.report(str(fault), None)
        return True

    def hold(self, loop: AbstractEventLoop, release: Callable[[], None]) -> None:
        """Set a timer for the message that the throttle holds."""
        due = self.throttle.due
        if due is not None and self._timer is None:
            self._releasing = (loop, release)
            self._timer = loop.call_later(max(0.0, due - time.monotonic()), release)

    def hush(self) -> None:
        """Forget the message that the throttle holds."""
        self.throttle.drop()
        self.forget_timer()

    def forget_timer(self) -> None:
        """Cancel or forget the timer of :meth:`hold`."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None


class Topic:
    """All listeners of one topic of one bridge.

    Args:
        name: The resolved name.
        changed: Called when the options of all listeners together have changed.
        emptied: Called when the last listener has ended.
        complain: Called with a message that does not decode, once for each connection
            and each kind of error.

    """

    def __init__(
        self,
        name: str,
        *,
        changed: Callable[["Topic"], None],
        emptied: Callable[["Topic"], None],
        complain: Callable[["Topic", str, ProtocolError], None],
    ) -> None:
        self.name = name
        self.listeners: dict[Subscription, None] = {}
        self.count = 0
        """Messages since the connection was opened."""
        self._changed = changed
        self._emptied = emptied
        self._complain = complain
        self.failing: set[object] = set()
        """The types as which the newest messages could not be decoded."""
        self._fault: BridgeError | None = None
        self._found: dict[type[ProtocolError], ProtocolError | None] = {}
        """The reason for each kind of error; None while it is searched for."""
        self._latest: ReceivedMessage | None = None
        self._may_be_latched = True

    @property
    def message_type(self) -> str | None:
        """The message type, if any listener has stated it."""
        return next((s.options.type for s in self.listeners if s.options.type), None)

    def check(self, options: SubscriptionOptions) -> None:
        """Check that another listener can share the subscription.

        Raises:
            ConfigError: If it states another type, or mixes raw and decoded messages.

        """
        mine = self.message_type
        if mine and options.type and not same_type(mine, options.type):
            raise ConfigError(
                f"{self.name} is subscribed as {mine}, not {options.type}"
            )
        raw = any(each.options.encoding == "raw" for each in self.listeners)
        if self.listeners and raw != (options.encoding == "raw"):
            raise ConfigError(
                f"{self.name}: raw and decoded messages cannot share a subscription"
            )

    def add(self, listener: Subscription) -> None:
        """Add ``listener``, and subscribe to more if it needs more."""
        self.listeners[listener] = None
        type = self.message_type
        self._may_be_latched = (
            type is None
            or self.name in _LATCHED_TOPICS
            or is_type(type, *_LATCHED_TYPES)
        )
        if self._fault is not None:
            listener.report(self._fault)
        self._changed(self)

    def remove(self, listener: Subscription) -> None:
        """Remove ``listener``, and subscribe to less if the others need less."""
        self.listeners.pop(listener, None)
        if self.listeners:
            alone = all(o.decode is not listener.decode for o in self.listeners)
            if self.failing and alone:
                self._succeeds(listener.decode)
            self._changed(self)
            return
        self._latest = None
        self._emptied(self)

    def change_pace(self) -> None:
        """Subscribe to more or less if somebody looks now, or nobody any more."""
        if any([listener.change_pace() for listener in self.listeners]):
            self._changed(self)

    def options(self) -> SubscriptionOptions:
        """Return options that serve every listener now."""
        each = [listener.options for listener in self.listeners]
        return SubscriptionOptions(
            self.message_type,
            min(options.least for options in each),
            max(options.queue_length for options in each),
            next((options.encoding for options in each if options.encoding), None),
        )

    def begin_anew(self) -> None:
        """Forget the faults of an earlier connection: a new one is open."""
        self.count = 0
        self._found.clear()
        self._clear_fault()

    def link_lost(self) -> None:
        """Forget the messages of the connection that has ended."""
        self._latest = None
        for listener in self.listeners:
            listener.hush()

    def received(self, message: ReceivedMessage) -> bool:
        """Count a received message; return False if it is too large for its type.

        A message that is too large is reported and not delivered.
        """
        self.count += 1
        size = message.size
        if size > GENERAL.size:
            views = [listener.decode for listener in self.listeners]
            type = self.message_type
            try:
                check_size(size, limit_of(type, views), type)
            except TooLarge as error:
                self.failing.add(TooLarge)
                self._determine_reason(error, None)
                return False
        self._latest = message if self._may_be_latched or self.count == 1 else None
        if size > LARGE and self.replay is None:  # too large to keep for nothing
            self._latest = None
        return True

    @property
    def replay(self) -> ReceivedMessage | None:
        """The message that a new listener gets, since it will not come again.

        A bridge sends a latched message once for each subscription on the wire.
        """
        latched = self.name in _LATCHED_TOPICS or self.count == 1
        if not latched and self.message_type is not None:
            latched = is_type(self.message_type, *_LATCHED_TYPES)
        return self._latest if latched else None

    def complain(
        self, error: ProtocolError, decode: type[msgspec.Struct] | None
    ) -> None:
        """Report a message that does not decode.

        The reason is determined once for each connection and each kind of error. If
        other messages were decoded since, the known reason is shown again.
        """
        self.failing.add(decode)
        self._determine_reason(error, decode)

    def silent(self) -> None:
        """Report that no messages come, as for a topic of another type."""
        self.failing.add(_Silence)
        self._determine_reason(_Silence("no messages come"), None)

    def _determine_reason(
        self, error: ProtocolError, decode: type[msgspec.Struct] | None
    ) -> None:
        kind = type(error)
        if kind not in self._found:
            self._found[kind] = None
            expected = self.message_type or (decode.__name__ if decode else "a message")
            self._complain(self, expected, error)
            return
        found = self._found[kind]
        if found is not None and self._fault is None:
            self._show(found)

    def failed(self, fault: ProtocolError, error: ProtocolError) -> None:
        """Show to all listeners why the messages cannot be used, if that is still so.

        Args:
            fault: The reason.
            error: The error that was reported.

        """
        self._found[type(error)] = fault
        if self.failing:
            self._show(fault)

    def over(self, fault: BridgeError) -> None:
        """Show to all listeners why no more messages come."""
        self._show(fault)

    def understood(self, decode: type[msgspec.Struct] | None) -> None:
        """Register that messages decode as ``decode``, and withdraw outdated faults."""
        self.failing -= {_Silence, TooLarge}
        self._succeeds(decode)

    def _succeeds(self, decode: type[msgspec.Struct] | None) -> None:
        self.failing.discard(decode)
        if not self.failing:
            self._clear_fault()

    def _show(self, fault: BridgeError) -> None:
        self._fault = fault
        for listener in tuple(self.listeners):
            listener.report(fault)

    def _clear_fault(self) -> None:
        self._fault = None
        self.failing.clear()
        for listener in tuple(self.listeners):
            listener.take_back()
