"""Buttons of robots: what they do over a real rosbridge, and what they refuse."""

import asyncio
import contextlib
import json
import threading
from collections.abc import Iterator
from types import SimpleNamespace

import pytest
from button_robot import robot_node

from equipment.waiting import until
from equipment.webmap_process import simulator
from webmap import Bridge, Robot
from webmap.base.errors import ConfigError
from webmap.config.buttons import ButtonConfig, read_buttons
from webmap.config.checks import Mistakes
from webmap.config.reading import read
from webmap.core.base_page import PageEntry
from webmap.core.operators import Viewer
from webmap.core.page import Page
from webmap.scene.element import Event

DOCK = {"label": "Dock", "service": "/dock", "type": "std_srvs/Trigger"}
HORN = {
    "label": "Horn",
    "topic": "/horn",
    "type": "std_msgs/Bool",
    "message": {"data": True},
}


# Valid and invalid configurations.


@pytest.mark.parametrize(
    ("change", "key", "words"),
    [
        ({"service": None}, "", "one of service, topic and parameter; got none"),
        ({"topic": "/x"}, "", "got service and topic"),
        (
            {"lable": "x"},
            "lable",
            'there is no key "lable" here; did you mean "label"?',
        ),
        ({"message": {}, "node": "/n"}, "node", 'with a service has no key "node"'),
        ({"message": {"a": 1}}, "message", 'with a service has no key "message"'),
        ({"label": ""}, "label", "expected a text of 1 to 60"),
        ({"label": None}, "", 'the key "label" is missing'),
        ({"label": "x" * 61}, "label", "expected a text of 1 to 60"),
        ({"service": "a b"}, "service", "the name of a service"),
        ({"type": "Trigger"}, "type", 'Trigger", expected a type, such as "std'),
        ({"timeout": 0}, "timeout", "expected seconds above 0, up to 3600"),
        ({"timeout": True}, "timeout", "expected seconds above 0"),
        ({"timeout": 3601}, "timeout", "expected seconds above 0, up to 3600"),
        ({"confirm": 1}, "confirm", "expected true, false or a question"),
        ({"form": "yes"}, "form", "expected true or false"),
        ({"args": [1]}, "args", "expected a table of fields"),
        ({"args": {"data": 1}}, "args.data", "no such field; there are none"),
        (
            {"type": "std_srvs/SetBool", "args": {"data": 1}},
            "args.data",
            "got 1, expected true or false",
        ),
        (
            {"type": "my/Srv", "args": {"x": {1, 2}}},
            "args",
            "it cannot be written as JSON",
        ),
        ({"type": None, "form": True}, "type", "a form needs the type"),
    ],
)
def test_an_invalid_button_is_refused_with_the_wrong_key(change, key, words):
    data = {**DOCK, **change}
    data = {name: value for name, value in data.items() if value is not None}
    mistakes = Mistakes()
    read(ButtonConfig, data, (), mistakes)
    ((path, message),) = mistakes.found
    assert path == tuple(filter(None, key.split(".")))
    assert words in message


@pytest.mark.parametrize(
    ("button", "words"),
    [
        ({"topic": "/x", "type": "geometry_msgs/Twist"}, "carries a velocity"),
        ({"topic": "/x", "type": "geometry_msgs/msg/TwistStamped"}, "a velocity"),
        ({"topic": "/bob/cmd_vel", "type": "std_msgs/String"}, "carries a velocity"),
        ({"topic": "bob/cmd_vel/", "type": "std_msgs/String"}, "carries a velocity"),
        (
            {"topic": "/wheels/commands", "type": "std_msgs/Float64MultiArray"},
            "/wheels/commands of type std_msgs/Float64MultiArray carries a velocity",
        ),
        ({"topic": "/x", "type": "gazebo_msgs/ModelState"}, "the place or the speed"),
        ({"topic": "/x", "type": "geometry_msgs/PoseStamped"}, "carries a goal"),
        ({"topic": "/goal_pose", "type": "std_msgs/Empty"}, "carries a goal"),
        ({"topic": "/mb/cancel", "type": "std_msgs/Empty"}, "the end of a goal"),
        ({"topic": "/x", "type": "actionlib_msgs/GoalID"}, "the end of a goal"),
        ({"service": "/n/_action/send_goal"}, "carries a goal"),
        ({"service": "/n/_action/cancel_goal"}, "the end of a goal"),
        ({"service": "/x", "type": "action_msgs/srv/CancelGoal"}, "the end of a goal"),
    ],
)
def test_buttons_that_would_move_robots_are_refused_by_name_and_by_type(
    link, robot, button, words
):
    with pytest.raises(ConfigError, match="the gate") as error:
        robot.add_module("Buttons", link, [{"label": "Go", **button}])
    assert "button 'Go'" in str(error.value)
    assert words in str(error.value)
    assert robot.modules == []


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (None, "a value is needed"),
        (float("nan"), "expected a finite number"),
        (2**63, "64 bits"),
        ([1, "a"], "a list of one kind"),
        ({"a": 1}, "expected true, false, a number, a text or a list"),
    ],
)
def test_a_parameter_value_that_ros_does_not_know_is_refused(value, words):
    with pytest.raises(ConfigError, match=f"button 'P': value: .*{words}"):
        read_buttons([{"label": "P", "parameter": "/p", "value": value}])


def nested(depth):
    value = {}
    for _ in range(depth):
        value = {"in": value}
    return value


@pytest.mark.parametrize(
    ("button", "words"),
    [
        ({"topic": "/x"}, 'the key "type" is missing'),
        ({"parameter": "/p", "value": [1], "form": True}, "no form for a list"),
        ({"parameter": "/p", "value": 1, "type": "std_msgs/Bool"}, 'no key "type"'),
        ({"service": "/s", "args": nested(100_000)}, "args: it is nested too deep"),
    ],
)
def test_a_button_whose_keys_do_not_fit_together_is_refused(button, words):
    with pytest.raises(ConfigError, match=words):
        read_buttons([{"label": "P", **button}])


def test_all_mistakes_of_a_button_are_in_one_error():
    with pytest.raises(ConfigError) as error:
        read_buttons([DOCK, {"label": "P", "service": "a b", "form": 1}])
    first, second = str(error.value).splitlines()
    assert first.startswith("button 'P': service: got the text \"a b\", expected")
    assert second.startswith("button 'P': form: got the whole number 1, expected true")
    with pytest.raises(ConfigError, match="button number 1: got the whole number 5"):
        read_buttons([DOCK, 5])


def test_a_button_with_confirm_asks_its_own_question_or_the_usual_one():
    asked = {
        confirm: read_buttons([{**DOCK, "confirm": confirm}])[0].question
        for confirm in (False, True, " Is it free? ")
    }
    assert list(asked.values()) == [None, "Run “Dock”?", "Is it free?"]


def test_more_than_a_hundred_buttons_are_refused():
    many = ({"label": f"{number}", "service": "/s"} for number in range(1000))
    with pytest.raises(ConfigError, match=r"buttons\[100\]: expected at most 100"):
        read_buttons(many)


def test_two_buttons_with_the_same_label_are_refused(link, robot):
    with pytest.raises(
        ConfigError, match=r"buttons\[1\]\.label: got .*no other button has"
    ):
        robot.add_module("Buttons", link, [DOCK, DOCK])


def test_declared_motion_topics_of_robots_are_refused_for_buttons(robot):
    bridge = Bridge("ws://test-buttons:9090")
    other = Robot("Ann")
    try:
        other.set_twist_topic(
            bridge,
            "/wheels",
            stop_hooks=[{"topic": "/lock", "type": "std_msgs/Bool"}],
        )
        other.set_move_topic(bridge, "/there", cancel_topic="/not_there")
        same = Bridge("ws://TEST-buttons:9090/")
        for topic in ("/wheels", "/there", "/not_there", "lock"):
            button = {"label": "Go", "topic": topic, "type": "std_msgs/Bool"}
            with pytest.raises(ConfigError, match="only the gate publishes"):
                robot.add_module("Buttons", same, [button])
    finally:
        other.destroy()


# Buttons over a rosbridge.


@pytest.fixture(autouse=True)
def patience(monkeypatch):
    """Allow a busy machine more time to find a type."""
    monkeypatch.setattr("webmap.ros.rosbridge.graph.BRIEF", 20.0)


@pytest.fixture(scope="module")
def sim() -> Iterator[dict[str, str]]:
    """The addresses of two simulated rosbridges, by dialect."""
    with (
        simulator("--robots", "1") as ros1,
        simulator("--robots", "1", "--dialect", "ros2") as ros2,
    ):
        yield {"ros1": ros1, "ros2": ros2}


@contextlib.asynccontextmanager
async def linked(url, services=None, topics=None):
    node = robot_node(url, services or {}, topics or {})
    playing = await asyncio.to_thread(node.__enter__)
    bridge = Bridge(url)
    bridge.start(asyncio.get_running_loop())
    await until(lambda: bridge.state == "open")
    try:
        yield bridge, playing
    finally:
        await bridge.stop()
        await asyncio.to_thread(node.__exit__, None, None, None)


def trigger(success=True, message="docked"):
    return ("std_srvs/Trigger", lambda args: {"success": success, "message": message})


def pressed(robot, button, url, values=None, *, before=None, **world):
    """Press a button over a simulator; return the button and the robot's node."""

    async def scenario():
        async with linked(url, **world) as (bridge, node):
            module = robot.add_module("Buttons", bridge, [button])
            (only,) = module.buttons
            if before is not None:
                before(bridge)
            await only.press(values, by="Ann")
            await until(lambda: only.state != "done" or node.received or node.calls)
            return only, node

    return asyncio.run(scenario())


def test_a_press_calls_the_service_and_shows_its_answer(sim, robot):
    received = []
    robot.add_module(
        lambda _: SimpleNamespace(on_button=lambda b: received.append((b.state, b.by)))
    )
    button, node = pressed(robot, DOCK, sim["ros1"], services={"/dock": trigger()})
    assert (button.state, button.result) == ("done", "Done: docked")
    assert [name for name, _ in node.calls] == ["/dock"]
    assert received == [("running", "Ann"), ("done", "Ann")]


def test_success_false_is_a_failure_with_the_message_of_the_robot(sim, robot):
    services = {"/dock": trigger(False, "no dock in sight")}
    button, _ = pressed(robot, DOCK, sim["ros1"], services=services)
    assert (button.state, button.result) == ("failed", "Failed: no dock in sight")


def test_a_missing_service_is_a_failure(sim, robot):
    button, _ = pressed(robot, DOCK, sim["ros1"])
    assert button.state == "failed"
    assert "/dock" in button.result
    assert "does not exist" in button.result


def test_a_service_without_an_answer_fails_after_the_timeout(sim, robot):
    services = {"/dock": ("std_srvs/Trigger", lambda args: None)}
    button, _ = pressed(robot, {**DOCK, "timeout": 0.2}, sim["ros1"], services=services)
    assert button.result == "Failed: /dock did not answer within 0.2 s"


def test_a_press_publishes_the_message(sim, robot):
    button, node = pressed(robot, HORN, sim["ros1"], topics={"/horn": "std_msgs/Bool"})
    assert button.result == "Published"
    assert node.received == [("/horn", {"data": True})]


def test_a_running_button_cannot_be_pressed_again(sim, robot):
    go_on = threading.Event()

    def wait(args: dict) -> dict:
        go_on.wait(30)
        return {"success": False, "message": "no dock in sight"}

    async def scenario():
        services = {"/dock": ("std_srvs/Trigger", wait)}
        async with linked(sim["ros1"], services=services) as (bridge, node):
            module = robot.add_module("Buttons", bridge, [{**DOCK, "timeout": 60}])
            dock = module["Dock"]
            first = asyncio.create_task(dock.press(by="Ann"))
            try:
                await until(lambda: node.calls)
                assert dock.why_disabled == "already running, started by Ann"
                assert await dock.press(by="Bea") is False
            finally:
                go_on.set()
            assert await first is False
            assert len(node.calls) == 1
            assert dock.by == "Ann"

    asyncio.run(scenario())


def test_only_buttons_with_during_stop_work_while_stop_is_active(sim, robot):
    async def scenario():
        async with linked(sim["ros1"], services={"/dock": trigger()}) as (bridge, node):
            light = {**DOCK, "label": "Light", "during_stop": True}
            module = robot.add_module("Buttons", bridge, [DOCK, light])
            report_fields = {
                "doing": "stopped",
                "holder": None,
                "goal": None,
                "alarm": None,
            }
            report_fields |= {"link": "up", "measured": None}
            report = SimpleNamespace(latched=True, other_writer=None, **report_fields)
            robot.on_gate_report(report)
            assert await module["Dock"].press() is False
            assert module["Dock"].result == "Not done: STOP is active: reset it first"
            assert node.calls == []
            assert await module["Light"].press() is True

    asyncio.run(scenario())


def test_a_press_on_a_topic_with_a_velocity_type_is_refused(sim, robot):
    button = {"label": "Go", "topic": "/wheels", "type": "std_msgs/Bool"}
    pressed_, node = pressed(
        robot, button, sim["ros1"], topics={"/wheels": "geometry_msgs/Twist"}
    )
    assert pressed_.state == "failed"
    assert "refused: /wheels of type geometry_msgs/Twist carries" in pressed_.result
    assert node.received == []


def test_a_press_on_a_service_that_cancels_goals_is_refused(sim, robot):
    services = {"/dock": ("action_msgs/CancelGoal", lambda args: {})}
    button, node = pressed(
        robot, {"label": "Dock", "service": "/dock"}, sim["ros1"], services=services
    )
    assert "refused: /dock of type action_msgs/CancelGoal" in button.result
    assert node.calls == []


def test_a_press_on_a_topic_later_declared_as_goal_topic_is_refused(sim, robot):
    def declare(bridge):
        robot.set_move_topic(Bridge(bridge.url), "/horn")

    button, node = pressed(
        robot, HORN, sim["ros1"], before=declare, topics={"/horn": "std_msgs/Bool"}
    )
    assert "refused: /horn carries a goal" in button.result
    assert node.received == []


def test_a_topic_with_another_type_gets_no_message(sim, robot):
    button, node = pressed(
        robot, HORN, sim["ros1"], topics={"/horn": "std_msgs/String"}
    )
    assert (
        button.result
        == "Failed: /horn is of type std_msgs/String, not of std_msgs/Bool"
    )
    assert node.received == []


def params(store):
    """The ROS 1 parameters in rosapi; those that begin with /fixed cannot be set."""

    def set_param(args):
        if not args["name"].startswith("/fixed"):
            store[args["name"]] = args["value"]
        return {}

    def get_param(args):
        return {"value": store.get(args["name"], args.get("default", ""))}

    return {
        "/rosapi/set_param": ("rosapi/SetParam", set_param),
        "/rosapi/get_param": ("rosapi/GetParam", get_param),
    }


@pytest.mark.parametrize("value", [0.4, 7, True, "fast", [1, 2]])
def test_a_parameter_of_ros_1_is_set_and_read_back(sim, robot, value):
    store: dict[str, str] = {}
    button = {"label": "P", "parameter": "/planner/x", "value": value}
    done, _ = pressed(robot, button, sim["ros1"], services=params(store))
    assert done.state == "done"
    assert json.loads(store["/planner/x"]) == value


def test_a_parameter_that_did_not_change_is_a_failure(sim, robot):
    store = {"/fixed/x": "1"}
    button = {"label": "P", "parameter": "/fixed/x", "value": 2}
    failed, _ = pressed(robot, button, sim["ros1"], services=params(store))
    assert failed.result == "Failed: got 1 for /fixed/x from the robot, expected 2"


@pytest.mark.parametrize(
    ("result", "state", "words"),
    [
        ({"successful": True, "reason": ""}, "done", "max_vel is 0.4"),
        (
            {"successful": False, "reason": "too fast"},
            "failed",
            "Failed: /controller refused: too fast",
        ),
    ],
)
def test_a_parameter_of_ros_2_is_set_by_its_node(sim, robot, result, state, words):
    button = {
        "label": "P",
        "parameter": "max_vel",
        "node": "/controller",
        "value": 0.4,
    }
    services = {
        "/controller/set_parameters": (
            "rcl_interfaces/SetParameters",
            lambda args: {"results": [result]},
        )
    }
    done, node = pressed(robot, button, sim["ros2"], services=services)
    assert (done.state, done.result) == (state, words)
    ((_, args),) = node.calls
    (parameter,) = args["parameters"]
    assert parameter["name"] == "max_vel"
    value = parameter["value"]
    assert len(value) == 10, "the graph fills in the other fields of the type"
    filled = {name: each for name, each in value.items() if each}
    assert filled == {"type": 3, "double_value": 0.4}


def test_a_press_without_a_link_fails_with_the_reason(robot):
    async def scenario():
        module = robot.add_module("Buttons", Bridge("ws://127.0.0.1:1"), [HORN])
        assert await module["Horn"].press() is False
        return module["Horn"].result

    assert "was never opened" in asyncio.run(scenario())


def test_unknown_form_fields_are_requested_only_from_ros_1_and_on_demand(sim, robot):
    button = {"label": "F", "topic": "/f", "type": "nav_msgs/Path2", "form": True}

    async def scenario(dialect):
        asked = []
        details = {"typedefs": [typedef("nav_msgs/Path2", n="int8", p="my/Part"),
                                typedef("my/Part", ok="bool")]}  # fmt: skip
        services = {
            "/rosapi/message_details": (
                "rosapi/MessageDetails",
                lambda args: asked.append(args) or details,
            )
        }
        async with linked(sim[dialect], services) as (bridge, _):
            (only,) = robot.add_module("Buttons", bridge, [button]).buttons
            with pytest.raises(ConfigError, match="Path2 are not known here"):
                only.fields()
            assert asked == []
            try:
                await only.ask_fields()
            except Exception as error:
                return str(error), asked
            return [field.name for field in only.fields()], asked

    assert asyncio.run(scenario("ros1")) == (["n", "p"], [{"type": "nav_msgs/Path2"}])
    words, asked = asyncio.run(scenario("ros2"))
    assert (
        "the bridge is of ROS 2, so it is not asked for the fields of nav_msgs/Path2"
        in words
    )
    assert asked == []


def typedef(type, **fields):
    return {
        "type": type,
        "fieldnames": list(fields),
        "fieldtypes": list(fields.values()),
        "fieldarraylen": [-1] * len(fields),
        "examples": [""] * len(fields),
        "constnames": [],
        "constvalues": [],
    }


# Buttons on a page.


def test_a_viewer_sees_a_disabled_button_and_cannot_press_it(
    link, robot, channel, tmp_path
):
    entry = PageEntry("/", lambda page: None, None, tmp_path, "test")
    viewer = Viewer("v2", "Vic", "viewer")
    page = Page(entry, channel, viewer, None, {})
    module = robot.add_module("Buttons", link, [DOCK])
    with page.scope.active():
        module.show_buttons_in(page.element("here"))
    (holder,) = page.element("here").children
    go = next(e for e in holder.walk() if getattr(e, "tag", "") == "button")
    assert go.get("disabled") is not None
    assert (
        go.get("title")
        == "Not available: only operators of this robot can press this button"
    )
    (handler,) = go.handlers("click")
    asyncio.run(handler(Event(kind="click")))
    assert module["Dock"].state == "idle"
    page.close()
    assert module["Dock"]._listeners != []  # of the module
    assert len(module["Dock"]._listeners) == 1
