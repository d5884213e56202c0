"""The readiness check: what would be in the way of driving, and what to do about it.

:func:`~webmap.discovery.doctor.measure.observe` looks, and
:func:`~webmap.discovery.doctor.verdict.judge` decides; what it decides is plain data,
so that a terminal and a page say the same.
"""

from webmap.discovery.doctor.meant import MeantRobot
from webmap.discovery.doctor.observed import Heard, Observed
from webmap.discovery.doctor.verdict import is_ready, judge
from webmap.ros.finding import Finding

__all__ = ["Finding", "Heard", "MeantRobot", "Observed", "is_ready", "judge"]
