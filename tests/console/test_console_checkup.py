"""The readiness check that all viewers of a page share."""

import asyncio
from dataclasses import replace

import pytest

from equipment.waiting import until
from webmap import Bridge
from webmap.discovery.doctor import BridgeFacts, ConfiguredRobot, Finding
from webmap.features.doctor.doctor_panel import Checkup, checkup_of, groups
from webmap.ros.rosbridge.checks import LinkFacts


def test_only_one_check_of_a_bridge_runs_at_a_time():
    asked, go_on = [], asyncio.Event()

    async def observe(url, *, seconds, configured, progress):
        asked.append(url)
        progress("Listening for 3 s.")
        await go_on.wait()
        return BridgeFacts(url, trouble="nothing listens there")

    async def run():
        checkup = Checkup("ws://bob:9090", observe=observe)
        for _ in range(3):
            checkup.start()
        await until(lambda: checkup.doing == "Listening for 3 s.")
        checkup.start()
        assert checkup.is_running
        assert checkup.ended is None
        before = checkup.version
        go_on.set()
        await until(lambda: not checkup.is_running)
        assert asked == ["ws://bob:9090"]
        assert checkup.version > before, "pages see that there is a new result"
        assert checkup.summary == "1 wrong"
        assert "WRONG    The rosbridge cannot be reached" in checkup.text
        checkup.start()
        await until(lambda: not checkup.is_running)
        assert len(asked) == 2, "a second check observes the bridge again"

    asyncio.run(run())


def test_a_check_that_raises_is_shown_as_a_finding_and_can_be_repeated(caplog):
    async def observe(url, *, seconds, configured, progress):
        raise RuntimeError("broken")

    async def run():
        checkup = Checkup("ws://bob:9090", observe=observe)
        for _ in range(2):
            checkup.start()
            await until(lambda: not checkup.is_running)
            (finding,) = checkup.findings
            assert finding.level == "wrong"
            assert "RuntimeError('broken')" in finding.text

    asyncio.run(run())
    assert "the readiness check of ws://bob:9090 failed" in caplog.text


@pytest.mark.parametrize(
    ("levels", "summary"),
    [
        (["good", "note", "good"], "No problems: 1 note, 2 good"),
        (["good", "wrong", "warning", "warning"], "1 wrong, 2 warnings, 1 good"),
    ],
)
def test_the_summary_counts_the_findings_of_each_level(levels, summary):
    checkup = Checkup("ws://bob:9090")
    checkup.findings = [Finding(level, "bridge", "x") for level in levels]
    assert checkup.summary == summary


def test_a_bridge_has_one_check_for_all_viewers():
    one, other = Bridge("ws://a:1"), Bridge("ws://a:1")
    assert checkup_of(one) is checkup_of(one)
    assert checkup_of(one) is not checkup_of(other)


def test_the_check_receives_the_robots_of_the_page():
    asked = []

    async def observe(url, *, seconds, configured, progress):
        asked.append(configured(None))
        return BridgeFacts(url)

    async def run():
        checkup = Checkup("ws://bob:9090", observe=observe)
        bob = ConfiguredRobot("Bob")
        checkup.start([bob])
        await until(lambda: not checkup.is_running)
        assert asked == [[bob]]

    asyncio.run(run())


async def seen_at(url, **_):
    return BridgeFacts(url)


def test_a_slow_call_test_runs_only_on_request_and_its_result_is_reported():
    received = []

    async def tried(seen):
        received.append(checkup.doing)
        return replace(seen, link=LinkFacts(calls_in_threads=False, tried=True))

    checkup = Checkup("ws://bob:9090", observe=seen_at, tried=tried)

    async def run():
        checkup.start()
        await until(lambda: not checkup.is_running)
        assert not received, "the slow call is not tried without a request"
        ended = checkup.ended
        checkup.try_call()
        assert not checkup.can_try, "only one check runs at a time"
        await until(lambda: not checkup.is_running)
        assert checkup.ended == ended, "the bridge was not observed again"

    asyncio.run(run())
    assert received == ["Testing what a slow service call delays."]
    assert "hangs blocks its whole connection (tried)" in checkup.text


@pytest.mark.parametrize("trouble", [None, "nothing listens there"])
def test_no_slow_call_test_runs_at_an_unchecked_or_unreachable_bridge(trouble):
    async def observe(url, **_):
        return BridgeFacts(url, trouble=trouble)

    async def tried(seen):
        raise AssertionError

    async def run():
        checkup = Checkup("ws://bob:9090", observe=observe, tried=tried)
        if trouble is not None:
            checkup.start()
            await until(lambda: not checkup.is_running)
        assert not checkup.can_try
        version = checkup.version
        checkup.try_call()
        assert checkup.version == version

    asyncio.run(run())


def test_html_tags_in_the_name_of_a_robot_are_shown_as_text():
    name = "<b onclick=alert(1)>"
    heading, items = groups([Finding("warning", name, f"{name} is odd.", "Look.")])
    assert heading.text == name
    (item,) = items.children
    assert item.get("data-level") == "warning"
    assert f"Warning: {name} is odd." in item.text
    assert "Look." in item.text
