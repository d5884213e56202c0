"""The number of nonzero velocities that are on their way to a robot is limited."""

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


def test_at_most_six_velocities_may_be_unconfirmed():
    assert MOST == 6
    full()


def test_every_topic_may_have_six_unconfirmed_velocities():
    assert full().room("/other/cmd_vel")


def test_zeros_do_not_count_as_unconfirmed_velocities():
    unproven = UnconfirmedWrites()
    for _ in range(100):
        unproven.on_written("/cmd_vel", ZERO)
    assert unproven.room("/cmd_vel")


def test_an_echo_makes_room_for_one_velocity():
    unproven = full()
    unproven.echoed("/cmd_vel", AHEAD)
    assert unproven.room("/cmd_vel")
    unproven.on_written("/cmd_vel", AHEAD)
    assert not unproven.room("/cmd_vel")


def test_an_echo_also_confirms_the_velocities_written_before_it():
    unproven = UnconfirmedWrites()
    for _ in range(MOST - 1):
        unproven.on_written("/cmd_vel", AHEAD)
    unproven.on_written("/cmd_vel", TURN)
    unproven.echoed("/cmd_vel", TURN)
    for _ in range(MOST):
        assert unproven.room("/cmd_vel")
        unproven.on_written("/cmd_vel", AHEAD)


def test_an_echo_of_zero_confirms_nothing():
    unproven = full()
    unproven.on_written("/cmd_vel", ZERO)
    unproven.echoed("/cmd_vel", ZERO)
    assert not unproven.room("/cmd_vel")


def test_velocities_of_other_programs_and_topics_confirm_nothing():
    unproven = full()
    unproven.echoed("/cmd_vel", TURN)
    unproven.echoed("/other/cmd_vel", AHEAD)
    assert not unproven.room("/cmd_vel")


def test_an_echo_of_a_velocity_already_confirmed_by_a_ping_makes_no_room():
    unproven = full()
    unproven.on_ping(1, 0.0)
    unproven.on_pong(1)
    for _ in range(MOST):
        unproven.on_written("/cmd_vel", AHEAD)
    for _ in range(MOST):
        unproven.echoed("/cmd_vel", AHEAD)
        assert not unproven.room("/cmd_vel"), "the echo of an earlier velocity"
    unproven.echoed("/cmd_vel", AHEAD)
    assert unproven.room("/cmd_vel")


def test_the_memory_of_velocities_without_an_echo_is_limited():
    unproven = UnconfirmedWrites()
    for number in range(100):
        unproven.on_written("/cmd_vel", AHEAD)
        unproven.on_ping(number, 0.0)
        unproven.on_pong(number)
    assert len(unproven._unechoed["/cmd_vel"]) == REMEMBERED


def test_a_ping_answer_gives_the_time_when_the_ping_was_written():
    unproven = UnconfirmedWrites()
    for number, at in enumerate((1.0, 1.5, 1.7)):
        unproven.on_ping(number, at)
    assert unproven.on_pong(1) == 1.5
    assert unproven.on_pong(2) == 1.7


def test_a_ping_answer_confirms_the_velocities_written_before_the_ping():
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


def test_a_ping_answer_confirms_velocities_although_an_earlier_ping_has_no_answer():
    unproven = UnconfirmedWrites()
    unproven.on_ping(1, 0.0)
    for _ in range(MOST):
        unproven.on_written("/cmd_vel", AHEAD)
    unproven.on_ping(2, 0.0)
    unproven.on_pong(2)
    assert unproven.room("/cmd_vel")


def test_a_ping_answer_does_not_confirm_velocities_written_after_the_ping():
    unproven = UnconfirmedWrites()
    unproven.on_ping(1, 0.0)
    for _ in range(MOST):
        unproven.on_written("/cmd_vel", AHEAD)
    unproven.on_pong(1)
    assert not unproven.room("/cmd_vel")


def test_a_new_link_forgets_the_velocities_of_the_old_link():
    unproven = full()
    unproven.on_ping(1, 0.0)
    unproven.begin()
    for _ in range(MOST):
        assert unproven.room("/cmd_vel")
        unproven.on_written("/cmd_vel", TURN)
    unproven.echoed("/cmd_vel", AHEAD)
    assert not unproven.room("/cmd_vel"), "an echo of the old link"


@given(
    st.lists(
        st.sampled_from(["ahead", "turn", "zero", "deliver", "ping", "pong", "echo"]),
        max_size=200,
    )
)
def test_a_link_of_any_latency_never_holds_more_than_six_nonzero_velocities(steps):
    """The link delivers and answers in order, after any delay."""
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
