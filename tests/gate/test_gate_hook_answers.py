"""Stop hooks that fail: the answers of a bridge, and the reports of the gate."""

import json

import pytest
from link_bench import frame, in_loop, noting_bridge, raw_bridge

from equipment.gate_harness import KEY, URL, Bench, spec
from equipment.waiting import until
from webmap.config.motion import StopHook
from webmap.gate import actions, events, protocol
from webmap.gate.display import pages
from webmap.gate.lanes import calls, navigation
from webmap.gate.lanes.calls import RosbridgeCall, ServiceCalls
from webmap.gate.lanes.links import Links
from webmap.gate.lanes.navigation import answer_to
from webmap.gate.specs import Cap

LOCK = StopHook(topic="/lock", type="std_msgs/Bool")
E_STOP = StopHook(service="/e_stop", type="std_srvs/Trigger")
NO_SUCH = "Service /e_stop does not exist"
REFUSED = f"refused ({NO_SUCH})"


def response(**fields):
    return json.dumps({"op": "service_response", "id": "a", **fields}).encode()


class TestAnswer:
    @pytest.mark.parametrize(
        ("fields", "why"),
        [
            ({}, None),
            ({"result": True, "values": {}}, None),
            ({"result": True, "values": {"success": True, "message": "on"}}, None),
            ({"result": True, "values": [True]}, None),
            ({"result": False}, "refused"),
            ({"result": False, "values": {"success": True}}, "refused"),
            ({"result": False, "values": NO_SUCH}, REFUSED),
            ({"values": {"success": False}}, "the service reported a failure"),
            (
                {"result": True, "values": {"success": False, "message": "no power"}},
                "the service reported a failure (no power)",
            ),
            (
                {"values": {"success": False, "message": 7}},
                "the service reported a failure",
            ),
            ({"op": "status", "level": "error", "msg": "what?"}, "refused (what?)"),
        ],
    )
    def test_the_answer_shows_whether_the_call_failed_and_why(self, fields, why):
        assert answer_to(response(**fields), "a") == (why,)

    @pytest.mark.parametrize(
        "data",
        [
            b"rubbish",
            b"[1]",
            response(id="b"),
            response(id=None),
            response(op=7),
            response(op="publish"),
            response(op="status", level="warning", msg="slow"),
        ],
    )
    def test_other_messages_are_no_answer_to_the_call(self, data):
        assert answer_to(data, "a") is None

    def test_a_long_answer_is_reduced_to_a_short_printable_line(self):
        text = "no\n\x1b[31m\ud800 way " + "x" * 10**6
        (why,) = answer_to(response(result=False, values=text), "a")
        assert why.isprintable()
        assert why.startswith("refused (no [31m way xxx")
        assert len(why) == len("refused ()") + navigation.MOST_WORDS


class TestCall:
    @in_loop
    async def test_a_refused_call_is_reported_and_logged(self, caplog):
        async with noting_bridge() as bridge:
            bridge.answers_services = False
            ended, made = [], ServiceCalls(bridge.url)
            call = RosbridgeCall(b'{"op": "call_service", "id": "a"}', "a")
            made.call(call, "/e_stop", ended.append)
            await until(lambda: bridge.of("call_service"), "the call")
            await bridge.send(1, response(result=False, values=NO_SUCH).decode())
            await made.settle()
            bridge.unblock()
        assert ended == [REFUSED]
        assert [r.getMessage() for r in caplog.records] == [f"/e_stop: {REFUSED}"]
        assert caplog.records[0].levelname == "WARNING"

    @in_loop
    async def test_a_call_over_a_link_that_closes_at_once_reports_no_connection(self):
        async def talk(link):
            await link.accept(frame(0x8))

        async with raw_bridge(talk) as url:
            ended, made = [], ServiceCalls(url)
            made.call(RosbridgeCall(b"{}", "a"), "/e_stop", ended.append)
            await made.settle()
        (why,) = ended
        assert why.startswith("no ")
        assert "no connection" in why


class Activity:
    """The links of one robot with both kinds of hooks, and their events."""

    def __init__(self, url):
        self.events = []
        self.links = Links(self.events.append)
        self.robot = spec(bridge_url=url, stop_hooks=(LOCK, E_STOP))
        self.key = events.Key(url, "/cmd_vel")
        self.links.perform(actions.Attach(self.key, self.robot))

    def run(self, hook, number):
        self.links.perform(actions.RunHook(self.key, "r1", hook, True, number))

    def of(self, type):
        return [event for event in self.events if isinstance(event, type)]

    async def __aenter__(self):
        up = events.LinkUp(self.key.url, "tasks")
        await until(lambda: up in self.events, "the link")
        return self

    async def __aexit__(self, *_):
        self.links.close()
        await self.links.settle()


class TestLinks:
    @in_loop
    async def test_the_links_report_the_result_of_every_stop_hook(self, monkeypatch):
        monkeypatch.setattr(calls, "CALL_TIMEOUT", 0.5)
        async with noting_bridge() as bridge, Activity(bridge.url) as doing:
            doing.run(LOCK, 1)
            assert doing.of(events.HookEnded) == [events.HookEnded("r1", LOCK, 1, None)]
            doing.run(E_STOP, 2)
            await doing.links.settle()
            bridge.answers_services = False
            doing.run(E_STOP, 3)
            await doing.links.settle()
            assert doing.of(events.HookEnded)[1:] == [
                events.HookEnded("r1", E_STOP, 2, None),
                events.HookEnded("r1", E_STOP, 3, "no answer within 0.5 s"),
            ]
            bridge.unblock()

    @in_loop
    async def test_a_topic_hook_without_a_link_is_reported_as_not_sent(self, caplog):
        async with noting_bridge() as bridge, Activity(bridge.url) as doing:
            doing.links._tasks[bridge.url].lane.cut("no longer used")
            doing.run(LOCK, 1)
            (ended,) = doing.of(events.HookEnded)
            assert ended.why == "not sent: no connection"
            assert f"stop hook /lock: {ended.why}" in caplog.text


@pytest.fixture
def bench():
    return Bench().begin(spec(stop_hooks=(LOCK, E_STOP)))


def stop(bench):
    bench.send("a", op="stop", robot="r1")
    bench.run(0.05)


def reset(bench):
    bench.send("a", op="reset", robot="r1")
    bench.run(0.05)


def end(bench, hook, why=None, robot="r1", since=-1):
    """End the newest run of a hook, or an earlier run."""
    runs = [run for run in bench.did(actions.RunHook) if run.hook == hook]
    bench.handle(events.HookEnded(robot, hook, runs[since].number, why))


class TestReport:
    def test_the_report_names_a_failed_hook_until_the_hook_succeeds(self, bench):
        stop(bench)
        assert bench.report().hooks == ()
        end(bench, LOCK)
        end(bench, E_STOP, REFUSED)
        assert bench.report().hooks == (f"stop hook /e_stop: {REFUSED}",)
        stop(bench)
        assert bench.report().hooks == (f"stop hook /e_stop: {REFUSED}",)
        end(bench, E_STOP)
        assert bench.report().hooks == ()

    def test_the_report_distinguishes_a_topic_hook_from_a_service_hook(self):
        lock = StopHook(service="/lock", type="std_srvs/Trigger")
        bench = Bench().begin(spec(stop_hooks=(lock, LOCK)))
        stop(bench)
        end(bench, lock, "refused")
        end(bench, LOCK)
        assert bench.report().hooks == ("stop hook /lock: refused",)

    def test_the_report_omits_failed_hooks_after_a_reset(self, bench):
        stop(bench)
        end(bench, E_STOP, REFUSED)
        reset(bench)
        end(bench, LOCK)
        assert bench.report().hooks == ()

    def test_an_answer_to_an_earlier_run_of_a_hook_is_ignored(self, bench):
        stop(bench)
        stop(bench)
        end(bench, E_STOP, REFUSED, since=0)
        assert bench.report().hooks == ()
        reset(bench)
        end(bench, E_STOP, REFUSED)
        assert bench.report().hooks == ()

    def test_the_report_lists_hooks_without_a_link_until_the_hooks_have_run(
        self, bench
    ):
        bench.handle(events.LinkDown(URL, "tasks"))
        stop(bench)
        why = "not sent yet: no connection"
        assert bench.report().hooks == (
            f"stop hook /lock: {why}",
            f"stop hook /e_stop: {why}",
        )
        assert bench.did(actions.RunHook) == []
        bench.connect_links()
        end(bench, LOCK)
        end(bench, E_STOP)
        assert bench.report().hooks == ()

    def test_the_report_names_a_failed_hook_reset_until_the_reset_succeeds(self, bench):
        stop(bench)
        bench.break_links()
        reset(bench)
        why = "not sent yet: no connection"
        assert bench.report().hooks == (f"reset of stop hook /lock: {why}",)
        bench.handle(events.LinkUp(URL, "tasks"))
        end(bench, LOCK, "not sent: no connection")
        failed = "reset of stop hook /lock: not sent: no connection"
        assert bench.report().hooks == (failed,)
        bench.handle(events.LinkUp(URL, "tasks"))
        end(bench, LOCK)
        assert bench.report().hooks == ()
        assert [run.stopped for run in bench.did(actions.RunHook)][2:] == [False] * 2

    def test_a_failed_hook_is_reported_for_every_alias_of_the_machine(self):
        hooks = (E_STOP,)
        bench = Bench().begin(spec(stop_hooks=hooks), spec(id="r2", stop_hooks=hooks))
        stop(bench)
        end(bench, E_STOP, REFUSED, robot="r1")
        end(bench, E_STOP, REFUSED, robot="r2")
        for robot in ("r1", "r2"):
            assert bench.report(robot).hooks == (f"stop hook /e_stop: {REFUSED}",)

    def test_a_failed_hook_is_sent_to_the_page(self, bench):
        stop(bench)
        end(bench, E_STOP, REFUSED)
        text = pages.robot_text(bench.report(), mine=False, page=Cap(1.0, 1.0, ""))
        assert json.loads(text)["hooks"] == [f"stop hook /e_stop: {REFUSED}"]


def test_a_failed_hook_runs_again_on_a_new_link_and_is_reported_until_it_succeeds(
    bench,
):
    stop(bench)
    end(bench, E_STOP, REFUSED)
    bench.handle(events.LinkDown(URL, "tasks"))
    before = len(bench.did(actions.RunHook))
    bench.handle(events.LinkUp(URL, "tasks"))
    hooks = [run.hook for run in bench.did(actions.RunHook)[before:]]
    assert E_STOP in hooks
    assert bench.report().hooks == (f"stop hook /e_stop: {REFUSED}",)
    end(bench, E_STOP)
    assert bench.report().hooks == ()


def test_stop_hooks_do_not_run_for_a_stop_that_was_reset_elsewhere(bench):
    bench.handle(events.LinkDown(URL, "tasks"))
    stop(bench)
    bench.handle(events.LockState(KEY, held=False, why="it has", elsewhere=True))
    bench.handle(events.StopFileChanged(KEY, None))
    assert bench.report().hooks == ()
    bench.handle(events.LinkUp(URL, "tasks"))
    assert bench.did(actions.RunHook) == []


class TestNewDeclaration:
    def test_a_robot_that_is_declared_again_still_gets_its_hook_reset(self, bench):
        stop(bench)
        bench.handle(events.LinkDown(URL, "tasks"))
        reset(bench)
        bench.handle(spec(name="Robert", stop_hooks=(LOCK, E_STOP)))
        assert len(bench.report().hooks) == 1
        bench.handle(events.LinkUp(URL, "tasks"))
        assert bench.did(actions.RunHook)[-1].stopped is False

    def test_a_robot_declared_with_other_hooks_runs_the_new_hooks(self, bench):
        stop(bench)
        end(bench, E_STOP, REFUSED)
        bench.handle(spec(stop_hooks=(LOCK,)))
        assert bench.report().hooks == ()
        assert bench.did(actions.RunHook)[-1].hook == LOCK


def test_a_hook_answer_for_a_removed_robot_sends_no_report(bench):
    stop(bench)
    bench.handle(protocol.Forget("r1"))
    before = len(bench.of(protocol.RobotReport))
    end(bench, E_STOP, REFUSED)
    assert len(bench.of(protocol.RobotReport)) == before
