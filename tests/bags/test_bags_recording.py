"""Reading a bag, and the errors of a bag that cannot be read."""

import os
import re

import pytest
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2

from equipment.bag_files import BEGIN, FRAMES, GRID, ODOMETRY, TWIST, Made, types_of
from webmap.bags.files import recording_name
from webmap.bags.recording import Recording
from webmap.base.errors import ConfigError


@pytest.fixture(scope="module")
def bag(made, tmp_path_factory):
    """A bag of four seconds: odometry, a map published once, a velocity."""
    return made.bag(
        tmp_path_factory.mktemp(made.dialect) / "office",
        ("/map", GRID, 0.0, made.grid([0, 100])),
        ("/odom", ODOMETRY, 1.0, made.odometry(1.0, 0.5)),
        ("/cmd_vel", TWIST, 2.0, made.message(TWIST)),
        ("/odom", ODOMETRY, 4.0, made.odometry(4.0, 2.0)),
    )


def test_a_recording_has_the_topics_types_dialect_and_length_of_its_bag(made, bag):
    recording = Recording([bag])
    types = {topic.name: topic.type for topic in recording.topics.values()}
    assert types == {"/map": GRID, "/odom": ODOMETRY, "/cmd_vel": TWIST}
    assert recording.dialect == made.dialect
    assert recording.begin == BEGIN
    assert recording.seconds == pytest.approx(4.0)
    recording.close()


def test_messages_are_read_in_order_from_a_start_time(bag):
    recording = Recording([bag])
    received = [(one.topic, one.time) for one in recording.messages(BEGIN + 10**9)]
    assert received == [
        ("/odom", BEGIN + 10**9),
        ("/cmd_vel", BEGIN + 2 * 10**9),
        ("/odom", BEGIN + 4 * 10**9),
    ]
    recording.close()


def test_a_message_is_decoded_as_the_rosbridge_server_publishes_messages(made, bag):
    recording = Recording([bag])
    *_, last = recording.messages(BEGIN)
    message = recording.message(last)
    assert message["pose"]["pose"]["position"]["x"] == 2.0
    assert message["header"]["stamp"] == made.time(4.0)
    recording.close()


def test_the_state_at_a_time_is_the_newest_message_of_each_topic(bag):
    recording = Recording([bag])
    state = recording.state_at(BEGIN + 15 * 10**8)
    assert [one.topic for one in state] == ["/map", "/odom"]
    recording.close()


def test_static_frames_and_grids_are_latched_topics(made, tmp_path):
    bag = made.bag(
        tmp_path / "names",
        ("/bob/tf_static", FRAMES, 0.0, made.frame("base")),
        ("/tf", FRAMES, 0.1, made.frame("base")),
        ("/costmap", GRID, 0.2, made.grid([0])),
    )
    recording = Recording([bag])
    latched = {name for name, topic in recording.topics.items() if topic.latched}
    assert latched == {"/bob/tf_static", "/costmap"}
    recording.close()


def test_a_single_mcap_file_is_read_without_its_folder(tmp_path):
    made = Made("ros2")
    folder = made.bag(
        tmp_path / "office", ("/odom", ODOMETRY, 0.0, made.odometry(0.0, 1.0))
    )
    recording = Recording([folder / "office.mcap"])
    assert list(recording.topics) == ["/odom"]
    recording.close()


def test_a_sqlite3_bag_is_read_from_its_folder_and_from_its_file(tmp_path):
    made, version = Made("ros2"), next(types_of("ros2").versions(ODOMETRY))
    with Writer2(
        tmp_path / "office", version=8, storage_plugin=StoragePlugin.SQLITE3
    ) as writer:
        odom = writer.add_connection(
            "/odom", version.type_name, typestore=version.store
        )
        writer.write(odom, BEGIN, version.bytes_of(made.odometry(0.0, 1.0)))
    for path in (tmp_path / "office", tmp_path / "office" / "office.db3"):
        recording = Recording([path])
        (only,) = recording.messages(BEGIN)
        assert recording.message(only)["pose"]["pose"]["position"]["x"] == 1.0
        recording.close()


def test_several_ros_1_bags_are_read_as_one_recording(tmp_path):
    made = Made("ros1")
    bags = [
        made.bag(
            tmp_path / name, (f"/{name}/odom", ODOMETRY, at, made.odometry(at, 1.0))
        )
        for name, at in (("late", 1.0), ("early", 0.0))
    ]
    recording = Recording(bags)
    received = [one.topic for one in recording.messages(recording.begin)]
    assert received == ["/early/odom", "/late/odom"]
    assert recording.name == "late.bag and 1 more"
    recording.close()


def refusal(*paths):
    with pytest.raises(ConfigError) as refused:
        Recording(paths)
    words = str(refused.value)
    assert "\n" not in words
    return words


def test_a_missing_file_is_refused_with_its_name(tmp_path):
    assert refusal(tmp_path / "gone.bag").endswith(
        "gone.bag: there is no such file or folder"
    )


def test_a_file_with_an_unknown_suffix_is_refused_with_the_known_suffixes(tmp_path):
    file = tmp_path / "notes.txt"
    file.write_text("hello")
    assert "expected .bag, .mcap, .db3, or the folder of a bag" in refusal(file)


def test_a_folder_without_metadata_is_refused(tmp_path):
    error = refusal(tmp_path)
    assert "there is no metadata.yaml in this folder" in error
    assert "`ros2 bag reindex`" in error


def test_bags_of_ros_1_and_ros_2_together_are_refused(tmp_path):
    for name in ("a.bag", "b.mcap"):
        (tmp_path / name).touch()
    words = refusal(tmp_path / "a.bag", tmp_path / "b.mcap")
    assert words == "bags of ROS 1 and of ROS 2 cannot be played as one"


@pytest.mark.parametrize("name", ["a.bag", "a.mcap", "folder"])
def test_a_pipe_or_a_device_is_refused(tmp_path, name):
    folder = tmp_path / "folder"
    folder.mkdir()
    (folder / "metadata.yaml").touch()
    os.mkfifo((folder if name == "folder" else tmp_path) / "a.mcap")
    (tmp_path / "a.bag").symlink_to("/dev/zero")
    kind = "a device" if name == "a.bag" else "a pipe"
    assert f"expected a file or a folder, got {kind}" in refusal(tmp_path / name)


def test_circular_symbolic_links_are_refused(tmp_path):
    (tmp_path / "a.bag").symlink_to("a.bag")
    assert "a.bag: the symbolic links lead in a circle" in refusal(tmp_path / "a.bag")


def test_a_too_large_metadata_file_is_refused(tmp_path):
    with (tmp_path / "metadata.yaml").open("wb") as file:
        file.truncate(5 << 20)
    error = refusal(tmp_path)
    assert "got 5242880 bytes, expected at most" in error
    assert "for the description of a bag" in error


@pytest.mark.parametrize(
    ("name", "tools"),
    [
        ("empty.bag", ["rosbag reindex"]),
        ("empty.mcap", ["mcap recover", "ros2 bag reindex"]),
        ("empty.db3", ["sqlite3 FILE .recover", "ros2 bag reindex"]),
    ],
)
@pytest.mark.parametrize("by_folder", [False, True])
def test_an_empty_file_is_refused_with_the_tools_that_repair_such_files(
    tmp_path, name, tools, by_folder
):
    (tmp_path / name).touch()
    (tmp_path / "metadata.yaml").touch()
    given = tmp_path if by_folder and name != "empty.bag" else tmp_path / name
    error = refusal(given)
    assert error.startswith(f"{given.name} cannot be read as a recording")
    assert re.findall("`(.*?)`", error) == tools


def test_a_file_that_the_system_does_not_open_has_no_tool(tmp_path, monkeypatch):
    def closed(*args, **options):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("rosbags.highlevel.AnyReader", closed)
    (tmp_path / "a.bag").touch()
    assert refusal(tmp_path / "a.bag").endswith("Permission denied")


def cut(whole, share):
    """Write the first part of a file to a new one; return it."""
    short = whole.with_name(f"short{whole.suffix}")
    data = whole.read_bytes()
    short.write_bytes(data[: int(len(data) * share)])
    return short


@pytest.mark.parametrize("share", [0.05, 0.1])
def test_a_file_that_is_cut_off_before_its_first_message_is_refused(made, bag, share):
    short = cut(bag if bag.is_file() else bag / "office.mcap", share)
    error = refusal(short)
    assert error.startswith(f"{short.name} cannot be read as a recording: ")
    tool = "`rosbag reindex`" if made.dialect == "ros1" else "`mcap recover`"
    assert tool in error


@pytest.mark.parametrize("share", [0.6, 0.95])
def test_a_bag_of_ros_1_that_is_cut_off_is_refused(tmp_path, share):
    made = Made("ros1")
    odometry = ("/odom", ODOMETRY, 0.0, made.odometry(0.0, 1.0))
    error = refusal(cut(made.bag(tmp_path / "office", odometry), share))
    assert error.startswith("short.bag cannot be read as a recording: ")
    assert "`rosbag reindex`" in error


@pytest.mark.parametrize("name", ["noise.bag", "noise.mcap", "noise.db3"])
def test_a_file_with_a_known_suffix_but_other_content_is_refused(tmp_path, name):
    (tmp_path / name).write_bytes(bytes(range(256)) * 40)
    assert refusal(tmp_path / name).startswith(f"{name} cannot be read as a recording")


def test_a_bag_without_messages_is_refused(made, tmp_path):
    assert "it contains no message" in refusal(made.bag(tmp_path / "nothing"))


def test_a_topic_with_an_undefined_type_is_left_out_with_a_warning(tmp_path):
    version = next(types_of("ros2").versions(ODOMETRY))
    with Writer2(
        tmp_path / "office", version=8, storage_plugin=StoragePlugin.MCAP
    ) as writer:
        lacking = {"msgdef": "acme_msgs/Joint[] joints\n", "rihs01": "RIHS01_0"}
        arm = writer.add_connection("/arm", "acme_msgs/msg/Arm", **lacking)
        odom = writer.add_connection(
            "/odom", version.type_name, typestore=version.store
        )
        writer.write(arm, BEGIN, bytes(8))
        writer.write(odom, BEGIN + 1, version.bytes_of(Made("ros2").odometry(0.0, 1.0)))
    warnings = []
    # Only the file, as rosbags checks the definitions of a folder, too.
    recording = Recording([tmp_path / "office" / "office.mcap"], warn=warnings.append)
    assert list(recording.topics) == ["/odom"]
    assert [one.topic for one in recording.messages(BEGIN)] == ["/odom"]
    assert warnings == [
        "office.mcap: /arm (acme_msgs/msg/Arm) is left out: there is no definition of "
        "acme_msgs/msg/Joint"
    ]
    recording.close()


def test_a_topic_with_a_recursive_type_is_left_out_with_a_warning(tmp_path):
    version = next(types_of("ros2").versions(ODOMETRY))
    with Writer2(
        tmp_path / "office", version=8, storage_plugin=StoragePlugin.MCAP
    ) as writer:
        endless = {"msgdef": "acme_msgs/Arm[] arms\n", "rihs01": "RIHS01_0"}
        arm = writer.add_connection("/arm", "acme_msgs/msg/Arm", **endless)
        odom = writer.add_connection(
            "/odom", version.type_name, typestore=version.store
        )
        writer.write(arm, BEGIN, bytes(8))
        writer.write(odom, BEGIN + 1, version.bytes_of(Made("ros2").odometry(0.0, 1.0)))
    warnings = []
    recording = Recording([tmp_path / "office" / "office.mcap"], warn=warnings.append)
    assert list(recording.topics) == ["/odom"]
    assert warnings == [
        "office.mcap: /arm (acme_msgs/msg/Arm) is left out: acme_msgs/Arm is nested "
        "too deep: in acme_msgs/Arm"
    ]
    recording.close()


def test_messages_that_do_not_match_their_type_are_left_out_with_one_warning(tmp_path):
    version = next(types_of("ros1").versions(ODOMETRY))
    with Writer1(tmp_path / "bad.bag") as writer:
        odom = writer.add_connection(
            "/odom", version.type_name, typestore=version.store
        )
        for moment in range(3):
            writer.write(odom, BEGIN + moment, b"\x01\x02")
    warnings = []
    recording = Recording([tmp_path / "bad.bag"], warn=warnings.append)
    assert [recording.message(one) for one in recording.messages(BEGIN)] == [None] * 3
    assert len(warnings) == 1
    assert re.search(
        r"messages of /odom that are not of the type .* are not played", warnings[0]
    )
    recording.close()


def test_a_recording_is_named_after_its_file(tmp_path):
    assert recording_name([tmp_path / "office.bag"]) == "office.bag"
