"""The sessions of this process with one Zenoh router.

Commands and ticks have sessions of their own: on one session with data they waited for
seconds over a narrow link, whatever their priority. There are two of them, each a
connection with every sample, of which the first copy counts: while a lost packet of one
connection is sent again, the other goes on. All sessions are clients of the router,
find nobody by themselves and listen on nothing.
"""

import atexit
import logging
import threading
from collections import OrderedDict, deque
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from webmap.agents.address import locator
from webmap.agents.router_access import RouterUser
from webmap.base.errors import WireError
from webmap.base.text import one_line
from webmap.base.zenoh_sessions import (
    OPENING,
    client_settings,
    why_not_reached,
    zenoh_config,
)

if TYPE_CHECKING:
    import zenoh
    from zenoh.handlers import Callback

log = logging.getLogger("webmap.agent")

Handler = Callable[[str, bytes], None]
"""Called with the key and the bytes of a message, in a thread of Zenoh."""

COPIES = 2
"""Sessions for the gate; each carries every sample."""

RETRY = 0.2
"""Seconds between two attempts to reach the router."""

EXPLAIN = 25
"""Failed attempts between two searches for the reason."""

CHECK = 0.25
"""Seconds between two checks whether the router is connected."""

SMALL = 4096
"""Bytes up to which several messages of a topic may wait; of larger ones the newest."""

MOST_WAITING = 10
"""Messages of a topic that wait at most."""

MOST_OF_ALL = 1000
"""Messages under a key that wait at most where every one counts."""

MOST_WAITING_BYTES = 8 << 20
"""Bytes under a key that wait at most besides the newest message."""

MOST_CHANGES_BYTES = 256 << 10
"""The same under the key of a topic where each message counts: more would be late."""

MOST_BYTES = 68 << 20
"""Bytes of the largest message: the largest of a rosbridge, and its packing."""

ASK_PATIENCE = 5.0
"""Seconds for an answer of another peer."""


class Peer:
    """The sessions with one router; opened again by themselves after each loss.

    Args:
        router: The router's address.
        user: Who this process is.
        most: Bytes of the largest message that it receives; larger ones are dropped
            before they fill the memory.

    Raises:
        ConfigError: If the address is none, or Zenoh is not installed.

    """

    def __init__(
        self, router: str, user: RouterUser | None = None, most: int = MOST_BYTES
    ) -> None:
        self.locator = locator(router)
        self.user = user or RouterUser.from_environment()
        self.trouble: str | None = f"waiting for the router at {self.locator}"
        """Why the router is not connected; None if it is."""
        who = (self.user.name, self.user.password, self.user.ca)
        self._config = client_settings(self.locator, most, *who)
        zenoh_config()  # to fail here, not in a thread
        self._lock = threading.Lock()
        self._ended = threading.Event()
        self._gate: list[zenoh.Session] = []
        self._data: zenoh.Session | None = None
        self._handlers: dict[int, tuple[str, Handler, bool, int, bool]] = {}
        self._answers: dict[str, Callable[[], bytes]] = {}
        self._declared: dict[int, list[Any]] = {}
        self._number = 0
        self._waiting: OrderedDict[str, deque[bytes]] = OrderedDict()
        self._wake = threading.Condition()
        self._putting = threading.Lock()
        self._threads: list[threading.Thread] = []
        self._receivers: list[Future[threading.Thread]] = []
        """The threads in which Zenoh calls a function, known when they end."""

    @property
    def connected(self) -> bool:
        """Whether the sessions with the router are open; else see ``trouble``."""
        return self.trouble is None

    def start(self) -> None:
        """Connect, and keep connected; a second call does nothing."""
        if self._threads:
            return
        for fn, name in ((self._keep, "router"), (self._send_waiting, "data")):
            thread = threading.Thread(target=fn, name=f"webmap-{name}", daemon=True)
            self._threads.append(thread)
            thread.start()

    def close(self) -> None:
        """Close the sessions; a process that does not close them hangs at its end.

        Then no thread is inside Zenoh. Python ends the threads that come back from
        there after its own end, and so aborts the process: Rust does not allow that.
        """
        self._ended.set()
        with self._wake:
            self._wake.notify_all()
        keeping, sending = self._threads or (None, None)
        if keeping is not None:
            keeping.join(3 * OPENING)
        with self._putting:
            sessions = (*self._gate, self._data)
            self._gate, self._data = [], None
        for session in sessions:
            if session is not None:
                session.close()  # type: ignore[no-untyped-call]
        if sending is not None:
            sending.join(OPENING)  # a closed session sends nothing
        for receiver in self._receivers:
            with suppress(TimeoutError):
                receiver.result(OPENING).join(OPENING)

    def listen(
        self,
        key: str,
        fn: Handler,
        *,
        gate: bool = False,
        most: int = MOST_BYTES,
        back: bool = False,
    ) -> int:
        """Call ``fn`` with each message under a key; return a number to end it.

        Args:
            key: The key; ``*`` and ``**`` match parts of keys.
            fn: Receives the messages.
            gate: Whether they are samples of :meth:`put_gate`. Each comes up to
                :data:`COPIES` times, in as many threads.
            most: Bytes of the largest message; larger ones are dropped unread.
            back: Whether data that this process itself sends comes only if the router
                sends it back.

        """
        with self._lock:
            self._number += 1
            number = self._number
            self._handlers[number] = (key, fn, gate, most, back)
            self._declare(number)
        return number

    def unlisten(self, number: int) -> None:
        """End :meth:`listen`."""
        with self._lock:
            self._handlers.pop(number, None)
            declared = self._declared.pop(number, [])
        for each in declared:
            each.undeclare()

    def answer(self, key: str, fn: Callable[[], bytes]) -> None:
        """Answer every question for a key with the result of ``fn``."""
        with self._lock:
            self._answers[key] = fn
            if self._data is not None:
                self._declare_answer(key)

    def ask(
        self, key: str, patience: float = ASK_PATIENCE, most: int = 1 << 20
    ) -> bytes | None:
        """Return the answer of another peer; None if there is none. Waits for it.

        Raises:
            WireError: If the answer has more than ``most`` bytes; it is not copied.

        """
        session = self._data
        if session is None:
            return None
        for reply in session.get(key, timeout=patience):
            if reply.ok is not None:
                payload = reply.ok.payload
                if len(payload) > most:
                    raise WireError(
                        f"got {len(payload)} bytes, expected {most} at most"
                    )
                return payload.to_bytes()
        return None

    def put_gate(self, key: str, data: bytes, only: int | None = None) -> None:
        """Send a sample of the gate now, or not at all.

        Args:
            key: The key.
            data: The sample.
            only: Chooses one of the connections, by the remainder of this number; None
                is for all of them.

        """
        import zenoh

        with self._putting:
            for copy, session in enumerate(self._gate):
                if only is not None and copy != only % len(self._gate):
                    continue
                with suppress(zenoh.ZError):  # it was closed just now
                    session.put(
                        f"{key}/{copy}",
                        data,
                        congestion_control=zenoh.CongestionControl.DROP,
                        priority=zenoh.Priority.REAL_TIME,
                        express=True,
                    )

    def put_data(
        self,
        key: str,
        data: bytes,
        *,
        all: bool = False,
        size: int = MOST_WAITING_BYTES,
    ) -> None:
        """Send data as soon as the link accepts it.

        Args:
            key: The key.
            data: The data.
            all: Whether every message counts. Otherwise the oldest that wait under the
                key are left out.
            size: Bytes that wait at most besides the newest message.

        """
        if not self.connected:
            return
        with self._wake:
            waiting = self._waiting.get(key)
            if waiting is None:
                waiting = self._waiting[key] = deque()
            most = MOST_WAITING if len(data) <= SMALL else 1
            while len(waiting) >= (MOST_OF_ALL if all else most) or (
                sum(map(len, waiting)) > size
            ):
                waiting.popleft()
            waiting.append(data)
            self._wake.notify()

    def _send_waiting(self) -> None:
        import zenoh

        while not self._ended.is_set():
            with self._wake:
                while not self._waiting and not self._ended.is_set():
                    self._wake.wait()
                if self._ended.is_set():
                    return
                key, waiting = self._waiting.popitem(last=False)
                data = waiting.popleft()
                if waiting:
                    self._waiting[key] = waiting
            session = self._data
            if session is None or not self.connected:
                continue
            try:
                session.put(
                    key,
                    data,
                    congestion_control=zenoh.CongestionControl.BLOCK,
                    priority=zenoh.Priority.DATA,
                    express=True,
                )
            except zenoh.ZError as error:
                log.warning("%s: data was not sent: %s", self.locator, error)

    def _keep(self) -> None:
        """Open the sessions, then note whether the router is connected."""
        import zenoh

        failures = 0
        while not self._ended.is_set():
            try:
                while len(self._gate) < COPIES:
                    self._gate.append(zenoh.open(zenoh_config(**self._config)))
                self._data = self._data or zenoh.open(zenoh_config(**self._config))
                break
            except zenoh.ZError:
                if failures % EXPLAIN == 0:
                    self._explain()
                failures += 1
                self._ended.wait(RETRY)
        self._check()  # before messages arrive, which are answered
        with self._lock:
            for number in self._handlers:
                self._declare(number)
            for key in self._answers:
                self._declare_answer(key)
        while not self._ended.wait(CHECK):
            self._check()

    def _check(self) -> None:
        """Note whether the router is connected."""
        data = self._data is not None and self._data.info.routers_zid()
        there = data and any(session.info.routers_zid() for session in self._gate)
        if there and not self.connected:
            self.trouble = None
            log.info("the router at %s is connected", self.locator)
        elif not there and self.connected:
            with self._wake:
                self._waiting.clear()  # it would arrive late, as if it were new
            self.trouble = f"no connection to the router at {self.locator}"
            log.warning("%s", self.trouble)

    def _explain(self) -> None:
        """Note why the router cannot be reached, and log it when it changes."""
        why = why_not_reached(self.locator, self.user.ca) or self.user.refusal
        trouble = f"cannot reach the router at {self.locator}: {one_line(why)}"
        if trouble != self.trouble:
            log.warning("%s", trouble)
        self.trouble = trouble

    def _declare(self, number: int) -> None:
        key, fn, gate, most, back = self._handlers[number]
        if self._data is None or number in self._declared:
            return

        def call(sample: "zenoh.Sample") -> None:
            try:
                size = len(sample.payload)
                if size > most:
                    log.warning(
                        "%s: a message of %d bytes was dropped, expected %d at most",
                        sample.key_expr,
                        size,
                        most,
                    )
                    return
                fn(str(sample.key_expr), sample.payload.to_bytes())
            except Exception:
                log.exception("%s: a message was lost", key)

        places = [(self._gate[0] if back else self._data, key)]
        if gate:
            places = [
                (session, f"{key}/{copy}") for copy, session in enumerate(self._gate)
            ]
        self._declared[number] = [
            session.declare_subscriber(place, self._receiver(call))
            for session, place in places
        ]

    def _declare_answer(self, key: str) -> None:
        def call(query: "zenoh.Query") -> None:
            with query:
                try:
                    query.reply(key, self._answers[key]())
                except Exception:
                    log.exception("%s: a question was not answered", key)

        assert self._data is not None
        self._data.declare_queryable(key, self._receiver(call))

    def _receiver(self, call: Callable[[Any], None]) -> "Callback[Any]":
        """Return a handler that Zenoh calls in a thread of its own."""
        from zenoh.handlers import Callback

        ended: Future[threading.Thread] = Future()
        known = [e for e in self._receivers if not e.done() or e.result().is_alive()]
        self._receivers = [*known, ended]
        return Callback(call, lambda: ended.set_result(threading.current_thread()))


_peers: dict[str, Peer] = {}
_peers_lock = threading.Lock()


def peer_of(router: str, most: int = MOST_BYTES) -> Peer:
    """Return the peer of this process for a router; it is started.

    Args:
        router: The router's address.
        most: Bytes of the largest message that a new peer receives.

    """
    with _peers_lock:
        place = locator(router)
        peer = _peers.get(place)
        if peer is None:
            if not _peers:
                atexit.register(close_peers)
            peer = _peers[place] = Peer(router, most=most)
            peer.start()
        return peer


def close_peers() -> None:
    """Close the peers of this process; called at its end, may take some seconds."""
    with _peers_lock:
        for peer in _peers.values():
            peer.close()
        _peers.clear()
