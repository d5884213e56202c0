"""Facts about the robot of the real graph, for its tests and its nodes."""

import math

ROBOT = "/robot_0"
START = (2.0, 1.5, 0.5)
"""The start of the robot in its odometry frame: x, y, yaw."""

ANGLE_MIN, ANGLE_STEP = -0.35, 0.1
RANGES = (1.0, math.nan, 2.0, math.inf, -math.inf, 0.01, 3.0, 99.0)
DRAWN = {0: 1.0, 2: 2.0, 6: 3.0}
"""The rays with a valid range, and their ranges."""

CELL = 0.1
CELLS = (60, 40)
CORNER = (-1.0, -0.5)
"""The south-west corner of the map."""

TOPICS = f"""\
/map [nav_msgs/msg/OccupancyGrid]
/parameter_events [rcl_interfaces/msg/ParameterEvent]
{ROBOT}/cmd_vel [geometry_msgs/msg/Twist]
{ROBOT}/odom [nav_msgs/msg/Odometry]
{ROBOT}/scan [sensor_msgs/msg/LaserScan]
/rosout [rcl_interfaces/msg/Log]
"""
"""The topics in the form of ``ros2 topic list -t``."""
