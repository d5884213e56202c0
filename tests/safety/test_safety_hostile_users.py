"""An operator drives a robot of an agent while hostile users of the router act."""

import pytest
from test_safety_hostile import check

pytest.importorskip("zenoh")
pytestmark = [pytest.mark.safety, pytest.mark.browser, pytest.mark.serial]

MORE_MEMORY = 100e6
"""Bytes by which the agent and its gate may grow meanwhile."""


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    from safety_router_bench import RouterBench

    with RouterBench(tmp_path_factory.mktemp("users")) as bench:
        bench.open_page()
        bench.drive_off()
        bench.let_go()
        yield bench


ACTS = [
    "bay4:another_robots_identity",
    "bay4:many_robots",
    "bay4:large_description",
    "bay4:deep_description",
    "bay4:reports_of_others",
    "east:many_displays",
    "east:large_samples",
    "east:many_samples",
    "east:bombs",
    "east:other_subscriptions",
    "east:calls",
    "east:pages_of_a_viewer",
]


@pytest.mark.parametrize("act", ACTS)
def test_an_operator_drives_and_stops_a_robot_beside_a_hostile_user(bench, act):
    before = bench.memory()
    with bench.beside(act):
        for bench.stops_all in (True, False):
            check(bench)
    assert bench.memory() < before + MORE_MEMORY
