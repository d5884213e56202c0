"""The browser's decoder reads the tree that Python encoded."""

import base64
import itertools
import json
import os
import secrets
import shutil
import subprocess
from pathlib import Path
from unittest.mock import patch

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from wire_picture import histories, picture_of, play

from webmap.base.geometry import Affine
from webmap.scene import html, node, svg
from webmap.scene.document import Document
from webmap.scene.live import Line
from webmap.scene.node import Fragment
from webmap.scene.wire.session import SceneSession

HERE = Path(__file__).parent
GOLDEN = HERE / "golden"
DECODER = HERE.parents[1] / "web" / "decode.mjs"


class Decoder:
    """A node process that answers frames with the tree that they build."""

    def __init__(self):
        executable = shutil.which("node")
        assert executable, "node is needed to test the browser's decoder"
        self._process = subprocess.Popen(
            [executable, DECODER],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def read(self, frames):
        encoded = [base64.b64encode(frame).decode() for frame in frames]
        self._process.stdin.write(json.dumps(encoded) + "\n")
        self._process.stdin.flush()
        return json.loads(self._process.stdout.readline())

    def close(self):
        self._process.stdin.close()
        assert self._process.wait(10) == 0
        self._process.stdout.close()


@pytest.fixture(scope="module")
def decoder():
    decoder = Decoder()
    yield decoder
    decoder.close()


@pytest.mark.slow
@given(histories)
@settings(max_examples=60)
def test_the_browser_decoder_builds_the_same_tree_for_any_scene_history(
    decoder, history
):
    session = SceneSession()
    answer = decoder.read(play(history, session))
    assert "error" not in answer, answer
    assert answer["picture"] == json.loads(json.dumps(picture_of(session)))


ADD = ("extend", 1, 0)
line_steps = st.lists(
    st.one_of(
        st.tuples(st.just("set"), st.integers(0, 4)),
        st.tuples(st.just("extend"), st.integers(0, 40), st.integers(0, 4)),
        st.tuples(st.sampled_from(["text", "unset", "take out", "one", "other"])),
        st.tuples(st.just("page"), st.integers(0, 1)),
    ),
    max_size=25,
)


@patch.object(Line, "KNOWN", 3)
@given(steps=line_steps)
@example(steps=[ADD, ("other",), ("one",), ADD, ("other",), ("page", 0), ADD])
@settings(max_examples=60)
def test_every_page_has_the_points_of_a_line_after_any_steps(decoder, steps):
    """The line moves between two fragments; the pages are late by a number of steps."""
    line, places, count = svg.polyline(), [svg.g(), svg.g()], itertools.count()
    fragments = [Fragment(place) for place in places]
    pages = [(SceneSession(), []), (SceneSession(), [])]
    for session, _ in pages:
        for fragment in fragments:
            session.mount(fragment, under=0)

    def look(session, frames):
        frame = session.frame(0.0)
        if frame is not None:
            frames.append(frame)
            session.receive(f'{{"op":"seen","frame":{session._frame}}}')

    def points(number):
        return [(next(count), 0.25) for _ in range(number)]

    places[0].append(line)
    for name, *numbers in [*steps, ("page", 0), ("page", 1)]:
        match name:
            case "set":
                line.set_line(points(*numbers))
            case "extend":
                line.extend_line(points(numbers[0]), drop=numbers[1])
            case "text":
                line.set(points=points(2))
            case "unset":
                line.unset("points")
            case "take out":
                line.remove()
            case "page":
                look(*pages[numbers[0]])
            case _:
                places[name == "other"].append(line)
    for session, frames in pages:
        answer = decoder.read(frames)
        assert answer.get("picture") == json.loads(json.dumps(picture_of(session)))


@given(st.binary(max_size=200), st.booleans())
def test_the_browser_decoder_reads_any_bytes_or_raises_a_known_error(
    decoder, data, with_header
):
    session = SceneSession()
    session.error("x")
    frame = session.frame(0.0)[:15] + data if with_header else data
    answer = decoder.read([frame])
    # The plain tree of the tests fails on unknown ids; a page does not.
    assert answer.get("kind", "WireError") in (
        "WireError",
        "VersionError",
        "TypeError",
        "Error",
    )


def everything_about_elements():
    root = svg.g(
        svg.title("Bob <b>&amp;</b> ü 🤖"),
        svg.circle(r=0.2, fill="red", stroke_width=0.02, data_name="Bob"),
        class_="robot stage",
        aria_label="robot Bob",
    )
    dots = svg.path(class_="dot").set_style("--dot-size", 0.05)
    dots.set_dots(b"\x01\x00\xff\xff\xe8\x03\x18\xfc", 0.001)
    line = svg.polyline().set_line([(1.5, -2), (3, 4)]).extend_line([(5, 6)], drop=1)
    root.append(dots, svg.g(transform="scale(2)"), line)
    root.set_pose(1.5, -2.25, 0.5)
    root.on("click", print, prevent=True, stop=True)
    root.children[3].set_matrix(Affine(1, 2, 3, 4, 5.5, 6))
    session = SceneSession()
    mount = session.mount(Fragment(root), under=0, order=2.5)
    session.set_class(mount, "selected", True)
    session.listen(mount, root.id, "pointerdown", prevent=True, stop=False)
    return session


def a_page_with_a_map():
    session = SceneSession()
    document = Document()
    page = session.mount(Fragment(document), under=0)
    document.bind("log").prepend(html.p("hello", html.input(type="text", value="x")))
    document.bind("label").text = "Bob"
    world = svg.g(class_="world")
    root = svg.svg(world, class_="webmap").set_map(world, 700, 500)
    container = document.bind("webmap_container")
    mount = session.mount(Fragment(root), under=container.id, within=page)
    robot = svg.g()
    robot.set_pose(500_000.5, 0, 0)
    session.mount(Fragment(robot), under=world.id, within=mount, order=100)
    session.view(root.id, "scale", 8.5, 350, 250)
    session.view(root.id, "follow", robot.id)
    session.attach(root.id, 7, "features/drive/teleop.js", {"speed": 1}, "teleop.css")
    session.send(7, {"text": "ü"})
    session.error("Something is wrong.")
    session.problem(300, "Something is wrong for now.")
    return session


def one_tick_of_two_robots():
    session = SceneSession()
    robots = [svg.g(svg.circle(r=0.2)), svg.g(svg.circle(r=0.2))]
    for robot in robots:
        session.mount(Fragment(robot), under=0)
    session.frame(0.0)
    for x, robot in enumerate(robots):
        robot.set_pose(x, 2, 3)
    session.restart()
    return session


GOLDEN_SESSIONS = (everything_about_elements, a_page_with_a_map, one_tick_of_two_robots)


@pytest.mark.parametrize("make", GOLDEN_SESSIONS)
def test_the_encoded_frames_match_the_golden_files(make, decoder, monkeypatch):
    monkeypatch.setattr(node, "_node_ids", itertools.count(1))
    monkeypatch.setattr(node, "_fragment_ids", itertools.count(1))
    monkeypatch.setattr(secrets, "randbits", lambda bits: 12345)
    session = make()
    frame = session.frame(1.5)
    target = GOLDEN / f"{make.__name__}.bin"
    if "WEBMAP_UPDATE_GOLDEN" in os.environ:
        number = session._frame
        flags = {"reset": bool(frame[2]), "frame": number, "now": 1.5}
        answer = decoder.read([frame])
        target.write_bytes(frame)
        text = json.dumps({**flags, **answer}, indent=1, ensure_ascii=False) + "\n"
        target.with_suffix(".json").write_text(text, encoding="utf-8")
        assert answer["picture"] == json.loads(json.dumps(picture_of(session)))
    assert frame == target.read_bytes(), (
        "the wire changed: if it was meant to, run this test with "
        "WEBMAP_UPDATE_GOLDEN=1 and look at the difference"
    )
