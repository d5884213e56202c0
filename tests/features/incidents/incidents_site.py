"""A console that keeps a recording soon, for `webmap run`.

The environment has ``BRIDGE``, the address of a simulator with one robot.
"""

import os

import webmap
from webmap.console import open_console
from webmap.features.incidents import incidents

incidents.AFTER = 2.0

config = webmap.RobotConfig.from_dict(
    {
        "name": "Bob",
        "bridge": os.environ["BRIDGE"],
        "odometry": "/robot_0/odom",
        "twist": "/robot_0/cmd_vel",
        "scan": "/robot_0/base_scan",
    }
)
open_console([webmap.Bridge(os.environ["BRIDGE"])], [config], incidents=True)
webmap.run()
