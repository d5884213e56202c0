"""Mistakes in fleet files, on command lines, in plain data and in calls.

Each has a name; the recordings have the error messages.
"""

import math

import wires_robots as robots

from webmap import Robot

BASE = """\
title = "Two halls"

[bridges]
north = "ws://north:9090"
south = "wss://south/ros"

[map]
bridge = "north"
topic = "/map"

[[robots]]
name = "Bob"
bridge = "north"
odometry = "/bob/odom"
scan = ["/bob/front/scan", "/bob/rear/scan"]
battery = "/bob/battery_state"

[robots.twist]
topic = "/bob/cmd_vel"
type = "geometry_msgs/Twist"
stops_within = 0.25
v_max = 0.5
w_max = 1

[robots.move]
topic = "/bob/goal"
cancel_topic = "/bob/cancel"
on_operator_loss = "cancel"

[[robots]]
name = "Ann"
bridge = "south"
base_link = "base_footprint"
tf = { namespace = "/ann", map_frame = "world" }
odometry = { topic = "/odom", type = "nav_msgs/msg/Odometry", throttle = 50 }
twist = { topic = "/cmd_vel", type = "geometry_msgs/msg/TwistStamped" }
modules = [
  { name = "LaserScanner", args = [{ bridge = "north" }, "/s"], options = { x = 1 } },
]
"""
"""A valid fleet file."""

OF_BOB = "w_max = 1\n"
"""The last key of Bob's twist."""


def twist(line):
    return (OF_BOB, f"{OF_BOB}{line}\n")


def bob(line):
    """Return a change that puts a line among Bob's keys."""
    return ('battery = "/bob/battery_state"\n', f"{line}\n")


def ann(line):
    return ('base_link = "base_footprint"\n', f"{line}\n")


def third(line):
    """Return a change that adds a robot at Bob's bridge, with a line."""
    robot = f'[[robots]]\nname = "Eve"\nbridge = "north"\n{line}\n'
    return ('[[robots]]\nname = "Ann"\n', f'{robot}\n[[robots]]\nname = "Ann"\n')


FLEET_FILES = {
    # Typing errors.
    "key of a twist": ("stops_within", "stops_witin"),
    "key of the file": ("title", "tilte"),
    "key of a frame": ("map_frame", "mapframe"),
    "key of a robot": ("odometry =", "odometri ="),
    "key of odometry": ("throttle", "throtle"),
    "key of goals": ("cancel_topic", "canceltopic"),
    "name of a bridge": ('"Bob"\nbridge = "north"', '"Bob"\nbridge = "nroth"'),
    "name of a module": ('"LaserScanner"', '"LaserScaner"'),
    "option of a module": ("{ x = 1 }", "{ colour = 1 }"),
    "bridge of a module": ('[{ bridge = "north" }', '[{ bridge = "east" }'),
    "word of operator loss": ('"cancel"\n', '"cancle"\n'),
    # Wrong types.
    "number in quotes": ("v_max = 0.5", 'v_max = "0.5"'),
    "no number": ("v_max = 0.5", 'v_max = "fast"'),
    "boolean for a number": ("0.25", "true"),
    "zero seconds": ("0.25", "0"),
    "negative": ("0.25", "-1.5"),
    "infinite": ("0.25", "inf"),
    "not a number": ("0.25", "nan"),
    "far too large": ("0.25", "9" * 400),
    "too large": ("v_max = 0.5", "v_max = 2e6"),
    "text for a boolean": twist('holonomic = "yes"'),
    "number for a boolean": twist("holonomic = 1"),
    "number for a text": ('"Bob"', "7"),
    "array for a table": ("[robots.twist]\n", "[[robots.twist]]\n"),
    "table for a topic": bob("battery = { topic = 1 }"),
    "number for a topic": ('"/bob/rear/scan"', "7"),
    "space in a topic": ('"/bob/odom"', '"/bob odom"'),
    "empty topic": ('"/bob/odom"', '""'),
    "type without velocity": ('"geometry_msgs/Twist"', '"nav_msgs/Odometry"'),
    "type without pose": ('"nav_msgs/msg/Odometry"', '"sensor_msgs/LaserScan"'),
    "type that is none": ('"geometry_msgs/Twist"', '"Twist"'),
    "part of a millisecond": ("throttle = 50", "throttle = 1.5"),
    "negative milliseconds": ("throttle = 50", "throttle = -1"),
    "frames of a number": bob("tf = 1"),
    "frames of a text": bob('tf = "yes"'),
    "address of a web page": ('"ws://north:9090"', '"http://north"'),
    "address without scheme": ('"ws://north:9090"', '"north:9090"'),
    "address of a number": ('"ws://north:9090"', "9090"),
    "title of a number": ('"Two halls"', "1"),
    "name of two lines": ('"Bob"', r'"B\nob"'),
    "name that is too long": ('"Bob"', f'"{"B" * 101}"'),
    "empty name": ('"Bob"', '""'),
    "base of nothing": ('"base_footprint"', '" "'),
    "modules that are a table": ("modules = [\n", "modules = {}\nx = [\n"),
    "module that is a text": ("modules = [\n", 'modules = ["Trail"]\nx = [\n'),
    "arguments that are a text": ('[{ bridge = "north" }, "/s"]', '"/s"'),
    "options that are an array": ("{ x = 1 }", "[1]"),
    "option of another kind": ("{ x = 1 }", '{ x = "1" }'),
    "module without arguments": (', args = [{ bridge = "north" }, "/s"]', ""),
    "topic where a bridge is": ('[{ bridge = "north" }, "/s"]', '["/s"]'),
    # Missing keys.
    "no name": ('name = "Bob"\n', ""),
    "no bridge of several": ('"Bob"\nbridge = "north"\n', '"Bob"\n'),
    "no topic of a map": ('topic = "/map"\n', ""),
    "no topic of a twist": ('topic = "/bob/cmd_vel"\n', ""),
    "no topic of a move": ('topic = "/bob/goal"\n', ""),
    "no name of a module": ('name = "LaserScanner", ', ""),
    "no robots": (BASE[BASE.index("[[robots]]") :], ""),
    "no bridges": (
        '[bridges]\nnorth = "ws://north:9090"\nsouth = "wss://south/ros"',
        "",
    ),
    "empty table of bridges": (
        'north = "ws://north:9090"\nsouth = "wss://south/ros"\n',
        "",
    ),
    "empty file": (BASE, ""),
    "remark alone": (BASE, "# nothing\n"),
    # Duplicates.
    "two of one name": ('"Ann"', '"Bob"'),
    "two names but for case": ('"Ann"', '"BOB"'),
    "two names but for form": ('"Ann"', '"\uff22ob"'),
    "two of one base": third('twist = "/bob/cmd_vel"'),
    "one base, other spelling": third('twist = "bob//cmd_vel/"'),
    "one key twice": ("w_max = 1", "v_max = 1"),
    "one table twice": ("[robots.move]", "[robots.twist]"),
    "one map twice": (
        '[map]\nbridge = "north"\ntopic = "/map"\n',
        2 * '[[map]]\nbridge = "north"\ntopic = "/map"\n',
    ),
    "two cameras of one name": bob(
        'cameras = [{ topic = "/a", name = "Arm" }, { topic = "/b", name = "arm" }]'
    ),
    # Stop hooks.
    "hooks that are a table": twist('stop_hooks = { topic = "/lock" }'),
    "hook that is a text": twist('stop_hooks = ["/lock"]'),
    "hook of both": twist('stop_hooks = [{ topic = "/lock", service = "/stop" }]'),
    "hook of neither": twist('stop_hooks = [{ type = "std_msgs/Bool" }]'),
    "hook with a typing error": twist('stop_hooks = [{ topik = "/lock" }]'),
    "hook of another type": twist(
        'stop_hooks = [{ topic = "/lock", type = "std_msgs/String" }]'
    ),
    "hook of a service's type": twist(
        'stop_hooks = [{ service = "/lock", type = "std_msgs/Bool" }]'
    ),
    "hook that is the velocity": twist('stop_hooks = [{ topic = "/bob/cmd_vel" }]'),
    # Limits of other axes.
    "no climb": twist("z_max = 0"),
    "no turn": twist('rx_max = "1"'),
    "axis with a typing error": twist("rz_max = 1"),
    "no acceleration": twist("a_max = 0"),
    # Goals and the initial pose.
    "action of another type": (
        'topic = "/bob/goal"\n',
        'action = "/go"\naction_type = "a/Fibonacci"\n',
    ),
    "frame of nothing": ('topic = "/bob/goal"\n', 'topic = "/bob/goal"\nframe = ""\n'),
    "action of a twist": twist('action = "/go"'),
    "two variances": bob('initial_pose = { topic = "/here", covariance = [1, 2] }'),
    "negative variance": bob(
        'initial_pose = { topic = "/here", covariance = [1, 2, -1] }'
    ),
    "no topic of a pose": bob("initial_pose = { covariance = [1, 2, 3] }"),
    # Scan assist.
    "assist without velocity": third(
        'scan_assist = { topic = "/scan", footprint = 0.3 }'
    ),
    "assist without footprint": bob("scan_assist = { topic = '/s' }"),
    "assist without topic": bob("scan_assist = { footprint = 0.3 }"),
    "footprint of two corners": bob(
        "scan_assist = { topic = '/s', footprint = [[0, 0], [1, 1]] }"
    ),
    "footprint of a bow tie": bob(
        "scan_assist = { topic = '/s', footprint = [[0, 0], [1, 1], [1, 0], [0, 1]] }"
    ),
    "footprint of no radius": bob("scan_assist = { topic = '/s', footprint = 0 }"),
    "assist with a typing error": bob(
        "scan_assist = { topic = '/s', footprint = 0.3, stop_distanze = 1 }"
    ),
    "assist of another word": bob(
        "scan_assist = { topic = '/s', footprint = 0.3, blind = 'crep' }"
    ),
    "assist without brake": bob(
        "scan_assist = { topic = '/s', footprint = 0.3, brake = 0 }"
    ),
    # Alignments.
    "alignment of a text": ann('alignment = "north"'),
    "alignment of two": ann("alignment = [1, 2]"),
    "alignment of no number": ann("alignment = [1, 2, nan]"),
    "alignment of a bridge": (
        '"wss://south/ros"',
        '{ url = "wss://south/ros", alignment = [1, 2, true] }',
    ),
    "bridge with a typing error": (
        '"wss://south/ros"',
        '{ url = "wss://south/ros", aligment = [1, 2, 3] }',
    ),
    "bridge without address": ('"wss://south/ros"', "{ alignment = [1, 2, 3] }"),
    # Pictures.
    "picture that is a text": bob('picture = "ann.png"'),
    "picture without width": bob('picture = { file = "ann.png", height = 1 }'),
    "picture that is not there": bob(
        'picture = { file = "none.png", width = 1, height = 1 }'
    ),
    "picture that is none": bob(
        'picture = { file = "fleet.toml", width = 1, height = 1 }'
    ),
    # Cameras and buttons.
    "camera of another scheme": bob('cameras = "rtsp://bob/stream"'),
    "camera of a number": bob("cameras = 7"),
    "camera of nothing": bob("cameras = {}"),
    "camera of both": bob('cameras = { topic = "/a", url = "http://bob/" }'),
    "camera with a typing error": bob('cameras = { topic = "/a", throtle = 5 }'),
    "buttons of a number": bob("buttons = 3"),
    "button that moves": bob(
        "buttons = [{ label = 'Go', topic = '/go', type = 'geometry_msgs/Twist' }]"
    ),
    "button with a typing error": bob(
        "buttons = [{ label = 'Go', service = '/go', confrim = true }]"
    ),
    "two buttons of one label": bob(
        "buttons = [{ label = 'Go', service = '/a' }, { label = 'Go', service = '/b' }]"
    ),
    "button of the velocity": bob(
        "buttons = [{ label = 'Go', topic = 'bob//cmd_vel', type = 'std_msgs/Bool' }]"
    ),
    # Places and scenery.
    "floor that is not there": ('title = "Two halls"', 'floor = "none.yaml"'),
    "floor that is a picture": ('title = "Two halls"', 'floor = "floor.png"'),
    "floor of a robot": twist('floor = "floor.yaml"'),
    "map of no bridge": ('[map]\nbridge = "north"', '[map]\nbridge = "nort"'),
    "map of another palette": (
        'topic = "/map"\n',
        'topic = "/map"\npalette = "cost"\n',
    ),
    "map with a typing error": ('topic = "/map"\n', 'topic = "/map"\nordr = 1\n'),
    "image without width": (
        "[map]",
        '[image]\nfile = "logo.png"\nx = 0\ny = 0\nheight = 1\n[map]',
    ),
    "module of a map": ("[map]", '[[modules]]\nname = "Marker"\n[map]'),
    "labels of a number": ('title = "Two halls"', "labels = 3"),
    "label without place": ("[map]", '[[labels]]\nname = "A"\nx = 1\n[map]'),
    "tiles of nowhere": (
        "[map]",
        '[tiles]\nsource = "tiles"\nlatitude = 91\nlongitude = 0\n[map]',
    ),
    "tiles of a host": (
        "[map]",
        '[tiles]\nsource = "https://a.example/{z}"\nlatitude = 1\nlongitude = 0\n[map]',
    ),
    # Invalid TOML.
    "value without quotes": ('"Bob"', "Bob"),
    "value of nothing": ("w_max = 1", "w_max = "),
    "odd number": ("w_max = 1", "w_max = .inf"),
    "quote without end": ('"Ann"', '"Ann'),
    "one bracket": ("[[robots]]\nname = ", "[robots]\nname = "),
    "line of another form": ("[bridges]", "bridges:"),
    "byte order mark": ('title = "Two halls"', '\ufefftitle = "Two halls"'),
    "nested too deep": (BASE, "x = " + "[" * 5000),
    "number of many digits": (BASE, "x = " + "9" * 5000),
    "file that is too large": (BASE, "#" * (2 << 20)),
    "control characters": (
        '"Bob"\nbridge = "north"',
        r'"Bob"' '\nbridge = "\\u001b[2J"',
    ),
    # Several at once.
    "several": ("v_max = 0.5\nw_max = 1", "vmax = 0.5\nw_max = false\nholonomic = 1"),
}
"""Changes of the valid file: the old text and the new text."""


def made_wrong(change):
    """Return a fleet file with a mistake.

    Raises:
        ValueError: If the file does not contain the old text.

    """
    old, new = change
    if old not in BASE:
        raise ValueError(f"the valid file does not contain {old!r}")
    return BASE.replace(old, new, 1).encode()


URL = "ws://127.0.0.1:9"
VIEW = ("view", URL, "--topics", "good.list", "--no-browser")

COMMAND_LINES = {
    "set without a sign": (*VIEW, "--set", "bob.scan"),
    "set without a robot": (*VIEW, "--set", "scan=/scan"),
    "set with a typing error": (*VIEW, "--set", "bob.scam=/scan"),
    "set of no role": (*VIEW, "--set", "bob.arm=/arm"),
    "set without a slash": (*VIEW, "--set", "bob.scan=scan"),
    "set with a space": (*VIEW, "--set", "bob.scan=/a b"),
    "set of two topics": (*VIEW, "--set", "bob.scan=/a,/b"),
    "set without a name": (*VIEW, "--set", "bob.name= "),
    "set of another type": (*VIEW, "--set", "bob.velocity_type=std_msgs/String"),
    "set with a tab": (*VIEW, "--set", "bob.name=a\tb"),
    "set of nobody": (*VIEW, "--set", "bop.scan=/scan"),
    "set of one name twice": (
        *("view", URL, "--robot", "A:/odom", "--robot", "B:/odom2"),
        *("--set", "A.name=b", "--no-browser"),
    ),
    "set of what a told robot has not": (
        *("view", URL, "--robot", "A:/odom", "--set", "A.plan=/plan", "--no-browser"),
    ),
    "robot without topics": (*VIEW, "--robot", "Bob"),
    "robot without a name": (*VIEW, "--robot", ":/odom"),
    "robot with too much": (*VIEW, "--robot", "Bob:/a:/b:/c:/d"),
    "robot of no bridge": (*VIEW, "--robot", "2@Bob:/odom"),
    "robot of a bridge with a name": (*VIEW, "--robot", "x@Bob:/odom"),
    "robot of no topic": (*VIEW, "--robot", "Bob:/o dom"),
    "two robots of one name": (*VIEW, "--robot", "Bob:/a", "--robot", "bob:/b"),
    "two robots of one base": (*VIEW, "--robot", "A:/a:/c", "--robot", "B:/b:c"),
    "robot of a long name": (*VIEW, "--robot", f"{'B' * 101}:/odom"),
    "stops within nothing": (*VIEW, "--stops-within", "0"),
    "stops within infinity": (*VIEW, "--stops-within", "inf"),
    "floor that is not there": (*VIEW, "--floor", "none.yaml"),
    "no address": ("view",),
    "address of a web page": ("view", "http://robot", "--show"),
    "address without scheme": ("view", "robot:9090", "--show"),
    "option with a typing error": ("view", URL, "--robt", "Bob:/odom"),
    "command with a typing error": ("viw", URL),
    "list with a wrong line": ("discover", URL, "--topics", "topics.list"),
    "list of nothing": ("discover", URL, "--topics", "empty.list"),
    "list of two bridges": ("discover", URL, URL, "--topics", "good.list"),
    "list that is not there": ("discover", URL, "--topics", "none.list"),
    "bridge that does not answer": ("discover", URL, "--wait", "0"),
    "told robot behind no bridge": (
        *("view", URL, "--show", "--wait", "0", "--robot", "Bob:/odom:/cmd_vel:/scan"),
    ),
    "fleet that is not there": ("check", "none.toml"),
    "fleet that is wrong": ("run", "fleet.toml", "--no-browser"),
    "doctor of a fleet and a set": ("doctor", "fleet.toml", "--set", "a.scan=/b"),
}

TWIST = {"bridge": "ws://robot:9090", "topic": "/cmd_vel"}
MOVE = {"bridge": "ws://robot:9090", "topic": "/goal"}
ASSIST = {"topic": "/scan", "footprint": 0.3}


def data(**fields):
    return {"name": "Bob", **fields}


def hooked(*hooks):
    return data(twist={**TWIST, "stop_hooks": list(hooks)})


def equipped(**module):
    return data(modules=[module])


DATA = {
    "list": [1],
    "text": "Bob",
    "nothing": None,
    "no name": {},
    "name of a number": {"name": 1},
    "unknown key": data(twst=TWIST),
    "velocity of a text": data(twist="/cmd_vel"),
    "velocity without bridge": data(twist={"topic": "/cmd_vel"}),
    "velocity without topic": data(twist={"bridge": "ws://robot:9090"}),
    "velocity with a typing error": data(twist={**TWIST, "vmax": 1}),
    "velocity of a number in quotes": data(twist={**TWIST, "v_max": "1"}),
    "negative velocity": data(twist={**TWIST, "v_max": -1}),
    "infinite velocity": data(twist={**TWIST, "w_max": math.inf}),
    "velocity of another type": data(twist={**TWIST, "type": "std_msgs/String"}),
    "velocity of no topic": data(twist={**TWIST, "topic": "cmd vel"}),
    "bridge of no address": data(twist={**TWIST, "bridge": "robot"}),
    "bridge of a web page": data(odometry={"bridge": "http://a", "topic": "/odom"}),
    "odometry of another type": data(
        odometry={"bridge": "ws://a", "topic": "/odom", "type": "sensor_msgs/Imu"}
    ),
    "odometry of part of a millisecond": data(
        odometry={"bridge": "ws://a", "topic": "/odom", "throttle": 1.5}
    ),
    "hook of a text": hooked("/lock"),
    "hook of both": hooked({"topic": "/lock", "service": "/stop"}),
    "hook of another type": hooked({"topic": "/lock", "type": "std_msgs/String"}),
    "hook of the velocity": hooked({"topic": "cmd_vel"}),
    "goals to nowhere": data(move={"bridge": "ws://robot:9090"}),
    "goals of another loss": data(move={**MOVE, "on_operator_loss": "stop"}),
    "goals of another action": data(
        move={**MOVE, "action": "/a", "action_type": "x/Y"}
    ),
    "pose of two numbers": data(initial_pose={**MOVE, "covariance": [1, 2]}),
    "pose of a negative number": data(initial_pose={**MOVE, "covariance": [1, 2, -3]}),
    "pose of another bridge": data(
        move=MOVE, initial_pose={"bridge": "ws://other:9090", "topic": "/here"}
    ),
    "assist of two corners": data(
        twist=TWIST, scan_assist={**ASSIST, "footprint": [[0, 0], [1, 1]]}
    ),
    "assist of no radius": data(twist=TWIST, scan_assist={**ASSIST, "footprint": 0}),
    "assist of another word": data(twist=TWIST, scan_assist={**ASSIST, "blind": "go"}),
    "assist without topic": data(twist=TWIST, scan_assist={"footprint": 0.3}),
    "alignment of two": data(alignment=[1, 2]),
    "alignment of no number": data(alignment=[1, 2, math.nan]),
    "module of no name": equipped(args=[]),
    "module with a typing error": equipped(name="LaserScaner"),
    "module of a wrong argument": equipped(name="Trail", options={"length": "1"}),
    "module of an unknown argument": equipped(name="Trail", options={"lenght": 1}),
    "module without arguments": equipped(name="Battery"),
    "module of a wrong value": equipped(name="Trail", options={"step": -1.0}),
    "model of an unknown tag": data(model={"tag": "script"}),
    "model without a tag": data(model={"attributes": {}}),
}


def with_bridge(method, *args, **options):
    """Return a call of a robot's method with a bridge."""

    def call():
        robot = Robot("Bob")
        getattr(robot, method)(robots.bridge_to("ws://robot:9090"), *args, **options)

    return call


def bare(method, *args, **options):
    """Return a call of a robot's method."""

    def call():
        robot = Robot("Bob")
        getattr(robot, method)(*args, **options)

    return call


def after(first, second):
    """Return two calls of one robot."""

    def call():
        robot, bridge = Robot("Bob"), robots.bridge_to("ws://robot:9090")
        first(robot, bridge)
        second(robot, bridge)

    return call


def velocity(*args, **options):
    return with_bridge("set_twist_topic", *args, **options)


def goals(*args, **options):
    return with_bridge("set_move_topic", *args, **options)


def pose(*args, **options):
    return with_bridge("set_initial_pose_topic", *args, **options)


def assist(*args, **options):
    return bare("set_scan_assist", *args, **options)


OTHER = "ws://other:9090"

CALLS = {
    "velocity without bridge": bare("set_twist_topic", "ws://robot:9090", "/cmd_vel"),
    "velocity without topic": with_bridge("set_twist_topic"),
    "velocity of no topic": velocity("cmd vel"),
    "velocity of a number": velocity(7),
    "velocity of another type": velocity("/cmd_vel", type="std_msgs/String"),
    "velocity of no type": velocity("/cmd_vel", type="Twist"),
    "velocity with a typing error": velocity("/cmd_vel", stops_witin=1),
    "velocity of a number in quotes": velocity("/cmd_vel", v_max="1"),
    "negative velocity": velocity("/cmd_vel", v_max=-1),
    "infinite turn": velocity("/cmd_vel", w_max=math.inf),
    "no acceleration": velocity("/cmd_vel", a_max=0),
    "no climb": velocity("/cmd_vel", z_max=0),
    "negative roll": velocity("/cmd_vel", rx_max=-1),
    "pitch of no number": velocity("/cmd_vel", ry_max=math.nan),
    "stop of no number": velocity("/cmd_vel", stops_within=math.nan),
    "holonomic of a text": velocity("/cmd_vel", holonomic="yes"),
    "hooks of a text": velocity("/cmd_vel", stop_hooks="/lock"),
    "hooks of a table": velocity("/cmd_vel", stop_hooks={"topic": "/lock"}),
    "hook of a text": velocity("/cmd_vel", stop_hooks=["/lock"]),
    "hook of both": velocity("/cmd_vel", stop_hooks=[{"topic": "/a", "service": "/b"}]),
    "hook of neither": velocity("/cmd_vel", stop_hooks=[{}]),
    "hook of another type": velocity(
        "/cmd_vel", stop_hooks=[{"topic": "/a", "type": "std_msgs/String"}]
    ),
    "hook of nothing": velocity("/cmd_vel", stop_hooks=[{"topic": ""}]),
    "hook of the velocity": velocity("/cmd_vel", stop_hooks=[{"topic": "cmd_vel"}]),
    "goals to nowhere": goals(),
    "goals of another loss": goals("/goal", on_operator_loss="stop"),
    "goals of another action": goals(action="/a", action_type="x/Y"),
    "goals of no topic": goals("go al"),
    "goals with a typing error": goals("/goal", canceltopic="/c"),
    "pose of two numbers": pose("/here", covariance=(1, 2)),
    "pose of a negative number": pose("/here", covariance=(1, 2, -3)),
    "pose of texts": pose("/here", covariance=("1", "2", "3")),
    "pose of no topic": pose("he re"),
    "pose of another bridge": after(
        lambda robot, bridge: robot.set_move_topic(bridge, "/goal"),
        lambda robot, bridge: robot.set_initial_pose_topic(robots.bridge_to(OTHER)),
    ),
    "goals of another bridge": after(
        lambda robot, bridge: robot.set_initial_pose_topic(bridge),
        lambda robot, bridge: robot.set_move_topic(robots.bridge_to(OTHER), "/goal"),
    ),
    "assist of no radius": assist("/scan", 0),
    "assist of a text": assist("/scan", "round"),
    "assist of two corners": assist("/scan", [(0, 0), (1, 1)]),
    "assist of the same corner": assist("/scan", [(0, 0), (1, 1), (0, 0)]),
    "assist of a bow tie": assist("/scan", [(0, 0), (1, 1), (1, 0), (0, 1)]),
    "assist of no area": assist("/scan", [(0, 0), (0.001, 0), (0, 0.001)]),
    "assist far away": assist("/scan", [(0, 0), (2000, 0), (0, 1)]),
    "assist of many corners": assist("/scan", [(n, n * n) for n in range(101)]),
    "assist without brake": assist("/scan", 0.3, brake=0),
    "assist of a negative creep": assist("/scan", 0.3, creep=-1.0),
    "assist of no number": assist("/scan", 0.3, x=math.nan),
    "assist of another word": assist("/scan", 0.3, blind="go"),
    "assist of no topic": assist("s can", 0.3),
    "odometry of no topic": with_bridge("set_odometry_topic", "o dom"),
    "odometry of another type": with_bridge("set_odometry_topic", "/odom", type="x/Y"),
    "odometry of a text": with_bridge("set_odometry_topic", "/odom", "50"),
    "odometry without bridge": bare("set_odometry_topic", "ws://robot:9090", "/odom"),
    "frames of a number": with_bridge("set_tf", map_frame=1),
    "frames of no topic": with_bridge("set_tf", namespace="/a b"),
    "alignment of no number": bare("set_alignment", 1.0, 2.0, math.inf),
    "alignment of a text": bare("set_alignment", "1", 2.0, 3.0),
    "bridge of a web page": lambda: robots.bridge_to("http://robot:9090"),
    "bridge without scheme": lambda: robots.bridge_to("robot:9090"),
    "bridge with a name": lambda: robots.bridge_to("ws://me:secret@robot:9090"),
    "bridge of nothing": lambda: robots.bridge_to(""),
    "module with a typing error": bare("add_module", "LaserScaner"),
    "module of a wrong argument": bare("add_module", "Trail", length="1"),
    "module of an unknown argument": bare("add_module", "Trail", lenght=1),
    "module without arguments": bare("add_module", "Battery"),
    "module without bridge": bare("add_module", "Battery", "ws://a", "/battery"),
    "motion before the start": bare("twist", 0.1),
    "goals before the start": bare("cancel"),
    "STOP before the start": bare("stop"),
    "reset before the start": bare("reset_stop"),
    "two robots of one model": after(
        lambda robot, bridge: None, lambda robot, bridge: Robot("Two", robot.model)
    ),
}
