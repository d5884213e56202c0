"""The process of the gate: it connects the rules with sockets, files and the display.

The rules never do I/O. :class:`Shell` does it through the links to the bridges, the
disk, the locks and the pipe to the display.

The process ends when the pipe ends, on a signal, or on an error of its own. In each
case it first sends zero to every driven machine, for half a second at most.
"""

import asyncio
import contextlib
import gc
import itertools
import logging
import os
import signal
import sys
import threading
from collections import deque
from types import FrameType
from typing import cast

from webmap.base.errors import WireError
from webmap.base.logs import set_up_logging
from webmap.gate import actions, events, pipe, protocol
from webmap.gate.clock import now
from webmap.gate.disk import Disk, Records
from webmap.gate.lanes.links import Links
from webmap.gate.locks import Locks, keep_private, state_folder
from webmap.gate.pipe import BackgroundHandler, PipeWriter
from webmap.gate.rules.gate import Gate
from webmap.gate.rules.motion import ZERO

log = logging.getLogger("webmap.gate")

STEP = 0.01
"""Seconds between two steps of the rules while a machine is held or moves."""

IDLE_STEP = 0.02
"""Seconds between two steps of the rules otherwise."""

DRAIN = 0.5
"""Seconds for zeros at the end, at most (S14)."""

LOOK = 0.1
"""Seconds between two checks of the STOP files, which another gate may write."""

LOCK_RETRY = 1.0
"""Seconds between two attempts to lock a machine that another gate has."""

REAL_TIME = 1
"""The lowest real-time priority: before every process that has none."""


class Shell:
    """Runs the rules: passes them events and performs their actions.

    Args:
        outbox: Takes the messages to the display.
        locks: The locks of this computer's machines.
        disk: The files that outlive the process.

    """

    def __init__(self, outbox: PipeWriter, locks: Locks, disk: Disk) -> None:
        self.failed = False
        self._gate = Gate()
        self._outbox = outbox
        self._locks = locks
        self._disk = disk
        self._links = Links(self.deliver)
        self._inbox: deque[protocol.ToGate | events.Event] = deque()
        self._working = False
        self._ending = asyncio.Event()
        self._silent = asyncio.Event()
        self._waiting_for_lock: dict[events.Key, asyncio.TimerHandle] = {}
        self._watched: set[events.Key] = set()
        """The machines that may be driven now."""

    def deliver(self, event: protocol.ToGate | events.Event) -> None:
        """Pass an event to the rules; one that comes during an action waits its turn.

        A gate that has failed ignores every event: its last velocity was zero.
        """
        if self.failed:
            return
        if isinstance(event, events.Shutdown):
            self._ending.set()
        self._inbox.append(event)
        if self._working:
            return
        self._working = True
        try:
            while self._inbox:
                self._do(self._gate.handle(self._inbox.popleft(), now()))
        except Exception:
            self._fail()
        finally:
            self._working = False

    async def run(self) -> None:
        """Run until shutdown, then send zeros and close the links."""
        stepping = asyncio.create_task(self._keep_stepping())
        looking = asyncio.create_task(self._keep_looking())
        await self._ending.wait()
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(DRAIN):
                await self._silent.wait()
                await self._links.settle()
                await self._disk.settle()
        stepping.cancel()
        looking.cancel()
        if self.failed:
            self._zero_all()  # again: the first may have met a broken link
        self._links.close()
        await asyncio.sleep(0)  # lets the loop write what it still holds

    async def _keep_stepping(self) -> None:
        loop = asyncio.get_running_loop()
        due = loop.time()
        while not self.failed:
            try:
                self._do(self._gate.step(now()))
            except Exception:
                self._fail()
            if self._ending.is_set() and self._gate.silent:
                self._silent.set()
            due += STEP if self._gate.busy else IDLE_STEP
            due = max(due, loop.time())  # a late step is not made up for
            await asyncio.sleep(due - loop.time())

    async def _keep_looking(self) -> None:
        while True:
            await asyncio.sleep(LOOK)
            for seen in await self._disk.check():
                self.deliver(seen)

    def _do(self, todo: list[actions.Action]) -> None:
        for zeros, group in itertools.groupby(todo, _is_zero):
            some = list(group)
            # All zeros are written before the rules get the result of the first.
            results = (
                self._links.write_zeros(cast("list[actions.WriteTwist]", some))
                if zeros
                else map(self._perform, some)
            )
            for result in results:
                if result is not None:
                    self._do(self._gate.handle(result, now()))

    def _perform(self, action: actions.Action) -> events.Event | None:
        match action:
            case actions.SendToDisplay(message):
                self._outbox.put(message)
            case actions.Lock(key):
                return self._lock(key)
            case actions.Unlock(key):
                timer = self._waiting_for_lock.pop(key, None)
                if timer is not None:
                    timer.cancel()
                self._locks.release(key)
                self._disk.forget(key)
            case actions.MarkDriven(key, driven):
                self._locks.mark(key, driven)
            case actions.SaveStop() | actions.SaveStopTest() | actions.SaveCheck():
                self._disk.keep(action, self.deliver)
            case actions.Watch(key, on):
                (self._watched.add if on else self._watched.discard)(key)
                return self._links.perform(action)
            case _:
                return self._links.perform(action)
        return None

    def _lock(self, key: events.Key) -> events.LockState:
        state = self._disk.recall(self._locks.acquire(key))
        self._waiting_for_lock.pop(key, None)
        if not state.held:
            loop = asyncio.get_running_loop()
            self._waiting_for_lock[key] = loop.call_later(
                LOCK_RETRY, lambda: self.deliver(self._lock(key))
            )
        return state

    def _fail(self) -> None:
        """Stop every machine after an error of the gate; the display restarts it."""
        log.exception("the gate has failed; every driven robot is stopped")
        self.failed = True
        try:
            self._zero_all()
        finally:
            self._ending.set()
            self._silent.set()

    def _zero_all(self) -> None:
        """Write zero to every machine that may be driven, even if a link is broken."""
        try:
            self._links.zero_all()
        except Exception:
            log.exception("zero not sent to all robots; sending it to each separately")
            for key in self._watched:
                with contextlib.suppress(Exception):
                    self._links.perform(actions.WriteTwist(key, ZERO, None, None))


def _is_zero(action: actions.Action) -> bool:
    return isinstance(action, actions.WriteTwist) and action.twist.is_zero


def rise() -> bool:
    """Give this thread, and those that it starts, a real-time priority.

    The gate needs little processor time, but needs it soon. Linux allows this to root
    and to users with ``RLIMIT_RTPRIO``. On other systems and for other users the gate
    works with the ordinary priority.

    Returns:
        Whether the system allowed it.

    """
    if sys.platform != "linux":
        return False
    with contextlib.suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(REAL_TIME))
        return True
    return False


def main() -> int:
    """Run the gate on this process's standard input and output."""
    pipe_in, pipe_out = _take_pipes()
    rise()
    handler = logging.StreamHandler()
    handler.setFormatter(logging.Formatter("%(levelname)s %(name)s: %(message)s"))
    background = BackgroundHandler(handler)
    set_up_logging(handler=background)
    outbox = PipeWriter(pipe_out)
    code = asyncio.run(_serve(pipe_in, outbox))
    outbox.close(0.2)
    background.drain(0.2)
    return code


async def _serve(pipe_in: int, outbox: PipeWriter) -> int:
    loop = asyncio.get_running_loop()
    folder = state_folder()
    keep_private(folder)
    locks = Locks(folder)
    locks.tidy()
    shell = Shell(outbox, locks, Disk(Records(folder)))

    def on_signal(number: int, frame: FrameType | None) -> None:
        why = f"the gate was ended by {signal.Signals(number).name}"
        loop.call_soon_threadsafe(shell.deliver, events.Shutdown(why))

    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, on_signal)
    threading.Thread(
        target=_read, args=(pipe_in, loop, shell), name="gate-inbox", daemon=True
    ).start()
    outbox.put(protocol.Ready(os.getpid()))
    gc.freeze()  # these objects stay; the collector need not look at them again
    await shell.run()
    return 1 if shell.failed else 0


def _read(file: int, loop: asyncio.AbstractEventLoop, shell: Shell) -> None:
    """Pass the messages of the pipe to the loop; runs in a thread of its own."""
    unpacker = pipe.Unpacker(protocol.ToGate)
    why = "the display process has ended"
    with contextlib.suppress(RuntimeError):  # the loop has ended before the pipe
        try:
            while data := os.read(file, 1 << 16):
                for message in unpacker.feed(data):
                    loop.call_soon_threadsafe(shell.deliver, message)
        except (OSError, WireError) as error:
            why = f"the pipe from the display is broken: {error}"
        finally:  # on any error: a gate that cannot receive a STOP must not go on
            loop.call_soon_threadsafe(shell.deliver, events.Shutdown(why))


def _take_pipes() -> tuple[int, int]:
    """Return the two pipes, for this module alone: no print can write into them."""
    pipe_in, pipe_out = os.dup(0), os.dup(1)
    if sys.platform == "win32":
        import msvcrt

        msvcrt.setmode(pipe_in, os.O_BINARY)
        msvcrt.setmode(pipe_out, os.O_BINARY)
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)
    os.dup2(2, 1)
    return pipe_in, pipe_out
