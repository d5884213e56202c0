"""The display's side of the gate of an agent, without a network."""

import json
import random
import threading

import msgspec
import pytest
from agent_reports import NAME, REPORT

from equipment.declarations import declared
from webmap.agents.displays import Displays
from webmap.agents.gate_messages import (
    AllReports,
    FromDisplay,
    SampleAck,
    StopAck,
)
from webmap.agents.remote_gate import RemoteGate
from webmap.base.errors import WireError
from webmap.gate import commands
from webmap.gate.protocol import (
    MAY_MOVE,
    CloseConnection,
    Connect,
    Disconnect,
    Forget,
    FromPage,
    FromProgram,
    GateDown,
    Hello,
    Holder,
    Identity,
    Ready,
    Refused,
    RefusedCount,
    Rename,
    RobotGone,
    RobotReport,
    SentTwist,
    Speeds,
    TakeReply,
    Tick,
)

LIMITS = Speeds(f"{NAME}/c1", 0.5, 1.0)
PAGE = Connect(f"{NAME}/c1", "Ann", "operator")
PROGRAM = Connect(f"{NAME}/program", f"program of {NAME}", "operator", program=True)
STOP = FromPage(f"{NAME}/c1", b'{"op":"stop","robot":"r1"}')


class Owner:
    def __init__(self):
        self.received = []

    def introduction(self):
        robots = [
            declared(id=id, name="Bob", bridge_url="zenoh://h/bay3", goal_topic="/goal")
            for id in ("r1", "r2")
        ]
        return [*robots, PAGE]

    def hear(self, message):
        self.received.append(message)

    def gone(self, down):
        self.received.append(down)

    def of(self, kind):
        return [message for message in self.received if isinstance(message, kind)]


class Bench:
    """A display and its agent; samples arrive when the test delivers them."""

    def __init__(self):
        self.owner = Owner()
        self.sent = []
        self.ways = []
        self.displays = Displays()
        self.router_trouble = None
        self.far = RemoteGate(
            "bay3",
            NAME,
            self.owner,
            threading.RLock(),
            self.publish,
            lambda: self.router_trouble,
        )

    def publish(self, sample, only):
        self.sent.append(sample)
        self.ways.append(only)

    def receive(self, message, now=0.0):
        self.far.take(self.displays.send(message, now), now)

    def arrive(self, now=0.0):
        samples, self.sent[:] = list(self.sent), []
        return [
            message
            for sample in samples
            for message in self.displays.receive(NAME, sample, now)
        ]


@pytest.fixture
def bench():
    return Bench()


@pytest.fixture
def connected(bench):
    bench.receive(Tick(1, {}))
    assert bench.arrive() == [PROGRAM, PAGE]
    bench.receive(Hello(PAGE.connection))
    bench.receive(AllReports((), ()))
    return bench


def test_a_new_name_and_the_identity_of_a_page_reach_the_agent(connected):
    who = Identity("91c2", "p1")
    connected.far.send(Connect(f"{NAME}/c2", "Ben", "operator", identity=who))
    connected.far.beat(0.0)
    (connect,) = connected.arrive()
    assert connect.identity == Identity(f"{NAME}/91c2", "p1")
    connected.far.send(Rename(f"{NAME}/c2", "Eva"))
    connected.far.beat(0.0)
    assert connected.arrive() == [Rename(f"{NAME}/c2", "Eva")]


def test_the_first_sample_introduces_the_pages_and_no_robot(bench):
    assert not bench.far.ready
    assert bench.far.trouble == "waiting for the agent bay3"
    bench.receive(Tick(1, {}))
    assert bench.far.ready
    assert bench.far.trouble is None
    assert bench.arrive() == [PROGRAM, PAGE]
    assert bench.owner.received == [Ready(0), Tick(1, {})]


def test_a_tick_is_as_long_with_many_pages_that_only_look_and_reaches_each(connected):
    acks = {PAGE.connection: -1, "program": -1}
    few = connected.displays.send(Tick(2, acks), 0.0)
    many = {f"east.{number}/c1": -1 for number in range(100)}
    assert len(connected.displays.send(Tick(3, acks | many), 0.0)) == len(few)
    connected.receive(Tick(4, acks))
    connected.receive(Tick(5, {**acks, PAGE.connection: 7}))
    assert connected.owner.received[-2:] == [
        Tick(4, {PAGE.connection: -1}),
        Tick(5, {PAGE.connection: 7}),
    ]


def test_a_page_that_the_agent_has_not_greeted_gets_no_tick(bench):
    bench.receive(Tick(1, {}))
    bench.receive(Tick(2, {}))
    assert bench.owner.received[-1] == Tick(2, {})
    bench.receive(Hello(PAGE.connection))
    bench.receive(Tick(3, {}))
    assert bench.owner.received[-1] == Tick(3, {PAGE.connection: -1})


def test_declarations_stay_here(connected):
    connected.far.send(
        declared(id="r1", name="Bob", bridge_url="ws://evil", goal_topic="/goal")
    )
    connected.far.send(Forget("r1"))
    assert connected.arrive() == []


def test_nothing_is_sent_before_the_agent_is_heard(bench):
    bench.far.send(FromPage(PAGE.connection, b'{"op":"take","robot":"r1"}'))
    assert bench.sent == []


@pytest.mark.parametrize("text", [STOP.text, b'{"robot":"r1","op":"stop"}'])
def test_a_stop_is_sent_again_until_the_agent_has_it(connected, text):
    stop = FromPage(PAGE.connection, text)
    connected.far.send(stop)
    connected.sent.clear()  # lost
    for now in (0.05, 0.1):
        connected.far.beat(now)
    got, took = connected.arrive(0.1)
    assert got == stop
    connected.receive(StopAck(NAME, took.session, took.number - 1), 0.12)  # of another
    connected.far.beat(0.25)
    got, took = connected.arrive(0.25)
    assert got == stop
    connected.receive(took, 0.3)
    connected.far.beat(0.45)
    assert connected.arrive(0.45) == []


def test_the_acknowledgement_of_another_display_ends_nothing(connected):
    connected.far.send(STOP)
    _, took = connected.arrive()
    connected.receive(StopAck("ben.5e", took.session, took.number), 0.05)
    connected.far.beat(0.15)
    assert STOP in connected.arrive(0.15)


def test_a_silent_agent_is_lost_and_its_robots_are_reported_as_unreachable(connected):
    connected.receive(REPORT, 0.1)
    connected.far.beat(0.59)
    assert connected.owner.of(GateDown) == []
    connected.far.beat(0.61)
    (down,) = connected.owner.of(GateDown)
    assert down.why == "no connection to the agent bay3"
    last = connected.owner.of(RobotReport)[-1]
    assert (last.link, last.holder, last.epoch, last.armable) == (
        "down",
        None,
        None,
        False,
    )
    assert last.reason == down.why
    connected.far.send(STOP)
    assert connected.arrive(0.7) == []


def test_the_reports_name_the_router_as_soon_as_it_is_known_to_be_lost(connected):
    connected.receive(REPORT, 0.1)
    connected.far.beat(0.61)
    connected.router_trouble = "no connection to the router at tcp/h:7447"
    for now in (9.0, 9.1):
        connected.far.beat(now)
    reasons = [each.reason for each in connected.owner.of(RobotReport)[-2:]]
    assert reasons == ["no connection to the agent bay3", connected.router_trouble]
    assert connected.owner.of(RobotReport)[-1].alarm == MAY_MOVE
    assert len(connected.owner.of(GateDown)) == 1
    connected.router_trouble = None
    connected.far.beat(9.2)
    assert (
        connected.owner.of(RobotReport)[-1].reason == "no connection to the agent bay3"
    )


@pytest.mark.parametrize(
    ("changes", "alarm"),
    [
        ({}, MAY_MOVE),
        ({"state": "stopping"}, MAY_MOVE),
        ({"state": "held", "measured": (0.3, 0, 0, 0, 0, 0)}, MAY_MOVE),
        ({"state": "held", "measured": (0.0,) * 6}, None),
        ({"holder": Holder(f"{NAME}/program", "program")}, MAY_MOVE),
        ({"holder": Holder("ben.5e/c1", "Ben")}, None),
        ({"holder": None, "state": "free"}, None),
        ({"stop_time": 0.4}, None),
    ],
)
def test_who_drives_a_robot_of_a_silent_agent_gets_the_alarm_that_it_may_move_on(
    connected, changes, alarm
):
    connected.receive(msgspec.structs.replace(REPORT, **changes), 0.1)
    connected.far.beat(0.61)
    last = connected.owner.of(RobotReport)[-1]
    assert (last.link, last.alarm) == ("down", alarm)
    timeout = "the base stops by its own command timeout of 0.40 s"
    assert (timeout in last.reason) == ("stop_time" in changes)
    connected.receive(AllReports((REPORT,), ("r1",)), 5.0)
    assert connected.owner.of(RobotReport)[-1].alarm is None


def test_an_agent_that_returns_gets_the_pages_and_a_kept_stop_again(connected):
    connected.far.send(STOP)
    connected.sent.clear()
    connected.far.beat(0.6)
    connected.sent.clear()
    connected.receive(Tick(9, {}), 5.0)
    connected.far.beat(5.05)
    got = connected.arrive(5.05)
    assert [each for each in got if not isinstance(each, StopAck)] == [
        Disconnect(PROGRAM.connection),
        Disconnect(PAGE.connection),
        PROGRAM,
        PAGE,
        STOP,
    ]


@pytest.mark.parametrize("how", ["agent", "gate"])
def test_a_restart_ends_all_leases(connected, how):
    connected.receive(REPORT, 0.1)
    if how == "agent":
        connected.displays = Displays()
        connected.receive(Tick(1, {}), 0.2)
    else:
        connected.receive(Ready(7), 0.2)
    (down,) = connected.owner.of(GateDown)
    assert down.why == "the gate of the agent bay3 has restarted"
    assert PAGE in connected.arrive(0.2)


def test_lost_samples_make_the_display_ask_for_all_reports(connected):
    assert connected.displays.wants_reports(0.0), "at the beginning"
    connected.displays.send(Tick(2, {}), 0.1)  # lost
    connected.receive(Tick(3, {}), 0.25)
    connected.arrive()
    assert connected.displays.wants_reports(0.25)


def test_all_reports_come_as_one_sample(connected):
    other = msgspec.structs.replace(REPORT, robot="r2")
    connected.receive(AllReports((REPORT, other), ("r1", "r2")), 0.1)
    assert connected.owner.of(RobotReport) == [REPORT, other]


def test_a_gate_that_has_just_started_removes_no_robot(connected):
    connected.receive(REPORT)
    connected.receive(AllReports((), ("r1",)), 0.1)
    assert connected.owner.of(RobotGone) == []


def test_all_pages_are_listed_again_each_second(connected):
    for now in (0.05, 0.15, 0.2):
        connected.far.beat(now)
    connected.sent.clear()
    connected.receive(Tick(2, {}), 1.0)
    connected.far.beat(0.95)
    assert connected.sent == []
    connected.far.beat(1.0)
    (sample,) = connected.sent
    answer = msgspec.msgpack.decode(sample[16:], type=FromDisplay)
    assert [page.id for page in answer.pages] == ["program", "c1"]


def test_samples_that_are_none_are_refused(connected):
    with pytest.raises(WireError):
        connected.far.take(b"x" * 40, 0.0)


@pytest.mark.parametrize(
    ("command", "text"),
    [
        (commands.Stop(None), {"op": "stop", "robot": "*"}),
        (commands.Reset("r1", "5f"), {"op": "reset", "robot": "r1", "stop": "5f"}),
        (commands.Cancel("r1"), {"op": "cancel", "robot": "r1"}),
    ],
)
def test_a_program_stops_resets_and_cancels_at_an_agent(connected, command, text):
    connected.far.send(FromProgram(command))
    got = next(each for each in connected.arrive() if not isinstance(each, StopAck))
    assert got.connection == PROGRAM.connection or got == FromProgram(command)
    if isinstance(got, FromPage):
        assert json.loads(got.text) == text


@pytest.mark.parametrize(
    "command",
    [
        commands.Take("r1"),
        commands.Release("r1"),
        commands.SetVelocity("r1", 3, 5, (0.5, 0.0, 0.1, 0.0, 0.0, 0.0)),
        commands.Goal("r1", 3, 0, 5, 1.0, 2.0, 0.5),
        commands.Locate("r1", 3, 0, 5, 1.0, 2.0, 0.5),
    ],
)
def test_a_program_controls_a_robot_of_an_agent_under_its_connection(
    connected, command
):
    connected.far.send(FromProgram(command, 4))
    assert connected.arrive() == [FromProgram(command, 4, PROGRAM.connection)]


def test_the_reply_of_the_agent_to_a_program_is_passed_on(connected):
    reply = TakeReply(4, "r1", 3, None, PROGRAM.connection)
    connected.receive(reply)
    assert connected.owner.of(TakeReply) == [reply]


def test_an_agent_that_returns_hears_of_the_program_anew_which_ends_its_control(
    connected,
):
    connected.arrive()
    connected.far.beat(0.6)  # the agent was silent
    connected.sent.clear()
    connected.receive(Tick(9, {}), 0.7)
    got = connected.arrive(0.7)
    assert got.index(Disconnect(PROGRAM.connection)) < got.index(PROGRAM)


def answers(bench, begin, seconds=1.0):
    """Return how many samples the display sends to an agent that sends ticks."""
    bench.sent.clear()
    for step in range(round(20 * seconds)):
        now = begin + step / 20
        bench.receive(Tick(2, {}), now)
        bench.far.beat(now)
    return len(bench.sent)


def test_a_display_answers_more_often_while_a_page_has_control_or_commands(connected):
    connected.receive(msgspec.structs.replace(REPORT, holder=None), 0.0)
    assert answers(connected, 1.0) == 1, "with the list of pages"
    connected.far.send(FromPage(PAGE.connection, b'{"op":"take"}'))
    assert answers(connected, 1.95) == 20
    assert answers(connected, 4.0) == 1
    connected.receive(REPORT, 5.0)  # a page has control
    assert answers(connected, 5.0) == 20


def test_an_idle_display_answers_over_its_connections_in_turn(connected):
    connected.receive(msgspec.structs.replace(REPORT, holder=None), 0.0)
    connected.ways.clear()
    assert answers(connected, 1.0, 4.0) == 4
    assert [way % 2 for way in connected.ways] in ([0, 1, 0, 1], [1, 0, 1, 0])
    connected.receive(REPORT, 5.0)  # a page has control
    connected.ways.clear()
    answers(connected, 5.0)
    assert set(connected.ways) == {None}


def test_the_first_command_of_an_idle_display_follows_an_answer(connected):
    """Without a recent answer the agent would end the control at once."""
    connected.arrive()
    take = FromPage(PAGE.connection, b'{"op":"take","robot":"r1"}')
    connected.receive(Tick(2, {}), 2.9)
    connected.far.send(take)
    assert connected.arrive(2.95) == [take]
    connected.receive(REPORT, 2.95)
    assert connected.displays.check(3.0) == []
    connected.sent.clear()
    connected.far.send(take)
    assert len(connected.sent) == 1


# What an agent says reaches its own robots and those who commanded them.


def test_the_words_of_an_agent_reach_only_pages_that_commanded_its_robots(connected):
    connected.receive(REPORT)
    words = Refused(PAGE.connection, None, "drive", "the agent heard nothing" * 100)
    connected.receive(words)
    stop_all = FromPage(PAGE.connection, b'{"op":"stop","robot":"*"}')
    connected.far.send(stop_all)
    connected.receive(words)
    connected.receive(Hello(PAGE.connection))
    assert connected.owner.of(Refused) == []
    connected.far.send(FromPage(PAGE.connection, b'{"op":"take","robot":"r1"}'))
    connected.receive(words)
    (got,) = connected.owner.of(Refused)
    assert got.robot is None
    assert got.why.startswith("agent bay3: the agent heard nothing")
    assert len(got.why) < 350


def test_an_agent_closes_no_page_that_drives_its_robots(connected):
    connected.receive(REPORT)
    connected.far.send(FromPage(PAGE.connection, b'{"op":"take","robot":"r1"}'))
    connected.receive(CloseConnection(PAGE.connection, "too many messages"))
    assert connected.owner.of(CloseConnection) == []


# A lost sample leaves no lasting error.


class Lossy(Bench):
    """A display and an agent with its gate; each sample can be lost on its way."""

    def __init__(self, seed):
        super().__init__()
        self.gate = {}
        self.lost, self.random = set(), random.Random(seed)
        """The kinds of samples of which the next is lost, perhaps several."""
        self.robots = {}
        self.now = 0.0

    def is_lost(self, message):
        kind = type(message).__name__
        if isinstance(message, SampleAck):
            kind = "list" if message.pages is not None else "answer"
        if kind not in self.lost:
            return False
        if self.random.random() < 0.7:
            self.lost.discard(kind)
        return True

    def report(self, message):
        match message:
            case RobotReport(robot=robot):
                self.robots[robot] = message
            case RobotGone(robot):
                del self.robots[robot]
        sample = self.displays.send(message, self.now)
        if not self.is_lost(message):
            self.far.take(sample, self.now)

    def obey(self, messages):
        for message in messages:
            match message:
                case Connect(connection):
                    self.gate[connection] = None
                    self.report(Hello(connection))
                case Disconnect(connection):
                    self.gate.pop(connection)
                case Speeds(connection, v, w):
                    self.gate[connection] = (v, w)
                case FromPage(_, text) if b"stop" in text:
                    self.gate["stop"] = True
                case StopAck() | Hello():
                    self.report(message)

    def step(self):
        self.now += 0.05
        self.report(Tick(1, {}))
        self.far.beat(self.now)
        samples, self.sent[:] = list(self.sent), []
        for sample in samples:
            if not self.is_lost(msgspec.msgpack.decode(sample[16:], type=FromDisplay)):
                self.obey(self.displays.receive(NAME, sample, self.now))
        self.obey(self.displays.waiting_stops())
        self.obey(self.displays.check(self.now))
        if self.displays.wants_reports(self.now):
            self.report(AllReports(tuple(self.robots.values()), tuple(self.robots)))


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(
    "lost",
    [
        "list",
        "answer",
        "FromPage",
        "Tick",
        "Hello",
        "RobotReport",
        "RobotGone",
        "AllReports",
        "RobotReport AllReports",
        "RobotGone answer",
        "StopAck",
    ],
)
def test_after_each_kind_of_lost_sample_both_sides_agree_again(lost, seed):
    bench = Lossy(seed)
    other = msgspec.structs.replace(REPORT, robot="r2")
    bench.report(other)
    for _ in range(bench.random.randrange(5, 30)):
        bench.step()
    changed = msgspec.structs.replace(REPORT, epoch=9)
    second = msgspec.structs.replace(PAGE, connection=f"{NAME}/c2")
    changes = [
        lambda: bench.far.send(LIMITS),
        lambda: bench.far.send(second),
        lambda: bench.report(changed),
        lambda: bench.report(RobotGone("r2")),
        lambda: bench.far.send(STOP),
    ]
    for change in (*changes[seed:], *changes[:seed]):  # each is once the last
        bench.lost = set(lost.split())
        change()
        for _ in range(bench.random.randrange(3)):
            bench.step()
    for _ in range(80):  # four seconds
        bench.step()
    assert bench.gate == {
        PROGRAM.connection: None,
        PAGE.connection: (0.5, 1.0),
        second.connection: None,
        "stop": True,
    }
    assert bench.far._greeted == {PAGE.connection, second.connection}
    assert bench.far._latest == {"r1": changed}
    assert bench.far._stops == {}
    shown = {m.robot: m for m in bench.owner.received if hasattr(m, "robot")}
    assert shown == {"r1": changed, "r2": RobotGone("r2")}


@pytest.mark.parametrize(
    "message",
    [
        msgspec.structs.replace(REPORT, robot="r9"),
        AllReports((msgspec.structs.replace(REPORT, robot="bay4/r1"),), ("r1",)),
        RobotGone("r9"),
        Refused(PAGE.connection, "r9", "take", "Ann drives it"),
        Refused(PAGE.connection, None, "drive", "any text"),
        TakeReply(1, "r9", 3, None, PROGRAM.connection),
        SentTwist("r9", 1.0, 0.0, 0.0, None),
        CloseConnection(PAGE.connection, "any text"),
    ],
)
def test_an_agent_says_nothing_about_robots_and_sockets_that_are_not_its_own(
    connected, message
):
    before = list(connected.owner.received)
    connected.receive(message, 0.1)
    assert connected.owner.received == before


def test_an_agent_cannot_report_a_robot_or_a_person_by_another_name(connected):
    connected.receive(msgspec.structs.replace(REPORT, name="Forklift"), 0.1)
    connected.receive(RefusedCount("Ann", 3, "drive: too old"), 0.1)
    assert connected.owner.received[-2:] == [
        REPORT,
        RefusedCount("the agent bay3", 3, "Ann: drive: too old"),
    ]


def test_the_texts_of_a_refused_count_are_cut(connected):
    connected.receive(RefusedCount("A" * 1000, 3, "b" * 1000), 0.1)
    (got,) = connected.owner.of(RefusedCount)
    assert got.last == f"{'A' * 64}: {'b' * 300}"


def test_a_robot_that_is_declared_later_is_reported_at_once(connected):
    late = declared(
        id="r3", name="Bob", bridge_url="zenoh://h/bay3", goal_topic="/goal"
    )
    report = msgspec.structs.replace(REPORT, robot="r3")
    connected.receive(REPORT, 0.1)
    connected.receive(report, 0.1)
    connected.arrive()
    connected.displays.wants_reports(0.1)
    connected.far.send(late)
    connected.far.beat(0.4)
    connected.arrive()
    assert connected.displays.wants_reports(0.4)
    connected.receive(AllReports((REPORT, report), ("r1", "r3")), 0.4)
    assert connected.owner.received[-1] == report
    connected.far.send(Forget("r3"))
    connected.receive(report, 0.5)
    assert connected.owner.received.count(report) == 1
