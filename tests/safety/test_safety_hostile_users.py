"""An operator drives a robot of an agent while hostile users of the router act."""

import pytest
from safety_run import FULL
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
    "bay4:another_robots_identity east:many_displays east:bombs",
    "bay4:reports_of_others east:large_samples east:other_subscriptions",
    "bay4:many_robots east:many_samples east:calls",
    "bay4:large_description east:pages_of_a_viewer",
    "bay4:deep_description",
]
"""What hostile users do at the same time. In a full run each acts alone too."""

if FULL:
    ACTS += " ".join(ACTS).split()


@pytest.mark.parametrize("acts", dict.fromkeys(ACTS))
def test_an_operator_drives_and_stops_a_robot_beside_a_hostile_user(bench, acts):
    before = bench.memory()
    with bench.beside(*acts.split()):
        for bench.stops_all in (True, False):
            # The hostile users work on the processors of this computer too.
            check(bench, strict=False)
    assert bench.memory() < before + MORE_MEMORY
