"""Run the gate: the display starts this process with ``python -m webmap.gate``."""

import os

from webmap.gate.process import main

if __name__ == "__main__":
    # Not sys.exit: the robots are stopped, and nothing that still waits (a thread
    # in a write, for example) may keep the process alive.
    os._exit(main())
