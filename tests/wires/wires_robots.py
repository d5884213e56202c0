"""The robots of the scripts, as a program configures them.

All calls of the scripts to a robot are here. If WebMap's interface changes, only these
functions change, and the recordings stay the same.
"""

from webmap import Bridge, Robot

POSE = "geometry_msgs/PoseWithCovarianceStamped"
ODOMETRY = "nav_msgs/Odometry"
HOOKS = (
    {"topic": "/lock", "type": "std_msgs/Bool"},
    {"service": "/e_stop", "type": "std_srvs/Trigger"},
)
FULL = 0.0625
"""Metres per second: so slow that a busy computer, which counts as a slow link, does
not reduce the speed."""

LIMITS = {"stops_within": 0.25, "v_max": FULL, "w_max": 1.0}

FOOTPRINT = ((0.3, 0.2), (-0.3, 0.2), (-0.3, -0.2), (0.3, -0.2))


def with_odometry(bridge, name, **options):
    robot = Robot(name, **options)
    robot.set_odometry_topic(bridge, "/odom", 50, type=ODOMETRY)
    return robot


def of_twist(bridge, name, **options):
    """A robot that is driven by Twist."""
    robot = with_odometry(bridge, name)
    settings = {"type": "geometry_msgs/Twist", **LIMITS, **options}
    robot.set_twist_topic(bridge, "/cmd_vel", **settings)
    return robot


def of_stamped(bridge, name):
    """A robot whose velocity type rosapi reports; it also moves sideways."""
    robot = with_odometry(bridge, name, base_link="base_footprint")
    robot.set_twist_topic(bridge, "/cmd_vel", holonomic=True, a_max=1e6, **LIMITS)
    return robot


def with_hooks(bridge, name):
    return of_twist(bridge, name, stop_hooks=HOOKS)


def by_simple_goals(bridge, name):
    """A robot whose goals go to a topic, with a map of its own."""
    robot = of_twist(bridge, name)
    robot.set_move_topic(
        bridge, "/move_base_simple/goal", frame="hall", cancel_topic="/move_base/cancel"
    )
    robot.set_initial_pose_topic(bridge, covariance=(0.1, 0.2, 0.3))
    robot.set_alignment(10.0, 0.0, 90.0)
    return robot


def by_move_base(bridge, name):
    robot = of_twist(bridge, name)
    robot.set_move_topic(
        bridge, action="/move_base", action_type="move_base_msgs/MoveBaseAction"
    )
    return robot


def by_navigation(bridge, name):
    """A robot of ROS 2 whose goals are cancelled when the sender is lost."""
    robot = of_twist(bridge, name, type="geometry_msgs/msg/Twist")
    robot.set_move_topic(
        bridge,
        "/goal_pose",
        action="/navigate_to_pose",
        action_type="nav2_msgs/action/NavigateToPose",
        on_operator_loss="cancel",
    )
    robot.set_initial_pose_topic(bridge, "/initialpose", frame="unused")
    return robot


def of_goals_alone(bridge, name):
    """A robot without velocity."""
    robot = Robot(name)
    robot.set_move_topic(bridge, "/goal", cancel_topic="/cancel")
    return robot


def that_flies(bridge, name):
    return of_twist(bridge, name, z_max=0.05, rx_max=0.3, ry_max=0.4)


def that_assists(bridge, name, **options):
    robot = of_twist(bridge, name)
    assist(robot, **options)
    return robot


def of_unknown_stop(bridge, name):
    """A robot without a stated command timeout and speed."""
    robot = with_odometry(bridge, name)
    robot.set_twist_topic(bridge, "/cmd_vel", type="geometry_msgs/Twist")
    return robot


def with_everything(bridge, other, name):
    """A robot with every setting; each setting has a different value."""
    robot = Robot(name, base_link="base_footprint")
    robot.set_odometry_topic(
        other, "odometry/filtered", 20, type="nav_msgs/msg/Odometry"
    )
    robot.set_tf(
        bridge,
        map_frame="world",
        base_frame="chassis",
        namespace="/one",
        quiet=True,
    )
    robot.set_alignment(1.0, 2.0, 30.0)
    robot.set_twist_topic(
        bridge,
        "base/cmd_vel/",
        type="geometry_msgs/msg/TwistStamped",
        stops_within=0.4,
        v_max=1.25,
        w_max=2.5,
        a_max=0.75,
        holonomic=True,
        stop_hooks=HOOKS,
        z_max=0.5,
        rx_max=0.6,
        ry_max=0.7,
    )
    robot.set_scan_assist(
        "front/scan",
        FOOTPRINT,
        x=0.1,
        y=0.2,
        angle=45.0,
        upside_down=True,
        frame="/laser",
        stop_distance=0.25,
        brake=0.6,
        blind="creep",
        creep=0.05,
    )
    robot.set_move_topic(
        other,
        "goal_pose",
        frame="hall",
        cancel_topic="cancel_all",
        on_operator_loss="cancel",
        action="drive_to",
        action_type="nav2_msgs/action/NavigateToPose",
    )
    robot.set_initial_pose_topic(other, "pose_estimate", covariance=(1, 2, 3))
    return robot


def of_poses(bridge, name):
    """A robot that accepts only initial poses."""
    robot = Robot(name)
    robot.set_initial_pose_topic(bridge, "/initialpose", frame="hall")
    return robot


def at(name, url, velocity="", goal=""):
    """A robot with a bridge, and topics for velocity and goals only if given."""
    robot, bridge = Robot(name), Bridge(url)
    if velocity:
        robot.set_twist_topic(bridge, velocity, type="geometry_msgs/Twist")
    if goal:
        robot.set_move_topic(bridge, goal)
    return robot


MAKERS = (
    "of_twist",
    "of_stamped",
    "with_hooks",
    "by_simple_goals",
    "by_move_base",
    "by_navigation",
    "of_goals_alone",
    "that_flies",
    "that_assists",
    "of_unknown_stop",
    "with_everything",
    "of_poses",
)
"""The functions above that make robots."""


def bridge_to(url):
    return Bridge(url)


# Changes of a declared robot.


def assist(robot, footprint=0.25, **options):
    robot.set_scan_assist("/scan", footprint, **options)


def no_assist(robot):
    robot.clear_scan_assist()


def odometry(robot, bridge, topic="/odom", type=ODOMETRY):
    robot.set_odometry_topic(bridge, topic, type=type)


def no_odometry(robot):
    robot.unsubscribe_odometry_topic()


def velocity(robot, bridge, topic="/cmd_vel", **options):
    robot.set_twist_topic(bridge, topic, **options)


def no_velocity(robot):
    robot.unadvertise_twist_topic()


def goals(robot, bridge, topic="/goal", **options):
    robot.set_move_topic(bridge, topic, **options)


def no_goals(robot):
    robot.unadvertise_move_topic()


def pose_topic(robot, bridge):
    robot.set_initial_pose_topic(bridge)


def alignment(robot, x, y, angle):
    robot.set_alignment(x, y, angle)


def frames(robot, bridge, **options):
    robot.set_tf(bridge, **options)


def gone(robot):
    robot.destroy()


# Properties of configured robots.


def all_robots():
    """Every robot of the process, by name."""
    from webmap.core.visible_robot import robots

    return sorted(robots.values(), key=lambda robot: robot.name)


def modules_of(robot):
    """The modules of a robot: their names and arguments.

    Of a module that was not added by name, only the class is known.
    """
    return [
        robot.arguments_of(module) or (f"({type(module).__name__})", (), {})
        for module in list(robot.modules)  # another thread may add one meanwhile
    ]


def plain_data(robot):
    return robot.to_dict()


def of_plain_data(data, bridges=None):
    return Robot.from_dict(data, bridges)


def scenery_of(console):
    """The scenery that a console shows besides robots, by kind."""
    return {
        "maps": [
            (bridge.url, topic, options)
            for (bridge, topic), options in console.grids.items()
        ],
        "pictures": console.images,
        "modules": list(console._modules.items()),
        "more modules": console._more,
    }
