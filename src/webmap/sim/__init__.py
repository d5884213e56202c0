"""A simulated building with robots, behind a rosbridge server of its own.

It replaces a real rosbridge and its robots, and is used over the same sockets. Open
``world`` for robots and walls, ``node`` for topics. Run it with ``webmap sim``.
"""

from webmap.sim.process import run_simulator

__all__ = ["run_simulator"]
