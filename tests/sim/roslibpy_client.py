"""A Python application with roslibpy; it prints its results as one JSON object.

Arguments: the bridge's URL and its dialect. A process of its own: roslibpy's reactor
cannot be started twice.
"""

import json
import math
import sys
import threading

import roslibpy
import roslibpy.ros1.actionlib

URL, DIALECT = sys.argv[1:]
ROS2 = DIALECT == "ros2"
WAIT = 20


def type_name(package, kind, name):
    return f"{package}/{kind}/{name}" if ROS2 else f"{package}/{name}"


ODOM = type_name("nav_msgs", "msg", "Odometry")


def first(ros, topic, kind, accept=lambda message: True):
    """The first message that is accepted."""
    found, came = [], threading.Event()

    def take(message):
        if not found and accept(message):
            found.append(message)
            came.set()

    subscribed = roslibpy.Topic(ros, topic, kind)
    subscribed.subscribe(take)
    if not came.wait(WAIT):
        raise TimeoutError(f"nothing on {topic}")
    subscribed.unsubscribe()
    return found[0]


def position(odometry):
    at = odometry["pose"]["pose"]["position"]
    return at["x"], at["y"]


def drive(ros, start):
    """Drive until odometry has moved; return where it is then."""
    twist = roslibpy.Topic(
        ros, "/robot_0/cmd_vel", type_name("geometry_msgs", "msg", "Twist")
    )
    message = roslibpy.Message({"linear": {"x": 0.5}, "angular": {"z": 0.0}})
    done = threading.Event()

    def repeat():
        while not done.wait(0.05):
            twist.publish(message)

    threading.Thread(target=repeat, daemon=True).start()
    moved = first(
        ros, "/robot_0/odom", ODOM, lambda m: math.dist(position(m), start) > 0.3
    )
    done.set()
    return position(moved)


def goal_status(ros, place):
    """Send a goal by actionlib and return how it ended."""
    client = roslibpy.ros1.actionlib.ActionClient(
        ros, "/robot_0/move_base", "move_base_msgs/MoveBaseAction"
    )
    pose = {"position": {"x": place[0], "y": place[1]}, "orientation": {"z": 1, "w": 1}}
    target = {"header": {"frame_id": "map"}, "pose": pose}
    goal = roslibpy.ros1.actionlib.Goal(
        client, roslibpy.Message({"target_pose": target})
    )
    goal.send()
    goal.wait(WAIT)
    return goal.status["status"]


def main():
    received = {}
    ros = roslibpy.Ros(URL)
    ros.run(WAIT)
    received["topics"] = ros.get_topics()
    received["odom_type"] = ros.get_topic_type("/robot_0/odom")
    received["odom_topics"] = ros.get_topics_for_type(ODOM)
    received["services"] = ros.get_services()
    received["stop_type"] = ros.get_service_type("/robot_0/stop")
    received["nodes"] = ros.get_nodes()
    received["details"] = ros.get_node_details("/robots")
    if not ROS2:
        # It reads only times in the form of ROS 1.
        received["time"] = dict(ros.get_time())
        # This call ends the real rosapi of ROS 2.
        received["twist"] = ros.get_message_details("geometry_msgs/Twist")
        received["params"] = ros.get_params()
    start = position(first(ros, "/robot_0/odom", ODOM))
    scan_type = type_name("sensor_msgs", "msg", "LaserScan")
    scan = first(ros, "/robot_0/base_scan", scan_type)
    received["ranges"] = len(scan["ranges"])
    grid = first(ros, "/map", type_name("nav_msgs", "msg", "OccupancyGrid"))
    received["cells"] = len(grid["data"])
    place = drive(ros, start)
    received["way"] = math.dist(place, start)
    stop = roslibpy.Service(
        ros, "/robot_0/stop", type_name("std_srvs", "srv", "Trigger")
    )
    received["stop"] = dict(stop.call(roslibpy.ServiceRequest(), timeout=WAIT))
    if not ROS2:
        received["goal"] = goal_status(ros, place)
    ros.close()
    print(json.dumps(received, default=dict), flush=True)
    ros.terminate()


main()
