"""GPS fixes on the plane of the map."""

import math

import pytest
from module_fakes import header, pose, to_root
from test_layers_frames import send_transforms, transform

from webmap.base.errors import ConfigError

DATUM = (50.0, 14.0)
# From the WGS 84 ellipsoid, at 50 degrees north.
METRES_A_DEGREE = {"lat": 111_229.0, "lon": 71_695.8}


def fix(lat, lon, status=0, spread=None, *, ros2=False) -> dict:
    return {
        "header": header("gps", ros2=ros2),
        "status": {"status": status, "service": 1},
        "latitude": lat,
        "longitude": lon,
        "altitude": 300.0,
        "position_covariance": spread or [0.0] * 9,
        "position_covariance_type": 2 if spread else 0,
    }


def at(module) -> tuple[float, float]:
    return to_root(module.cross).apply(0, 0)


@pytest.mark.parametrize("ros2", [False, True])
def test_a_fix_is_drawn_at_its_true_distance_from_the_datum(link, robot, ros2):
    module = robot.add_module("NavSatFix", link, datum=DATUM)
    link.publish("/fix", fix(50.001, 13.998, ros2=ros2))
    assert at(module) == pytest.approx(
        (-0.002 * METRES_A_DEGREE["lon"], 0.001 * METRES_A_DEGREE["lat"]), abs=0.01
    )
    assert module.position == pytest.approx(at(module))


@pytest.mark.parametrize("type", ["gps_common/GPSFix", "gps_msgs/msg/GPSFix"])
def test_a_gps_fix_message_is_drawn_like_a_nav_sat_fix_message(link, robot, type):
    ros2 = type.startswith("gps_msgs")
    module = robot.add_module("NavSatFix", link, "/gps", datum=DATUM, type=type)
    assert link.types["/gps"] == type
    message = fix(50.001, 14.0, status=18, spread=[4.0, 0, 0, 0, 4.0, 0, 0, 0, 9.0])
    more = {"header": header("", ros2=ros2), "satellites_used": 7, "status": 18}
    link.publish(
        "/gps", {**message, "status": more, "track": 90.0, "speed": 1.0, "dip": 0.0}
    )
    assert at(module) == pytest.approx((0, 111.229), abs=0.01)
    assert module.covariance.get("r") == "2"
    link.publish("/gps", {**message, "status": {**more, "status": -1}})
    assert "lost" in module.svg.classes


def test_a_message_type_without_fixes_is_refused(link, robot):
    with pytest.raises(ConfigError, match="type is one of sensor_msgs/NavSatFix, "):
        robot.add_module("NavSatFix", link, type="sensor_msgs/LaserScan")


def test_north_is_along_x_with_east_at_90_degrees(link, robot):
    module = robot.add_module("NavSatFix", link, datum=DATUM, east=90.0)
    link.publish("/fix", fix(50.001, 14.0))
    assert at(module) == pytest.approx((111.229, 0), abs=0.01)


def test_without_a_datum_the_first_fix_is_placed_at_the_robot(link, robot):
    robot.set_odometry_topic(link, "/odom", type="geometry_msgs/PoseStamped")
    link.publish("/odom", {"header": header(), "pose": pose(7, -3, 1.0)})
    module = robot.add_module("NavSatFix", link)
    link.publish("/fix", fix(50.0, 14.0))
    assert at(module) == pytest.approx((7, -3))
    link.publish("/odom", {"header": header(), "pose": pose(9, 9, 2.0)})
    link.publish("/fix", fix(50.0001, 14.0))
    assert at(module) == pytest.approx((7, -3 + 11.1229), abs=0.01)


def test_a_fix_before_the_first_pose_does_not_set_the_datum(link, robot):
    robot.set_odometry_topic(link, "/odom", type="geometry_msgs/PoseStamped")
    module = robot.add_module("NavSatFix", link)
    link.publish("/fix", fix(50.0, 14.0))
    assert module.cross.get("visibility") == "hidden"
    assert module.datum is module.position is None
    link.publish("/odom", {"header": header(), "pose": pose(7, -3)})
    link.publish("/fix", fix(50.001, 14.0))
    assert at(module) == pytest.approx((7, -3))


@pytest.fixture
def in_odometry(link, robot):
    """Put a robot at (1, 0) by its odometry."""

    def at_one(*, quiet):
        robot.set_odometry_topic(link, "/odom", type="geometry_msgs/PoseStamped")
        robot.set_tf(link, quiet=quiet)
        link.publish("/odom", {"header": header("odom"), "pose": pose(1, 0)})
        return robot.add_module("NavSatFix", link)

    return at_one


@pytest.mark.parametrize("quiet", [False, True])
def test_the_first_fix_waits_until_frames_place_the_robot_on_the_map(
    link, in_odometry, quiet
):
    module = in_odometry(quiet=quiet)
    link.publish("/fix", fix(50.0, 14.0))
    assert module.position is None
    send_transforms(link, transform("map", "odom", 30, 20, 0))
    link.publish("/odom", {"header": header("odom"), "pose": pose(2, 0)})
    link.publish("/fix", fix(50.001, 14.0))
    assert at(module) == pytest.approx((32, 20))
    assert module.datum == (50.001, 14.0)


def test_a_fix_is_placed_by_odometry_until_the_robot_has_a_map_frame(
    link, in_odometry, monkeypatch
):
    module = in_odometry(quiet=True)
    monkeypatch.setattr("webmap.poses.frames.GRACE", 0.0)
    link.publish("/fix", fix(50.0, 14.0))
    assert at(module) == pytest.approx((1, 0))
    link.publish("/fix", fix(50.001, 14.0))
    assert at(module) == pytest.approx((1, 111.229), abs=0.01)
    send_transforms(link, transform("map", "odom", 30, 20, 0))
    link.publish("/odom", {"header": header("odom"), "pose": pose(2, 0)})
    link.publish("/fix", fix(50.002, 14.0))
    assert at(module) == pytest.approx((32, 20))
    link.publish("/fix", fix(50.003, 14.0))
    assert at(module) == pytest.approx((32, 131.229), abs=0.01)


def test_the_radius_of_the_circle_is_the_standard_deviation(link, robot):
    module = robot.add_module("NavSatFix", link, datum=DATUM)
    link.publish("/fix", fix(50, 14, spread=[4.0, 0, 0, 0, 2.25, 0, 0, 0, 9.0]))
    assert module.covariance.get("r") == "2"
    link.publish("/fix", fix(50, 14, spread=[math.nan] * 9))
    assert module.covariance.get("r") == "0"


def test_a_fix_across_the_date_line_is_near_the_datum(link, robot):
    module = robot.add_module("NavSatFix", link, datum=(0.0, 179.9999))
    link.publish("/fix", fix(0.0, -179.9999))
    assert at(module) == pytest.approx((22.26, 0), abs=0.01)


def test_a_lost_fix_keeps_the_last_position(link, robot):
    module = robot.add_module("NavSatFix", link, datum=DATUM)
    assert module.cross.get("visibility") == "hidden"
    link.publish("/fix", fix(50, 14))
    link.publish("/fix", fix(None, None, status=-1))
    assert "lost" in module.svg.classes
    assert at(module) == (0, 0)
    assert robot.problems == {}
    link.publish("/fix", fix(50, 14))
    assert "lost" not in module.svg.classes
    assert module.cross.get("visibility") is None


@pytest.mark.parametrize(
    ("lat", "lon"), [(None, 14), (50, None), (91, 14), (-90.1, 0), (50, 1e9)]
)
def test_a_fix_with_invalid_coordinates_is_refused(link, robot, lat, lon):
    module = robot.add_module("NavSatFix", link, datum=DATUM)
    link.publish("/fix", fix(50, 14))
    link.publish("/fix", fix(lat, lon))
    assert at(module) == (0, 0)
    (problem,) = robot.problems.values()
    assert "latitude of -90 to 90 degrees" in problem


@pytest.mark.parametrize("datum", [(91, 0), (50,), (math.nan, 0), (90, 0)])
def test_an_invalid_datum_is_refused(link, robot, datum):
    with pytest.raises(ValueError, match=r"datum(: expected 2 in| is a latitude)"):
        robot.add_module("NavSatFix", link, datum=datum)
