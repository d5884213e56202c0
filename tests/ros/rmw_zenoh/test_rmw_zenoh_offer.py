"""What liveliness tokens announce, and the frames for it, without a router."""

from collections import deque

import pytest

from webmap.base.errors import ProtocolError
from webmap.ros.foxglove.protocol import (
    Advertise,
    MessageData,
    Status,
    Unadvertise,
    receive,
)
from webmap.ros.limits import MAX_FRAME
from webmap.ros.rmw_zenoh import offer as offers
from webmap.ros.rmw_zenoh.offer import Offer, change_of, message_frame, read_token
from webmap.ros.sockets.frame_reader import whole_of

# The examples of docs/design.md of rmw_zenoh.
STRING = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
HEAD = "@ros2_lv/0/8b20917502ee955ac4476e0266340d5c/0/10"
TALKER = (
    f"{HEAD}/MP/%/%/talker/%chatter/std_msgs::msg::dds_::String_/{STRING}/::,7:,:,:,,"
)
LISTENER = "@ros2_lv/0/aac3178e146ba6f1fc6e6a4085e77f21/0/0/NN/%/%/listener"


def odometry(i, kind="MP", topic="%odom", hash="h", quality=""):
    type = "nav_msgs::msg::dds_::Odometry_"
    return (
        f"@ros2_lv/0/a/0/{i}/{kind}/%/%/n{i}/{topic}/{type}/{hash}/:{quality}:,7:,:,:,,"
    )


def apply(offer, came=(), gone=()):
    """Return what a client reads after tokens came and went."""
    changes = deque(change_of(token, came=True) for token in came)
    changes.extend(change_of(token, came=False) for token in gone)
    frames = [receive(frame) for frame in offer.apply(changes)]
    assert not changes
    return frames


def changed(offer, came=(), gone=()):
    """Return the topics of the new channels, and the ids of those that ended."""
    ended, new = apply(offer, came, gone)
    assert isinstance(ended, Unadvertise)
    assert isinstance(new, Advertise)
    assert not new.faults
    return [each.topic for each in new.channels], ended.channel_ids


def test_the_examples_of_the_design_of_rmw_zenoh_are_read():
    talker = read_token(TALKER)
    source = talker.source
    assert talker.publishes
    assert (talker.node, source.topic) == ("/talker", "/chatter")
    assert (source.type, source.hash) == ("std_msgs/msg/String", STRING)
    assert source.key == f"chatter/std_msgs::msg::dds_::String_/{STRING}"
    assert not talker.latched
    assert not read_token(TALKER.replace("/MP/", "/MS/")).publishes
    assert read_token(LISTENER) is None
    assert read_token(TALKER.replace("/MP/", "/SS/")) is None
    assert read_token(TALKER.replace("/MP/", "/SC/")) is None


def test_a_namespace_and_transient_local_are_read():
    token = TALKER.replace("%/%/talker/%chatter", "%/%one%arm/talker/%one%arm%map")
    latched = read_token(token.replace("::,7", ":1:,7"))
    assert (latched.node, latched.source.topic) == ("/one/arm/talker", "/one/arm/map")
    assert latched.latched
    assert latched.source.key.startswith("one/arm/map/")
    later = read_token(token + "/cuda:0")  # of a later release
    assert later.source.topic == "/one/arm/map"


@pytest.mark.parametrize(
    "token",
    [
        "",
        "@ros2_lv/0",
        "@ros2_lv/0/a/0/1/MP/%/%/node",
        "other/0/a/0/1/NN/%/%/node",
        TALKER.replace("MP", "XX"),
        TALKER.replace("std_msgs::msg::dds_::String_", "std_msgs::msg::String"),
        TALKER.replace("dds_::String_", "dds_::9String_"),
        TALKER.replace("%chatter", "chatter"),
        TALKER.replace("%chatter", "%chat ter"),
        TALKER.replace("%chatter", "%%chatter"),
        TALKER.replace("%chatter", "%" + "long" * 100),
        TALKER.replace(STRING, "long" * 1000),
        TALKER.replace(STRING, "*"),
        TALKER.replace("/0/", "/*/", 1),
        TALKER.replace("/talker/", "/tal$*/"),
        TALKER.replace("String_", "long" * 1000 + "_"),
    ],
)
def test_a_lying_token_is_refused_in_words(token):
    with pytest.raises(ProtocolError, match="which no rmw_zenoh makes") as refused:
        read_token(token)
    assert len(str(refused.value)) < 400


def test_a_token_with_control_characters_is_shown_on_one_line():
    with pytest.raises(ProtocolError) as refused:
        read_token(TALKER.replace("%chatter", "%\x1b[31m\nchatter"))
    assert "\n" not in str(refused.value)
    assert "\x1b" not in str(refused.value)


def test_ten_thousand_tokens_come_and_go():
    offer = Offer()
    tokens = [odometry(i, topic=f"%odom{i % 100}") for i in range(10_000)]
    topics, ended = changed(offer, tokens)
    assert sorted(topics) == sorted(f"/odom{i}" for i in range(100))
    assert not ended
    assert len(offer.nodes("/odom7", publish=True)) == 100
    assert changed(offer, tokens) == ([], [])
    topics, ended = changed(offer, gone=[*tokens, *tokens, "never there"])
    assert (topics, len(ended)) == ([], 100)
    assert not offer.channels
    assert not offer._endpoints


def test_more_tokens_than_the_limit_are_left_out(monkeypatch):
    monkeypatch.setattr(offers, "MOST_ENDPOINTS", 3)
    offer = Offer()
    status, _, new = apply(offer, [odometry(i, topic=f"%o{i}") for i in range(5)])
    assert isinstance(status, Status)
    assert status.message == offers.TOO_MANY
    assert len(new.channels) == 3
    changed(offer, [odometry(2, topic="%o2")])  # it is known already
    changed(offer, gone=[odometry(0, topic="%o0")])
    assert changed(offer, [odometry(4, topic="%o4")])[0] == ["/o4"]


def test_a_channel_has_the_type_and_its_hash_and_lasts_as_long_as_a_publisher():
    offer = Offer()
    _, new = apply(offer, [odometry(1), odometry(2), odometry(3, hash="other")])
    first, second = new.channels
    assert (first.topic, first.encoding) == ("/odom", "cdr")
    assert (first.schema_name, first.schema) == ("nav_msgs/msg/Odometry", "h")
    assert second.schema == "other"
    assert changed(offer, gone=[odometry(1)]) == ([], [])
    assert changed(offer, gone=[odometry(2)]) == ([], [first.id])
    assert list(offer.channels) == [second.id]


def test_subscribers_announce_a_topic_until_it_has_a_publisher():
    offer = Offer()
    reader = odometry(1, "MS", hash="mine")
    assert changed(offer, [reader])[0] == ["/odom"]
    assert offer.nodes("/odom", publish=False) == ["/n1"]
    assert offer.nodes("/odom", publish=True) == []
    topics, ended = changed(offer, [odometry(2)])
    assert (topics, len(ended)) == (["/odom"], 1)
    assert [each.hash for each in offer.channels.values()] == ["h"]
    assert changed(offer, gone=[odometry(2)])[0] == ["/odom"]


def test_a_publisher_that_keeps_messages_makes_another_channel():
    offer = Offer()
    changed(offer, [odometry(1), odometry(2, "MS", quality="1")])
    ((plain, source),) = offer.channels.items()
    assert not source.latched
    latched = odometry(3, quality="1")
    assert changed(offer, [latched]) == (["/odom"], [plain])
    (source,) = offer.channels.values()
    assert source.latched
    assert changed(offer, [odometry(4), odometry(5, quality="1")]) == ([], [])


def test_errors_about_invalid_tokens_are_few():
    found = apply(Offer(), [f"lie {i}" for i in range(1000)] + [odometry(1)])
    errors = [each for each in found if isinstance(each, Status)]
    assert 1 < len(errors) < 100
    assert found[-1].channels


def test_as_many_channels_as_there_may_be_fit_into_one_frame():
    every = range(offers.MOST_ENDPOINTS)
    long = "h" * (offers.MOST_TOKEN - len(odometry(99_999, topic="%o99999", hash="")))
    tokens = [odometry(i, topic=f"%o{i}", hash=long) for i in every]
    assert len(changed(Offer(), tokens)[0]) == offers.MOST_ENDPOINTS


def test_without_changes_nothing_is_sent():
    assert apply(Offer()) == []


def attachment(time=5, length=16):
    number, stamp = (7).to_bytes(8, "little"), time.to_bytes(8, "little")
    return number + stamp + bytes([length]) + bytes(range(16))


def test_a_message_gets_the_time_of_its_attachment():
    frame = message_frame(3, "/odom", b"data", 4, attachment(time=12))
    assert receive(frame) == MessageData(3, 12)
    assert frame.endswith(b"data")


def test_of_a_message_that_is_too_long_the_length_is_sent():
    frame = message_frame(3, "/map", b"", MAX_FRAME + 1, attachment())
    size, head = whole_of(frame)
    assert size > MAX_FRAME
    assert receive(head) == MessageData(3, 5)


@pytest.mark.parametrize("wrong", [b"", bytes(32), bytes(34), attachment(length=15)])
def test_a_message_with_another_attachment_becomes_an_error(wrong):
    event = receive(message_frame(3, "/odom", b"data", 4, wrong))
    assert isinstance(event, Status)
    assert event.level == 2
    assert event.message.startswith("/odom: got a message with an attachment of")
    assert "older rmw_zenoh" in event.message
