"""Large frames are decoded elsewhere, so that small ones need not wait for them."""

import asyncio
import contextlib
import logging
from array import array
from collections.abc import Callable
from typing import Any, NamedTuple

import msgspec

from webmap.children import python_command
from webmap.errors import ProtocolError
from webmap.ros.arrays import dec_hook
from webmap.ros.decoding import convert
from webmap.ros.events import Publish
from webmap.ros.worker import LENGTH, MAX_MESSAGE, Answer, Request, view_name

log = logging.getLogger("webmap.ros")

LARGE = 256 << 10
"""Bytes above which a frame is decoded elsewhere."""

PATIENCE = 20.0
"""Longest time for one frame, in seconds."""


class _Worker:
    """The one worker process of this process; started by the first large frame."""

    def __init__(self) -> None:
        self.users: set[int] = set()
        self._process: asyncio.subprocess.Process | None = None
        self._turn = asyncio.Lock()

    async def decode(self, message: Publish, type: Any) -> None:
        """Let ``message`` know itself as ``type``, or what is wrong with it."""
        view = view_name(type)
        request = Request(message.topic, message.frame, view)
        async with self._turn:
            try:
                async with asyncio.timeout(PATIENCE):
                    answer = await self._ask(request)
            except (OSError, EOFError, TimeoutError) as error:
                await self.stop()
                why = ProtocolError(f"its decoder ended: {error!r}")
                message.prime(type, why)
                return
            except asyncio.CancelledError:
                await self.stop()  # an answer that nobody reads would meet the next
                raise
        message.prime(type, _outcome(answer, type, view))

    async def _ask(self, request: Request) -> Answer:
        process = self._process
        if process is None or process.returncode is not None:
            process = self._process = await _start()
        if process.stdin is None or process.stdout is None:
            raise EOFError("the worker has no pipes")
        body = msgspec.msgpack.encode(request)
        process.stdin.write(LENGTH.pack(len(body)) + body)
        await process.stdin.drain()
        (length,) = LENGTH.unpack(await process.stdout.readexactly(LENGTH.size))
        if length > MAX_MESSAGE:
            raise EOFError(f"an answer of {length} bytes")
        return msgspec.msgpack.decode(
            await process.stdout.readexactly(length), type=Answer
        )

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


def _outcome(answer: Answer, type: Any, view: str | None) -> Any:
    """Return the value of an answer, or the error that it is."""
    if answer.error is not None:
        return ProtocolError(answer.error)
    try:
        if view is not None:
            decoder = msgspec.msgpack.Decoder(type, dec_hook=dec_hook)
            return decoder.decode(answer.message)
        plain = msgspec.msgpack.decode(answer.message, ext_hook=_array)
        return plain if type is None else convert(plain, type)
    except (msgspec.DecodeError, ProtocolError) as error:
        return ProtocolError(str(error))


def _array(code: int, data: memoryview) -> "array[Any]":
    numbers: array[Any] = array(chr(code))
    numbers.frombytes(data)
    return numbers


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


class _Job(NamedTuple):
    message: Publish
    types: frozenset[Any]
    then: tuple[Callable[[], None], ...]


def _merged(before: _Job | None, job: _Job) -> _Job:
    """Return what waits now: both, where two listeners want the same message."""
    if before is None or before.message is not job.message:
        return job
    return _Job(job.message, before.types | job.types, before.then + job.then)


class Offload:
    """The large frames of one bridge: in order within a topic, the newest wins."""

    def __init__(self) -> None:
        self._waiting: dict[str, _Job | None] = {}
        """For each topic that is being decoded, what comes after."""
        self._tasks: set[asyncio.Task[None]] = set()

    def wants(self, message: Publish) -> bool:
        """Return whether ``message`` must not be decoded here and now."""
        return len(message.frame) > LARGE or message.topic in self._waiting

    def decode(
        self, message: Publish, types: frozenset[Any], then: Callable[[], None]
    ) -> None:
        """Decode ``message`` as each of ``types`` elsewhere, and call ``then``.

        What waits for its turn is dropped when a newer message of its topic comes.
        """
        job = _Job(message, types, (then,))
        if message.topic in self._waiting:
            self._waiting[message.topic] = _merged(self._waiting[message.topic], job)
            return
        self._waiting[message.topic] = None
        task = asyncio.ensure_future(self._work(message.topic, job))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _work(self, topic: str, first: _Job) -> None:
        job: _Job | None = first
        try:
            while job is not None:
                await self._one(job)
                job, self._waiting[topic] = self._waiting[topic], None
        finally:
            del self._waiting[topic]

    async def _one(self, job: _Job) -> None:
        if len(job.message.frame) > LARGE:
            worker = _acquire(self)
            for type in job.types:
                if not job.message.is_decoded(type):
                    await worker.decode(job.message, type)
        for then in job.then:
            try:
                then()
            except Exception:
                log.exception("a message on %s was lost", job.message.topic)

    async def stop(self) -> None:
        """Forget what is under way, and end the process if nobody else uses it."""
        tasks = list(self._tasks)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        await _release(self)
