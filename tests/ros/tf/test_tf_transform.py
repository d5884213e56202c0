"""Transforms: composition, inverse and interpolation."""

import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from webmap.base.geometry import Pose, Quaternion, Vector3
from webmap.ros.tf import Transform, TransformError
from webmap.ros.tf.transform import alike, between

METRES = st.floats(-100, 100)
POINTS = st.builds(Vector3, METRES, METRES, METRES)
PARTS = st.floats(-1, 1)
SHARES = st.floats(0, 1)


@st.composite
def rotations(draw):
    parts = [draw(PARTS) for _ in range(4)]
    norm = math.hypot(*parts)
    assume(norm > 0.1)
    return Quaternion(*(part / norm for part in parts))


TRANSFORMS = st.builds(Transform, POINTS, rotations())
POSES = st.builds(Pose, METRES, METRES, st.floats(-math.pi, math.pi))


def near(one, other, within=1e-7):
    return math.dist((one.x, one.y, one.z), (other.x, other.y, other.z)) < within


def angle(p, q):
    """The angle between two rotations."""
    cosine = abs(p.x * q.x + p.y * q.y + p.z * q.z + p.w * q.w)
    return 2 * math.acos(min(cosine, 1.0))


@given(TRANSFORMS, TRANSFORMS, POINTS)
def test_a_product_applies_its_right_transform_first(one, other, point):
    assert near((one @ other).apply(point), one.apply(other.apply(point)))


@given(TRANSFORMS, POINTS)
def test_the_inverse_undoes_a_transform(transform, point):
    assert near(transform.inverse.apply(transform.apply(point)), point)
    assert near((transform @ transform.inverse).apply(point), point)


@given(TRANSFORMS, POINTS, POINTS)
def test_a_transform_preserves_distances(transform, one, other):
    def far(a, b):
        return math.dist((a.x, a.y, a.z), (b.x, b.y, b.z))

    moved = far(transform.apply(one), transform.apply(other))
    assert moved == pytest.approx(far(one, other), abs=1e-6)


@given(POSES, POSES)
def test_transforms_of_plane_poses_compose_like_poses(one, other):
    both = (Transform.from_pose(one) @ Transform.from_pose(other)).planar
    flat = one @ other
    assert (both.x, both.y) == pytest.approx((flat.x, flat.y), abs=1e-6)
    assert math.cos(both.yaw - flat.yaw) == pytest.approx(1.0)


@given(TRANSFORMS, TRANSFORMS)
def test_interpolation_starts_and_ends_at_the_given_transforms(one, other):
    for share, end in ((0.0, one), (1.0, other)):
        mixed = between(one, other, share)
        assert near(mixed.translation, end.translation)
        assert angle(mixed.rotation, end.rotation) < 1e-6


@given(TRANSFORMS, TRANSFORMS, SHARES)
def test_an_interpolated_transform_lies_between_its_ends(one, other, share):
    mixed = between(one, other, share)
    for axis in ("x", "y", "z"):
        low, high = sorted(getattr(t.translation, axis) for t in (one, other))
        assert low - 1e-9 <= getattr(mixed.translation, axis) <= high + 1e-9
    whole = angle(one.rotation, other.rotation)
    assert angle(one.rotation, mixed.rotation) <= whole + 1e-6
    assert mixed.rotation.norm == pytest.approx(1.0)


@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), SHARES)
def test_rotation_is_interpolated_evenly_and_in_the_shorter_direction(start, by, share):
    one = Transform.from_pose(Pose(0, 0, start))
    other = Transform.from_pose(Pose(0, 0, start + by))
    yaw = between(one, other, share).rotation.yaw
    assert math.cos(yaw - start - share * by) == pytest.approx(1.0, abs=1e-6)


def test_a_rotation_with_a_norm_near_one_is_normalised():
    odd = Transform(rotation=Quaternion(0, 0, 0, 1.05)).checked()
    assert odd.rotation == Quaternion()


@pytest.mark.parametrize(
    ("transform", "words"),
    [
        (Transform(rotation=Quaternion(0, 0, 0, 0)), "norm of 0"),
        (Transform(rotation=Quaternion(1, 1, 0, 0)), "norm of 1.41"),
        (Transform(rotation=Quaternion(0, 0, math.nan, 1)), "not finite"),
        (Transform(Vector3(math.inf, 0, 0)), "not finite"),
    ],
)
def test_an_invalid_transform_is_refused(transform, words):
    with pytest.raises(TransformError, match=words):
        transform.checked()


def test_an_upside_down_frame_is_mirrored_when_seen_from_above():
    over = Transform(Vector3(1.0, 2.0, 3.0), Quaternion(1.0, 0.0, 0.0, 0.0))
    assert over.from_above.apply(1.0, 0.5) == pytest.approx((2.0, 1.5))
    assert over.from_above.determinant == pytest.approx(-1.0)


def test_a_vertical_plane_is_a_line_when_seen_from_above():
    half = math.sqrt(0.5)
    upright = Transform(Vector3(), Quaternion(half, 0.0, 0.0, half))
    assert upright.from_above.apply(1.0, 7.0) == pytest.approx((1.0, 0.0))


@given(st.floats(-3.0, 3.0), st.floats(-9, 9), st.floats(-9, 9))
def test_a_rotation_in_the_plane_is_unchanged_when_seen_from_above(yaw, x, y):
    flat = Transform.from_pose(Pose(1.0, -1.0, yaw))
    there = flat.apply(Vector3(x, y))
    assert flat.from_above.apply(x, y) == pytest.approx((there.x, there.y))


@given(TRANSFORMS, POINTS)
def test_heading_and_tilt_combine_to_the_whole_transform(transform, point):
    pose, tilt = transform.heading_and_tilt
    both = Transform.from_pose(pose).apply(tilt.apply(point))
    assert near(both, transform.apply(point), 1e-3), (
        "a tilt of a microradian is ignored"
    )
    assert (tilt.translation.x, tilt.translation.y) == (0.0, 0.0)
    assert pose == transform.planar


@given(POSES, METRES)
def test_an_upright_transform_has_no_tilt(pose, height):
    lifted = Transform(Vector3(0.0, 0.0, height)) @ Transform.from_pose(pose)
    assert lifted.upright
    assert lifted.heading_and_tilt[1] == Transform(Vector3(0.0, 0.0, height))


def test_an_upside_down_transform_is_tilted_by_half_a_turn():
    over = Transform(Vector3(1.0, 2.0, 0.5), Quaternion(1.0, 0.0, 0.0, 0.0))
    assert not over.upright
    pose, tilt = over.heading_and_tilt
    assert pose == Pose(1.0, 2.0, 0.0)
    assert near(tilt.apply(Vector3(1.0, 1.0, 0.0)), Vector3(1.0, -1.0, 0.5))


@given(TRANSFORMS, POINTS)
def test_the_matrix_rows_map_points_like_the_transform(transform, point):
    x, y, z = (
        a * point.x + b * point.y + c * point.z + by for a, b, c, by in transform.rows
    )
    assert near(Vector3(x, y, z), transform.apply(point))


@given(TRANSFORMS, st.floats(0.01, math.pi), st.floats(0.01, 10.0))
def test_transforms_are_alike_within_the_given_tolerances(transform, turn, way):
    turned = transform @ Transform(rotation=Quaternion.from_yaw(turn))
    moved = Transform(Vector3(way)) @ transform
    assert alike(transform, turned, 0.0001, turn + 0.001)
    assert not alike(transform, turned, 0.0001, turn - 0.001)
    assert alike(transform, moved, way + 0.0001, 0.001)
    assert not alike(transform, moved, way - 0.0001, 0.001)
