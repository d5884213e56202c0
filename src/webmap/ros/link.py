"""What a bridge needs of a link, the way in which it speaks to one ROS system.

*A new kind of link* in the design has the rules that no type can state. All methods are
called in the model's thread.
"""

import asyncio
import logging
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Literal, Protocol, TypedDict, Unpack

from webmap.base.errors import BridgeClosed, BridgeError, ProtocolError
from webmap.base.text import one_line
from webmap.ros.definitions import Definitions
from webmap.ros.received_message import BridgeStats, LinkState, ReceivedMessage
from webmap.ros.sockets.connection import CLOSED_HERE
from webmap.ros.subscriptions import Topic

log = logging.getLogger("webmap.ros")

PATIENCE = 5.0
"""Longest wait for the response to a call, in seconds."""


class _Lane(Protocol):
    """The connection that carries the messages."""

    @property
    def state(self) -> LinkState:
        """``connecting`` also between two attempts, ``closed`` only after a stop."""

    @property
    def last_heard(self) -> float | None:
        """When the last bytes came, on the monotonic clock; None before the first."""

    @property
    def lag(self) -> float:
        """Approximate delay of the data that now comes, in seconds; 0 if not known."""

    def start(self, loop: asyncio.AbstractEventLoop) -> None:
        """Begin to connect, and connect again after each loss and failed attempt.

        A second call while it runs has no effect. It is also called after
        ``_Link.stop``.

        Args:
            loop: The event loop, which runs in the model's thread.

        """


class _Graph(Protocol):
    """What is known of the ROS system; None means unknown or no answer."""

    def known(self, topic: str) -> str | None:
        """Return the known type of ``topic``, without a question."""

    async def topics(self) -> dict[str, str]:
        """Return the topics and the type of each, also before ``lane.start()``.

        Raises:
            BridgeClosed: If the robot cannot be reached.
            ServiceError: If it does not list its topics.

        """

    async def topic_type(self, topic: str) -> str | None:
        """Return the type of ``topic``, in any dialect."""

    async def service_type(self, service: str) -> str | None:
        """Return the type of ``service``, in any dialect."""

    async def nodes(
        self, kind: Literal["publishers", "subscribers"], topic: str
    ) -> list[str] | None:
        """Return the names of the nodes of a kind."""

    async def definitions(self, type: str, kind: str) -> Definitions:
        """Return the definitions of a type: see :meth:`webmap.Bridge.definitions`."""

    async def time(self) -> float | None:
        """Return the time of the ROS system in seconds since 1970."""

    async def set_parameter(self, name: str, value: Any, patience: float) -> Any:
        """Set a parameter and return its new value, or raise ServiceError."""


class _Link(Protocol):
    stats: BridgeStats
    """Counts of the connection, which the link keeps."""

    trouble: str | None
    """Why the connection is not open: set by the link; None while it is open."""

    over: str | None
    """Why no connection is opened any more: set by the bridge, which has ended."""

    @property
    def lane(self) -> _Lane: ...
    @property
    def graph(self) -> _Graph: ...
    def refuse_if_over(self) -> None:
        """Raise BridgeClosed with ``over``, if that is set."""

    def subscribe(self, topic: Topic) -> None:
        """Pass on the messages of a topic; called again when ``topic.options`` changes.

        A link may pass on more messages than ``topic.options`` asks for, such as every
        one: the bridge decodes those that a listener needs.
        """

    def unsubscribe(self, topic: Topic) -> None:
        """End the subscription to a topic."""

    def published_type(self, topic: str) -> str | None:
        """Return the type with which ``topic`` is published here, None if it is not."""

    def publish(self, topic: str, type: str, message: Mapping[str, Any]) -> None:
        """Send a message now, or raise an error; nothing is queued for later.

        Raises:
            BridgeClosed: If the connection is not open, or accepts no more data.
            ValueError: If a number is NaN or infinite, and the link writes JSON.
            TypeError: If a value has no form in what the link writes.

        """

    def unadvertise(self, topic: str) -> None:
        """Stop publishing on ``topic``; no effect if it was not published."""

    async def call_service(
        self,
        service: str,
        args: Mapping[str, Any] | Sequence[Any] | None,
        *,
        type: str | None,
        timeout: float,
    ) -> Any:
        """Call a service and return the fields of the response.

        Raises:
            ServiceError: If the service fails or does not respond in time.
            BridgeClosed: If the connection cannot be opened, or ends before that.

        """

    async def stop(self) -> None:
        """Close every connection; keep the subscriptions for another start."""


class LinkCallbacks(TypedDict):
    """What a bridge lets its link call. They log nothing: the link does."""

    opened: Callable[[], None]
    """To call when the connection is open."""

    closed: Callable[[str], None]
    """To call when an open connection has ended, with a reason."""

    received: Callable[[Topic, ReceivedMessage], bool]
    """To call with each message of a subscribed topic. It returns whether the message
    can be used; a link may ignore that."""

    report: Callable[[Exception], None]
    """To call with each error that a person may need to know, such as a failed attempt
    to connect."""


class LinkType(Protocol):
    """The class of a kind of link; it need not derive from any other class."""

    def __call__(
        self, url: str, name: str, **callbacks: Unpack[LinkCallbacks]
    ) -> _Link:
        """Make the link of one bridge, which opens no connection yet.

        Args:
            url: The normalised address: without the port if that is the default one.
            name: The bridge's name, as shown to people.
            callbacks: What the link calls.

        """


class _Calls(Protocol):
    async def call(
        self,
        service: str,
        args: Mapping[str, Any] | Sequence[Any] | None,
        type: str | None,
        patience: float,
        /,
    ) -> Any: ...
    async def stop(self) -> None: ...


class ReconnectingLink:
    """The state of a link, what is logged about it, and its calls.

    Args:
        name: The bridge's name, as shown to people.
        callbacks: Those of the bridge.

    """

    _calls: _Calls

    def __init__(self, name: str, **callbacks: Unpack[LinkCallbacks]) -> None:
        self.stats = BridgeStats()
        self.trouble: str | None = None
        """Why the connection is not open: the last failed attempt or the last loss."""
        self.over: str | None = None
        """Why no connection is opened any more; None if connections are allowed."""
        self._name = name
        self._on_open = callbacks["opened"]
        self._on_close = callbacks["closed"]
        self._on_message = callbacks["received"]
        self._report = callbacks["report"]
        self._complained = False
        """Whether the failure of the connection has been logged."""

    def refuse_if_over(self) -> None:
        """Raise BridgeClosed if no connection is opened any more."""
        if self.over is not None:
            raise BridgeClosed(self.over)

    async def call_service(
        self,
        service: str,
        args: Mapping[str, Any] | Sequence[Any] | None = None,
        *,
        type: str | None = None,
        timeout: float = PATIENCE,
    ) -> Any:
        """Call a ROS service on a socket of its own; return the fields of the response.

        Raises:
            ServiceError: If the service fails or does not respond in time.
            BridgeClosed: If the connection cannot be opened, or ends before the
                response.

        """
        self.refuse_if_over()
        return await self._calls.call(service, args, type, timeout)

    def _opened(self) -> None:
        self.stats.links += 1
        self.trouble, self._complained = None, False
        log.info("%s: the connection is open", self._name)

    def _lost(self, reason: str) -> None:
        level = logging.INFO if reason == CLOSED_HERE else logging.WARNING
        log.log(level, "%s: the connection ended: %s", self._name, reason)
        self.trouble = reason

    def _not_opened(self, error: BridgeClosed) -> None:
        # Log one line for a bridge that cannot be reached, however long that lasts.
        level = logging.DEBUG if self._complained else logging.WARNING
        self._complained = True
        self.trouble = error.why
        log.log(level, "%s", error, extra={"source": self._name})
        self._report(error)


def report_error(
    name: str, message: object, report: Callable[[Exception], None]
) -> None:
    """Report an error that a bridge itself reports.

    Args:
        name: The bridge's name, as shown to people.
        message: What the bridge reports.
        report: Called with the error.

    """
    text = f"{name}: the bridge reports an error: {one_line(message)}"
    log.warning("%s", text, extra={"source": name})
    report(BridgeError(text))


def report_malformed(
    name: str,
    found: str,
    topics: Iterable[Topic],
    report: Callable[[Exception], None],
) -> None:
    """Report a frame that is not in the protocol of a bridge, also to one subscriber.

    Args:
        name: The bridge's name, as shown to people.
        found: What it sent, as the end of a sentence.
        topics: The topics with the subscribers.
        report: Called with the error.

    """
    error = ProtocolError(f"{name} sent {found}")
    log.warning("%s", error, extra={"source": name})
    report(error)
    for topic in topics:
        for listener in topic.listeners:
            if listener.mention(error):
                return
