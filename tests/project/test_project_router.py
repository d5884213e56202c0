"""The computed message rates of a large fleet."""

import pytest

from benchmarks.router import DOWN, UP, Costs, Layout, flows


def test_a_router_passes_each_message_of_an_agent_to_each_display():
    up = sum(rate for rate, _ in UP.values())
    down = sum(rate for rate, _ in DOWN.values())
    cost = Costs(into=1.0, out=0.0, put=0.0, take=0.0)
    paid_out = Costs(into=0.0, out=1.0, put=0.0, take=0.0)
    layout = Layout("", agents=6, displays=4, shown=3)
    assert flows(layout, cost)["a router: processors"] == 6 * up + 12 * down
    assert flows(layout, paid_out)["a router: processors"] == 12 * (up + down)


def test_regions_divide_the_work_and_what_crosses_them_comes_on_top():
    cost = Costs(1.0, 1.0, 0.0, 0.0)

    def of(layout):
        return flows(layout, cost)["a router: processors"]

    whole = of(Layout("", 100, 10, 5))
    assert of(Layout("", 100, 10, 5, routers=5)) == pytest.approx(whole / 5)
    crossing = of(Layout("", 100, 10, 5, routers=5, crossing=0.5))
    assert whole / 5 < crossing < 3 * whole / 5
