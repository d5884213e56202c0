"""Service calls: each has a socket of its own and does not wait for other calls."""

import json

from link_bench import in_loop, noting_bridge, raw_bridge

from equipment.waiting import until
from webmap.gate.lanes import calls
from webmap.gate.lanes.calls import RosbridgeCall, ServiceCalls


def request(id, service="/e_stop"):
    return json.dumps({"op": "call_service", "id": id, "service": service}).encode()


@in_loop
async def test_each_call_has_its_own_socket_that_closes_after_the_answer(caplog):
    async with noting_bridge() as bridge:
        made = ServiceCalls(bridge.url)
        made.call(RosbridgeCall(request("a"), "a"), "/e_stop")
        made.call(RosbridgeCall(request("b"), "b"), "/e_stop")
        await made.settle()
        assert {t.message["id"] for t in bridge.of("call_service")} == {"a", "b"}
        assert len({t.link for t in bridge.received}) == 2
        await until(lambda: not bridge.links, "the end of both sockets")
        await made.settle()  # there is nothing to wait for
    assert caplog.records == []


@in_loop
async def test_a_hanging_call_blocks_no_other_call_and_times_out(monkeypatch, caplog):
    monkeypatch.setattr(calls, "CALL_TIMEOUT", 1.0)
    async with noting_bridge() as bridge:
        bridge.answers_services = False
        made = ServiceCalls(bridge.url)
        made.call(RosbridgeCall(request("hangs"), "hangs"), "cancelling")
        await until(lambda: bridge.of("call_service"), "the first call")
        bridge.answers_services = True
        made.call(RosbridgeCall(request("second"), "second"), "/e_stop")
        await until(lambda: len(made._calling) == 1, "the end of the second")
        assert caplog.records == []
        await made.settle()
        assert [r.getMessage() for r in caplog.records] == [
            "cancelling: no answer within 1 s"
        ]
        bridge.unblock()
        await until(lambda: not bridge.links, "the end of its socket")


@in_loop
async def test_only_the_answer_with_the_id_of_the_call_ends_the_call():
    async with noting_bridge() as bridge:
        bridge.answers_services = False
        made = ServiceCalls(bridge.url)
        made.call(RosbridgeCall(request("a"), "a"), "/e_stop")
        await until(lambda: bridge.of("call_service"), "the call")
        await bridge.send(1, "rubbish")
        await bridge.send(1, '{"op": "service_response", "id": "another"}')
        await bridge.send(1, '{"op": "status", "id": null}')
        assert made._calling
        await bridge.send(1, '{"op": "service_response", "id": "a"}')
        await made.settle()
        bridge.unblock()


@in_loop
async def test_a_call_without_a_connection_is_logged_as_failed(caplog):
    async def talk(link):
        await link.request()
        link.send(b"HTTP/1.1 503 Service Unavailable\r\nContent-Length: 0\r\n\r\n")

    async with raw_bridge(talk) as url:
        made = ServiceCalls(url)
        made.call(RosbridgeCall(request("a"), "a"), "/e_stop")
        await made.settle()
        assert caplog.text.count("/e_stop: no connection: ") == 1
        assert "503" in caplog.text


@in_loop
async def test_a_call_ends_with_a_log_entry_when_its_connection_is_lost(caplog):
    async with noting_bridge() as bridge:
        bridge.answers_services = False
        made = ServiceCalls(bridge.url)
        made.call(RosbridgeCall(request("a"), "a"), "/e_stop")
        await until(lambda: bridge.of("call_service"), "the call")
        bridge.transport_of(1).abort()
        await made.settle()
        assert "/e_stop: no answer: connection lost" in caplog.text
        bridge.unblock()


@in_loop
async def test_closing_the_calls_closes_their_sockets_without_a_log_entry(caplog):
    async with noting_bridge() as bridge:
        bridge.answers_services = False
        made = ServiceCalls(bridge.url)
        made.call(RosbridgeCall(request("a"), "a"), "/e_stop")
        await until(lambda: bridge.of("call_service"), "the call")
        made.close()
        await made.settle()
        bridge.unblock()
        await until(lambda: not bridge.links, "the end of its socket")
    assert caplog.records == []
