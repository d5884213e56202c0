"""The marks of a recording: stops, goals, their results, and alarms."""

import pytest

from equipment.bag_files import ODOMETRY, Made
from webmap.bags import marks as marks_module
from webmap.bags.marks import MarkFinder, find_marks

DIAGNOSTICS = "diagnostic_msgs/DiagnosticArray"
LOG_1, LOG_2 = "rosgraph_msgs/Log", "rcl_interfaces/Log"
STATUS_1, STATUS_2 = "actionlib_msgs/GoalStatusArray", "action_msgs/GoalStatusArray"
POSE, BOOL = "geometry_msgs/PoseStamped", "std_msgs/Bool"


def found(topic, type_name, *messages):
    """Return the marks of messages that arrive once a second."""
    finder = MarkFinder()
    assert finder.wants(topic, type_name)
    for at, message in enumerate(messages):
        finder.look(topic, type_name, float(at), message)
    return [(mark.at, mark.kind, mark.text) for mark in finder.marks]


def part(level, message="too hot"):
    return {"level": level, "name": "motor", "hardware_id": "", "message": message}


@pytest.mark.parametrize("error", [2, b"\x02"])
def test_an_error_of_diagnostics_is_one_alarm_while_it_lasts(error):
    levels = [0, error, error, 0, error]
    arrays = [{"status": [part(level)]} for level in levels]
    assert found("/diagnostics", DIAGNOSTICS, *arrays) == [
        (1.0, "alarm", "motor: too hot"),
        (4.0, "alarm", "motor: too hot"),
    ]


@pytest.mark.parametrize(
    ("type_name", "warn", "error"), [(LOG_1, 4, 8), (LOG_2, 30, 40)]
)
def test_an_error_in_the_log_is_an_alarm_and_a_warning_is_not(type_name, warn, error):
    lines = [{"level": level, "name": "/base", "msg": "x"} for level in (warn, error)]
    assert found("/rosout", type_name, *lines) == [(1.0, "alarm", "/base: x")]


def test_a_repeated_log_line_is_one_alarm():
    lines = [{"level": 8, "name": "/base", "msg": "x"}] * 30
    assert len(found("/rosout", LOG_1, *lines)) == 1


def test_a_goal_of_an_action_and_its_result_are_marks_of_ros_2():
    def goals(*states):
        info = {"goal_id": {"uuid": [7] * 16}}
        return {"status_list": [{"status": s, "goal_info": info} for s in states]}

    topic = "/navigate_to_pose/_action/status"
    assert found(topic, STATUS_2, goals(), goals(1), goals(2), goals(4)) == [
        (1.0, "goal", "Goal accepted by /navigate_to_pose"),
        (3.0, "result", "Goal reached by /navigate_to_pose"),
    ]


def test_a_goal_of_move_base_is_marked_once_by_all_its_topics():
    finder = MarkFinder()
    goal = {"goal_id": {"id": "a"}}
    finder.look("/move_base/goal", "move_base_msgs/MoveBaseActionGoal", 1.0, goal)
    active = {"status_list": [{"status": 1, "goal_id": {"id": "a"}}]}
    finder.look("/move_base/status", STATUS_1, 1.1, active)
    result = {"status": {"status": 4, "goal_id": {"id": "a"}}}
    finder.look("/move_base/result", "move_base_msgs/MoveBaseActionResult", 5.0, result)
    texts = [(mark.kind, mark.text) for mark in finder.marks]
    assert texts == [
        ("goal", "Goal accepted by /move_base"),
        ("result", "Goal failed by /move_base"),
    ]


def test_goals_that_were_over_before_the_recording_are_no_marks():
    over = {"status_list": [{"status": 3, "goal_id": {"id": "old"}}]}
    assert found("/move_base/status", STATUS_1, over, over) == []


def test_a_goal_topic_is_a_goal_with_its_position():
    pose = {"pose": {"position": {"x": 1.0, "y": -2.5}}}
    assert found("/goal_pose", POSE, pose) == [
        (0.0, "goal", "Goal at 1.00, -2.50 m on /goal_pose")
    ]


@pytest.mark.parametrize("topic", ["/e_stop", "/bob/estop", "/emergency", "/bob/stop"])
def test_a_stop_topic_is_marked_when_it_becomes_true(topic):
    states = [{"data": state} for state in (False, True, True, False)]
    assert found(topic, BOOL, *states) == [(1.0, "stop", f"Stop on {topic}")]


@pytest.mark.parametrize(
    ("topic", "type_name"),
    [("/nonstop", BOOL), ("/tracked_pose", POSE), ("/odom", ODOMETRY)],
)
def test_other_topics_have_no_events(topic, type_name):
    assert not MarkFinder.wants(topic, type_name)


def test_a_message_with_other_fields_than_expected_is_no_mark():
    assert found("/x", "other_msgs/OtherActionGoal", {}, {"goal_id": 3}) == []


def test_more_events_than_the_limit_are_counted(monkeypatch):
    monkeypatch.setattr(marks_module, "MOST", 2)
    finder = MarkFinder()
    for at in range(5):
        line = {"level": 8, "name": "/base", "msg": f"{at}"}
        finder.look("/rosout", LOG_1, float(at), line)
    assert (len(finder.marks), finder.left_out) == (2, 3)


def test_control_characters_and_long_texts_are_replaced_and_cut():
    line = {"level": 8, "name": "/base", "msg": "a\n" * 1000}
    ((_, _, text),) = found("/rosout", LOG_1, line)
    assert len(text) <= marks_module.LONGEST
    assert text.isprintable()


def bag(made, path):
    states = enumerate((False, True, False))
    return made.bag(
        path,
        ("/odom", ODOMETRY, 0.0, made.odometry(0.0, 0.0)),
        *(("/e_stop", BOOL, at, made.message(BOOL, data=s)) for at, s in states),
        ("/odom", ODOMETRY, 4.0, made.odometry(4.0, 0.0)),
    )


def test_the_marks_of_a_recording_are_found_and_the_end_is_reported(made, tmp_path):
    reports = []
    find_marks([bag(made, tmp_path / "office")], reports.append)
    assert reports[-1].read == 1.0
    assert [(mark.at, mark.kind) for mark in reports[-1].marks] == [(1.0, "stop")]


def test_the_progress_is_reported(made, tmp_path, monkeypatch):
    monkeypatch.setattr(marks_module, "REPORT", 0.0)
    reports = []
    find_marks([bag(made, tmp_path / "office")], reports.append)
    read = [report.read for report in reports]
    assert read == pytest.approx([0.0, 0.25, 0.5, 1.0])


def test_the_search_ends_when_it_is_no_longer_wanted(made, tmp_path):
    reports = []
    find_marks([bag(made, tmp_path / "office")], reports.append, lambda: False)
    assert reports == []


def test_a_file_that_cannot_be_read_has_no_marks(tmp_path):
    broken = tmp_path / "broken.bag"
    broken.write_bytes(b"nothing")
    reports = []
    find_marks([broken], reports.append)
    assert [(report.marks, report.read) for report in reports] == [([], 1.0)]


def test_a_recording_without_events_has_no_marks(tmp_path):
    made = Made("ros2")
    path = made.bag(
        tmp_path / "calm", ("/odom", ODOMETRY, 0.0, made.odometry(0.0, 0.0))
    )
    reports = []
    find_marks([path], reports.append)
    assert reports[-1].marks == []
