"""What an agent accepts from displays, and when the pages of a display end."""

import msgspec
import pytest
from agent_reports import REPORT

from webmap.agents.displays import Answer, Displays, ReportAll, Unknown
from webmap.agents.samples import Numbering, Order
from webmap.base.errors import WireError
from webmap.gate import commands
from webmap.gate.commands import Stop, Take
from webmap.gate.protocol import (
    Connect,
    Disconnect,
    Forget,
    FromPage,
    FromProgram,
    Heartbeat,
    Holder,
    RobotGone,
    RobotSpec,
    Speeds,
    Tick,
    WriterNodes,
)

PAGE = Connect("west/c1", "Ann", "operator")
PROGRAM = Connect("west/program", "the program", "operator", program=True)
STOP = b'{"op":"stop","robot":"*"}'


class West:
    """A display, and the agent that it reaches."""

    def __init__(self, **roles):
        self.displays = Displays({"": "operator"} | roles)
        self.numbering = Numbering()
        self.order = Order()

    def send(self, message, now=0.0):
        sample = self.numbering.next(msgspec.msgpack.encode(message))
        return self.displays.receive("west", sample, now)

    def receive(self, tick, now):
        self.order.take(self.displays.send(Tick(tick, {}), now))

    def answers(self, now, connections=None):
        answer = Answer(self.order.session or 0, self.order.newest, connections)
        return self.send(answer, now)

    def reports_control_of(self, connection, now=0.0):
        holder = None if connection is None else Holder(connection, "Ann")
        report = msgspec.structs.replace(REPORT, holder=holder)
        self.displays.send(report, now)


@pytest.fixture
def west():
    return West()


def test_a_page_and_its_commands_reach_the_gate(west):
    speeds = Speeds("west/c1", 1.0, 2.0)
    command = FromPage("west/c1", b'{"op":"take","robot":"r1"}')
    assert [west.send(each) for each in (PAGE, speeds, command)] == [
        [PAGE],
        [speeds],
        [command],
    ]
    assert west.displays.introduction() == [PAGE, speeds]


@pytest.mark.parametrize(
    "message",
    [
        RobotSpec(id="r1", name="Bob", bridge_url="ws://evil", v_max=100.0),
        Forget("r1"),
        WriterNodes("r1", ("/a",)),
        Heartbeat(),
    ],
)
def test_a_display_can_declare_no_robot_and_send_nothing_else(west, message):
    with pytest.raises(WireError, match="display west: got no message"):
        west.send(message)


def test_a_display_uses_only_connections_of_its_own(west):
    with pytest.raises(WireError, match="expected one that begins with west/"):
        west.send(Connect("east/c1", "Ann", "operator"))


def test_a_display_gives_its_pages_at_most_its_own_role():
    west = West(west="viewer")
    assert west.send(PAGE) == [Connect("west/c1", "Ann", "viewer")]


def test_a_message_of_an_unknown_page_is_dropped_but_stop_is_obeyed(west):
    assert west.send(FromPage("west/c7", b'{"op":"take","robot":"r1"}')) == []
    assert west.send(FromPage("west/c7", STOP)) == [FromProgram(Stop(None))]


def velocity(**changes):
    fields = {
        "robot": "r1",
        "epoch": 3,
        "tick": 5,
        "velocity": (0.5, 0.0, 0.0, 0.0, 0.0, 0.0),
    }
    return commands.SetVelocity(**fields | changes)


def from_program(command, connection="west/program"):
    return FromProgram(command, 4, connection)


@pytest.mark.parametrize(
    "command",
    [
        Take("r1"),
        commands.Release("r1"),
        velocity(),
        commands.Goal("r1", 3, 0, 5, 1.0, 2.0, 0.5),
        commands.Locate("r1", 3, 0, 5, 1.0, 2.0, 0.5),
    ],
)
def test_the_commands_of_a_program_reach_the_gate_under_its_connection(west, command):
    assert west.send(PROGRAM) == [PROGRAM]
    message = from_program(command)
    assert west.send(message) == [message]
    assert west.displays.introduction() == [PROGRAM]


@pytest.mark.parametrize("connection", ["program", "east/program", "west/c1", "west/"])
def test_a_program_uses_no_other_connection(west, connection):
    west.send(PAGE)
    west.send(PROGRAM)
    hello = Connect(connection, "Ann", "operator", program=True)
    for message in (hello, from_program(Take("r1"), connection)):
        with pytest.raises(WireError, match="display west: got"):
            west.send(message)
    assert west.displays.introduction() == [PAGE, PROGRAM]


def test_no_page_uses_the_connection_of_a_program(west):
    with pytest.raises(WireError, match="got a page as 'west/program'"):
        west.send(Connect("west/program", "Ann", "operator"))


@pytest.mark.parametrize(
    "command",
    [
        Stop("r1"),
        commands.Reset("r1", "5f"),
        commands.Cancel("r1"),
        Take("r" * 65),
        Take(""),
        velocity(epoch=-1),
        velocity(robot="r\n1"),
        commands.Goal("r1", 3, 0, 5, 1e9, 2.0, 0.5),
        commands.Locate("r1", 3, 0, 5, float("nan"), 2.0, 0.5),
    ],
)
def test_what_a_page_could_not_send_or_needs_no_control_is_refused(west, command):
    west.send(PROGRAM)
    with pytest.raises(WireError, match="got a command of its program"):
        west.send(from_program(command))


def test_a_velocity_of_another_form_is_refused(west):
    west.send(PROGRAM)
    for velocity_ in ((0.5, 0.0), ("a", 0, 0, 0, 0, 0), None):
        with pytest.raises(WireError, match="got no message"):
            west.send(from_program(velocity(velocity=velocity_)))


def test_a_program_has_at_most_the_role_of_its_display():
    west = West(west="viewer")
    (got,) = west.send(PROGRAM)
    assert (got.role, got.program) == ("viewer", True)


def test_a_program_that_is_not_known_moves_nothing_and_is_asked_for(west):
    assert west.send(from_program(Take("r1"))) == []
    assert west.send(from_program(velocity())) == []
    assert west.displays.unknown("west") is None, (
        "a new introduction would end its control"
    )
    assert west.answers(0.0, ("west/program",)) == []
    assert west.displays.unknown("west") == Unknown("west", ("west/program",))
    assert west.send(FromPage("west/program", STOP)) == [FromProgram(Stop(None))]


def test_the_program_of_a_silent_display_ends_after_half_a_second(west):
    west.send(PAGE, 0.0)
    west.send(PROGRAM, 0.0)
    west.reports_control_of("west/program")
    west.receive(1, 0.05)
    west.answers(0.1)
    assert west.displays.look(0.55) == []
    assert west.displays.look(0.56) == [Disconnect("west/program")]
    assert west.displays.look(0.6) == []
    assert west.send(from_program(velocity()), 0.7) == []
    west.reports_control_of("west/c1")
    assert west.displays.look(1.06) == [Disconnect("west/c1")]


def test_a_program_that_its_display_no_longer_lists_ends(west):
    west.send(PROGRAM)
    assert west.answers(0.0, ()) == [Disconnect("west/program")]


def test_the_role_is_that_of_the_user_and_counts_for_each_of_its_displays():
    displays = Displays({"": "viewer", "ann": "operator"})
    for user, role in (("ann", "operator"), ("bob", "viewer")):
        name = f"{user}.4f"
        hello = Connect(f"{name}/c1", "A page", "operator")
        sample = Numbering().next(msgspec.msgpack.encode(hello))
        (got,) = displays.receive(name, sample, 0.0)
        assert got.role == role


def test_a_page_that_the_display_no_longer_lists_ends(west):
    other = Connect("west/c2", "Ben", "operator")
    west.send(PAGE)
    west.send(other)
    assert west.answers(0.0, ("west/c2",)) == [Disconnect("west/c1")]
    assert west.displays.introduction() == [other]


def test_pages_that_ended_while_the_display_was_slow_are_asked_for(west):
    west.send(PAGE, 0.0)
    west.displays.look(3.1)
    west.answers(3.1, ("west/c1", "west/program"))
    unknown = west.displays.unknown("west")
    assert unknown == Unknown("west", ("west/c1", "west/program"))
    assert west.displays.unknown("west") is None


def test_a_display_that_lost_a_sample_gets_all_reports_once(west):
    assert not west.displays.wants_reports(1.0)
    assert west.send(ReportAll()) == []
    assert west.displays.wants_reports(1.0)
    assert not west.displays.wants_reports(1.0)


def test_displays_that_ask_for_all_reports_again_and_again_get_them_with_pauses(west):
    sent = 0
    for step in range(100):
        assert west.send(ReportAll()) == []
        sent += west.displays.wants_reports(1.0 + step / 100)
    assert sent == 5


def test_an_agent_remembers_a_bounded_number_of_displays(monkeypatch):
    monkeypatch.setattr("webmap.agents.displays.MOST_DISPLAYS", 2)
    displays = Displays()

    def connect(name):
        hello = Connect(f"{name}/c1", "Ann", "operator")
        return displays.receive(
            name, Numbering().next(msgspec.msgpack.encode(hello)), 0.0
        )

    connect("a")
    connect("b")
    with pytest.raises(WireError, match="more than 2 displays"):
        connect("c")
    displays.look(3.1)
    assert connect("c")


def test_a_sample_that_comes_twice_or_late_is_dropped(west):
    first = west.numbering.next(msgspec.msgpack.encode(PAGE))
    second = west.numbering.next(msgspec.msgpack.encode(Disconnect("west/c1")))
    assert west.displays.receive("west", second, 0.0) == []
    assert west.displays.receive("west", first, 0.0) == []
    assert west.displays.receive("west", second, 0.0) == []


def test_the_pages_of_a_silent_display_with_control_end_after_1_s(west):
    west.send(PAGE, 0.0)
    west.reports_control_of("west/c1")
    west.receive(1, 0.05)
    west.answers(0.1)
    assert west.displays.look(1.05) == []
    assert west.displays.look(1.06) == [Disconnect("west/c1")]
    assert west.displays.look(1.2) == []


def test_control_that_begins_long_after_an_answer_is_not_ended_at_once(west):
    west.send(PAGE, 0.0)
    west.send(PROGRAM, 0.0)
    west.receive(1, 0.05)
    west.answers(0.1)
    west.reports_control_of("west/program", 1.5)  # from another display
    west.reports_control_of("west/program", 1.7)
    assert west.displays.look(2.0) == []
    assert west.displays.look(2.01) == [Disconnect("west/program")]


@pytest.mark.parametrize("end", ["released", "gone", "of another"])
def test_the_pages_of_a_silent_display_without_control_end_after_3_s(west, end):
    west.send(PAGE, 0.0)
    west.send(PROGRAM, 0.0)
    west.reports_control_of("east/c1" if end == "of another" else "west/c1")
    match end:
        case "released":
            west.reports_control_of(None)
        case "gone":
            west.displays.send(RobotGone("r1"), 0.0)
    west.receive(1, 0.05)
    west.answers(0.1)
    assert west.displays.look(3.05) == []
    ended = [Disconnect("west/c1"), Disconnect("west/program")]
    assert west.displays.look(3.06) == ended
    assert west.displays.look(3.2) == []


def test_an_answer_to_an_old_sample_is_no_sign_of_life(west):
    west.send(PAGE, 0.0)
    west.reports_control_of("west/c1")
    for tick in range(30):
        west.receive(tick, 0.05 * tick)
    late = Answer(west.order.session, 2)  # sent at 0.05 s
    west.send(late, 1.5)
    assert west.displays.look(1.5) == [Disconnect("west/c1")]


def test_a_display_that_restarts_loses_its_pages(west):
    west.send(PAGE)
    west.numbering = Numbering()
    again = Connect("west/c2", "Ann", "operator")
    assert west.send(again) == [Disconnect("west/c1"), again]


@pytest.mark.parametrize("sample", [b"", b"x" * 15, b"x" * 40, b"x" * 2_000_000])
def test_bytes_that_are_no_sample_are_refused(west, sample):
    with pytest.raises(WireError):
        west.displays.receive("west", sample, 0.0)
