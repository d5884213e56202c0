"""Test tools for WebMap's promises about motion, also for modules of other packages.

A :class:`WitnessRobot` records its commands with times, a :class:`FaultProxy` adds
network faults, :func:`check_invariants` reports violations in sentences, and a
:class:`Sentinel` measures how late the machine itself was in the same seconds. Open
``witness`` first.
"""

from webmap.testing.fault_proxy import FaultProxy, Shape
from webmap.testing.invariants import (
    Bounds,
    ClientMessage,
    Moved,
    Quiet,
    ReceivedTwist,
    Sentinel,
    WitnessLog,
    check_invariants,
)
from webmap.testing.witness import WitnessRobot

__all__ = [
    "Bounds",
    "ClientMessage",
    "FaultProxy",
    "Moved",
    "Quiet",
    "ReceivedTwist",
    "Sentinel",
    "Shape",
    "WitnessLog",
    "WitnessRobot",
    "check_invariants",
]
