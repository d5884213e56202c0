"""What WebMap's promises about motion are tested with, for modules of others too.

A :class:`WitnessRobot` notes what it is told and when, a :class:`FaultProxy` spoils the
way to it, :func:`check_invariants` says in sentences what must not have happened, and a
:class:`Sentinel` knows how late the machine itself was in the same seconds.
"""

from webmap.testing.invariants import Bounds, Quiet, check_invariants
from webmap.testing.log import Heard, Moved, Told, WitnessLog
from webmap.testing.proxy import FaultProxy, Shape
from webmap.testing.sentinel import Sentinel
from webmap.testing.witness import WitnessRobot

__all__ = [
    "Bounds",
    "FaultProxy",
    "Heard",
    "Moved",
    "Quiet",
    "Sentinel",
    "Shape",
    "Told",
    "WitnessLog",
    "WitnessRobot",
    "check_invariants",
]
