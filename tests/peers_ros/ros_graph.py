"""A robot as nodes of a real ROS 2, run by Python 3.12 in an environment of its own.

It has odometry, a scanner with rays of every odd kind, a battery and a latched map. It
drives with the last velocity, without a timeout: only a zero stops the robot. Each
velocity that reaches it becomes a line on standard output.
"""

import contextlib
import json
import math
import sys
import time

import rclpy
from geometry_msgs.msg import Twist
from nav_msgs.msg import OccupancyGrid, Odometry
from rclpy.executors import ExternalShutdownException
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from ros_facts import ANGLE_MIN, ANGLE_STEP, CELL, CELLS, CORNER, RANGES, ROBOT, START
from sensor_msgs.msg import LaserScan

PERIOD = 0.05


class Robot:
    """One robot; the topics are those that Nav2's robots have."""

    def __init__(self, node):
        self.node, self.twist = node, (0.0, 0.0)
        self.pose = list(START)
        self.steps = 0
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.odom = node.create_publisher(Odometry, f"{ROBOT}/odom", 10)
        self.scan = node.create_publisher(
            LaserScan, f"{ROBOT}/scan", qos_profile_sensor_data
        )
        self.map = node.create_publisher(OccupancyGrid, "/map", latched)
        self.map.publish(floor())
        node.create_subscription(Twist, f"{ROBOT}/cmd_vel", self.drive, 10)
        node.create_timer(PERIOD, self.step)

    def drive(self, twist):
        self.twist = (twist.linear.x, twist.angular.z)
        print_json(twist=self.twist, at=time.monotonic(), pose=self.pose)

    def step(self):
        speed, turn = self.twist
        x, y, yaw = self.pose
        self.pose = [
            x + speed * math.cos(yaw) * PERIOD,
            y + speed * math.sin(yaw) * PERIOD,
            yaw + turn * PERIOD,
        ]
        self.odom.publish(self.odometry())
        self.steps += 1
        if self.steps % 2 == 0:
            self.scan.publish(self.rays())

    def header(self, message, frame):
        message.header.stamp = self.node.get_clock().now().to_msg()
        message.header.frame_id = frame
        return message

    def odometry(self):
        odom = self.header(Odometry(), "robot_0/odom")
        odom.child_frame_id = "robot_0/base_link"
        place, turn = odom.pose.pose.position, odom.pose.pose.orientation
        place.x, place.y, yaw = self.pose
        turn.z, turn.w = math.sin(yaw / 2), math.cos(yaw / 2)
        odom.pose.covariance[35] = math.nan
        odom.twist.twist.linear.x, odom.twist.twist.angular.z = self.twist
        return odom

    def rays(self):
        scan = self.header(LaserScan(), "robot_0/laser")
        scan.angle_min, scan.angle_increment = ANGLE_MIN, ANGLE_STEP
        scan.angle_max = ANGLE_MIN + ANGLE_STEP * (len(RANGES) - 1)
        scan.range_min, scan.range_max = 0.05, 10.0
        scan.ranges = list(RANGES)
        return scan


def floor():
    """A room with walls on all sides."""
    grid = OccupancyGrid()
    grid.header.frame_id = "map"
    info, (width, height) = grid.info, CELLS
    info.resolution, info.width, info.height = CELL, width, height
    info.origin.position.x, info.origin.position.y = CORNER
    info.origin.orientation.w = 1.0
    grid.data = [
        100 if x in (0, width - 1) or y in (0, height - 1) else 0
        for y in range(height)
        for x in range(width)
    ]
    return grid


def print_json(**what):
    print(json.dumps(what), flush=True)


def main():
    rclpy.init(args=sys.argv)
    node = rclpy.create_node("robots")
    Robot(node)
    print_json(ready=True)
    with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(node)


if __name__ == "__main__":
    main()
