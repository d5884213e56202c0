import json
import math

import pytest

from webmap.ros.rosbridge import ops


def decoded(frame):
    return json.loads(frame)


def test_a_subscription_has_an_id_a_throttle_rate_and_a_queue_length():
    assert decoded(
        ops.subscribe("/scan", id="WebMap-1", type="sensor_msgs/LaserScan")
    ) == {
        "op": "subscribe",
        "id": "WebMap-1",
        "topic": "/scan",
        "type": "sensor_msgs/LaserScan",
        "throttle_rate": 1,
        "queue_length": ops.BURST,
    }


@pytest.mark.parametrize("compression", [None, "none", "png", "cbor", "cbor-raw"])
@pytest.mark.parametrize("queue_length", [0, 1, 100])
@pytest.mark.parametrize("throttle", [0, 1, 250])
def test_no_subscription_can_hang_a_bridge_or_drop_a_burst(
    throttle, queue_length, compression
):
    frame = decoded(
        ops.subscribe(
            "/a",
            id="x",
            throttle_rate=throttle,
            queue_length=queue_length,
            compression=compression,
        )
    )
    assert frame["throttle_rate"] == max(throttle, 1)
    assert frame["queue_length"] >= max(queue_length, 1)
    if throttle == 0 and compression in (None, "none"):
        assert frame["queue_length"] >= 10


def test_an_unsubscribe_request_contains_the_subscription_id():
    assert decoded(ops.unsubscribe("/scan", id="WebMap-1")) == {
        "op": "unsubscribe",
        "id": "WebMap-1",
        "topic": "/scan",
    }


def test_advertised_topics_are_not_latched():
    frame = decoded(ops.advertise("/cmd_vel", "geometry_msgs/Twist", id="WebMap-2"))
    assert frame["queue_size"] == 1
    assert frame["latch"] is False


def test_a_call_without_arguments_sends_an_empty_mapping():
    assert decoded(ops.call_service("/rosapi/topics", id="WebMap-3"))["args"] == {}


@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf])
def test_nan_and_infinity_are_never_sent(number):
    with pytest.raises(ValueError, match=r"JSON|nan|inf"):
        ops.publish("/cmd_vel", {"linear": {"x": number}})
    with pytest.raises(ValueError, match=r"JSON|nan|inf"):
        ops.call_service("/set", {"value": [number]}, id="WebMap-4")


def test_values_without_a_json_form_are_refused():
    with pytest.raises(TypeError):
        ops.publish("/a", {"x": object()})
    loop = []
    loop.append(loop)
    with pytest.raises(ValueError, match=r"[Cc]ircular"):
        ops.publish("/a", {"x": loop})


def test_text_of_any_language_is_kept():
    assert decoded(ops.publish("/a", {"data": "löwe 獅"}))["msg"] == {"data": "löwe 獅"}


def test_a_lone_surrogate_is_refused():
    with pytest.raises(ValueError, match="surrogates"):
        ops.publish("/a", {"data": "\ud800"})
