"""What an agent accepts from displays, and when the pages of a display end."""

from contextlib import suppress

import msgspec
import pytest
from agent_reports import REPORT

from equipment.declarations import declared
from webmap.agents import displays as displays_module
from webmap.agents import gate_messages
from webmap.agents.displays import Displays
from webmap.agents.gate_messages import Numbering, Order, PageState, SampleAck, StopAck
from webmap.agents.gates import AgentGate
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
    Hello,
    Holder,
    Identity,
    Ready,
    Rename,
    RobotGone,
    Speeds,
    Tick,
    WriterNodes,
)

PAGE = Connect("west/c1", "Ann", "operator")
PROGRAM = Connect("west/program", "the program", "operator", program=True)
ANN = PageState("c1", "Ann", "operator")
OWN = PageState("program", "the program", "operator")
STOP = b'{"op":"stop","robot":"*"}'
STOP_R1 = b'{"op":"stop","robot":"r1"}'


class West:
    """A display, and the agent that it reaches."""

    def __init__(self, **roles):
        self.displays = Displays({"": "operator"} | roles)
        self.numbering = Numbering()
        self.order = Order()

    def send(self, message, now=0.0, name="west", numbering=None):
        numbering = numbering or self.numbering
        sample = numbering.next(msgspec.msgpack.encode(message))
        return self.displays.receive(name, sample, now)

    def connects(self, *pages, now=0.0, name="west"):
        numbering = None if name == "west" else Numbering()
        return self.send(SampleAck(0, 0, pages), now, name, numbering)

    def receive(self, tick, now):
        self.order.take(self.displays.send(Tick(tick, {}), now))

    def answers(self, now, pages=None, reports=False):
        answer = SampleAck(self.order.session or 0, self.order.newest, pages, reports)
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
    assert west.connects(ANN) == [PAGE]
    assert west.connects(msgspec.structs.replace(ANN, speeds=(1.0, 2.0))) == [speeds]
    assert west.connects(msgspec.structs.replace(ANN, speeds=(1.0, 2.0))) == []
    assert west.send(command) == [command]
    assert west.displays.introduction() == [PAGE, speeds]


@pytest.mark.parametrize(
    "message",
    [
        declared(
            id="r1",
            name="Bob",
            bridge_url="ws://evil",
            twist_topic="/cmd_vel",
            v_max=100.0,
        ),
        Forget("r1"),
        WriterNodes("r1", ("/a",)),
        Heartbeat(),
        PAGE,
        Disconnect("west/c1"),
        Speeds("west/c1", 1.0, 2.0),
    ],
)
def test_a_display_can_declare_no_robot_and_send_nothing_else(west, message):
    with pytest.raises(WireError, match="display west: got no message"):
        west.send(message)


def test_a_new_name_of_a_page_does_not_connect_it_again(west):
    west.connects(ANN)
    west.connects(msgspec.structs.replace(ANN, speeds=(1.0, 2.0)))
    eva = msgspec.structs.replace(ANN, name="Eva", speeds=(1.0, 2.0))
    assert west.connects(eva) == [Rename("west/c1", "Eva")]
    ben = msgspec.structs.replace(eva, name="Ben", speeds=(2.0, 2.0))
    assert west.connects(ben) == [
        Rename("west/c1", "Ben"),
        Speeds("west/c1", 2.0, 2.0),
    ]
    assert len(west.connects(msgspec.structs.replace(ben, role="viewer"))) == 2


def test_a_display_cannot_pretend_to_be_a_person_of_another_one(west):
    page = msgspec.structs.replace(ANN, person="ben", page="p1")
    (connect,) = west.connects(page)
    assert connect.identity == Identity("west/ben", "p1")


def test_a_display_uses_only_connections_of_its_own(west):
    west.connects(ANN)
    assert west.connects(ANN, name="east") == [Connect("east/c1", "Ann", "operator")]
    assert west.send(FromPage("east/c1", b'{"op":"take","robot":"r1"}')) == []


def test_a_display_gives_its_pages_at_most_its_own_role():
    west = West(west="viewer")
    assert west.connects(ANN) == [Connect("west/c1", "Ann", "viewer")]


def test_a_message_of_an_unknown_page_is_dropped_but_stop_is_obeyed(west):
    assert west.send(FromPage("west/c7", b'{"op":"take","robot":"r1"}')) == []
    (stop, _) = west.send(FromPage("west/c7", STOP))
    assert stop == FromProgram(Stop(None))


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
    assert west.connects(OWN) == [PROGRAM]
    message = from_program(command)
    assert west.send(message) == [message]
    assert west.displays.introduction() == [PROGRAM]


@pytest.mark.parametrize("connection", ["program", "east/program", "west/c1", "west/"])
def test_a_program_uses_no_other_connection(west, connection):
    west.connects(ANN, OWN)
    with pytest.raises(WireError, match="display west: got"):
        west.send(from_program(Take("r1"), connection))


def move_for(page, x=1.0):
    return from_program(commands.MoveFor("r1", page, 5, x, 2.0, 0.5))


def test_a_program_sends_goals_for_pages_of_its_own_display_only(west):
    west.connects(ANN, OWN)
    message = move_for("west/c1")
    assert west.send(message) == [message]
    for page in ("east/c1", "c1", "west/c9"):
        with pytest.raises(WireError, match="in the name of"):
            west.send(move_for(page))
    with pytest.raises(WireError, match="expected within"):
        west.send(move_for("west/c1", x=1e9))


@pytest.mark.parametrize(
    "command",
    [
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
    west.connects(OWN)
    with pytest.raises(WireError, match="got a command of its program"):
        west.send(from_program(command))


def test_a_velocity_of_another_form_is_refused(west):
    west.connects(OWN)
    for velocity_ in ((0.5, 0.0), ("a", 0, 0, 0, 0, 0), None):
        with pytest.raises(WireError, match="got no message"):
            west.send(from_program(velocity(velocity=velocity_)))


def test_a_program_has_at_most_the_role_of_its_display():
    west = West(west="viewer")
    (got,) = west.connects(OWN)
    assert (got.role, got.program) == ("viewer", True)


def test_a_program_that_is_not_known_moves_nothing(west):
    assert west.send(from_program(Take("r1"))) == []
    assert west.send(from_program(velocity())) == []


def test_the_program_of_a_silent_display_ends_after_half_a_second(west):
    west.connects(ANN, OWN)
    west.reports_control_of("west/program")
    west.receive(1, 0.05)
    west.answers(0.1)
    assert west.displays.check(0.55) == []
    assert west.displays.check(0.56) == [Disconnect("west/program")]
    assert west.displays.check(0.6) == []
    assert west.send(from_program(velocity()), 0.7) == []
    west.reports_control_of("west/c1")
    assert west.displays.check(1.06) == [Disconnect("west/c1")]


def test_a_program_that_its_display_no_longer_lists_ends(west):
    west.connects(OWN)
    assert west.answers(0.0, ()) == [Disconnect("west/program")]


def test_the_role_is_that_of_the_user_and_counts_for_each_of_its_displays():
    displays = Displays({"": "viewer", "ann": "operator"})
    for user, role in (("ann", "operator"), ("bob", "viewer")):
        name = f"{user}.4f"
        hello = SampleAck(0, 0, (PageState("c1", "A page", "operator"),))
        sample = Numbering().next(msgspec.msgpack.encode(hello))
        (got,) = displays.receive(name, sample, 0.0)
        assert got.role == role


def test_a_page_that_the_display_no_longer_lists_ends(west):
    ben = PageState("c2", "Ben", "operator")
    west.connects(ANN, ben)
    assert west.connects(ben) == [Disconnect("west/c1")]
    assert west.displays.introduction() == [Connect("west/c2", "Ben", "operator")]


def test_pages_that_ended_while_the_display_was_slow_return_with_its_next_list(west):
    west.connects(ANN)
    assert west.displays.check(3.1) == [Disconnect("west/c1")]
    assert west.answers(3.1, (ANN, OWN)) == [PAGE, PROGRAM]


def test_a_page_that_has_missed_its_hello_gets_it_again(west):
    west.connects(ANN)
    waiting = msgspec.structs.replace(ANN, greeted=False)
    assert west.connects(waiting) == [], "the gate has not greeted it"
    west.displays.send(Hello("west/c1"), 0.0)
    assert west.connects(waiting) == [Hello("west/c1")]
    west.displays.send(Ready(7), 0.0)  # another gate, which greets it by itself
    assert west.connects(waiting) == []


def test_displays_that_ask_for_all_reports_again_and_again_get_them_with_pauses(west):
    assert not west.displays.wants_reports(0.5)
    sent = 0
    for step in range(100):
        assert west.answers(1.0, reports=True) == []
        sent += west.displays.wants_reports(1.0 + step / 100)
    assert sent == 5


# Who sends too much has less room, and all others have theirs. STOP always counts.


def test_displays_and_pages_that_a_user_pretends_leave_the_room_of_others(west):
    refused = 0
    for number in range(140):
        try:
            west.connects(ANN, name=f"eve.{number}")
        except WireError:
            refused += 1
    assert refused == 40
    many = [PageState(f"c{number}", "Eve", "operator") for number in range(250)]
    for number in range(5):
        got = west.connects(*many, name=f"mal.{number}")
        assert len(got) == gate_messages.MOST_PAGES
    assert west.connects(*many, name="mal.6") == []
    assert west.connects(ANN) == [PAGE]
    command = FromPage("west/c1", b'{"op":"take","robot":"r1"}')
    assert west.send(command) == [command]


def stops_of(messages):
    """Return for which robots messages to the gate are a STOP."""
    found = [each.command for each in messages if isinstance(each, FromProgram)]
    found += [commands.stop_in(m.text) for m in messages if isinstance(m, FromPage)]
    return [each.robot for each in found if isinstance(each, Stop)]


@pytest.mark.parametrize(
    "limit",
    [
        "users",
        "displays",
        "pages",
        "samples of a display",
        "samples of a user",
        "number",
        "session",
        "connection",
        "program",
    ],
)
def test_a_stop_is_obeyed_whatever_limit_is_reached(west, limit):
    west.reports_control_of(None)  # the robot is known
    name, message, numbering = "eve.1", FromPage("eve.1/c1", STOP_R1), Numbering(5)
    west.connects(ANN, name=name)
    match limit:
        case "users":
            name = "zoe.1"
            for number in range(60):
                west.connects(ANN, name=f"user{number}.1")
        case "displays":
            name = "eve.200"
            for number in range(2, 101):
                west.connects(ANN, name=f"eve.{number}")
            with pytest.raises(WireError):
                west.connects(ANN, name=name)
        case "pages":
            message = FromPage("eve.1/c199", STOP_R1)
        case "samples of a display" | "samples of a user":
            for number in range(5000):
                other = f"eve.{number % 9}" if limit.endswith("user") else name
                with suppress(WireError):
                    west.send(SampleAck(0, 0), 0.0, other, numbering)
            with pytest.raises(WireError, match="sends too much"):
                west.send(SampleAck(0, 0), 0.0, name, numbering)
        case "number":
            numbering.sent = (1 << 64) - 2
            west.send(SampleAck(0, 0), 0.0, name, numbering)
            numbering.sent = 3
        case "session":
            for _ in range(3):
                west.send(SampleAck(0, 0), 0.0, name, Numbering())
        case "connection":
            message = FromPage("west/c1", STOP_R1)
        case "program":
            message = FromProgram(Stop("r1"), 0, "eve.1/program")
    assert stops_of(west.send(message, 0.0, name, numbering)) == ["r1"]


def test_the_second_copy_of_a_stop_is_no_second_stop(west):
    west.connects(ANN)
    sample = west.numbering.next(msgspec.msgpack.encode(FromPage("west/c1", STOP)))
    took = StopAck("west", west.numbering.session, west.numbering.sent)
    assert west.displays.receive("west", sample, 0.0) == [
        FromPage("west/c1", STOP),
        took,
    ]
    west.connects(ANN)
    assert west.displays.receive("west", sample, 9.0) == []
    assert west.displays.waiting_stops() == []


def test_a_stop_of_an_unknown_page_is_kept_for_the_next_gate():
    gate, published = AgentGate(lambda sample: published.append(sample)), []
    sample = Numbering().next(msgspec.msgpack.encode(FromPage("eve.1/c1", STOP)))
    gate.take_sample("eve.1", sample)
    assert len(published) == 1, "the acknowledgement"
    assert gate.introduction() == [FromProgram(Stop(None))]


def test_a_flood_of_stops_is_few_stops_and_delays_none_of_another_user(west):
    west.reports_control_of(None)
    passed = []
    for number in range(2000):
        now = number / 1000
        text = b'{"op":"stop","robot":"%d"}' % number
        passed += west.send(FromPage("eve.1/c1", text), now, "eve.1")
        if number == 1000:
            message = FromPage("west/c1", STOP_R1)
            assert stops_of(west.send(message, now)) == ["r1"]
        if number % 50 == 49:  # a tick
            passed += west.displays.waiting_stops()
    assert stops_of(passed) == [None] * 80
    assert len(passed) < 130, "with the acknowledgements"


def test_a_stop_that_waits_for_a_tick_is_for_its_robot(west):
    west.reports_control_of(None)
    west.connects(ANN)
    message = FromPage("west/c1", STOP_R1)
    assert stops_of(west.send(message, 1.0)) == ["r1"]
    assert west.send(message, 1.01) == []
    assert west.displays.waiting_stops() == [FromProgram(Stop("r1"))]
    assert west.displays.waiting_stops() == []


def test_a_display_that_replaces_its_pages_all_the_time_sends_too_much(west):
    changed = 0
    for turn in range(50):
        pages = [PageState(f"c{turn}.{n}", "Ann", "operator") for n in range(100)]
        with suppress(WireError):
            changed += len(west.connects(*pages))
    assert changed < 1500


def test_a_command_and_a_list_have_a_greatest_size(west):
    west.connects(ANN)
    long = FromPage("west/c1", b"x" * displays_module.MOST_COMMAND)
    with pytest.raises(WireError, match="got a command of"):
        west.send(long)
    name = "\U0001f916" * gate_messages.MOST_NAME
    who = ("91c2b3a4f5", "0b7e0b7e0b")
    pages = [
        PageState(f"c{number:05}.12345", name, "operator", (0.5, 0.5), False, *who)
        for number in range(gate_messages.MOST_PAGES)
    ]
    assert len(west.connects(*pages)) == 1 + 2 * len(pages)
    answer = SampleAck(1 << 63, 1 << 63, tuple(pages), reports=True)
    assert len(msgspec.msgpack.encode(answer)) < gate_messages.MOST_SAMPLE - 16


def test_a_sample_that_comes_twice_or_late_is_dropped(west):
    first = west.numbering.next(msgspec.msgpack.encode(SampleAck(0, 0, (ANN,))))
    second = west.numbering.next(msgspec.msgpack.encode(SampleAck(0, 0, ())))
    assert west.displays.receive("west", second, 0.0) == []
    assert west.displays.receive("west", first, 0.0) == []
    assert west.displays.receive("west", second, 0.0) == []


def test_the_pages_of_a_silent_display_with_control_end_after_1_s(west):
    west.connects(ANN)
    west.reports_control_of("west/c1")
    west.receive(1, 0.05)
    west.answers(0.1)
    assert west.displays.check(1.05) == []
    assert west.displays.check(1.06) == [Disconnect("west/c1")]
    assert west.displays.check(1.2) == []


def test_control_that_begins_long_after_an_answer_is_not_ended_at_once(west):
    west.connects(ANN, OWN)
    west.receive(1, 0.05)
    west.answers(0.1)
    west.reports_control_of("west/program", 1.5)  # from another display
    west.reports_control_of("west/program", 1.7)
    assert west.displays.check(2.0) == []
    assert west.displays.check(2.01) == [Disconnect("west/program")]


@pytest.mark.parametrize("end", ["released", "gone", "of another"])
def test_the_pages_of_a_silent_display_without_control_end_after_3_s(west, end):
    west.connects(ANN, OWN)
    west.reports_control_of("east/c1" if end == "of another" else "west/c1")
    match end:
        case "released":
            west.reports_control_of(None)
        case "gone":
            west.displays.send(RobotGone("r1"), 0.0)
    west.receive(1, 0.05)
    west.answers(0.1)
    assert west.displays.check(3.05) == []
    ended = [Disconnect("west/c1"), Disconnect("west/program")]
    assert west.displays.check(3.06) == ended
    assert west.displays.check(3.2) == []


def test_an_answer_to_an_old_sample_is_no_sign_of_life(west):
    west.connects(ANN)
    west.reports_control_of("west/c1")
    for tick in range(30):
        west.receive(tick, 0.05 * tick)
    late = SampleAck(west.order.session, 2)  # sent at 0.05 s
    west.send(late, 1.5)
    assert west.displays.check(1.5) == [Disconnect("west/c1")]


def test_a_display_that_restarts_loses_its_pages(west):
    west.connects(ANN)
    west.numbering = Numbering()
    again = Connect("west/c2", "Ann", "operator")
    page = PageState("c2", "Ann", "operator")
    assert west.connects(page) == [Disconnect("west/c1"), again]


@pytest.mark.parametrize("message", [Heartbeat(), from_program(Take(""))])
def test_the_gate_hears_of_the_end_of_pages_after_a_bad_sample_of_a_new_session(
    west, message
):
    west.connects(ANN, OWN)
    west.numbering = Numbering()
    with pytest.raises(WireError):
        west.send(message)
    assert west.connects(ANN) == [
        Disconnect("west/c1"),
        Disconnect("west/program"),
        PAGE,
    ]


@pytest.mark.parametrize("sample", [b"", b"x" * 15, b"x" * 40, b"x" * 2_000_000])
def test_bytes_that_are_no_sample_are_refused(west, sample):
    with pytest.raises(WireError):
        west.displays.receive("west", sample, 0.0)
