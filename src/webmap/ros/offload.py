"""Decoding of large frames in another process, so that they do not delay small ones."""

import asyncio
import contextlib
import logging
import time
from array import array
from collections import deque
from collections.abc import AsyncIterator, Callable, Iterator
from typing import Any, NamedTuple, cast

import msgspec

from webmap.base.errors import ProtocolError
from webmap.base.processes import python_command
from webmap.ros.arrays import dec_hook
from webmap.ros.decoding import Unreadable, convert
from webmap.ros.limits import LARGE, MAX_FRAME, TooLarge
from webmap.ros.received_message import ReceivedMessage
from webmap.ros.worker import (
    LENGTH,
    MAX_MESSAGE,
    WorkRequest,
    WorkResult,
    class_name,
    item_type,
    view_name,
)

log = logging.getLogger("webmap.ros")

PATIENCE = 20.0
"""Longest time for one frame, in seconds."""

CHUNK = 1 << 20
"""Bytes that are copied at a time; the event loop waits for each copy."""

MOST_WAITING = 16
"""Most messages of a topic that wait for the decoding, where each message counts."""


class Reply(NamedTuple):
    """An answer, its parts, and how long the worker was busy with it."""

    answer: WorkResult
    parts: list[bytearray]
    seconds: float


_WORKER_FAILURES = (
    OSError,
    EOFError,
    TimeoutError,
    msgspec.MsgspecError,
    RuntimeError,  # from uvloop, if the pipe has just closed
)


class _Worker:
    """The only worker process of this process; the first large frame starts it.

    It handles one request at a time, in the order of the requests. Each bridge sends
    one request at a time, so every bridge gets its turn.
    """

    def __init__(self) -> None:
        self.users: set[int] = set()
        self._process: asyncio.subprocess.Process | None = None
        self._turn = asyncio.Lock()
        self.taking_over = asyncio.Lock()
        """Held while a part of an answer is processed; others wait in order."""

    async def ask(
        self, request: WorkRequest, data: bytes | bytearray | memoryview
    ) -> Reply:
        """Return the worker's answer to a request; a failure is an answer, too."""
        async with self._turn:
            began = time.monotonic()
            try:
                async with asyncio.timeout(PATIENCE):
                    answer, parts = await self._ask(request, data)
            except _WORKER_FAILURES as error:
                await self.stop()
                answer, parts = WorkResult(error=f"its decoder ended: {error!r}"), []
            except asyncio.CancelledError:
                await self.stop()  # the next request would get this answer
                raise
            return Reply(answer, parts, time.monotonic() - began)

    async def _ask(
        self, request: WorkRequest, data: bytes | bytearray | memoryview
    ) -> tuple[WorkResult, list[bytearray]]:
        process = self._process
        if process is None or process.returncode is not None:
            process = self._process = await _start()
        if process.stdin is None or process.stdout is None:
            raise EOFError("the worker has no pipes")
        body = msgspec.msgpack.encode(request)
        process.stdin.write(LENGTH.pack(len(body)) + body)
        view = memoryview(data)
        for at in range(0, len(data), CHUNK):
            process.stdin.write(view[at : at + CHUNK])
            await process.stdin.drain()
        await process.stdin.drain()
        (length,) = LENGTH.unpack(await process.stdout.readexactly(LENGTH.size))
        if length > CHUNK:
            raise EOFError(f"an answer of {length} bytes")
        head = await process.stdout.readexactly(length)
        answer = msgspec.msgpack.decode(head, type=WorkResult)
        if sum(answer.sizes) > MAX_MESSAGE:
            raise EOFError(f"an answer of {sum(answer.sizes)} bytes")
        return answer, [await _read(process.stdout, size) for size in answer.sizes]

    async def stop(self) -> None:
        """End the process; the next large frame starts another."""
        process, self._process = self._process, None
        if process is None:
            return
        with contextlib.suppress(ProcessLookupError):
            process.kill()
        await process.wait()
        if process.stdin is not None:
            process.stdin.close()


async def _start() -> asyncio.subprocess.Process:
    return await asyncio.create_subprocess_exec(
        *python_command("webmap.ros.worker"),
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE,
    )


async def _read(stream: asyncio.StreamReader, size: int) -> bytearray:
    """Read so many bytes in pieces, since one long copy would block the event loop.

    The result grows with the pieces: filling a large one with zeros first takes long.
    """
    found = bytearray()
    while len(found) < size:
        piece = await stream.read(min(CHUNK, size - len(found)))
        if not piece:
            raise EOFError("the worker has ended")
        found += piece
    return found


def values(answer: WorkResult, parts: list[bytearray], type: Any) -> Iterator[Any]:
    """Build the value of an answer, one step for each received part.

    Yields:
        For a type that is ``separable``, each part as a message of its own. For other
        types, None for each step and the message at the end.

    Raises:
        ProtocolError: If the answer is an error, or not of the type.

    """
    if answer.error is not None:
        raise _ERRORS.get(answer.kind, ProtocolError)(answer.error)
    try:
        if view_name(type) is None:
            plain = msgspec.msgpack.decode(parts[0], ext_hook=_array)
            yield plain if type is None else convert(plain, type)
            return
        message = msgspec.msgpack.decode(
            parts[0], type=type, dec_hook=dec_hook, ext_hook=_numbers
        )
        if answer.field is not None:
            item: Any = item_type(message, answer.field)
            items = msgspec.msgpack.Decoder(list[item])
            whole = getattr(message, answer.field)
            separable = getattr(type, "separable", False)
            for part in parts[1:]:
                yield message if separable else None
                more = items.decode(part)
                if separable:
                    message = msgspec.structs.replace(message, **{answer.field: more})
                else:
                    whole += more
        yield message
    except (msgspec.DecodeError, ProtocolError) as error:
        raise ProtocolError(str(error)) from None


_ERRORS: dict[str, type[ProtocolError]] = {
    error.__name__: error for error in (TooLarge, Unreadable)
}


def _array(code: int, data: memoryview) -> "array[Any]":
    numbers: array[Any] = array(chr(code))
    numbers.frombytes(data)
    return numbers


def _numbers(code: int, data: memoryview) -> memoryview:
    return data.cast(cast(Any, chr(code)))


_shared: _Worker | None = None


def _acquire(user: object) -> _Worker:
    global _shared  # one worker for each process is the point
    if _shared is None:
        _shared = _Worker()
    _shared.users.add(id(user))
    return _shared


async def _release(user: object) -> None:
    global _shared
    worker = _shared
    if worker is None or id(user) not in worker.users:
        return
    worker.users.discard(id(user))
    if not worker.users:
        _shared = None
        await worker.stop()


@contextlib.asynccontextmanager
async def worker_kept() -> AsyncIterator[None]:
    """Keep the worker process for several calls of :func:`aside`."""
    user = object()
    _acquire(user)
    try:
        yield
    finally:
        await _release(user)


async def aside(
    function: Callable[..., bytes],
    data: bytes | bytearray | memoryview,
    *arguments: object,
) -> bytearray:
    """Call a function of WebMap with bytes in the worker process; return the result.

    Raises:
        ProtocolError: If the function raises one, or does not end.

    """
    user, name = object(), view_name(function)
    request = WorkRequest(len(data), call=name, arguments=list(arguments))
    worker = _acquire(user)
    try:
        reply = await worker.ask(request, data)
    finally:
        await _release(user)
    if reply.answer.error is not None:
        raise ProtocolError(reply.answer.error)
    return reply.parts[0]


_END = object()


class _Job(NamedTuple):
    message: ReceivedMessage
    types: frozenset[Any]
    then: tuple[Callable[[Any], None], ...]
    counts: bool


class Offload:
    """Decodes the large frames of one bridge: in order within a topic, the newest wins.

    Where each message counts, all of them are decoded, if the worker is fast enough.

    The worker has at most one frame of a bridge at a time. After each frame the bridge
    waits for as long as the decoding took, so the worker is free at least half of the
    time.
    """

    def __init__(self) -> None:
        self._waiting: dict[str, deque[_Job]] = {}
        """For each topic that is being decoded, the messages that wait."""
        self._tasks: set[asyncio.Task[None]] = set()
        self._turn = asyncio.Lock()
        self._rests_until = 0.0

    def is_needed(self, message: ReceivedMessage) -> bool:
        """Return whether ``message`` must be decoded by the worker."""
        return len(message.frame) > LARGE or message.topic in self._waiting

    def decode(
        self,
        message: ReceivedMessage,
        types: frozenset[Any],
        then: Callable[[Any], None],
        *,
        counts: bool = False,
    ) -> None:
        """Decode ``message`` in the worker as each of ``types``; then call ``then``.

        ``then`` is called once for each type, or once for each part of a ``separable``
        one. A newer message of the topic replaces a message that waits, and ends the
        delivery of a message in parts, unless ``counts`` is set: see
        :func:`webmap.ros.subscriptions.each_counts`.
        """
        job = _Job(message, types, (then,), counts)
        waiting = self._waiting.get(message.topic)
        if waiting is not None:
            _join(waiting, job)
            return
        self._waiting[message.topic] = deque()
        task = asyncio.ensure_future(self._work(message.topic, job))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _work(self, topic: str, job: _Job) -> None:
        waiting = self._waiting[topic]
        try:
            while True:
                await self._one(job, waiting)
                if not waiting:
                    break
                job = waiting.popleft()
        finally:
            del self._waiting[topic]

    async def _one(self, job: _Job, waiting: deque[_Job]) -> None:
        for type in job.types:
            message = job.message
            if len(message.frame) <= LARGE or message.is_decoded(type):
                _call(job, type)
                continue
            async with self._turn:
                wait = self._rests_until - time.monotonic()
                if wait > 0:
                    await asyncio.sleep(wait)
                    if _is_late(job, waiting):
                        return
                request = WorkRequest(
                    len(message.frame),
                    message.topic,
                    class_name(message.__class__),
                    view_name(type),
                    arguments=list(message.arguments),
                )
                worker = _acquire(self)
                reply = await worker.ask(request, message.frame)
                self._rests_until = time.monotonic() + reply.seconds
            await self._deliver_in_parts(job, type, reply, waiting, worker.taking_over)

    async def _deliver_in_parts(
        self,
        job: _Job,
        type: Any,
        reply: Reply,
        waiting: deque[_Job],
        turn: asyncio.Lock,
    ) -> None:
        """Deliver the message step by step, with a pause of the same length after each.

        All bridges share the lock ``turn``, so many bridges take no more time than one.
        """
        steps, parts = 0, values(reply.answer, reply.parts, type)
        try:
            # Deliver the first step even if late: else a fast topic would show nothing.
            while not (steps and _is_late(job, waiting)):
                async with turn:
                    began = time.monotonic()
                    value = next(parts, _END)
                    if value is _END:
                        break
                    if value is not None:
                        job.message.prime(type, value)
                        _call(job, type)
                        steps += 1
                    await asyncio.sleep(time.monotonic() - began)
        except ProtocolError as error:
            job.message.prime(type, error)
            _call(job, type)
        if steps > 1:  # the last value is only a part of the message
            job.message.forget(type)

    async def stop(self) -> None:
        """Cancel all work, and end the process if no other bridge uses it."""
        tasks = list(self._tasks)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        await _release(self)


def _join(waiting: deque[_Job], job: _Job) -> None:
    """Queue a message in place of the older one, unless each message counts."""
    if waiting and waiting[-1].message is job.message:
        last = waiting.pop()
        counts = last.counts or job.counts
        job = _Job(job.message, last.types | job.types, last.then + job.then, counts)
    elif not job.counts:
        waiting.clear()
    waiting.append(job)
    while len(waiting) > MOST_WAITING or (
        sum(len(each.message.frame) for each in waiting) > MAX_FRAME
    ):
        waiting.popleft()


def _is_late(job: _Job, waiting: deque[_Job]) -> bool:
    """Return whether a newer message has come that replaces this one."""
    return bool(waiting) and not job.counts


def _call(job: _Job, type: Any) -> None:
    for then in job.then:
        try:
            then(type)
        except Exception:
            log.exception("a message on %s was lost", job.message.topic)
