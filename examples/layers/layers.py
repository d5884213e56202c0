"""The layer tutorial: all layers of a robot on a map.

Start the simulator, and then this::

    webmap sim --robots 3 --wander
    webmap run examples/layers/layers.py
"""

import webmap

bridge = webmap.Bridge("ws://localhost:9090")

shape = webmap.svg.path(d="M.25 0L-.2.2V-.2Z", fill="#1f6feb", stroke="#fff")
robot = webmap.Robot("Robot 0", shape)
robot.set_odometry_topic(bridge, "/robot_0/odom")
robot.set_tf(bridge, base_frame="robot_0/base_link")
robot.set_twist_topic(bridge, "/robot_0/cmd_vel", stops_within=0.25)
robot.set_move_topic(bridge, "/robot_0/move_base_simple/goal")

# Layers of the robot. The pose of each sensor on the robot is known from /tf.
robot.add_module("LaserScanner", bridge, "/robot_0/base_scan", max_dots=None)
robot.add_module("PointCloud", bridge, "/robot_0/points", z_min=0.1, colour_by="z")
robot.add_module("Range", bridge, "/robot_0/sonar")
robot.add_module("Path", bridge, "/robot_0/plan")
lookahead = {"name": "lookahead", "frame": "robot"}
robot.add_module("PointStamped", bridge, "/robot_0/lookahead_point", **lookahead)
robot.add_module("Trail")
robot.add_module("PoseArray", bridge, "/robot_0/particlecloud")
robot.add_module("PoseWithCovariance", bridge, "/robot_0/amcl_pose")
robot.add_module("Polygon", bridge, "/robot_0/move_base/local_costmap/footprint")
robot.add_module("NavSatFix", bridge, "/robot_0/fix", datum=(48.4, 9.95))
robot.add_module("Diagnostics", bridge, prefix="robot_0/")


@webmap.page("/")
def main(page):
    map = webmap.Map(page.element("webmap_container"))
    map.add_module("MouseViewControl")
    map.add_module("Teleop", 1.0, 1.5)

    # Layers of the map. The local costmap is in the frame of odometry.
    map.add_module("OccupancyGrid", bridge, "/map")
    costmap = "/robot_0/move_base/local_costmap/costmap"
    map.add_module("OccupancyGrid", bridge, costmap, palette="costmap", map_frame="map")
    map.add_module("Markers", bridge, "/robot_0/markers")

    # Each viewer switches layers on and off.
    map.add_module("LayerSwitches")
    map.add_robot(robot)
    map.fit(-21, -13.5, 42, 27)


webmap.run()
