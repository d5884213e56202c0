"""What every test shares."""

from collections.abc import Iterator

import pytest
from hypothesis import HealthCheck, settings
from playwright.sync_api import Browser

from real_browser import launched

# Two noisy cores: how long an example takes says nothing about the code.
settings.register_profile(
    "webmap", deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("webmap")


@pytest.fixture(scope="module")
def chromium() -> Iterator[Browser]:
    with launched() as browser:
        yield browser
