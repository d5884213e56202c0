"""No command that was sent more than 300 ms ago moves the robot (S2).

A page sends another direction every 0.7 s and records the time of each command. The
direction of a velocity at the robot therefore shows when its command was sent. The
test does not use the ticks of the gate: both times are from the clock of this machine.
Each direction is sent for 0.4 s, and again 5.6 s later; all stalls are shorter.
"""

import time

import pytest
from safety_bench import pass_time
from safety_run import LONG

from equipment.waiting import wait_for
from webmap.testing import Shape

pytestmark = [pytest.mark.safety, pytest.mark.browser, pytest.mark.serial]

MAX_AGE = 0.3
"""The age in seconds above which the gate refuses a command."""

ON_THE_WAY = 0.1
"""Seconds for the transport to and from the gate, and for comparing the clocks."""

DRIVE = """(async () => {
    const { protocols } = await import("/_webmap/web/access.js");
    const OFF = [0, 0];
    const PHASES = [
        [1, 0], [0, 1], [-1, 0], [0, -1], [1, 1], [-1, 1], [-1, -1], [1, -1],
    ];
    const sent = [];
    let socket, tick, robot, epoch, seq = 0;
    const connect = () => {
        const url = new URL("/_webmap/drive", location.href);
        url.protocol = "ws:";
        [tick, robot, epoch] = [null, null, null];
        socket = new WebSocket(url, protocols());
        socket.onclose = () => setTimeout(connect, 100);
        socket.onmessage = (event) => {
            const message = JSON.parse(event.data);
            if (message.op === "tick") tick = message.tick;
            if (message.op !== "robot") return;
            robot = message.robot;
            epoch = message.mine ? message.epoch : null;
            if (message.state === "free") {
                socket.send(JSON.stringify({ op: "take", robot }));
            }
        };
    };
    connect();
    setInterval(() => {
        if (socket.readyState !== WebSocket.OPEN || tick === null) return;
        const now = performance.timeOrigin + performance.now();
        const phase = Math.floor(now / 700);
        const off = now % 700 > 400 || epoch === null;
        const [x, turn] = off ? OFF : PHASES[phase % PHASES.length];
        sent.push([now / 1000, x, turn]);
        seq += 1;
        const stamp = { op: "drive", robot, epoch: epoch ?? 0, seq, tick };
        socket.send(JSON.stringify({ ...stamp, x, y: 0, turn }));
    }, 50);
    window.sent = () => sent;
    return true;
})()"""


def sign(number):
    return (number > 0) - (number < 0)


def ages(received, sent):
    """Return the age of each nonzero velocity: since its direction was sent last."""
    found = []
    for each in received:
        way = sign(each.twist.vx), sign(each.twist.wz)
        if way == (0, 0):
            continue
        earlier = [one for one in sent if one[0] <= each.at + 0.02]
        times = [at for at, x, turn in earlier if (x, turn) == way]
        assert times, f"the page did not send {each.twist}"
        found.append(each.at - times[-1])
    return found


def stall(bench, way, seconds):
    bench.web_hop.hold(way)
    pass_time(seconds)
    bench.web_hop.release(way)


@pytest.fixture
def driven(bench):
    """A bench whose page drives the robot in all directions, one after the other."""
    bench.open_page()
    assert bench.tab.evaluate(DRIVE)
    wait_for(lambda: len(moves(bench)) > 20, "motion")
    yield bench
    bench.web_hop.shape(Shape())
    bench.close_page()


def moves(bench):
    return [received for received in bench.robot.log.twists if not received.is_zero]


def commands_of(bench):
    offset = time.time() - time.monotonic()
    return [(at - offset, x, turn) for at, x, turn in bench.tab.evaluate("sent()")]


@LONG
@pytest.mark.parametrize("way", ["up", "down", "both"])
def test_stalls_between_page_and_gate_deliver_no_command_above_the_age_limit(
    driven, way
):
    begin, since = len(driven.robot.log.twists), time.monotonic()
    for seconds in (0.2, 0.5, 1.0, 3.0):
        stall(driven, way, seconds)
        before = len(moves(driven))
        wait_for(lambda b=before: len(moves(driven)) > b + 10, "motion after the stall")
    found = ages(driven.robot.log.twists[begin:], commands_of(driven))
    assert len(found) > 40
    assert max(found) <= MAX_AGE + ON_THE_WAY + driven.sentinel.worst(since)


def test_a_slow_link_with_jitter_delivers_no_command_above_the_age_limit(driven):
    begin, since = len(driven.robot.log.twists), time.monotonic()
    driven.web_hop.shape(Shape(latency=0.03, jitter=0.12))
    pass_time(6.0)
    found = ages(driven.robot.log.twists[begin:], commands_of(driven))
    assert found, "the link was too slow to drive at all"
    assert max(found) <= MAX_AGE + ON_THE_WAY + driven.sentinel.worst(since)
