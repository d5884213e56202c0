"""A widget whose connection to the notebook is in the hands of a test."""

from collections.abc import Iterator

import comm
import ipywidgets
import pytest
from fake_comm import FakeComm
from playwright.sync_api import Browser, Page

import webmap
from equipment.chromium import watched_tab


@pytest.fixture(autouse=True)
def fake_comms(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Give each widget a fake connection, and close the pages of all after the test."""
    monkeypatch.setattr(comm, "create_comm", FakeComm)
    yield
    ipywidgets.Widget.close_all()


@pytest.fixture(autouse=True, scope="module")
def ending() -> Iterator[None]:
    """End WebMap, which the first widget starts, after the last test."""
    yield
    webmap.stop()


@pytest.fixture
def tab(chromium: Browser) -> Iterator[Page]:
    with watched_tab(chromium, 900, 700) as page:
        yield page
