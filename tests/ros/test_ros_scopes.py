"""A bridge and its subscriptions end with the scope that made them."""

import asyncio

import pytest

from equipment.fake_rosbridge import FakeRosbridge, bridged
from equipment.waiting import until
from webmap.base.errors import BridgeClosed
from webmap.base.lifecycle import Lifecycle
from webmap.base.scope import Scope
from webmap.ros import bridge as bridge_module
from webmap.ros.bridge import Bridge
from webmap.ros.callbacks import Callbacks


def run(scenario):
    asyncio.run(scenario())


@pytest.fixture
def lifecycle(monkeypatch):
    """A lifecycle for the bridges of one test."""
    lifecycle = Lifecycle()
    monkeypatch.setattr(bridge_module, "lifecycle", lifecycle)
    return lifecycle


class Work:
    """An async callback that runs until it is cancelled."""

    def __init__(self):
        self.began = self.cancelled = 0

    async def __call__(self, *args):
        self.began += 1
        try:
            await asyncio.Event().wait()
        except asyncio.CancelledError:
            self.cancelled += 1
            raise


def test_a_running_async_callback_is_cancelled_with_its_subscription():
    async def scenario():
        by_hand, by_scope, scope = Work(), Work(), Scope("page")
        async with bridged() as (server, bridge):
            seen = bridge.subscribe("/a", by_hand)
            with scope.active():
                bridge.subscribe("/a", by_scope)
            await server.wait_for("subscribe")
            await server.publish("/a", {"data": 1})
            await until(lambda: by_hand.began and by_scope.began)
            seen.remove()
            await until(lambda: by_hand.cancelled)
            assert not by_scope.cancelled
            scope.close()
            await until(lambda: by_scope.cancelled)

    run(scenario)


def test_removing_a_callback_cancels_its_running_coroutine():
    async def scenario():
        work = Work()
        callbacks = Callbacks("on_close", lambda error: None)
        _, removal = callbacks.add(work)
        callbacks.call("the link was lost")
        await until(lambda: work.began)
        removal.remove()
        await until(lambda: work.cancelled)

    run(scenario)


def test_a_callback_that_removes_its_own_subscription_runs_to_completion():
    async def scenario():
        done = []

        async def once(message):
            seen.remove()
            await asyncio.sleep(0)
            done.append(message["data"])

        async with bridged() as (server, bridge):
            seen = bridge.subscribe("/a", once)
            await server.wait_for("subscribe")
            await server.publish("/a", {"data": 1})
            await until(lambda: done)
            assert done == [1]

    run(scenario)


def test_a_bridge_closes_with_the_scope_that_created_the_bridge(lifecycle):
    async def scenario():
        server, page, got = FakeRosbridge(), Scope("page"), []
        await server.start()
        lifecycle.begin(asyncio.get_running_loop())
        with page.active():
            bridge = Bridge(server.url)
            bridge.subscribe("/a", got.append)
        await until(lambda: bridge.state == "open")
        assert len(page) == 2
        page.close()
        await until(lambda: bridge.state == "closed" and not server.links)
        assert list(lifecycle._services) == []
        bridge.start(asyncio.get_running_loop())
        assert bridge.state == "closed"
        await lifecycle.end()
        await server.stop()

    run(scenario)


def test_a_bridge_created_outside_a_scope_stays_in_the_lifecycle(lifecycle):
    bridge = Bridge("ws://robot:9090")
    assert list(lifecycle._services) == [bridge]


def test_a_bridge_whose_scope_was_closed_does_not_start(lifecycle):
    page = Scope("page")
    with page.active():
        bridge = Bridge("ws://robot:9090")
    page.close()

    async def scenario():
        lifecycle.begin(asyncio.get_running_loop())
        assert bridge.state == "new"
        await lifecycle.end()

    run(scenario)


def test_using_a_bridge_whose_scope_closed_raises_the_reason(lifecycle, caplog):
    async def scenario():
        server, page, received = FakeRosbridge(), Scope("page"), []
        robot = Scope("robot", lambda text, about: received.append(text))
        await server.start()
        lifecycle.begin(asyncio.get_running_loop())
        with page.active():
            bridge = Bridge(server.url)
        with robot.active():
            bridge.subscribe("/odom", print)
        page.close()
        await until(lambda: received)
        assert "ended with the page or the module that made its bridge" in received[0]
        assert "/odom" in caplog.text
        for use in (
            lambda: bridge.subscribe("/scan", print),
            lambda: bridge.publish("/a", {"data": "x"}, "std_msgs/String"),
            lambda: bridge.on_open(print),
        ):
            with pytest.raises(BridgeClosed, match="create it outside of both"):
                use()
        with pytest.raises(BridgeClosed, match="create it outside of both"):
            await bridge.call_service("/dock")
        robot.close()
        await lifecycle.end()
        await server.stop()

    run(scenario)


def test_no_error_is_reported_for_a_bridge_that_closes_with_its_users(
    lifecycle, caplog
):
    async def scenario():
        server, page, received = FakeRosbridge(), Scope("page"), []
        robot = Scope("robot", lambda text, about: received.append(text))
        await server.start()
        lifecycle.begin(asyncio.get_running_loop())
        with page.active():
            page.add(_Closes(robot))  # older, so it is removed later
            bridge = Bridge(server.url)
        with robot.active():
            bridge.subscribe("/odom", print)
        page.close()
        await until(lambda: bridge.state == "closed")
        await lifecycle.end()
        assert received == []
        assert caplog.text == ""
        await server.stop()

    run(scenario)


class _Closes:
    def __init__(self, scope):
        self.remove = scope.close
