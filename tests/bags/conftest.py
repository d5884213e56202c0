"""Fixtures of the tests of recordings."""

import pytest

from equipment.bag_files import Made


@pytest.fixture(scope="module", params=["ros1", "ros2"])
def made(request):
    """An object that makes messages and bags of ROS 1 or ROS 2."""
    return Made(request.param)
