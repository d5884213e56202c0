"""Only a complete and valid command from a browser moves a robot."""

import functools
import json
import pickle

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from safety_corpus import CORPUS, NO_NUMBERS, REST, ROBOT

from equipment.gate_harness import Bench, spec
from webmap.gate import actions, protocol

pytestmark = pytest.mark.slow

MOTION = {
    "drive": {"x": 1.0, "y": 0.0, "turn": 0.0},
    "goal": {"x": 1.0, "y": 2.0, "yaw": 0.5},
    "locate": {"x": 1.0, "y": 2.0, "yaw": 0.5},
}
"""Fields of the operations that move a robot, or the pose that the robot estimates."""

FIELDS = {"op", "robot", "epoch", "seq", "tick", "x", "y", "turn", "yaw"}


def armed():
    """Return a gate that has moved its robot and accepts further commands."""
    return pickle.loads(pickled())


@functools.cache
def pickled():
    """Return such a gate as bytes to copy, because making a new one takes 40 ms."""
    bench = Bench().begin(spec(pose_topic="/initialpose"))
    bench.drive_off()
    bench.hold(0.8)  # until the gate sends no more zeros
    assert bench.report().armed
    bench.done.clear()
    return pickle.dumps(bench)


def moved(bench):
    """Return all messages to the robot since it was armed that may move it."""
    kinds = (actions.SendGoal, actions.SendPose)
    received = [each for kind in kinds for each in bench.did(kind)]
    return [
        *received,
        *(w for w in bench.did(actions.WriteTwist) if not w.twist.is_zero),
    ]


def filled(bench, text):
    bench.seq += 1
    for name, value in (
        ("ROBOT", "r1"),
        ("EPOCH", bench.report().epoch),
        ("SEQ", bench.seq),
        ("TICK", bench.tick),
    ):
        text = text.replace(name, str(value))
    return text


def send(bench, text):
    data = text if isinstance(text, bytes) else text.encode(errors="surrogatepass")
    bench.handle(protocol.FromPage("a", data))


def good(bench, op="drive"):
    bench.seq += 1
    return {
        "op": op,
        "robot": "r1",
        "epoch": bench.report().epoch,
        "seq": bench.seq,
        "tick": bench.tick,
        **MOTION[op],
    }


@pytest.mark.parametrize("op", MOTION)
def test_the_valid_commands_of_the_fuzz_tests_move_the_robot(op):
    bench = armed()
    send(bench, json.dumps(good(bench, op)))
    assert moved(bench)


def test_the_valid_original_of_the_corpus_commands_moves_the_robot():
    bench = armed()
    at = bench.now
    stamp = '"epoch":EPOCH,"seq":SEQ,"tick":TICK'
    send(bench, filled(bench, f'{{{ROBOT},{stamp},"x":1.0,{REST}}}'))
    assert bench.moving_since(at)


@pytest.mark.parametrize("text", CORPUS, ids=range(len(CORPUS)))
def test_no_text_of_the_corpus_starts_or_continues_motion(text):
    bench = armed()
    send(bench, filled(bench, text))
    bench.run(0.1)
    assert moved(bench) == []
    assert bench.refusals()

    bench = armed()
    bench.hold(0.3, x=1.0)
    since = bench.now
    bench.run(0.5, lambda: send(bench, filled(bench, text)))
    assert bench.moving_since(since + 0.2101) == []
    assert bench.written[-1].twist.is_zero


values = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=8)
    | st.sampled_from(["r1", "drive", "take", "goal", "locate", 1, 0.5]),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(st.sampled_from(sorted(FIELDS)) | st.text(max_size=4), inner)
    ),
    max_leaves=8,
)


@settings(deadline=None, max_examples=60)
@given(st.lists(st.binary(max_size=200) | st.text(max_size=200), max_size=15))
def test_random_bytes_and_texts_never_move_the_robot(texts):
    bench = armed()
    for text in texts:
        send(bench, text)
        bench.run(0.06)
    assert moved(bench) == []


@settings(deadline=None, max_examples=100)
@given(st.binary(max_size=1200) | st.text(max_size=200) | values.map(json.dumps))
def test_a_stop_command_with_any_bytes_after_its_beginning_still_stops_the_robot(rest):
    bench = armed()
    rest = rest if isinstance(rest, bytes) else rest.encode(errors="surrogatepass")
    send(bench, b'{"op":"stop"' + rest)
    assert bench.report().latched
    assert bench.written[-1].twist.is_zero


@settings(deadline=None, max_examples=60)
@given(st.lists(values, max_size=15))
def test_random_json_never_moves_the_robot(whole):
    bench = armed()
    for value in whole:
        send(bench, json.dumps(value))
        bench.run(0.06)
    assert moved(bench) == []


@settings(deadline=None, max_examples=100)
@given(st.data())
def test_a_command_with_one_invalid_field_never_moves_the_robot(data):
    bench = armed()
    command = good(bench, data.draw(st.sampled_from(sorted(MOTION))))
    name = data.draw(st.sampled_from(sorted(command)))
    how = data.draw(st.sampled_from(["dropped", "twice", "token", "renamed"]))
    if how == "dropped":
        del command[name]
        text = json.dumps(command)
    elif how == "renamed":
        command[data.draw(st.text(max_size=6).filter(lambda n: n not in FIELDS))] = (
            command.pop(name)
        )
        text = json.dumps(command)
    elif how == "twice":
        again = json.dumps({name: command[name]})
        text = f"{json.dumps(command)[:-1]},{again[1:]}"
    else:
        token = data.draw(st.sampled_from(NO_NUMBERS))
        parts = [
            f"{json.dumps(key)}:{token if key == name else json.dumps(value)}"
            for key, value in command.items()
        ]
        text = f"{{{','.join(parts)}}}"
    send(bench, text)
    bench.run(0.1)
    assert moved(bench) == []


@settings(deadline=None, max_examples=100)
@given(st.lists(st.integers(0, 9), min_size=10, max_size=30))
def test_a_valid_command_among_invalid_ones_moves_the_robot_for_200_ms_at_most(kinds):
    bench = armed()
    good_at = [bench.now]

    def send_next():
        nonlocal kinds
        kind, kinds = kinds[0], [*kinds[1:], kinds[0]]
        if kind == 0:
            good_at.append(bench.now)
            send(bench, json.dumps(good(bench)))
        elif kind < 3:  # more than 20 a second would close the page's connection
            send(bench, filled(bench, CORPUS[kind]))

    bench.run(2.0, send_next)
    for written in bench.moving_since(good_at[0]):
        assert min(written.at - at for at in good_at if at <= written.at) <= 0.2101


FROM_THE_PAGE = """(async () => {
    const url = new URL("/_webmap/drive", location.href);
    url.protocol = "ws:";
    const { protocols } = await import("/_webmap/web/access.js");
    const socket = new WebSocket(url, protocols());
    let tick = null, robot = null, epoch = null, seq = 0, refused = 0, closed = false;
    socket.onclose = () => { closed = true; };
    socket.onmessage = (event) => {
        const message = JSON.parse(event.data);
        if (message.op === "tick") tick = message.tick;
        if (message.op === "robot") {
            robot = message.robot;
            epoch = message.mine ? message.epoch : null;
        }
        if (message.op === "refused") refused += 1;
    };
    const until = async (check) => {
        for (let n = 0; n < 400 && !check(); n += 1)
            await new Promise((done) => setTimeout(done, 25));
    };
    const wait = (ms) => new Promise((done) => setTimeout(done, ms));
    await until(() => tick !== null && robot !== null);
    socket.send(JSON.stringify({ op: "take", robot }));
    await until(() => epoch !== null);
    const drive = (x) => socket.send(JSON.stringify(
        { op: "drive", robot, epoch, seq: ++seq, tick, x, y: 0, turn: 0 }));
    for (let n = 0; n < 8; n += 1) { drive(0); await wait(50); }
    const taken = epoch !== null;
    for (const text of CORPUS) {
        const filled = text.replaceAll("ROBOT", robot).replaceAll("EPOCH", epoch)
            .replaceAll("SEQ", ++seq).replaceAll("TICK", tick);
        socket.send(filled);
        await wait(35);
        if (!closed) drive(0);
        await wait(35);
    }
    const alive = !closed;
    socket.close();
    return { taken, refused, alive };
})()"""


@pytest.mark.safety
@pytest.mark.browser
@pytest.mark.serial
def test_no_text_of_the_corpus_sent_by_a_page_moves_the_robot(bench):
    bench.open_page()
    before = len(bench.robot.log.twists)
    # The server closes the socket at a too long message, without reading it.
    short = [text for text in CORPUS if len(text) < 1000]
    script = FROM_THE_PAGE.replace("CORPUS", json.dumps(short), 1)
    result = bench.tab.evaluate(script)
    assert result["taken"], "the socket of the page did not get control"
    assert result["alive"], "the gate closed the connection too early"
    assert result["refused"] > 0
    assert [t for t in bench.robot.log.twists[before:] if not t.is_zero] == []
    bench.drive_off()
    bench.let_go()
