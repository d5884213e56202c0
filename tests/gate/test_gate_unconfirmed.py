"""No more moving velocities are on their way to a robot than may come late."""

from hypothesis import given
from hypothesis import strategies as st

from webmap.base.geometry import Twist
from webmap.gate.lanes.control import MOST, REMEMBERED, UnconfirmedWrites

ZERO = Twist()
AHEAD = Twist(0.5)
TURN = Twist(0.0, 0.0, 0.5)


def full(*, topic="/cmd_vel", twist=AHEAD):
    unproven = UnconfirmedWrites()
    for _ in range(MOST):
        assert unproven.room(topic)
        unproven.on_written(topic, twist)
    assert not unproven.room(topic)
    return unproven


def test_six_may_be_on_their_way_and_no_more():
    assert MOST == 6
    full()


def test_each_robot_has_six_of_its_own():
    assert full().room("/other/cmd_vel")


def test_zeros_are_not_counted():
    unproven = UnconfirmedWrites()
    for _ in range(100):
        unproven.on_written("/cmd_vel", ZERO)
    assert unproven.room("/cmd_vel")


def test_an_echo_makes_room_for_one():
    unproven = full()
    unproven.echoed("/cmd_vel", AHEAD)
    assert unproven.room("/cmd_vel")
    unproven.on_written("/cmd_vel", AHEAD)
    assert not unproven.room("/cmd_vel")


def test_an_echo_proves_what_was_written_before_it_too():
    unproven = UnconfirmedWrites()
    for _ in range(MOST - 1):
        unproven.on_written("/cmd_vel", AHEAD)
    unproven.on_written("/cmd_vel", TURN)
    unproven.echoed("/cmd_vel", TURN)
    for _ in range(MOST):
        assert unproven.room("/cmd_vel")
        unproven.on_written("/cmd_vel", AHEAD)


def test_an_echo_of_zero_proves_nothing_as_others_say_zero_too():
    unproven = full()
    unproven.on_written("/cmd_vel", ZERO)
    unproven.echoed("/cmd_vel", ZERO)
    assert not unproven.room("/cmd_vel")


def test_what_others_say_proves_nothing():
    unproven = full()
    unproven.echoed("/cmd_vel", TURN)
    unproven.echoed("/other/cmd_vel", AHEAD)
    assert not unproven.room("/cmd_vel")


def test_an_echo_of_what_a_ping_has_proven_already_makes_no_room_for_another():
    unproven = full()
    unproven.on_ping(1, 0.0)
    unproven.on_pong(1)
    for _ in range(MOST):
        unproven.on_written("/cmd_vel", AHEAD)
    for _ in range(MOST):
        unproven.echoed("/cmd_vel", AHEAD)
        assert not unproven.room("/cmd_vel"), "it is that of an earlier one"
    unproven.echoed("/cmd_vel", AHEAD)
    assert unproven.room("/cmd_vel")


def test_echoes_that_never_come_are_not_waited_for_without_end():
    unproven = UnconfirmedWrites()
    for number in range(100):
        unproven.on_written("/cmd_vel", AHEAD)
        unproven.on_ping(number, 0.0)
        unproven.on_pong(number)
    assert len(unproven._unechoed["/cmd_vel"]) == REMEMBERED


def test_an_answer_tells_when_it_was_asked_for():
    unproven = UnconfirmedWrites()
    for number, at in enumerate((1.0, 1.5, 1.7)):
        unproven.on_ping(number, at)
    assert unproven.on_pong(1) == 1.5
    assert unproven.on_pong(2) == 1.7


def test_a_ping_that_is_answered_proves_what_was_written_before_it():
    unproven = UnconfirmedWrites()
    for _ in range(4):
        unproven.on_written("/cmd_vel", AHEAD)
    unproven.on_ping(7, 0.0)
    for _ in range(2):
        unproven.on_written("/cmd_vel", AHEAD)
    assert not unproven.room("/cmd_vel")
    unproven.on_pong(7)
    for _ in range(4):
        assert unproven.room("/cmd_vel")
        unproven.on_written("/cmd_vel", AHEAD)
    assert not unproven.room("/cmd_vel")


def test_a_ping_that_is_answered_answers_for_those_before_it():
    unproven = UnconfirmedWrites()
    unproven.on_ping(1, 0.0)
    for _ in range(MOST):
        unproven.on_written("/cmd_vel", AHEAD)
    unproven.on_ping(2, 0.0)
    unproven.on_pong(2)
    assert unproven.room("/cmd_vel")


def test_an_early_ping_proves_nothing_of_what_came_after_it():
    unproven = UnconfirmedWrites()
    unproven.on_ping(1, 0.0)
    for _ in range(MOST):
        unproven.on_written("/cmd_vel", AHEAD)
    unproven.on_pong(1)
    assert not unproven.room("/cmd_vel")


def test_a_new_link_begins_anew():
    unproven = full()
    unproven.on_ping(1, 0.0)
    unproven.begin()
    for _ in range(MOST):
        assert unproven.room("/cmd_vel")
        unproven.on_written("/cmd_vel", TURN)
    unproven.echoed("/cmd_vel", AHEAD)
    assert not unproven.room("/cmd_vel"), "that was said on the link before"


@given(
    st.lists(
        st.sampled_from(["ahead", "turn", "zero", "deliver", "ping", "pong", "echo"]),
        max_size=200,
    )
)
def test_a_link_of_any_latency_never_holds_more_than_six(steps):
    """The link takes in order, and answers in order, whenever it likes."""
    unproven, link, back = UnconfirmedWrites(), [], []
    pings = 0
    twists = {"ahead": AHEAD, "turn": TURN, "zero": ZERO}
    for step in steps:
        if step in twists:
            twist = twists[step]
            if twist.is_zero or unproven.room("/cmd_vel"):
                unproven.on_written("/cmd_vel", twist)
                link.append(twist)
        elif step == "ping":
            pings += 1
            unproven.on_ping(pings, 0.0)
            link.append(pings)
        elif step == "deliver" and link:
            back.append(link.pop(0))
        elif step in ("pong", "echo") and back:
            answer = back.pop(0)
            if isinstance(answer, Twist):
                unproven.echoed("/cmd_vel", answer)
            else:
                unproven.on_pong(answer)
        held = [what for what in link if isinstance(what, Twist) and not what.is_zero]
        assert len(held) <= MOST
