"""A rosbridge v2.1 server over a small ROS graph that is in this process.

For the simulator, recordings and tests. Open ``server`` first, then ``session``, which
is one client.
"""
