"""An operator drives a good robot while other robots send much too large messages."""

import pytest
from safety_hostile import beside
from test_safety_hostile import check

pytestmark = [pytest.mark.safety, pytest.mark.browser, pytest.mark.serial]

PEERS = {
    "beyond the limits": (
        "huge_diagnostics",
        "huge_path",
        "huge_transforms",
        "huge_markers",
    ),
    "just within them": (
        "long_diagnostics",
        "long_path",
        "long_transforms",
        "long_markers",
    ),
    "a map": ("large_map",),
    "a cloud": ("large_cloud",),
    "a picture": ("large_picture",),
    "of other kinds": ("long_line", "many_lists", "fragments", "bombs"),
}
"""Peers that send at the same time, each of them one message a second."""


@pytest.mark.parametrize("peers", PEERS.values(), ids=PEERS)
def test_large_messages_of_other_robots_delay_no_tick_and_no_stop(bench, peers):
    names = [f"safety_large_peers:{name}" for name in peers]
    with beside(bench, *names, shown=True):
        check(bench)
