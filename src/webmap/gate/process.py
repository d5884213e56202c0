"""The process of the gate: its pipe to the display, its signals, its end.

The process ends when the pipe ends, on a signal, or on an error of its own. In each
case it first sends zero to every driven machine, for half a second at most.
"""

import asyncio
import contextlib
import gc
import logging
import os
import signal
import sys
import threading
from types import FrameType

from webmap.base.errors import WireError
from webmap.base.logs import set_up_logging
from webmap.gate import events, pipe, protocol
from webmap.gate.disk import Disk, Records
from webmap.gate.locks import Locks, keep_private, state_folder
from webmap.gate.pipe import BackgroundHandler, Outbox
from webmap.gate.shell import Shell

REAL_TIME = 1
"""The lowest real-time priority: before every process that has none."""


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
    outbox = Outbox(pipe_out)
    code = asyncio.run(_serve(pipe_in, outbox))
    outbox.close(0.2)
    background.drain(0.2)
    return code


async def _serve(pipe_in: int, outbox: Outbox) -> int:
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
