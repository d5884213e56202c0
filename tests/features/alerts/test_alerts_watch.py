"""Alerts come from the gate's report, the connection, and the modules."""

import asyncio
from types import SimpleNamespace

import pytest

from equipment.waiting import until
from webmap.features.alerts.alerts import KINDS, LOST, Alerts, AlertWatch, conditions


def bridge(**changes):
    return SimpleNamespace(
        **{"state": "open", "lost": False, "replays": False, "name": "hall"} | changes
    )


def report(**changes):
    known = {
        "alarm": None,
        "other_writer": None,
        "doing": "free",
        "stop": None,
        "link": "up",
        "goal": None,
    }
    return SimpleNamespace(**known | changes)


def robot(*, link=None, gate_report=None, silent=0.1, throttle=100, modules=()):
    return SimpleNamespace(
        id="r1",
        name="Bob",
        pose_source=SimpleNamespace(
            bridge=bridge() if link is None else link, period=throttle / 1000
        ),
        silent_for=silent,
        report=report() if gate_report is None else gate_report,
        modules=modules,
        charge=next((each.charge for each in modules if hasattr(each, "charge")), None),
        battery_low=0.2,
    )


def battery(charge):
    return SimpleNamespace(charge=charge)


def health(*levels):
    parts = [
        SimpleNamespace(name=f"part {n}", message="too hot", level=level)
        for n, level in enumerate(levels)
    ]
    return SimpleNamespace(parts=parts, hold=10.0)


FAILED = SimpleNamespace(state="failed", why="no path")


@pytest.mark.parametrize(
    ("bob", "found"),
    [
        (robot(), {}),
        (
            robot(gate_report=report(alarm="still moving", other_writer="/joy sends")),
            {"disobeys": "Not obeying: still moving; /joy sends"},
        ),
        (
            robot(
                gate_report=report(
                    doing="unconfirmed", stop=SimpleNamespace(why="no odometry")
                )
            ),
            {"unconfirmed": "STOP not confirmed: no odometry"},
        ),
        (
            robot(gate_report=report(doing="blocked")),
            {"blocked": "Driven, but not moving"},
        ),
        (robot(gate_report=report(goal=FAILED)), {"goal": "Goal failed: no path"}),
        (
            robot(gate_report=report(goal=SimpleNamespace(state="failed", why=""))),
            {"goal": "Goal failed"},
        ),
        (
            robot(gate_report=report(link="down")),
            {"commands": "No connection for commands"},
        ),
        (robot(silent=LOST + 0.1), {"lost": "No pose received"}),
        (robot(silent=LOST + 0.1, throttle=2000), {}),
        (robot(silent=None), {}),
        (
            robot(link=bridge(state="closed", lost=True)),
            {"lost": "No connection to the bridge"},
        ),
        (robot(link=bridge(state="connecting"), silent=9), {}),
        (robot(modules=[battery(0.199)]), {"battery": "Battery at 20 %"}),
        (robot(modules=[battery(0.2), battery(None)]), {}),
        (robot(modules=[health("error", "warn")]), {"health": "part 0: too hot"}),
        (
            robot(modules=[health("error", "error", "error")]),
            {"health": "part 0: too hot and 2 more"},
        ),
        (robot(modules=[health("warn", "stale", "ok")]), {}),
    ],
)
def test_the_conditions_of_a_robot_that_make_an_alert(bob, found):
    assert conditions(bob) == found
    assert set(found) <= set(KINDS)


def test_a_recording_makes_no_alert():
    link = bridge(replays=True, lost=True, state="closed")
    bob = robot(link=link, silent=99, modules=[battery(0.0), health("error")])
    assert conditions(bob) == {}


def test_the_charge_of_a_low_battery_is_settable():
    alerts = Alerts()
    bob = robot(modules=[battery(0.4)])
    bob.battery_low = 0.5
    AlertWatch(alerts, lambda: [bob]).look(1.0)
    assert [alert.text for alert in alerts.listed.values()] == ["Battery at 40 %"]


def test_a_new_connection_for_commands_makes_no_alert():
    alerts, gate_report = Alerts(), report(link="down")
    watch = AlertWatch(alerts, lambda: [robot(gate_report=gate_report)])
    watch.look(1.0)
    watch.look(1.0 + LOST - 0.5)
    assert not alerts.listed
    watch.look(1.0 + LOST)
    assert [alert.kind for alert in alerts.listed.values()] == ["commands"]
    gate_report.link = "up"
    watch.look(5.0)
    assert [alert.ended for alert in alerts.listed.values()] == [5.0]


def test_the_fault_of_a_bridge_is_one_alert_and_not_one_for_each_robot():
    alerts, link = Alerts(), bridge(state="closed", lost=True)
    robots = [robot(link=link, gate_report=report(link="down")) for _ in range(30)]
    for number, each in enumerate(robots):
        each.id = f"r{number}"
    robots[7].report = report(link="down", alarm="may still be moving")
    watch = AlertWatch(alerts, lambda: robots)
    watch.look(1.0)
    watch.look(1.0 + LOST)
    fault, worse = alerts.listed.values()
    assert (fault.kind, fault.name) == ("bridge", "hall")
    assert fault.text == "No connection: 30 robots"
    assert (worse.kind, worse.robot) == ("disobeys", "r7")
    link.lost, link.state = False, "open"
    for each in robots:
        each.report = report()
    watch.look(9.0)
    assert {a.ended for a in alerts.listed.values()} == {9.0}


def test_the_alerts_of_a_removed_robot_end():
    alerts, shown = Alerts(), [robot(silent=9)]
    watch = AlertWatch(alerts, lambda: shown)
    watch.look(1.0)
    shown.clear()
    watch.look(2.0)
    assert [alert.ended for alert in alerts.listed.values()] == [2.0]


def test_the_watch_looks_without_a_page_and_survives_a_faulty_robot(caplog):
    looks = []

    def robots():
        looks.append(None)
        raise RuntimeError("faulty")

    async def scenario():
        watch = AlertWatch(Alerts(), robots)
        watch.start(asyncio.get_running_loop())
        await until(lambda: len(looks) >= 2)
        await watch.stop()
        await watch.stop()

    asyncio.run(scenario())
    assert "the alerts were not updated" in caplog.text
