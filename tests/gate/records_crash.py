"""Is killed after each line of code that stores a STOP, and prints the stored STOP.

Started as ``records_crash.py FOLDER``. Prints a line of JSON for each child process:
the user, the number of lines, whether the STOP was acknowledged, whether the process
ended normally, and the user of the STOP that is on disk afterwards.
"""

import json
import os
import signal
import sys
from pathlib import Path

from webmap.base import plain_files
from webmap.gate import disk
from webmap.gate.disk import Records
from webmap.gate.events import Key, Press

KEY = Key("ws://127.0.0.1:9090", "/cmd_vel")
IDS = frozenset({"a1"})


def press(by: str | None) -> Press | None:
    """Return the STOP of a user, or None."""
    return None if by is None else Press(by, "a1")


def die_after(lines: int) -> None:
    """Kill this process after it has run a number of lines of the modules."""
    left = lines

    def trace(frame, event, _):
        nonlocal left
        if frame.f_code.co_filename not in {disk.__file__, plain_files.__file__}:
            return None
        if event == "line":
            left -= 1
            if left < 0:
                os.kill(os.getpid(), signal.SIGKILL)
        return trace

    sys.settrace(trace)


def keep(folder: Path, by: str | None, lines: int) -> tuple[bool, bool]:
    """Store or end a STOP in a child; return if it was acknowledged, and survived."""
    received, sent = os.pipe()
    child = os.fork()
    if not child:
        die_after(lines)
        problem = Records(folder).keep_latch(KEY, press(by), IDS)
        sys.settrace(None)
        os.write(sent, b"ack" if problem is None else b"no")
        os._exit(0)
    os.close(sent)
    _, status = os.waitpid(child, 0)
    acknowledged = os.read(received, 8) == b"ack"
    os.close(received)
    return acknowledged, os.WIFEXITED(status)


def main() -> None:
    """Kill storing and ending a STOP after every line, until a child survives."""
    folder = Path(sys.argv[1])
    for by, before in (("Ann", None), (None, "Ann")):
        lines, lived = 0, False
        while not lived:
            assert Records(folder).keep_latch(KEY, press(before), IDS) is None
            acknowledged, lived = keep(folder, by, lines)
            left = Records(folder).latch_of(KEY)
            stored = None if left is None else left.by
            print(json.dumps([by, lines, acknowledged, lived, stored]))
            lines += 1


if __name__ == "__main__":
    main()
