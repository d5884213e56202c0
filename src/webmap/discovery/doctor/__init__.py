"""The diagnosis of a bridge: what prevents driving, and what to do about it.

``measure`` asks and listens, ``verdict`` decides; open ``verdict`` first. The findings
are plain data, so that a terminal and a page show the same. Checks of rosbridge itself
are in ``webmap.ros.rosbridge``.
"""

from webmap.discovery.doctor.facts import (
    BridgeFacts,
    ConfiguredRobot,
    Measurement,
)
from webmap.discovery.doctor.verdict import is_ready, judge
from webmap.ros.rosbridge.advice import Finding

__all__ = [
    "BridgeFacts",
    "ConfiguredRobot",
    "Finding",
    "Measurement",
    "is_ready",
    "judge",
]
