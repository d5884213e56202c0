"""``python -m webmap.gate``: the gate's process, started by the display."""

import os

from webmap.gate.process import main

if __name__ == "__main__":
    # Not sys.exit: nothing that waits (a thread in a write, for one) may keep a
    # process alive that has stopped its robots and is done.
    os._exit(main())
