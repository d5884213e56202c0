"""Kills itself after each line that keeps a STOP on disk, and says what is left of it.

Started as ``records_crash.py FOLDER``; a line of JSON for each death: after how many
lines, whether the STOP had been acknowledged, and who says STOP to whoever asks then.
"""

import json
import os
import signal
import sys
from pathlib import Path

from webmap.gate import disk
from webmap.gate.disk import Records
from webmap.gate.events import Key, Press

KEY = Key("ws://127.0.0.1:9090", "/cmd_vel")
IDS = frozenset({"a1"})


def press(by: str | None) -> Press | None:
    """Return the STOP of somebody."""
    return None if by is None else Press(by, "a1")


def die_after(lines: int) -> None:
    """Have this process killed once it ran so many lines of the module."""
    left = lines

    def trace(frame, event, _):
        nonlocal left
        if frame.f_code.co_filename != disk.__file__:
            return None
        if event == "line":
            left -= 1
            if left < 0:
                os.kill(os.getpid(), signal.SIGKILL)
        return trace

    sys.settrace(trace)


def keep(folder: Path, by: str | None, lines: int) -> tuple[bool, bool]:
    """Keep or end a STOP in a child; returns whether it was acknowledged, and lived."""
    received, said = os.pipe()
    child = os.fork()
    if not child:
        die_after(lines)
        problem = Records(folder).keep_latch(KEY, press(by), IDS)
        sys.settrace(None)
        os.write(said, b"ack" if problem is None else b"no")
        os._exit(0)
    os.close(said)
    _, status = os.waitpid(child, 0)
    acknowledged = os.read(received, 8) == b"ack"
    os.close(received)
    return acknowledged, os.WIFEXITED(status)


def main() -> None:
    """Die at every line of both, until one lives."""
    folder = Path(sys.argv[1])
    for by, before in (("Ann", None), (None, "Ann")):
        lines, lived = 0, False
        while not lived:
            assert Records(folder).keep_latch(KEY, press(before), IDS) is None
            acknowledged, lived = keep(folder, by, lines)
            left = Records(folder).latch_of(KEY)
            stands = None if left is None else left.by
            print(json.dumps([by, lines, acknowledged, lived, stands]))
            lines += 1


if __name__ == "__main__":
    main()
