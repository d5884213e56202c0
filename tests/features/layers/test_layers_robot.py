"""The robot modules of WebMap."""

import math

import msgspec
import numpy as np
import pytest
from module_fakes import dots

from equipment.ray_points import points_of
from webmap import Robot
from webmap.base.errors import ProtocolError
from webmap.base.scope import Removal, keep
from webmap.features.layers.laser_scanner import check_rays, scan_rays
from webmap.ros.decoding import convert
from webmap.ros.messages import BatteryStateMsg, LaserScanMsg


class Link:
    """A bridge that records its subscribers."""

    url = "ws://test:9090"
    state = "open"
    lag = 0.0

    def __init__(self) -> None:
        self.listeners: dict[str, tuple] = {}

    def subscribe(self, topic, callback, type=None, **options):
        self.listeners[topic] = (callback, type, options)
        return keep(Removal(lambda: self.listeners.pop(topic)))


def scan(ranges, *, start=0.0, step=math.pi / 2, low=0.1, high=10.0) -> LaserScanMsg:
    plain = {
        "header": {"stamp": {"secs": 0, "nsecs": 0}, "frame_id": "laser"},
        "angle_min": start,
        "angle_increment": step,
        "range_min": low,
        "range_max": high,
        "ranges": ranges,
    }
    return convert(plain, LaserScanMsg)


def test_each_dot_is_at_the_end_of_its_ray():
    points = points_of(scan_rays(scan([1.0, 2.0, 3.0])))
    assert points == pytest.approx(np.array([[1, 0], [0, 2], [-3, 0]]), abs=1e-6)


@pytest.mark.parametrize("miss", [None, math.inf, -math.inf, math.nan, 0.05, 11.0])
def test_a_ray_without_a_valid_range_has_no_dot(miss):
    points = points_of(scan_rays(scan([1.0, miss, 3.0])))
    assert points == pytest.approx(np.array([[1, 0], [-3, 0]]), abs=1e-6)


def test_a_clockwise_scan_has_its_dots_in_place():
    points = points_of(scan_rays(scan([1.0, 1.0], step=-math.pi / 2)))
    assert points == pytest.approx(np.array([[1, 0], [0, -1]]), abs=1e-6)


def test_dots_are_thinned_evenly_and_keep_their_bearings():
    step = math.tau / 360
    points = points_of(scan_rays(scan([1.0] * 360, step=step), max_dots=50))
    assert len(points) == 50
    bearings = np.arctan2(points[:, 1], points[:, 0])
    rays = np.round(np.unwrap(bearings) / step).astype(int)
    assert set(np.diff(rays)) <= {7, 8}


def test_all_rays_are_drawn_if_there_are_fewer_than_max_dots():
    assert len(points_of(scan_rays(scan([1.0] * 20), max_dots=50))) == 20


@pytest.mark.parametrize(
    "bad", [scan([]), scan([None] * 5), scan([1.0], high=math.nan)]
)
def test_an_empty_scan_or_a_scan_with_a_nan_limit_draws_at_most_one_dot(bad):
    assert len(points_of(scan_rays(bad))) <= 1


@pytest.mark.parametrize("angle", [math.nan, math.inf])
def test_a_scan_with_a_non_finite_angle_is_refused(angle):
    for wrong in (scan([1.0], start=angle), scan([1.0], step=angle)):
        with pytest.raises(ProtocolError, match=r"angle_\w+ must be finite radians"):
            check_rays(wrong)


def test_the_scanner_draws_one_path_of_class_dot_on_the_robot():
    link, robot = Link(), Robot("Bob")
    scanner = robot.add_module("LaserScanner", link, "/base_scan", 0.1, 0.0, 90.0)
    callback, type_name, options = link.listeners["/base_scan"]
    assert type_name == "sensor_msgs/LaserScan"
    assert options["throttle"] == 300
    callback(scan([1.0, 2.0]))
    (dot,) = scanner.svg.children
    assert "dot" in dot.classes
    assert "laserscan" in scanner.svg.classes
    assert scanner.svg.parent is robot.svg
    assert dots(dot) == pytest.approx(np.array([[1, 0], [0, 2]]), abs=1e-6)
    robot.remove_module(scanner)
    assert link.listeners == {}
    assert scanner.svg.parent is None


def test_max_dots_of_zero_is_refused():
    with pytest.raises(ValueError, match="max_dots must be at least 1"):
        Robot("Bob").add_module("LaserScanner", Link(), "/scan", max_dots=0)


def publish_percentages(link, *percentages):
    """Publish battery states."""
    callback, _, _ = link.listeners["/battery"]
    for percentage in percentages:
        callback(convert({"percentage": percentage, "voltage": 24.0}, BatteryStateMsg))


def test_a_battery_that_counts_to_100_is_read_correctly_at_low_charge():
    link, robot = Link(), Robot("Bob")
    battery = robot.add_module("Battery", link, "/battery")
    publish_percentages(link, 1.04)  # a gauge that is not calibrated
    assert battery.charge == 1.0
    publish_percentages(link, 80.0)
    assert battery.charge == 0.8
    publish_percentages(link, 1.0)
    assert battery.charge == 0.01
    assert not robot.problems


@pytest.mark.parametrize("wrong", [-1.0, 101.0, 1e300])
def test_an_invalid_battery_percentage_is_a_problem_until_a_valid_one_arrives(wrong):
    link, robot = Link(), Robot("Bob")
    battery = robot.add_module("Battery", link, "/battery")
    publish_percentages(link, 0.5, wrong)
    assert battery.charge is None
    (problem,) = robot.problems.values()
    assert problem.startswith(
        "/battery: a battery has a percentage of 0 to 1, or of 0 to"
    )
    assert f"got {wrong:g}" in problem
    publish_percentages(link, 0.5)
    assert battery.charge == 0.5
    assert not robot.problems


@pytest.mark.parametrize(
    ("percentage", "charge"), [(0.5, 0.5), (None, None), (80.0, 0.8), (-1.0, None)]
)
def test_the_battery_passes_its_charge_or_none_to_other_modules(percentage, charge):
    received = []

    class Listener:
        def __init__(self, robot) -> None:
            pass

        def on_battery_update(self, battery):
            received.append(battery.charge)

    link, robot = Link(), Robot("Bob")
    robot.add_module(Listener)
    robot.add_module("Battery", link, "/battery")
    publish_percentages(link, percentage)
    assert received == [charge]


def test_a_map_module_gets_the_battery_of_the_selected_robot_only(map):
    received = []

    class Listener:
        def __init__(self, map) -> None:
            pass

        def on_battery_update(self, battery):
            received.append((battery.robot.name, battery.charge))

    map.add_module(Listener)
    for name in ("Ann", "Bob"):
        link, robot = Link(), Robot(name)
        robot.add_module("Battery", link, "/battery")
        map.add_robot(robot)
        publish_percentages(link, 0.25)
        map.set_selected(robot)
        publish_percentages(link, 0.5)
    assert received == [("Ann", 0.5), ("Bob", 0.5)]


def test_from_dict_adds_the_modules_of_a_robot():
    link = Link()
    robot = Robot.from_dict(
        {
            "name": "Bob",
            "modules": [
                {
                    "name": "LaserScanner",
                    "args": [{"bridge": "lab"}, "/scan"],
                    "options": {"max_dots": 20},
                }
            ],
        },
        {"lab": link},
    )
    assert robot.modules[0].max_dots == 20
    assert "/scan" in link.listeners
    assert msgspec.json.encode(robot.motion.spec()) == b"null"
