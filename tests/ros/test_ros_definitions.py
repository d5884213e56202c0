"""The message definitions, compared with those of three releases in rosbags."""

import pytest
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore

from webmap.base.errors import ConfigError
from webmap.ros.definitions import Definitions, UnknownType, shipped, split_texts

FILLER = "structure_needs_at_least_one_member"
TIMES = {"builtin_interfaces/Time": "time", "builtin_interfaces/Duration": "duration"}
NEWER = {"sensor_msgs/Range": [("variance", "float32", None, None)]}
"""The fields that Humble lacks at the end."""


def plain(name):
    """A type name without the ``msg`` part that rosbags adds."""
    name = name.replace("/msg/", "/")
    return TIMES.get(name, name)


def of_rosbags(store, name):
    """Names, types, fixed sizes and bounds of the fields of a type."""
    found = []
    for field, (kind, inner) in store.fielddefs[name][1]:
        size = most = None
        if kind in (Nodetype.ARRAY, Nodetype.SEQUENCE):
            (_, inner), count = inner
            size = count if kind == Nodetype.ARRAY else "any"
            if kind == Nodetype.SEQUENCE and count:
                most = count
        type_name = plain(inner) if isinstance(inner, str) else inner[0]
        if field != FILLER:
            found.append((field, type_name, size, most))
    return found


def of_catalogue(definition):
    return [
        (
            field.name,
            field.type,
            field.size if field.size is not None else "any" if field.is_array else None,
            field.most,
        )
        for field in definition.fields
    ]


@pytest.mark.parametrize(
    ("release", "least"), [("ROS1_NOETIC", 70), ("ROS2_HUMBLE", 70), ("ROS2_JAZZY", 70)]
)
def test_every_shipped_definition_matches_rosbags(release, least):
    store, known = get_typestore(Stores[release]), shipped(ros2="ROS2" in release)
    newer = NEWER if release == "ROS2_HUMBLE" else {}
    compared = 0
    for name in known:
        spelled = "{}/msg/{}".format(*name.split("/"))
        if spelled not in store.fielddefs:
            continue
        compared += 1
        definition = known.definition(name)
        theirs = [*of_rosbags(store, spelled), *newer.get(name, [])]
        assert of_catalogue(definition) == theirs, name
        theirs = {each[0]: each[2] for each in store.fielddefs[spelled][0]}
        ours = {each.name: each.value for each in definition.constants}
        assert {each: theirs.get(each) for each in ours} == ours, name
    assert compared > least


@pytest.mark.parametrize("ros2", [False, True])
def test_every_type_of_the_catalogue_has_a_complete_definition(ros2):
    known = shipped(ros2=ros2)
    for name in known:
        assert known.definition(name).name == name


def test_a_type_is_found_in_either_spelling():
    known = shipped(ros2=True)
    assert known.definition("nav_msgs/msg/Path") is known.definition("nav_msgs/Path")
    request = known.definition("std_srvs/srv/SetBool")
    assert request.name == "std_srvs/SetBoolRequest"


def test_only_ros1_headers_have_a_sequence_number():
    names = [
        [
            field.name
            for field in shipped(ros2=ros2).definition("std_msgs/Header").fields
        ]
        for ros2 in (False, True)
    ]
    assert names == [["seq", "stamp", "frame_id"], ["stamp", "frame_id"]]


def test_an_action_has_the_messages_of_its_dialect():
    action = "ACTION: my_msgs/Dock\nint8 bay\n---\nbool done\n---\nfloat32 left"
    ros1 = Definitions(split_texts(action, ros2=False), ros2=False)
    goal = ros1.definition("my_msgs/DockActionGoal")
    assert [field.type for field in goal.fields] == [
        "std_msgs/Header", "actionlib_msgs/GoalID", "my_msgs/DockGoal",
    ]  # fmt: skip
    ros2 = Definitions(split_texts(action, ros2=True), ros2=True)
    (_, feedback) = ros2.definition("my_msgs/action/Dock_FeedbackMessage").fields
    assert [field.name for field in feedback.fields] == ["left"]


def test_a_bag_definition_text_with_several_types_is_split():
    rule = "=" * 80
    text = f"Joint[<=3] joints\nwstring<=5 name\n{rule}\nMSG: my_msgs/Joint\ntime at"
    texts = split_texts(text, "my_msgs/Arm", ros2=True)
    joints, name = Definitions(texts, ros2=True).definition("my_msgs/Arm").fields
    assert (joints.type, joints.most, joints.size) == ("my_msgs/Joint", 3, None)
    assert [field.type for field in joints.fields] == ["time"]
    assert (name.type, name.longest) == ("string", 5)


def test_given_definitions_override_shipped_definitions():
    mine = Definitions({"std_msgs/Bool": "uint8 data"}, ros2=True)
    assert mine.definition("std_msgs/msg/Bool").fields[0].type == "uint8"
    assert shipped(ros2=True).definition("std_msgs/Bool").fields[0].type == "bool"


def test_a_type_that_contains_itself_is_refused():
    texts = {"my_msgs/A": "B b", "my_msgs/B": "A[] a"}
    with pytest.raises(ConfigError, match="nested too deep: in my_msgs/A, my_msgs/B"):
        Definitions(texts, ros2=True).definition("my_msgs/A")


def test_an_unknown_field_type_is_named_in_the_error():
    with pytest.raises(UnknownType, match="fields of my_msgs/B are not known"):
        Definitions({"my_msgs/A": "B b"}, ros2=True).definition("my_msgs/A")
