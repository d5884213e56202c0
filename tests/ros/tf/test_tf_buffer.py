"""The buffer of frames."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from webmap.base.errors import ProtocolError
from webmap.base.geometry import Pose, Quaternion, Vector3
from webmap.ros.messages import Time
from webmap.ros.tf import (
    Buffer,
    FrameMissing,
    NotConnected,
    NotKnownThen,
    Transform,
    TransformError,
)
from webmap.ros.tf.buffer import MOST_COMPARED, MOST_FRAMES


def at(x, y=0.0, yaw=0.0):
    return Transform.from_pose(Pose(x, y, yaw))


@pytest.fixture
def robot():
    """A robot that drives along x at 1 m/s from 10 s to 12 s, ten times a second."""
    buffer = Buffer()
    buffer.add("map", "odom", at(100.0), 10.0)
    buffer.add("map", "odom", at(100.0), 10.9)
    buffer.add("map", "odom", at(100.0), 11.8)
    for step in range(21):
        buffer.add("odom", "base_link", at(step / 10), 10.0 + step / 10)
    buffer.add("base_link", "laser", at(0.3, 0.0, math.pi), 0.0, static=True)
    return buffer


def place(transform):
    return pytest.approx((transform.planar.x, transform.planar.y), abs=1e-9)


def test_a_lookup_combines_the_transforms_of_several_frames(robot):
    assert place(robot.lookup("map", "base_link", 11.0)) == (101.0, 0.0)
    assert place(robot.lookup("map", "laser", 11.0)) == (101.3, 0.0)


def test_a_lookup_interpolates_between_two_transforms(robot):
    assert place(robot.lookup("map", "base_link", 11.05)) == (101.05, 0.0)


def test_a_lookup_without_a_time_uses_the_newest_common_time(robot):
    assert robot.newest("map", "base_link") == 11.8
    assert place(robot.lookup("map", "base_link")) == (101.8, 0.0)
    assert place(robot.lookup("odom", "base_link")) == (2.0, 0.0)


def test_static_frames_are_known_at_all_times(robot):
    assert robot.newest("base_link", "laser") is None
    for time in (None, -5.0, 1e9):
        assert place(robot.lookup("base_link", "laser", time)) == (0.3, 0.0)


def test_the_transform_of_a_frame_to_itself_is_the_identity(robot):
    assert robot.lookup("laser", "laser", 1e9) == Transform()


def test_a_lookup_between_two_branches_uses_their_common_ancestor(robot):
    robot.add("base_link", "camera", at(-0.2), 0.0, static=True)
    assert place(robot.lookup("laser", "camera")) != (-0.5, 0.0)
    assert place(robot.lookup("laser", "camera")) == (0.5, 0.0)


def test_an_upside_down_sensor_has_its_left_side_on_the_right_of_the_base():
    buffer = Buffer()
    over = Transform(Vector3(0, 0, 0.5), Quaternion(1, 0, 0, 0))
    buffer.add("base", "laser", over, 0.0, static=True)
    point = buffer.lookup("base", "laser").apply(Vector3(1, 1, 0))
    assert (point.x, point.y, point.z) == pytest.approx((1, -1, 0.5))


@pytest.mark.parametrize(
    ("time", "words"),
    [
        (12.5, "'odom' -> 'base_link': the newest stamp is 12.000 s, 0.500 s before"),
        (9.0, "the oldest stamp is 10.000 s, 1.000 s after the requested 9.000 s"),
    ],
)
def test_a_lookup_outside_the_known_times_names_the_nearest_known_time(
    robot, time, words
):
    with pytest.raises(NotKnownThen) as error:
        robot.lookup("odom", "base_link", time)
    assert words in str(error.value)


def test_a_lookup_in_a_time_gap_is_refused(robot):
    robot.add("odom", "base_link", at(9.0), 15.0)
    with pytest.raises(NotKnownThen, match=r"gap of 3\.000 s from 12\.000 s on"):
        robot.lookup("odom", "base_link", 13.0)
    assert place(robot.lookup("odom", "base_link", 15.0)) == (9.0, 0.0)


def test_the_error_for_a_missing_frame_lists_the_known_frames(robot):
    with pytest.raises(FrameMissing) as error:
        robot.lookup("map", "base_lnk")
    assert "did you mean 'base_link'?" in str(error.value)
    assert "there are: base_link, laser, map, odom" in str(error.value)
    with pytest.raises(FrameMissing, match="there are: none"):
        Buffer().lookup("map", "odom")


def test_the_error_for_a_missing_frame_lists_only_some_of_many_frames():
    buffer = Buffer()
    for number in range(50):
        buffer.add("root", f"f{number}", at(0), 0.0)
    with pytest.raises(FrameMissing, match="and 39 more"):
        buffer.lookup("root", "nothing")


def test_a_lookup_between_two_trees_names_their_roots(robot):
    robot.add("world_2", "odom_2", at(0), 10.0)
    with pytest.raises(
        NotConnected, match="tree of 'map', 'odom_2' in the tree of 'wor"
    ):
        robot.lookup("odom_2", "laser")


def test_a_frame_loop_is_refused_and_changes_nothing(robot):
    words = "'laser' -> 'odom' would close a loop: 'odom' -> 'base_link' -> 'laser' -> "
    with pytest.raises(TransformError, match=words):
        robot.add("laser", "odom", at(0), 11.0)
    with pytest.raises(TransformError, match="loop"):
        robot.add("odom", "odom", at(0), 11.0)
    assert place(robot.lookup("map", "base_link", 11.0)) == (101.0, 0.0)


def test_a_backward_time_jump_is_noted_and_clears_the_history_of_the_frame(robot):
    robot.add("odom", "base_link", at(5.0), 3.0)
    assert "jumped back by 9.000 s" in robot.notes[-1]
    assert place(robot.lookup("odom", "base_link", 3.0)) == (5.0, 0.0)
    with pytest.raises(NotKnownThen):
        robot.lookup("odom", "base_link", 11.0)


def test_a_slightly_late_transform_is_inserted_in_time_order(robot):
    robot.add("odom", "base_link", at(1.5, 1.0), 11.45)
    assert place(robot.lookup("odom", "base_link", 11.45)) == (1.5, 1.0)
    assert not robot.notes


def test_a_buffer_keeps_ten_seconds_of_transforms():
    buffer = Buffer()
    for step in range(300):
        buffer.add("odom", "base", at(step), step / 10)
    with pytest.raises(NotKnownThen, match=r"the oldest stamp is 19\.900 s"):
        buffer.lookup("odom", "base", 19.0)


@pytest.mark.parametrize("carrier", ["base_link", "laser", "odom", "map", "post"])
def test_a_sensor_and_what_carries_it_are_found_as_if_one_by_one(robot, carrier):
    robot.add("map", "post", at(7.0), 0.0, static=True)
    for target, source in (("map", "laser"), ("post", "laser"), ("laser", "map")):
        both = robot.lookup_carried(target, source, carrier, 11.05)
        one = robot.lookup(target, source, 11.05)
        assert both == (one, robot.find(target, carrier, 11.05).transform)


def test_an_unknown_carrier_is_none_and_an_unknown_sensor_an_error(robot):
    assert robot.lookup_carried("map", "laser", "trailer", 11.0)[1] is None
    with pytest.raises(NotKnownThen):
        robot.lookup_carried("map", "laser", "base_link", 99.0)


def test_find_uses_the_given_time_or_else_the_newest_transform(robot):
    then, now = robot.find("map", "base_link", 11.0), robot.find("map", "base_link")
    assert place(then.transform) == (101.0, 0.0)
    assert (then.newest, then.on_time) == (11.8, True)
    assert place(now.transform) == (101.8, 0.0)
    assert (now.newest, now.on_time) == (11.8, False)
    assert robot.find("map", "base_link", 12.5) == now
    assert robot.find("laser", "base_link").newest is None
    assert robot.find("map", "map") == (Transform(), None, False)
    with pytest.raises(FrameMissing):
        robot.find("map", "camera", 11.0)


def test_a_lookup_follows_changes_of_the_frame_tree(robot):
    robot.add("world", "tag", at(1.0), 11.0)
    with pytest.raises(NotConnected):
        robot.lookup("map", "tag", 11.0)
    assert place(robot.lookup("map", "base_link", 11.0)) == (101.0, 0.0)
    robot.add("map", "world", at(5.0), 11.0)
    assert place(robot.lookup("map", "tag", 11.0)) == (6.0, 0.0)
    robot.add("map", "base_link", at(7.0), 11.0)
    assert place(robot.lookup("map", "base_link", 11.0)) == (7.0, 0.0)
    assert place(robot.lookup("map", "laser", 11.0)) == (7.3, 0.0)


def test_a_frame_that_changes_its_parent_is_noted(robot):
    robot.add("map", "base_link", at(7.0), 11.0)
    assert "was in 'odom' and is in 'map' now" in robot.notes[-1]
    assert place(robot.lookup("map", "base_link", 11.0)) == (7.0, 0.0)
    assert "odom" in robot.frames


def test_a_parent_without_children_is_removed():
    buffer = Buffer()
    buffer.add("old", "base", at(0), 1.0)
    buffer.add("new", "base", at(0), 2.0)
    assert buffer.frames == ["base", "new"]


def test_a_namespace_prefixes_all_frames_except_shared_frames():
    buffer = Buffer()
    for name in ("robot_0", "robot_1"):
        buffer.add("map", "odom", at(1.0), 1.0, namespace=f"/{name}")
        buffer.add("odom", "base_link", at(1.0), 1.0, namespace=f"/{name}")
    assert buffer.frames == [
        "map", "robot_0/base_link", "robot_0/odom", "robot_1/base_link", "robot_1/odom",
    ]  # fmt: skip
    assert place(buffer.lookup("robot_0/base_link", "robot_1/base_link")) == (0.0, 0.0)


def test_an_existing_namespace_prefix_is_not_added_twice():
    buffer = Buffer()
    assert buffer.name("robot_0/odom", "/robot_0") == "robot_0/odom"
    assert buffer.name("/odom") == "odom"


@pytest.mark.parametrize(
    ("parent", "child", "stamp", "words"),
    [
        ("", "a", 0.0, "has no name"),
        ("a", "/", 0.0, "has no name"),
        ("a", "b", math.nan, "the stamp is nan"),
    ],
)
def test_a_transform_without_a_frame_name_or_a_valid_stamp_is_refused(
    parent, child, stamp, words
):
    with pytest.raises(TransformError, match=words):
        Buffer().add(parent, child, at(0), stamp)


def test_the_error_for_an_invalid_transform_names_its_frames():
    bad = Transform(rotation=Quaternion(0, 0, 0, 0))
    with pytest.raises(TransformError, match="'odom' -> 'base': the rotation has a"):
        Buffer().add("odom", "base", bad, 0.0)


def test_a_flood_of_frames_removes_the_least_recently_updated_frames(robot):
    for number in range(2 * MOST_FRAMES):
        robot.add("map", f"object_{number}", at(number), 1e6 - number)
        if number % 100 == 0:
            robot.add("odom", "base_link", at(2.0), 12.0)
    assert len(robot.frames) <= MOST_FRAMES + 1, "and the root"
    assert "object_0" not in robot.frames
    newest = f"object_{2 * MOST_FRAMES - 1}"
    assert place(robot.lookup("map", newest)) == (2 * MOST_FRAMES - 1, 0.0)
    robot.add("map", "late/odom", at(5.0), 13.0)
    robot.add("late/odom", "late/base_link", at(1.0), 13.0)
    assert place(robot.lookup("map", "late/base_link")) == (6.0, 0.0)
    # Old parent frames and static frames are kept.
    assert place(robot.lookup("map", "laser", 11.8)) == (102.1, 0.0)


def test_a_full_buffer_does_not_remove_the_parent_of_a_new_frame():
    buffer = Buffer()
    for number in range(MOST_FRAMES):
        buffer.add("root", f"f{number}", at(1.0), 0.0)
    buffer.add("f0", "one more", at(1.0), 0.0)
    assert buffer.chain("one more") == ["one more", "f0", "root"]
    assert "f1" not in buffer.frames


def test_a_buffer_full_of_static_frames_refuses_new_frames():
    buffer = Buffer()
    for number in range(MOST_FRAMES):
        buffer.add("root", f"f{number}", at(0), 0.0, static=True)
    with pytest.raises(TransformError, match="4096 frames already"):
        buffer.add("root", "one more", at(0), 0.0)
    buffer.add("root", "f7", at(1), 1.0, static=True)


def test_a_missing_name_is_compared_once_and_never_with_too_many_frames(
    robot, monkeypatch
):
    compared = []

    def compare(name, names, n):
        compared.append(len(names))
        return []

    monkeypatch.setattr("webmap.ros.tf.buffer.difflib.get_close_matches", compare)

    def miss() -> str:
        with pytest.raises(FrameMissing) as error:
            robot.lookup("map", "bas_link")
        return str(error.value)

    assert miss() == miss()
    assert compared == [4], "the same text is not computed again"
    robot.add("odom", "base_link", at(2.0), 12.0)
    robot.add("base_link", "camera", at(1.0), 0.0)
    assert "there are: base_link, camera, laser, map, odom" in miss()
    assert compared == [4, 5]
    for number in range(MOST_COMPARED):
        robot.add("map", f"object_{number}", at(0.0), 0.0)
    assert "and 193 more" in miss()
    assert compared == [4, 5]


POSES = st.builds(
    Pose, st.floats(-10, 10), st.floats(-10, 10), st.floats(-math.pi, math.pi)
)
NAMES = ["a", "b", "c", "d", "e"]


@st.composite
def trees(draw):
    """A tree of five frames that move at their own times, known from 1 s to 2 s."""
    buffer = Buffer()
    for index, child in enumerate(NAMES[1:], start=1):
        parent = NAMES[draw(st.integers(0, index - 1))]
        middle = draw(st.floats(1.1, 1.9))
        for stamp in (1.0, middle, 2.0):
            buffer.add(parent, child, Transform.from_pose(draw(POSES)), stamp)
    return buffer


FRAMES = st.sampled_from(NAMES)
TIMES = st.floats(1.0, 2.0)


def same(one, other):
    for point in (Vector3(), Vector3(1, 0, 0), Vector3(0, 1, 0)):
        p, q = one.apply(point), other.apply(point)
        assert (p.x, p.y, p.z) == pytest.approx((q.x, q.y, q.z), abs=1e-6)


@given(trees(), FRAMES, FRAMES, FRAMES, TIMES)
def test_a_lookup_over_any_intermediate_frame_gives_the_same_transform(
    tree, target, over, source, time
):
    same(
        tree.lookup(target, source, time),
        tree.lookup(target, over, time) @ tree.lookup(over, source, time),
    )


@given(trees(), FRAMES, FRAMES, TIMES)
def test_the_reverse_lookup_gives_the_inverse_transform(tree, target, source, time):
    there, back = tree.lookup(target, source, time), tree.lookup(source, target, time)
    same(there @ back, Transform())


# Times outside of the known transforms.


def test_a_moving_frame_is_extrapolated_for_a_limited_time(robot):
    assert place(robot.lookup("odom", "base_link", 12.15, ahead=0.2)) == (2.15, 0.0)
    with pytest.raises(NotKnownThen, match="before the requested"):
        robot.lookup("odom", "base_link", 12.25, ahead=0.2)


def test_a_turning_frame_is_extrapolated():
    buffer = Buffer()
    for step in range(5):
        buffer.add("odom", "base", at(0, 0, step / 10), 10.0 + step / 10)
    ahead = buffer.lookup("odom", "base", 10.5, ahead=0.2)
    assert ahead.planar.yaw == pytest.approx(0.5)


@pytest.mark.parametrize(
    "received",
    [
        [(10.0, 0.0, 0.0)],  # once only
        [(10.0, 0.0, 0.0), (10.1, 3.0, 0.0)],  # the robot jumped
        [(10.0, 0.0, 0.0), (10.1, 3.0, 3.0)],  # the robot turned round
        [(9.0, 2.0, 0.0), (10.1, 3.0, 0.0)],  # too long ago
        [(10.09, 2.99, 0.0), (10.1, 3.0, 0.0)],  # too close together to measure a speed
    ],
)
def test_a_frame_without_a_plausible_velocity_is_not_extrapolated(received):
    buffer = Buffer()
    for stamp, x, yaw in received:
        buffer.add("odom", "base", at(x, 0.0, yaw), stamp)
    stamp, x, _ = received[-1]
    assert place(buffer.lookup("odom", "base", stamp + 0.1, ahead=0.2)) == (x, 0.0)


def test_chain_lists_a_frame_and_all_its_ancestors(robot):
    assert robot.chain("laser") == ["laser", "base_link", "odom", "map"]
    assert robot.chain("nowhere") == ["nowhere"]


NUMBERS = st.sampled_from([0.0, 1.0, -2.5, 1e7, 1e200, math.inf, math.nan])
TURNS = st.sampled_from(
    [
        *((0.0, 0.0, 0.0, 1.0), (0.6, 0.0, 0.0, 0.8), (0.0, 0.0, 0.0, 0.0)),
        *((0.0, 0.0, 0.0, 1.05), (1.0, 1.0, 1.0, 1.0), (math.nan, 0.0, 0.0, 1.0)),
    ]
)
FRAMES = st.sampled_from(["map", "odom", "/odom", "base", "", "n" * 300])


@given(
    st.lists(
        st.tuples(
            st.tuples(
                st.sampled_from([0, 10, 100, 10**400]),
                st.sampled_from([0, 1, 999_999_999, -1, 10**9]),
                st.sampled_from([0, 11]),
                st.sampled_from([0, 5]),
                FRAMES,
                FRAMES,
                *[NUMBERS] * 3,
            ),
            TURNS,
            st.sampled_from([False, False, False, True]),
        ),
        max_size=30,
    )
)
def test_a_row_of_a_message_is_added_as_its_transform(rows):
    one, other = Buffer(), Buffer()
    for values, turn, static in rows:
        notes = []
        secs, nsecs, sec, nanosec, parent, child, *place = values
        try:
            stamp = Time(secs, nsecs, sec, nanosec).seconds
        except ProtocolError:
            with pytest.raises(TransformError, match=r"nanoseconds|digits|name"):
                one.add_row((*values, *turn), static=static, namespace="/r")
            continue
        transform = Transform(Vector3(*place), Quaternion(*turn))
        options = {"static": static, "namespace": "/r"}
        given = (parent, child, transform, stamp)
        for add, arguments in ((one.add_row, [(*values, *turn)]), (other.add, given)):
            try:
                notes.append(add(*arguments, **options))
            except TransformError as error:
                notes.append(str(error))
        assert notes[0] == notes[1]
        assert [*one._tracks] == [*other._tracks]
    assert one.frames == other.frames
    for frame, track in one._tracks.items():
        same = other._tracks[frame]
        assert (track.parent, track.static) == (same.parent, same.static)
        assert track._stamps == same._stamps
        assert track._transforms == same._transforms
