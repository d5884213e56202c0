"""Who listens to which topic, and what the bridge is asked for on their behalf."""

import time
from asyncio import AbstractEventLoop, TimerHandle
from collections.abc import Callable

import msgspec

from webmap.errors import BridgeError, ConfigError, ProtocolError
from webmap.identifiers import generate_id
from webmap.ros import large, ops
from webmap.ros.callbacks import Callback
from webmap.ros.events import Publish
from webmap.ros.large import InJson
from webmap.ros.limits import GENERAL, LARGE, TooLarge, check_size, limit_of
from webmap.ros.names import is_type, same_type, split_type
from webmap.ros.throttle import Throttle
from webmap.ros.wish import Wish
from webmap.scope import Scope, current_scope

_LATCHED_TYPES = ("nav_msgs/OccupancyGrid",)
_LATCHED_TOPICS = ("/tf_static", "/robot_description")


class _Silence(ProtocolError):
    """Nothing comes at all."""


class Subscription:
    """One listener to a topic; made by :meth:`webmap.Bridge.subscribe`.

    It ends when :meth:`remove` is called, or with the scope that it was made in.
    """

    def __init__(
        self,
        topic: "Topic",
        callback: Callback,
        wish: Wish,
        decode: type[msgspec.Struct] | None,
    ) -> None:
        self.topic = topic.name
        """The resolved name of the topic."""
        self.wish = wish
        self.decode = decode
        self.removed = False
        self.undecoded = False
        """Whether it is handed each message as it came, at once and not decoded."""
        self.throttle: Throttle[Publish] = Throttle(wish.throttle / 1000)
        self._of = topic
        self._callback = callback
        self._timer: TimerHandle | None = None
        self._reported = False
        self._scope: Scope | None = current_scope()
        if self._scope is not None:
            self._scope.add(self)

    def remove(self) -> None:
        """End this subscription and no other; the second call does nothing."""
        if self.removed:
            return
        self.removed = True
        self._callback.end()
        self.hush()
        self.take_back()
        if self._scope is not None:
            self._scope.discard(self)
        self._of.remove(self)

    def deliver(self, message: Publish) -> None:
        """Decode the message as the listener wants it and hand it over."""
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
        """Show whoever subscribed that the messages cannot be used."""
        if self._scope is not None and self._scope.report is not None:
            self._reported = True
            self._scope.report(str(fault), self)

    def take_back(self) -> None:
        """Take back what :meth:`report` showed, if it did."""
        if self._reported and self._scope is not None:
            self._reported = False
            if self._scope.mended is not None:
                self._scope.mended(self)

    def mention(self, fault: ProtocolError) -> bool:
        """Tell whoever subscribed of what passes; False if nobody is to be told."""
        if self._scope is None or self._scope.report is None:
            return False
        self._scope.report(str(fault), None)
        return True

    def hold(self, loop: AbstractEventLoop, release: Callable[[], None]) -> None:
        """Come back for what the throttle holds."""
        due = self.throttle.due
        if due is not None and self._timer is None:
            self._timer = loop.call_later(max(0.0, due - time.monotonic()), release)

    def hush(self) -> None:
        """Forget what the throttle holds."""
        self.throttle.drop()
        self.forget_timer()

    def forget_timer(self) -> None:
        """Note that the timer of :meth:`hold` has fired, or keep it from firing."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None


class Topic:
    """All listeners to one topic of one bridge, and their one wire subscription.

    Args:
        name: The resolved name.
        send: Sends a frame if the link is open, else does nothing.
        complain: Is told of a message that does not decode, once for each link and
            each kind of error.
        too_large: Called when messages turn out to be too large for CBOR, with the
            bytes of one in JSON; with None if links ended before one came.
        emptied: Called when the last listener has gone.

    """

    def __init__(
        self,
        name: str,
        *,
        send: Callable[[bytes], None],
        complain: Callable[["Topic", str, ProtocolError], None],
        too_large: Callable[["Topic", int | None], None],
        emptied: Callable[["Topic"], None],
    ) -> None:
        self.name = name
        self.listeners: dict[Subscription, None] = {}
        self.count = 0
        """Messages since the link was opened."""
        self._send = send
        self._complain = complain
        self._too_large = too_large
        self._emptied = emptied
        self._in_json = InJson()
        self._asked_at = 0.0
        """When the wire was asked for the first message of this encoding."""
        self.failing: set[object] = set()
        """As what the newest messages could not be decoded."""
        self._fault: BridgeError | None = None
        self._found: dict[type[ProtocolError], ProtocolError | None] = {}
        """What was found out of each kind of error; None while it is looked for."""
        self._latest: Publish | None = None
        self._asked: Wish | None = None
        self._id = ""

    @property
    def message_type(self) -> str | None:
        """The message type, if any listener said it."""
        return next((s.wish.type for s in self.listeners if s.wish.type), None)

    def check(self, wish: Wish) -> None:
        """Let a further listener join if what it wants goes with the others.

        Raises:
            ConfigError: If it names another type, or another kind of raw bytes.

        """
        mine = self.message_type
        if mine and wish.type and not same_type(mine, wish.type):
            raise ConfigError(f"{self.name} is subscribed as {mine}, not {wish.type}")
        raw = self._asked is not None and self._asked.compression == "cbor-raw"
        if self.listeners and raw != (wish.compression == "cbor-raw"):
            raise ConfigError(
                f"{self.name}: raw and decoded messages cannot share a subscription"
            )

    def add(self, listener: Subscription) -> None:
        """Let ``listener`` join, and ask the bridge for more if it wants more."""
        self.listeners[listener] = None
        if self._fault is not None:
            listener.report(self._fault)
        self.update()

    def remove(self, listener: Subscription) -> None:
        """Let ``listener`` go, and ask the bridge for less if the others want less."""
        self.listeners.pop(listener, None)
        if self.listeners:
            alone = all(o.decode is not listener.decode for o in self.listeners)
            if self.failing and alone:
                self._succeeds(listener.decode)
            self.update()
            return
        if self._asked is not None:
            self._send(ops.unsubscribe(self.name, id=self._id))
        self._asked, self._latest = None, None
        self._emptied(self)

    def wish(self) -> Wish:
        """Return what serves every listener."""
        type = self.message_type
        each = [listener.wish for listener in self.listeners]
        chosen = next((w.compression for w in each if w.compression), None)
        bulk = type is not None and is_type(type, *large.BULK)
        wish = Wish(
            # The name as in ROS 1, which bridges of both kinds understand.
            str(split_type(type)) if type else None,
            min(w.throttle for w in each),
            max(w.queue_length for w in each),
            chosen or ("cbor" if bulk else None),
        )
        if wish.compression == "cbor" and self._in_json.on:
            throttle = max(wish.throttle, large.THROTTLE)
            return wish._replace(throttle=throttle, compression="none")
        return wish

    def ask_in_json(self) -> bool:
        """Ask for JSON because CBOR does not come; return whether that was done."""
        if self._asked is None:
            return False
        answer = self._in_json.silent(self._asked.type, self._asked.compression)
        if answer == "ask":
            self.renew()
        elif answer == "given up":
            self._too_large(self, None)
        return answer == "ask"

    @property
    def awaits_large(self) -> bool:
        """Whether the bridge may be busy with a large message for this topic."""
        asked = self._asked
        if self.count or asked is None or asked.type is None:
            return False
        if not is_type(asked.type, *large.REPLACED):
            return False
        waited = time.monotonic() - self._asked_at
        return waited < large.PATIENCE.get(asked.compression or "", 0.0)

    def update(self) -> None:
        """Ask the bridge anew if what is wanted has changed.

        The new subscription begins before the old one ends, so nothing is missed.
        """
        wish = self.wish()
        if self._asked == wish:
            return
        old, had = self._id, self._asked is not None
        self._ask(wish)
        if had:
            self._send(ops.unsubscribe(self.name, id=old))

    def again(self) -> None:
        """Ask the bridge on a new link, which knows nothing of the old one."""
        self.count = 0
        self._found.clear()
        self._in_json.begin()
        self._mend()
        self._ask(self.wish())

    def renew(self) -> None:
        """Give the subscription up and ask for it anew.

        While there is one, a bridge goes on with the old one's quality of service.
        """
        if self._asked is not None:
            self._send(ops.unsubscribe(self.name, id=self._id))
            self._ask(self.wish())

    def link_lost(self) -> None:
        """Forget what the old link brought and was asked."""
        self._asked, self._latest = None, None
        for listener in self.listeners:
            listener.hush()

    def _ask(self, wish: Wish) -> None:
        if self._asked is None or self._asked.compression != wish.compression:
            self._asked_at = time.monotonic()
        self._asked, self._id = wish, generate_id()
        self._send(
            ops.subscribe(
                self.name,
                id=self._id,
                type=wish.type,
                throttle_rate=wish.throttle,
                queue_length=wish.queue_length,
                compression=wish.compression,
            )
        )

    def received(self, message: Publish) -> bool:
        """Note a message that came; False if it is too large for its type.

        One that is too large is reported and belongs to nobody.
        """
        self.count += 1
        size = len(message.frame)
        if size > GENERAL.size:
            views = [listener.decode for listener in self.listeners]
            type = self.message_type
            try:
                check_size(size, limit_of(type, views), type)
            except TooLarge as error:
                self.failing.add(TooLarge)
                self._find_out(error, None)
                return False
        self._latest = message
        too_large = self._in_json.received(in_parts=message.in_parts)
        if too_large:
            self._too_large(self, len(message.frame))
        elif too_large is False:
            self.renew()
        if size > LARGE and self.replay is None:  # nobody will ask for it
            self._latest = None
        return True

    @property
    def replay(self) -> Publish | None:
        """What a listener that joins late is given, since it will not come again.

        A bridge sends a latched message once for each subscription of the wire.
        """
        latched = self.name in _LATCHED_TOPICS or self.count == 1
        if not latched and self.message_type is not None:
            latched = is_type(self.message_type, *_LATCHED_TYPES)
        return self._latest if latched else None

    def complain(
        self, error: ProtocolError, decode: type[msgspec.Struct] | None
    ) -> None:
        """Report a message that does not decode.

        Why that is so is found out once for each link and each kind of error. If one
        was understood meanwhile, the same is said again.
        """
        self.failing.add(decode)
        self._find_out(error, decode)

    def silent(self) -> None:
        """Report that nothing comes, as of a topic of another type."""
        self.failing.add(_Silence)
        self._find_out(_Silence("nothing will come"), None)

    def _find_out(
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
        """Show everybody who listens why the messages cannot be used, if they cannot.

        Args:
            fault: What was found out.
            error: What was complained of.

        """
        self._found[type(error)] = fault
        if self.failing:
            self._show(fault)

    def over(self, fault: BridgeError) -> None:
        """Show everybody who listens why nothing comes any more."""
        self._show(fault)

    def understood(self, decode: type[msgspec.Struct] | None) -> None:
        """Note that messages decode so, and take back what is true no more."""
        self.failing -= {_Silence, TooLarge}
        self._succeeds(decode)

    def _succeeds(self, decode: type[msgspec.Struct] | None) -> None:
        self.failing.discard(decode)
        if not self.failing:
            self._mend()

    def _show(self, fault: BridgeError) -> None:
        self._fault = fault
        for listener in tuple(self.listeners):
            listener.report(fault)

    def _mend(self) -> None:
        self._fault = None
        self.failing.clear()
        for listener in tuple(self.listeners):
            listener.take_back()
