"""The speeds of a free robot that a page receives."""

import json
import math
import threading

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from equipment.gate_harness import Bench, spec
from webmap.gate import protocol
from webmap.gate.display.pages import Pages
from webmap.gate.specs import Cap, Speed, offered, page_cap, speed_in_force

INF = math.inf
LIMITS = st.sampled_from([0.0, 0.2, 0.3, 0.6, 1.0, INF])


def free(**changes):
    """Return the report of a free robot."""
    return Bench().begin(spec(**changes)).report()


@pytest.fixture
def pages():
    return Pages(lambda message: None, threading.RLock(), print, print)


def join(pages, *speeds):
    texts = []
    connection = pages.connect("Ann", "operator", texts.append, print)
    if speeds:
        connection.set_speeds(*speeds)
    pages.on_hello(protocol.Hello(connection.id))
    return connection, texts


def cap_of(texts):
    text = json.loads(texts[-1])
    return text["v"], text["w"], text["why"]


def test_a_free_robot_reports_its_own_speed_limits():
    report = free(v_max=0.5, w_max=1.0)
    assert (report.v, report.w, report.why) == (0.5, 1.0, ("limit of the robot",))


def test_a_free_robot_without_limits_reports_an_unlimited_speed():
    report = free(v_max=None, w_max=None)
    assert (report.v, report.w, report.why) == (INF, INF, ())


def test_the_report_of_a_free_robot_includes_the_speed_limit_of_the_page(pages):
    _, quick = join(pages, 0.8, 1.2)
    _, slow = join(pages, 0.2, 0.4)
    pages.on_report(free(v_max=None, w_max=None))
    assert cap_of(quick) == (0.8, 1.2, ["normal limit"])
    assert cap_of(slow) == (0.2, 0.4, ["normal limit"])
    pages.on_report(free(v_max=0.5, w_max=1.0))
    assert cap_of(quick) == (0.5, 1.0, ["limit of the robot"])


def test_the_report_of_a_taken_robot_includes_the_speed_limit_of_the_page():
    bench = Bench().begin(spec(v_max=None, w_max=None))
    bench.handle(protocol.Speeds("a", 0.8, 1.2))
    bench.take()
    report = bench.report()
    assert (report.v, report.w, report.why) == (0.8, 1.2, ("normal limit",))


def test_a_page_that_changes_its_speed_limit_receives_a_report_at_once(pages):
    connection, texts = join(pages)
    pages.on_report(free(v_max=None, w_max=None))
    assert cap_of(texts) == (0.3, 0.6, ["no limit stated"])
    connection.set_speeds(0.8, 1.2)
    assert cap_of(texts) == (0.8, 1.2, ["normal limit"])


def test_a_page_that_sets_the_same_speed_limit_again_receives_nothing(pages):
    connection, texts = join(pages, 0.8, 1.2)
    pages.on_report(free(v_max=None, w_max=None))
    received = len(texts)
    connection.set_speeds(0.8, 1.2)
    assert len(texts) == received
    connection.set_speeds(0.4, 1.2)
    assert len(texts) == received + 1


def test_a_page_receives_no_report_before_hello(pages):
    pages.on_report(free(v_max=None, w_max=None))
    texts = []
    connection = pages.connect("Ann", "operator", texts.append, print)
    connection.set_speeds(0.8, 1.2)
    assert texts == []
    pages.on_hello(protocol.Hello(connection.id))
    assert cap_of(texts) == (0.8, 1.2, ["normal limit"])


def test_a_page_without_control_does_not_change_the_reported_speed(pages):
    bench = Bench().begin()
    bench.take("b")
    connection, texts = join(pages, 0.2, 0.2)
    pages.on_report(bench.report())
    assert cap_of(texts) == (1.0, 1.5, ["limit of the robot"])
    received = len(texts)
    connection.set_speeds(0.1, 0.1)
    assert len(texts) == received


def test_an_invalid_speed_limit_of_a_page_counts_as_zero():
    assert page_cap(math.nan, -1.0) == Cap(0.0, 0.0, "normal limit")


@given(LIMITS, LIMITS, LIMITS, LIMITS)
def test_the_offered_speed_equals_the_speed_in_force_after_taking_control(
    own_v, own_w, v, w
):
    stated = any(limit < INF for limit in (own_v, own_w))
    own = Speed(own_v, own_w, ("limit of the robot",) if stated else ())
    page = page_cap(v, w)
    then = speed_in_force([Cap(own_v, own_w, "limit of the robot"), page])
    seen = offered(own, page)
    assert (seen.v, seen.w) == (then.v, then.w)
    assert set(seen.why) <= set(then.why)
    assert bool(seen.why) == bool(then.why)


def test_a_report_with_an_infinite_speed_is_decoded_unchanged():
    report = free(v_max=None, w_max=None)
    packed = msgspec.msgpack.encode(report)
    assert msgspec.msgpack.decode(packed, type=protocol.RobotReport) == report
