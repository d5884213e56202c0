"""A simulated building with robots, behind a rosbridge server of its own.

It stands in for a real rosbridge and the robots behind it: what talks to it takes the
same road as to a real one. Run it with ``python -m webmap.sim`` or ``webmap sim``.
"""

from webmap.sim.process import run_simulator

__all__ = ["run_simulator"]
