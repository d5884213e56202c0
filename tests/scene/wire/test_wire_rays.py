"""A scan is sent in few bytes and drawn where its rays end."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace
from test_wire_browser_reads import Decoder

from equipment.ray_points import points_of
from webmap.base.errors import SceneError
from webmap.base.geometry import Affine
from webmap.scene import svg
from webmap.scene.live import Rays
from webmap.scene.node import Fragment
from webmap.scene.wire.rays import NEAR, encode_rays
from webmap.scene.wire.session import SceneSession

PAGE = (
    '{"op":"view","map_element":%d,"a":%f,"b":0,"c":0,"d":%f,"e":350,"f":250,'
    '"width":700,"height":500,"left":0,"top":0,"dpr":%f}'
)


@pytest.fixture(scope="module")
def decoder():
    decoder = Decoder()
    yield decoder
    decoder.close()


def rays(reach, **fields):
    total = fields.pop("total", len(reach))
    turn = math.tau / max(1, total)
    data = np.asarray(reach, "<f4").tobytes()
    return Rays(data, **{"total": total, "first": -math.pi, "turn": turn, **fields})


def room(count=360, noise=0.01, seed=1):
    """Return the distances in a room of 8 m by 6 m, with the noise of a real sensor."""
    chance = np.random.default_rng(seed)
    bearings = (np.arange(count) + 0.5) * math.tau / count - math.pi
    along = np.where(np.cos(bearings) > 0, 5.0, 3.0) / abs(np.cos(bearings))
    across = np.where(np.sin(bearings) > 0, 2.0, 4.0) / abs(np.sin(bearings))
    reach = np.minimum(along, across)
    reach[20:30] = 1.5
    return reach + chance.normal(0.0, noise, count)


def shown(*scans, pixels=0.0, dpr=1.0):
    """Return a session of a page, the path in it, and its frames."""
    world = svg.g()
    root = svg.svg(world).set_map(world, 700, 500)
    path = svg.path(class_="dot")
    world.append(path)
    session = SceneSession()
    session.mount(Fragment(root), under=0)
    if pixels:
        session.receive(PAGE % (root.id, pixels, -pixels, dpr))
    frames = []
    for scan in scans:
        path.set_rays(scan)
        frames += look(session)
    return session, root, path, frames


def look(session, now=0.0):
    frame = session.frame(now)
    if frame is None:
        return []
    session.receive(f'{{"op":"seen","frame":{session._frame}}}')
    return [frame]


def drawn(decoder, frames):
    """Return where the page has its dots, in metres."""
    answer = decoder.read(frames)
    assert "error" not in answer, answer
    (mount,) = answer["picture"]
    dots = mount["root"]["children"][0]["children"][0]["dots"]
    return np.array(dots["points"]).reshape(-1, 2) * dots["unit"]


CASES = {
    "one ray": rays([2.0]),
    "nothing hit": rays([math.nan] * 20),
    "no rays": Rays(b"", 0, 0.0, 0.0),
    "a room": rays(room()),
    "thinned": rays(room()[(np.arange(50) * 7.2).astype(int)], total=360),
    "misses": rays(np.where(np.arange(360) % 17 == 0, math.nan, room())),
    "mostly misses": rays(np.where(np.arange(360) % 90, math.nan, room())),
    "clockwise": rays(room(), first=math.pi, turn=-math.tau / 360),
    "mounted": rays(room(), place=Affine(0, -1, 1, 0, 0.3, -0.2)),
    "swept": rays(room(), moved=(0.1, -0.02, 0.3)),
    "negative and infinite": rays([1.0, -2.0, math.inf, -math.inf, 3.0]),
    "far": rays([0.5, 900.0, 3.0]),
}


@pytest.mark.parametrize("name", CASES)
def test_dots_are_where_the_rays_hit(decoder, name):
    scan = CASES[name]
    reach = np.frombuffer(scan.ranges, "<f4")
    hits = np.where(np.isfinite(reach) & (reach >= 0), reach, np.nan).astype("<f4")
    expected = points_of(replace(scan, ranges=hits.tobytes()))
    found = drawn(decoder, shown(scan)[3])
    near = 0.03 if name == "far" else 0.0013
    assert len(found) == len(expected)
    assert np.allclose(found, expected, atol=near, rtol=0)


@given(
    st.lists(
        st.one_of(st.floats(0, 100, width=32), st.just(math.nan)),
        min_size=1,
        max_size=60,
    ),
    st.sampled_from([0.001, 0.004, 0.016]),
)
@settings(max_examples=60, deadline=None)
def test_the_page_reads_any_distances(decoder, reach, detail):
    scan = rays(reach)
    session, _, path, _ = shown()
    session._dots._detail = detail
    path.set_rays(scan)
    found, expected = drawn(decoder, look(session)), points_of(scan)
    farthest = max([0.0, *np.nan_to_num(reach)])
    near = max(detail, farthest / 30000) / 2 + 0.002
    if farthest * scan.turn > NEAR * near:  # otherwise neighbouring rays are one dot
        assert len(found) == len(expected)
        assert np.allclose(found, expected, atol=near, rtol=0)
    assert (len(found) > 0) == (len(expected) > 0)


def test_a_scan_of_a_room_takes_a_fraction_of_the_bytes_of_its_points():
    points = 4 * 360
    assert len(encode_rays(rays(room()), 0.001)) < points / 4
    assert len(encode_rays(rays(room()), 0.004)) < points / 5.5
    assert len(encode_rays(rays(room(noise=0.0)), 0.001)) < points / 6


def test_random_distances_take_no_more_than_their_bits():
    reach = np.random.default_rng(1).uniform(0.5, 1.9, 360)
    assert len(encode_rays(rays(reach), 0.001)) < 360 * 11.5 / 8 + 30


@pytest.mark.parametrize(
    ("pixels", "dpr", "detail"),
    [(500, 1, 0.001), (50, 1, 0.002), (50, 2, 0.001), (10, 1, 0.008), (0.01, 1, 1.0)],
)
def test_distances_are_rounded_to_an_eighth_of_a_pixel_of_the_screen(
    decoder, pixels, dpr, detail
):
    scan = rays(room(20))
    _, _, path, frames = shown(scan, pixels=pixels, dpr=dpr)
    assert list(path._coded) == [detail]
    assert detail == 0.001 or detail <= 1 / (pixels * dpr) / 8
    if detail < 1:  # then all dots are within half a pixel
        found, expected = drawn(decoder, frames), points_of(scan)
        assert np.allclose(found, expected, atol=detail / 2 + 0.001, rtol=0)


def test_zooming_in_sends_the_scan_again_and_zooming_out_does_not(decoder):
    scan = rays(room())
    session, root, _, frames = shown(scan, pixels=10)
    session.receive(PAGE % (root.id, 5, -5, 1))
    assert look(session) == []
    session.receive(PAGE % (root.id, 500, -500, 1))
    frames += look(session)
    assert len(frames) == 2
    assert np.allclose(drawn(decoder, frames), points_of(scan), atol=0.0013, rtol=0)
    assert look(session) == []


def test_rays_within_half_a_pixel_are_one_and_the_nearest_of_them_stays(decoder):
    reach = np.full(3600, 8.0)
    reach[1234] = 2.0  # a pole
    scan = rays(reach)
    whole = drawn(decoder, shown(scan)[3])
    frames = shown(scan, pixels=10)[3]
    found = drawn(decoder, frames)
    assert len(whole) == 3600
    assert 1000 < len(found) < 2000
    gaps = np.hypot(*(found - np.roll(found, 1, axis=0)).T)
    assert np.sort(gaps)[-3] <= 0.05 + 0.008  # half a pixel, except for the pole
    pole = found[np.hypot(*found.T) < 3]
    assert len(pole) == 1
    bearing = 1234 * math.tau / 3600 - math.pi
    at = np.array([2 * math.cos(bearing), 2 * math.sin(bearing)])
    assert np.hypot(*(pole[0] - at)) < 0.05


def test_a_scan_that_did_not_change_visibly_sends_nothing():
    reach = np.full(360, 4.0)
    session, _, path, _ = shown(rays(reach), pixels=50)
    path.set_rays(rays(reach.copy()))
    assert look(session) == []
    path.set_rays(rays(reach + 1e-4))
    assert look(session) == []
    path.set_rays(rays(reach + 0.01))
    assert len(look(session)) == 1
    path.set_rays(rays(reach))
    assert len(look(session)) == 1
    assert look(session) == []


def test_a_scan_is_encoded_once_for_all_pages_with_similar_views(monkeypatch):
    from webmap.scene.wire import rays as module

    calls = []
    real = module.encode_rays
    monkeypatch.setattr(
        module, "encode_rays", lambda *args: calls.append(args[1]) or real(*args)
    )
    world = svg.g(svg.path(class_="dot"))
    root = svg.svg(world).set_map(world, 700, 500)
    fragment = Fragment(root)
    sessions = []
    for number in range(20):
        session = SceneSession()
        session.mount(fragment, under=0)
        pixels = 33 + number if number < 15 else 5
        session.receive(PAGE % (root.id, pixels, -pixels, 1))
        look(session)
        sessions.append(session)
    for number in range(3):
        world.children[0].set_rays(rays(room(seed=number)))
        for session in sessions:
            assert len(look(session)) == 1
    assert sorted(calls) == 3 * [0.002] + 3 * [0.016]


def test_dots_follow_their_element_into_another_fragment(decoder):
    scan = rays(room())
    path = svg.path()
    lost = svg.g(path)
    Fragment(lost)
    path.set_rays(scan)
    path.remove()
    session, _, first, frames = shown(rays([1.0]))
    path.set_rays(rays(room(seed=2)))
    parent = first.parent
    first.remove()
    parent.append(path)
    frames += look(session)
    found = drawn(decoder, frames)
    assert np.allclose(found, points_of(rays(room(seed=2))), atol=0.0013, rtol=0)


def test_rays_need_a_path_whole_distances_and_finite_numbers():
    path = svg.path()
    for wrong, why in [
        (replace(rays([1.0]), ranges=b"123"), "4 bytes each"),
        (replace(rays([1.0, 2.0]), total=1), "got 8 bytes for 1 rays"),
        (replace(rays([1.0]), first=math.nan), "must be finite"),
        (replace(rays([1.0]), place=Affine(e=math.inf)), "must be finite"),
        (replace(rays([1.0]), moved=(0.0, math.inf, 0.0)), "must be finite"),
    ]:
        with pytest.raises(SceneError, match=why):
            path.set_rays(wrong)
    with pytest.raises(SceneError, match="not a path"):
        svg.g().set_rays(rays([1.0]))
