"""A real ROS 2 graph for the tests, on machines where ROS can be installed."""

from collections.abc import Iterator

import pytest
import real_ros
from playwright.sync_api import Browser, Page

from equipment.chromium import watched_tab


@pytest.fixture(scope="module")
def ros() -> Iterator[real_ros.Ros]:
    """A robot without frames, and a rosbridge without rosapi in front of it."""
    about, why = real_ros.installed()
    if about is None:
        pytest.skip(f"no real ROS here: {why}")
    with real_ros.running(about) as graph:
        yield graph


@pytest.fixture
def tab(chromium: Browser) -> Iterator[Page]:
    with watched_tab(chromium, 1200, 800) as page:
        yield page
