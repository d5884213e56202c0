"""What the tests of recordings share."""

import pytest

from bag_making import Made


@pytest.fixture(scope="module", params=["ros1", "ros2"])
def made(request):
    """What makes messages and bags, of either ROS."""
    return Made(request.param)
