"""No more moving velocities are on their way to a robot than may come late."""

from hypothesis import given
from hypothesis import strategies as st

from webmap.gate.lanes.unproven import MOST, REMEMBERED, Unproven
from webmap.geometry import Twist

ZERO = Twist()
AHEAD = Twist(0.5)
TURN = Twist(0.0, 0.0, 0.5)


def full(*, topic="/cmd_vel", twist=AHEAD):
    unproven = Unproven()
    for _ in range(MOST):
        assert unproven.room(topic)
        unproven.wrote(topic, twist)
    assert not unproven.room(topic)
    return unproven


def test_six_may_be_on_their_way_and_no_more():
    assert MOST == 6
    full()


def test_each_robot_has_six_of_its_own():
    assert full().room("/other/cmd_vel")


def test_zeros_are_not_counted():
    unproven = Unproven()
    for _ in range(100):
        unproven.wrote("/cmd_vel", ZERO)
    assert unproven.room("/cmd_vel")


def test_an_echo_makes_room_for_one():
    unproven = full()
    assert unproven.echoed("/cmd_vel", AHEAD)
    assert unproven.room("/cmd_vel")
    unproven.wrote("/cmd_vel", AHEAD)
    assert not unproven.room("/cmd_vel")


def test_an_echo_proves_what_was_written_before_it_too():
    unproven = full()
    unproven.wrote("/cmd_vel", ZERO)
    assert unproven.echoed("/cmd_vel", ZERO)
    for _ in range(MOST):
        assert unproven.room("/cmd_vel")
        unproven.wrote("/cmd_vel", AHEAD)


def test_what_others_say_proves_nothing():
    unproven = full()
    assert not unproven.echoed("/cmd_vel", TURN)
    assert not unproven.echoed("/other/cmd_vel", AHEAD)
    assert not unproven.room("/cmd_vel")


def test_an_echo_of_what_is_proven_already_is_still_an_answer():
    unproven = full()
    unproven.pinged(1)
    unproven.ponged(1)
    assert unproven.echoed("/cmd_vel", AHEAD)
    for _ in range(REMEMBERED):
        unproven.wrote("/cmd_vel", ZERO)
    unproven.pinged(2)
    unproven.ponged(2)
    assert not unproven.echoed("/cmd_vel", AHEAD)


def test_a_ping_that_is_answered_proves_what_was_written_before_it():
    unproven = Unproven()
    for _ in range(4):
        unproven.wrote("/cmd_vel", AHEAD)
    unproven.pinged(7)
    for _ in range(2):
        unproven.wrote("/cmd_vel", AHEAD)
    assert not unproven.room("/cmd_vel")
    unproven.ponged(7)
    for _ in range(4):
        assert unproven.room("/cmd_vel")
        unproven.wrote("/cmd_vel", AHEAD)
    assert not unproven.room("/cmd_vel")


def test_a_ping_that_is_answered_answers_for_those_before_it():
    unproven = Unproven()
    unproven.pinged(1)
    for _ in range(MOST):
        unproven.wrote("/cmd_vel", AHEAD)
    unproven.pinged(2)
    unproven.ponged(2)
    assert unproven.room("/cmd_vel")
    unproven.ponged(1)


def test_an_early_ping_proves_nothing_of_what_came_after_it():
    unproven = Unproven()
    unproven.pinged(1)
    for _ in range(MOST):
        unproven.wrote("/cmd_vel", AHEAD)
    unproven.ponged(1)
    assert not unproven.room("/cmd_vel")


def test_a_new_link_begins_anew():
    unproven = full()
    unproven.pinged(1)
    unproven.begin()
    assert unproven.room("/cmd_vel")
    assert not unproven.echoed("/cmd_vel", AHEAD)


@given(
    st.lists(
        st.sampled_from(["ahead", "turn", "zero", "deliver", "ping", "pong", "echo"]),
        max_size=200,
    )
)
def test_a_link_of_any_latency_never_holds_more_than_six(steps):
    """The link takes in order, and answers in order, whenever it likes."""
    unproven, link, back = Unproven(), [], []
    pings = 0
    twists = {"ahead": AHEAD, "turn": TURN, "zero": ZERO}
    for step in steps:
        if step in twists:
            twist = twists[step]
            if twist.is_zero or unproven.room("/cmd_vel"):
                unproven.wrote("/cmd_vel", twist)
                link.append(twist)
        elif step == "ping":
            pings += 1
            unproven.pinged(pings)
            link.append(pings)
        elif step == "deliver" and link:
            back.append(link.pop(0))
        elif step in ("pong", "echo") and back:
            answer = back.pop(0)
            if isinstance(answer, Twist):
                unproven.echoed("/cmd_vel", answer)
            else:
                unproven.ponged(answer)
        held = [what for what in link if isinstance(what, Twist) and not what.is_zero]
        assert len(held) <= MOST
