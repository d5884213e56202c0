from simulated import Bench

from webmap.ros.rosbridge.server.client import Outbox
from webmap.ros.rosbridge.server.encode import Publication


def publication(topic, number):
    return Publication(topic, "std_msgs/Int32", {"data": number}, 0.0)


def drain(outbox):
    found = []
    while (entry := outbox.pop()) is not None:
        found.append(entry if isinstance(entry, list) else entry.message["data"])
    return found


def test_an_outbox_sends_its_entries_in_order():
    outbox = Outbox()
    outbox.publication(publication("/a", 1), 10)
    outbox.reply(["r"])
    outbox.publication(publication("/b", 2), 10)
    assert drain(outbox) == [1, ["r"], 2]


def test_a_full_topic_queue_keeps_the_newest_messages():
    outbox = Outbox()
    for number in range(10):
        outbox.publication(publication("/a", number), 2)
    assert outbox.dropped == 8
    assert drain(outbox) == [8, 9]


def test_a_full_topic_queue_drops_no_messages_of_another_topic():
    outbox = Outbox()
    outbox.publication(publication("/b", 100), 1)
    for number in range(10):
        outbox.publication(publication("/a", number), 1)
        outbox.reply([str(number)])
    outbox.publication(publication("/b", 101), 1)
    assert drain(outbox) == [101, 9, *([str(n)] for n in range(10))]


def test_forgetting_a_topic_removes_its_waiting_messages():
    outbox = Outbox()
    outbox.publication(publication("/a", 1), 5)
    outbox.publication(publication("/b", 2), 5)
    outbox.forget("/a")
    assert drain(outbox) == [2]


def test_the_outbox_of_a_client_that_reads_nothing_is_limited():
    bench = Bench()
    client = bench.client()
    client.send(op="subscribe", topic="/robot_0/odom", queue_length=1)
    client.send(op="subscribe", topic="/robot_0/base_scan")
    bench.run(60)
    assert len(client.session.outbox) <= 101
    newest = client.operations("publish", "/robot_0/odom")
    assert len(newest) == 1
    stamp = newest[0]["msg"]["header"]["stamp"]
    assert bench.time - stamp["secs"] - stamp["nsecs"] * 1e-9 < 0.1


def test_too_many_unread_service_responses_overflow_a_session():
    bench = Bench()
    client = bench.client()
    call = '{"op":"call_service","service":"/rosapi/get_time"}'
    assert not client.session.overflowed
    for _ in range(11):
        client.session.receive(call * 1000)
    assert client.session.overflowed
