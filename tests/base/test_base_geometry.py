"""Poses, orientations and affine maps obey their mathematical rules."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from webmap.base.geometry import Affine, Pose, Quaternion, Twist, normalize_angle

NUMBERS = st.floats(-1e4, 1e4)
ANGLES = st.floats(-100, 100)
POSES = st.builds(Pose, NUMBERS, NUMBERS, ANGLES)


def close(pose: Pose, other: Pose) -> bool:
    return math.isclose(pose.x, other.x, abs_tol=1e-6) and (
        math.isclose(pose.y, other.y, abs_tol=1e-6)
        and abs(normalize_angle(pose.yaw - other.yaw)) < 1e-9
    )


@given(ANGLES)
def test_a_normalised_angle_keeps_its_direction_between_minus_pi_and_pi(angle):
    normal = normalize_angle(angle)
    assert -math.pi <= normal <= math.pi
    assert math.cos(normal) == pytest.approx(math.cos(angle), abs=1e-9)
    assert math.sin(normal) == pytest.approx(math.sin(angle), abs=1e-9)


def test_the_float_just_below_minus_pi_stays_in_the_interval():
    assert abs(normalize_angle(math.nextafter(-math.pi, -math.inf))) <= math.pi


@given(POSES)
def test_a_pose_and_its_inverse_undo_each_other(pose):
    assert close(pose @ pose.inverse, Pose())
    assert close(pose.inverse @ pose, Pose())


@given(POSES, POSES, POSES)
def test_pose_composition_is_associative(a, b, c):
    left, right = (a @ b) @ c, a @ (b @ c)
    assert math.isclose(left.x, right.x, abs_tol=1e-5)
    assert math.isclose(left.y, right.y, abs_tol=1e-5)


def test_one_metre_forward_of_a_robot_facing_north_is_one_metre_north():
    assert close(Pose(1, 2, math.pi / 2) @ Pose(1, 0, 0), Pose(1, 3, math.pi / 2))


@given(st.floats(-math.pi, math.pi))
def test_a_yaw_survives_the_conversion_to_a_quaternion(yaw):
    again = Quaternion.from_yaw(yaw).yaw
    assert normalize_angle(again - yaw) == pytest.approx(0, abs=1e-9)


@given(st.floats(-3, 3), st.floats(0.1, 10))
def test_scaling_a_quaternion_does_not_change_its_yaw(yaw, factor):
    q = Quaternion.from_yaw(yaw)
    scaled = Quaternion(q.x * factor, q.y * factor, q.z * factor, q.w * factor)
    assert scaled.yaw == pytest.approx(yaw)


def test_a_quaternion_of_zeros_has_the_norm_zero():
    assert Quaternion(0, 0, 0, 0).norm == 0


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_is_finite_detects_nan_and_infinity_in_a_twist(bad):
    assert Twist(1, 2, 3).is_finite
    assert not Twist(bad, 0, 0).is_finite
    assert not Twist(0, 0, bad).is_finite
    assert Twist(0.0, -0.0, 0.0).is_zero


MAPS = st.builds(
    lambda angle, factor, x, y: (
        Affine.translation(x, y)
        @ Affine.rotation(angle)
        @ Affine.scaling(factor)
        @ Affine(d=-1)
    ),
    ANGLES,
    st.floats(0.01, 100),
    NUMBERS,
    NUMBERS,
)


@given(MAPS, NUMBERS, NUMBERS)
def test_an_affine_map_and_its_inverse_undo_each_other(tf, x, y):
    assert tf.inverse.apply(*tf.apply(x, y)) == pytest.approx((x, y), abs=1e-3)


@given(MAPS, MAPS, st.floats(-10, 10), st.floats(-10, 10))
def test_a_product_of_affine_maps_applies_both_in_turn(first, second, x, y):
    together = (second @ first).apply(x, y)
    assert together == pytest.approx(
        second.apply(*first.apply(x, y)), rel=1e-6, abs=1e-6
    )


def test_a_singular_affine_map_has_no_inverse():
    with pytest.raises(ValueError, match="flattens"):
        _ = Affine(0, 0, 0, 0).inverse


@pytest.mark.parametrize("factor", [0.0, -1.0, math.nan, math.inf])
def test_a_scale_must_be_a_number_above_zero(factor):
    with pytest.raises(ValueError, match="above 0"):
        Affine.scaling(factor)


def test_a_pose_gives_the_transforms_out_of_its_frame_and_into_it():
    pose = Pose(2.0, -3.0, 0.7)
    assert Affine.into_pose(pose) == Affine.of_pose(pose).inverse
    assert Affine.into_pose(pose).apply(2.0, -3.0) == pytest.approx((0.0, 0.0))
