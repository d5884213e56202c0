"""Which topics are recorded, and what is reported during the recording."""

import asyncio
import json
import threading
import time as time_module
from types import SimpleNamespace

import pytest

from webmap.bags import record, recorder
from webmap.bags.player import STATUS
from webmap.bags.record import TopicSubscriber
from webmap.base.errors import BridgeClosed
from webmap.ros.bridge import Bridge
from webmap.ros.offload import LARGE
from webmap.ros.rosbridge.events import Publish

ODOMETRY = "nav_msgs/Odometry"
STRING = "std_msgs/String"


class FakeBridge:
    """A bridge whose topics and messages come from the test."""

    def __init__(self, topics):
        self.now, self.callbacks, self.state = dict(topics), {}, "open"
        self.opened = self.closed = self.trouble = None
        self.opens = True

    def on_open(self, call):
        self.opened = call
        return SimpleNamespace(remove=lambda: None)

    def on_close(self, call):
        self.closed = call
        return SimpleNamespace(remove=lambda: None)

    def subscribe(self, topic, callback, type, **_):
        self.callbacks[topic] = callback
        return SimpleNamespace()

    def feed(self, topic, message):
        operation = {"op": "publish", "topic": topic, "msg": message}
        self.callbacks[topic](Publish(topic, json.dumps(operation).encode()))

    async def topics(self):
        if self.state != "open":
            raise BridgeClosed("away")
        return dict(self.now)

    def start(self, loop):
        if self.opens:
            self.opened()

    async def stop(self):
        self.state = "closed"


class FakeRecorder:
    """Records its messages; it does not know the types of ``acme_msgs``."""

    def __init__(self):
        self.got, self.times, self.dropped = [], [], []
        self.full, self.pause = False, 0.0

    def add(self, topic, type_name):
        return not type_name.startswith("acme_msgs/")

    def take(self, topic, message, time):
        if self.full:
            raise OSError("No space left on device")
        time_module.sleep(self.pause)
        self.times.append(time)
        self.got.append((topic, message))

    def drop(self, topic, why, error=""):
        self.dropped.append((topic, why, error))


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    monkeypatch.setattr(record, "LOOK", 0.001)


class Story:
    """One recording, and the events while it runs."""

    def __init__(self, topics, **options):
        self.bridge, self.recorder = FakeBridge(topics), FakeRecorder()
        self.reported, self.stop = [], asyncio.Event()
        self.listening = TopicSubscriber(
            self.bridge, self.recorder, report=self.reported.append, **options
        )

    def run(self, happens, **options):
        async def story():
            going = asyncio.create_task(
                self.listening.run(
                    self.bridge.now,
                    self.stop,
                    ready=lambda: None,
                    show=lambda _: None,
                    **options,
                )
            )
            while not self.bridge.opened:
                await asyncio.sleep(0)
            async with asyncio.timeout(10):
                await happens()
                self.stop.set()
                return await going

        return asyncio.run(story())


def test_all_topics_except_the_replay_status_are_recorded():
    story = Story({"/odom": ODOMETRY, STATUS: STRING})

    async def happens():
        story.bridge.feed("/odom", {"x": 1})

    story.run(happens)
    assert story.recorder.got == [("/odom", {"x": 1})]
    assert set(story.bridge.callbacks) == {"/odom"}


def test_topics_that_appear_later_are_recorded():
    story = Story({"/odom": ODOMETRY})

    async def happens():
        story.bridge.now["/scan"] = "sensor_msgs/LaserScan"
        while "/scan" not in story.bridge.callbacks:
            await asyncio.sleep(0.001)

    story.run(happens)
    assert story.reported == []


def test_only_the_named_topics_are_recorded():
    story = Story({"/odom": ODOMETRY, "/chat": STRING}, only=["/odom", "/later"])

    async def happens():
        assert story.listening.missing == ["/later"]

    story.run(happens)
    assert set(story.bridge.callbacks) == {"/odom"}


def test_topics_with_unknown_types_are_reported_once():
    story = Story({"/a": "acme_msgs/Arm", "/b": "acme_msgs/Leg", "/odom": ODOMETRY})

    async def happens():
        story.bridge.now["/chat"] = STRING
        while "/chat" not in story.bridge.callbacks:
            await asyncio.sleep(0.001)

    story.run(happens)
    assert story.reported == [
        "Not recorded, since their types are unknown: /a (acme_msgs/Arm), "
        "/b (acme_msgs/Leg)"
    ]


def test_a_lost_and_restored_link_is_reported_with_the_gap():
    story = Story({"/odom": ODOMETRY})

    async def happens():
        story.bridge.closed("the robot went to sleep")
        story.bridge.opened()

    story.run(happens)
    lost, back = story.reported
    assert lost.startswith("The connection was lost (the robot went to sleep)")
    assert back == "The connection is open again; 0.0 s are missing in the bag"


def test_recording_ends_after_its_duration():
    story = Story({"/odom": ODOMETRY})

    async def ended():
        return await story.listening.run(
            story.bridge.now,
            story.stop,
            duration=0.01,
            ready=lambda: None,
            show=lambda _: None,
        )

    assert 0.01 <= asyncio.run(ended()) < 5


def test_a_full_disk_ends_recording_with_an_error():
    story = Story({"/odom": ODOMETRY})

    async def happens():
        story.recorder.full = True
        story.bridge.feed("/odom", {})

    with pytest.raises(OSError, match="No space left"):
        story.run(happens)


def test_a_link_that_never_opens_is_reported_with_the_reason(monkeypatch):
    monkeypatch.setattr(record, "OPEN_WITHIN", 0.001)
    story = Story({"/odom": ODOMETRY})
    story.bridge.opens, story.bridge.trouble = False, "nothing listens there"

    async def ended():
        await story.listening.run(
            story.bridge.now,
            story.stop,
            duration=0.05,
            ready=lambda: None,
            show=lambda _: None,
        )

    asyncio.run(ended())
    assert story.reported == [
        "Nothing is recorded yet: the connection is not open (nothing listens there)",
        "Nothing is recorded: the connection was never open (nothing listens there)",
    ]


def test_slow_writing_does_not_change_the_arrival_time_of_messages():
    story = Story({"/odom": ODOMETRY})
    story.recorder.pause = 0.2
    all_came = []

    async def happens():
        for x in range(3):
            story.bridge.feed("/odom", {"x": x})
        all_came.append(time_module.time_ns())

    story.run(happens)
    assert [message["x"] for _, message in story.recorder.got] == [0, 1, 2]
    assert story.recorder.times == sorted(story.recorder.times)
    assert story.recorder.times[2] <= all_came[0]


def test_unreadable_messages_are_counted_as_dropped():
    story = Story({"/odom": ODOMETRY})

    async def happens():
        frame = b'{"op":"publish","topic":"/odom","msg":{"x":'
        story.bridge.callbacks["/odom"](Publish("/odom", frame))

    story.run(happens)
    ((topic, why, error),) = story.recorder.dropped
    assert (topic, why) == ("/odom", "messages that cannot be read are not recorded")
    assert "not JSON" in error


def test_messages_above_the_queue_limit_are_counted_as_dropped(monkeypatch):
    monkeypatch.setattr(recorder, "HELD", 3 * recorder.ASIDE)
    story = Story({"/odom": ODOMETRY})
    all_came, write = threading.Event(), story.recorder.take

    def write_late(*message):
        assert all_came.wait(10)
        write(*message)

    story.recorder.take = write_late

    async def happens():
        for x in range(10):
            story.bridge.feed("/odom", {"x": x})
        all_came.set()

    story.run(happens)
    got, dropped = story.recorder.got, story.recorder.dropped
    assert got[0] == ("/odom", {"x": 0})
    assert len(got) + len(dropped) == 10
    assert 7 <= len(dropped) <= 8
    assert "more arrive than can be written" in dropped[0][1]


class HandFed(Bridge):
    """A bridge without a link, whose frames come from the test."""

    def start(self, loop):
        self._fan_out.begin(loop)

    def feed(self, topic, message):
        operation = {"op": "publish", "topic": topic, "msg": message}
        self._link._received(json.dumps(operation).encode())


def test_large_messages_and_the_small_messages_between_them_are_all_recorded():
    """A display needs only the newest large message; a bag needs all of them."""
    story = Story({"/map": "nav_msgs/OccupancyGrid"}, stated_types={})
    story.bridge = HandFed("ws://127.0.0.1:1")
    story.listening._bridge = story.bridge
    sent = [
        {"number": number, "padding": "x" * (LARGE if number % 2 else 1)}
        for number in range(20)
    ]

    async def recorded():
        going = asyncio.create_task(
            story.listening.run(
                {"/map": "nav_msgs/OccupancyGrid"},
                story.stop,
                ready=lambda: None,
                show=lambda _: None,
            )
        )
        await asyncio.sleep(0)
        for message in sent:
            story.bridge.feed("/map", message)
        story.stop.set()
        await going

    asyncio.run(recorded())
    assert story.recorder.got == [("/map", message) for message in sent]
