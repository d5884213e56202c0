"""Recordings: bags of ROS 1 and ROS 2 that are played, and that are written.

A recording that is played stands in for a rosbridge and the robots behind it, as the
simulator does. What is here knows nothing of the display, and nobody else knows
rosbags, which is installed with ``webmap[bags]``.
"""
