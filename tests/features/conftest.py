"""A link, a page and a map for modules."""

from collections.abc import Iterator

import pytest
from module_fakes import Channel, Link

from webmap import Map, Robot
from webmap.core.base_page import PageEntry
from webmap.core.operators import Viewer
from webmap.core.page import Page


@pytest.fixture
def link() -> Link:
    return Link()


@pytest.fixture
def channel() -> Channel:
    return Channel()


@pytest.fixture
def page(channel, tmp_path) -> Iterator[Page]:
    entry = PageEntry("/", lambda page: None, None, tmp_path, "test")
    page = Page(entry, channel, Viewer("v1", "Ann", "admin"), None, {})
    yield page
    page.close()


@pytest.fixture
def map(page) -> Map:
    return Map(page.element("map"), 700, 500)


@pytest.fixture
def robot() -> Iterator[Robot]:
    robot = Robot("Bob")
    yield robot
    robot.destroy()
