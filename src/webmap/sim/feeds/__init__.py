"""What robots say beside odometry and scans, worked out only while somebody listens.

Costmaps, clouds, footprints, particles, doubts, look-ahead points, sonars, fixes,
markers, health and logs, under the names that Nav2 and move_base give them.
"""

from webmap.sim.feeds.all import Feeds

__all__ = ["Feeds"]
