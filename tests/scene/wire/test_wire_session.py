import gzip
import json
import struct

import pytest

from webmap.base.errors import WireError
from webmap.scene import html, svg
from webmap.scene.document import Document
from webmap.scene.node import Fragment
from webmap.scene.wire.messages import ElementEvent, ModuleMessage, ViewReport
from webmap.scene.wire.opcodes import RESET, VERSION
from webmap.scene.wire.page_state import PendingRecords
from webmap.scene.wire.session import SceneSession

HEADER = struct.Struct("<HBId")


def header(frame):
    return HEADER.unpack_from(frame)


def seen(session, frame):
    number = header(frame)[2]
    session.receive(f'{{"op":"seen","frame":{number}}}')


def next_frame(session, now=0.0):
    frame = session.frame(now)
    if frame is not None:
        seen(session, frame)
    return frame


def event(mount, element, kind="click"):
    return f'{{"op":"event","mount":{mount},"element":{element.id},"event":"{kind}"}}'


def report(element, applied=0, a=1.0):
    return (
        f'{{"op":"view","map_element":{element.id},"a":{a},"b":0,"c":0,"d":-1,"e":350,'
        f'"f":250,"width":700,"height":500,"left":0,"top":0,"applied":{applied}}}'
    )


def a_map():
    world = svg.g(class_="world")
    root = svg.svg(world, class_="webmap")
    root.set_map(world, 700, 500)
    return root, world


def test_a_session_without_changes_sends_no_frame():
    assert SceneSession().frame(0.0) is None


def test_a_frame_has_a_version_a_number_and_the_time():
    session = SceneSession()
    session.error("hello")
    assert header(session.frame(12.5)) == (VERSION, 0, 1, 12.5)


def test_only_changes_are_sent_after_the_first_frame():
    session = SceneSession()
    root = svg.g()
    session.mount(Fragment(root), under=0)
    assert next_frame(session)
    assert session.frame(0.0) is None
    root.set_pose(1, 2, 3)
    # Seven bits of a number are a byte.
    ids = [-(-id.bit_length() // 7) for id in (root.id, root.fragment.id)]
    assert len(next_frame(session)) == HEADER.size + len(b"op") + sum(ids) + 12
    assert session.frame(0.0) is None


def test_a_page_receives_a_heartbeat_one_second_after_the_last_frame():
    session = SceneSession()
    assert session.frame(100.0) is None
    session.error("hello")
    next_frame(session, now=100.0)
    assert session.frame(100.9) is None
    heartbeat = next_frame(session, now=101.0)
    assert len(heartbeat) == HEADER.size
    assert header(heartbeat)[1:] == (0, 2, 101.0)
    assert session.frame(101.5) is None


def test_a_viewer_without_acknowledgements_gets_no_third_frame():
    session = SceneSession()
    root = svg.g()
    session.mount(Fragment(root), under=0)
    frames = []
    for x in range(10):
        root.set_pose(x, 0, 0)
        frames.append(session.frame(0.0))
    assert [frame is not None for frame in frames] == [True, True] + [False] * 8
    seen(session, frames[0])
    assert struct.pack("<f", 9) in session.frame(0.0)
    assert session.frame(0.0) is None


def test_an_acknowledgement_of_an_unsent_frame_is_ignored():
    session = SceneSession()
    for _ in range(2):
        session.error("x")
        session.frame(0.0)
    session.receive('{"op":"seen","frame":999}')
    session.error("x")
    assert session.frame(0.0) is None


def test_a_slow_viewer_does_not_delay_a_fast_viewer():
    root = svg.g()
    fragment = Fragment(root)
    slow, quick = SceneSession(), SceneSession()
    for session in (slow, quick):
        session.mount(fragment, under=0)
        next_frame(session)
    for x in range(5):
        root.set_pose(x, 0, 0)
        slow.frame(0.0)
        assert next_frame(quick)


def test_the_same_change_is_encoded_once_for_all_sessions(monkeypatch):
    from webmap.scene.wire import encode

    calls = []
    real = encode._encode_changes
    monkeypatch.setattr(
        encode, "_encode_changes", lambda *args: calls.append(args) or real(*args)
    )
    root = svg.g()
    fragment = Fragment(root)
    sessions = [SceneSession() for _ in range(50)]
    for session in sessions:
        session.mount(fragment, under=0)
        next_frame(session)
    root.set_pose(1, 2, 3)
    assert len({next_frame(session)[HEADER.size :] for session in sessions}) == 1
    assert len(calls) == 1


def test_a_viewer_too_far_behind_receives_a_full_reset():
    session = SceneSession()
    root = svg.g()
    fragment = Fragment(root)
    session.mount(fragment, under=0)
    next_frame(session)
    for _ in range(Fragment.REMOVALS_KEPT + 1):
        child = svg.g()
        root.append(child)
        fragment.mark_sent()
        child.remove()
    assert header(session.frame(0.0))[1] == RESET


def test_a_restart_sends_the_whole_scene_with_the_choices_of_the_page():
    session = SceneSession()
    root, _ = a_map()
    mount = session.mount(Fragment(root), under=0)
    session.set_class(mount, "selected", True)
    session.listen(mount, root.id, "click")
    session.view(root.id, "translate", 1, 2)
    session.attach(root.id, 7, "modules/x.js", {"speed": 1}, "x.css")
    first = session.frame(0.0)
    session.restart()
    again = session.frame(1.0)
    assert header(again)[1:3] == (RESET, 2)
    for part in (b"selected", b"modules/x.js", b'{"speed":1}', b"x.css"):
        assert part in first
        assert part in again
    assert struct.pack("<dd", 1, 2) in again


def test_a_page_that_reads_gzip_gets_a_large_whole_scene_compressed_and_no_changes():
    plain, packed = SceneSession(), SceneSession()
    hello = {"op": "hello", "page": "page-0001", "url": "/", "width": 1, "height": 1}
    plain.receive(json.dumps(hello))
    packed.receive(json.dumps({**hello, "gzip": True}))
    texts = [html.p(text="a long sentence") for _ in range(200)]
    fragment = Fragment(html.div(*texts))
    for session in (plain, packed):
        session.restart()
        session.mount(fragment, under=0)
    whole, small = plain.frame(0.0), packed.frame(0.0)
    assert len(small) < len(whole) / 3
    assert gzip.decompress(small) == whole
    texts[0].text = "another sentence " * 200
    assert plain.frame(0.0) == packed.frame(0.0)


def test_a_small_whole_scene_is_not_compressed():
    session = SceneSession()
    session.receive(
        '{"op":"hello","page":"page-0001","url":"/","width":1,"height":1,"gzip":true}'
    )
    session.restart()
    session.mount(Fragment(html.p(text="short")), under=0)
    assert header(session.frame(0.0))[:2] == (VERSION, RESET)


def test_a_restart_allows_two_new_unacknowledged_frames():
    session = SceneSession()
    for _ in range(2):
        session.error("x")
        session.frame(0.0)
    session.restart()
    assert session.frame(0.0) is not None
    session.error("x")
    assert session.frame(0.0) is not None
    session.error("x")
    assert session.frame(0.0) is None


def test_a_page_that_asks_for_a_resync_receives_a_full_reset():
    session = SceneSession()
    session.mount(Fragment(svg.g()), under=0)
    next_frame(session)
    assert session.receive('{"op":"resync"}') == []
    assert header(session.frame(0.0))[1] == RESET


def test_a_mount_removed_before_the_next_frame_is_not_sent():
    session = SceneSession()
    fragment = Fragment(svg.g())
    session.unmount(session.mount(fragment, under=0))
    assert session.frame(0.0) is None
    session.unmount(99)


def test_unmounting_a_fragment_also_unmounts_the_fragments_inside():
    session = SceneSession()
    root, world = a_map()
    outer = session.mount(Fragment(root), under=0)
    inner = session.mount(Fragment(svg.g()), under=world.id, within=outer)
    session.attach(root.id, 1, "x.js", {})
    session.unmount(outer)
    assert session.fragment(inner) is None
    assert not session._fragments
    assert not session._map_views
    assert not session._attached
    with pytest.raises(WireError, match="not on the page"):
        session.set_class(inner, "x", True)
    with pytest.raises(WireError, match="not on the page"):
        session.mount(Fragment(svg.g()), under=1, within=outer)


def test_only_events_with_a_handler_are_accepted():
    session = SceneSession()
    button, other = html.button(), html.button()
    mount = session.mount(Fragment(html.div(button, other)), under=0)
    assert session.receive(event(mount, button)) == []
    removal = button.on("click", print)
    (seen,) = session.receive(event(mount, button))
    assert isinstance(seen, ElementEvent)
    assert session.element(mount, seen.element) is button
    assert session.receive(event(mount, other)) == []
    assert session.receive(event(mount + 1, button)) == []
    assert session.receive(event(mount, button, "keydown")) == []
    removal.remove()
    assert session.receive(event(mount, button)) == []


def test_a_listener_of_one_session_does_not_apply_to_another_session():
    ours, theirs = SceneSession(), SceneSession()
    root = svg.g()
    fragment = Fragment(root)
    mounts = [session.mount(fragment, under=0) for session in (ours, theirs)]
    ours.listen(mounts[0], root.id, "click", stop=True)
    assert ours.receive(event(mounts[0], root))
    assert theirs.receive(event(mounts[1], root)) == []
    ours.unlisten(mounts[0], root.id, "click")
    ours.unlisten(mounts[0], root.id, "click")
    assert ours.receive(event(mounts[0], root)) == []


def test_applied_view_operations_are_not_sent_again():
    session = SceneSession()
    root, _ = a_map()
    session.mount(Fragment(root), under=0)
    for x in (1.5, 2.5, 3.5):
        session.view(root.id, "translate", x, 0)
    session.frame(0.0)
    (seen,) = session.receive(report(root, applied=2, a=42.25))
    assert isinstance(seen, ViewReport)
    session.restart()
    again = session.frame(0.0)
    assert struct.pack("<d", 42.25) in again
    received = [x for x in (1.5, 2.5, 3.5) if struct.pack("<dd", x, 0) in again]
    assert received == [3.5]


def test_pending_view_operations_of_an_inactive_page_are_limited():
    session = SceneSession()
    root, _ = a_map()
    session.mount(Fragment(root), under=0)
    for _ in range(100_000):
        session.view(root.id, "translate", 1, 0)
    canvas = session._map_views[root.id]
    assert len(canvas._unreported) == canvas.UNREPORTED_KEPT
    assert len(session.frame(0.0)) < 100_000


@pytest.mark.parametrize(
    ("operation", "args"),
    [("spin", (1,)), ("scale", ()), ("set", (1, 2)), ("rotate", (float("nan"),))],
)
def test_an_invalid_view_operation_is_refused(operation, args):
    session = SceneSession()
    root, _ = a_map()
    session.mount(Fragment(root), under=0)
    with pytest.raises(ValueError, match="got"):
        session.view(root.id, operation, *args)


def test_only_maps_have_views_and_modules():
    session = SceneSession()
    root = svg.svg()
    session.mount(Fragment(root), under=0)
    with pytest.raises(WireError, match="no map"):
        session.view(root.id, "scale", 2)
    with pytest.raises(WireError, match="no map"):
        session.attach(root.id, 1, "x.js", {})
    assert session.receive(report(root)) == []


def test_module_messages_pass_only_while_the_module_is_attached():
    session = SceneSession()
    root, _ = a_map()
    session.mount(Fragment(root), under=0)
    session.attach(root.id, 5, "x.js", {})
    text = '{"op":"module","instance":5,"data":{"x":1}}'
    assert session.receive(text) == [ModuleMessage(instance=5, data={"x": 1})]
    session.send(5, {"hello": "there"})
    assert b'{"hello":"there"}' in session.frame(0.0)
    session.detach(5)
    session.send(5, {"hello": "again"})
    assert session.receive(text) == []
    assert b"again" not in session.frame(0.0)


def test_pending_error_messages_of_an_inactive_page_are_limited():
    session = SceneSession()
    for number in range(5000):
        session.error(f"number {number}")
    frame = session.frame(0.0)
    assert frame.count(b"number ") == PendingRecords.MESSAGES_KEPT
    assert b"number 4999" in frame


def test_the_bytes_that_wait_for_a_sleeping_page_are_limited():
    session = SceneSession()
    root, world = a_map()
    outer = session.mount(Fragment(root), under=0)
    session.attach(root.id, 5, "x.js", {})
    next_frame(session)
    for number in range(200):
        session.send(5, {"number": number, "more": "x" * 50_000})
    pending = session._pending
    assert sum(map(len, pending.messages)) <= PendingRecords.MESSAGE_BYTES_KEPT
    frame = next_frame(session)
    assert b'"number":199,' in frame
    # A single message may be longer.
    session.send(5, {"more": "x" * 2_000_000})
    assert len(next_frame(session)) > 2_000_000
    session.frame(1.0)
    session.frame(2.0)
    for _ in range(1000):  # while the page acknowledges nothing
        session.send(5, {"number": -1})
        session.view(root.id, "translate", 1.0, 1.0)
    for _ in range(100_000):
        inner = session.mount(Fragment(svg.g()), under=world.id, within=outer)
        pending.new.clear()  # as if the page had received the frame
        session.unmount(inner)
        assert len(pending.gone) <= PendingRecords.BYTES_KEPT
    assert pending.send_all


def test_a_page_receives_the_current_state_of_each_problem():
    session = SceneSession()
    session.problem(7, "it is 1 m off")
    session.problem(8, "it is hot")
    session.mended(8)
    session.problem(7, "it is lost")
    frame = session.frame(0.0)
    assert frame[15:] == b"\x0e\x07\x0ait is lost" + b"\x0e\x08\x00"
    session.mended(7)
    assert session.frame(0.0)[15:] == b"\x0e\x07\x00"


def test_a_reloaded_page_receives_the_newest_unsolved_problems():
    session = SceneSession()
    for number in range(200):
        session.problem(number, f"number {number}.")
    session.mended(199)
    session.frame(0.0)
    session.restart()
    again = session.frame(0.0)
    received = [number for number in range(200) if b"number %d." % number in again]
    assert len(received) == PendingRecords.PROBLEMS_KEPT - 1
    assert received == list(range(100, 199))


def test_pending_problems_of_an_inactive_page_are_limited_without_losing_one():
    session = SceneSession()
    for number in range(5000):
        session.problem(number, f"number {number}.")
        if number != 4321:
            session.mended(number)
    frame = session.frame(0.0)
    assert frame[2] == RESET
    assert b"number 4321." in frame
    assert len(frame) < 100_000


def test_opening_a_page_a_thousand_times_leaves_no_state_behind():
    session = SceneSession()
    fragment = Fragment(svg.g())
    for _ in range(1000):
        document = Document()
        page = session.mount(Fragment(document), under=0)
        container = document.bind("map")
        root, world = a_map()
        map_mount = session.mount(Fragment(root), under=container.id, within=page)
        robot = session.mount(fragment, under=world.id, within=map_mount)
        session.listen(robot, fragment.root.id, "click")
        session.attach(root.id, 1, "x.js", {})
        session.view(root.id, "scale", 2.0)
        next_frame(session)
        session.unmount(page)
        next_frame(session)
    left = (session._mounts, session._fragments, session._map_views, session._attached)
    assert left == ({}, {}, {}, {})


def test_a_reloaded_page_receives_the_newest_notices_again():
    session = SceneSession()
    for number in range(7):
        session.error(f"number {number}")
    session.error("number 3")
    session.frame(0.0)
    session.restart()
    again = session.frame(0.0)
    received = [number for number in range(7) if b"number %d" % number in again]
    assert received == [2, 3, 4, 5, 6]
    assert again.count(b"number 3") == 1
