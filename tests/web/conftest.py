"""A real Chromium and a small display."""

from collections.abc import Callable, Iterator

import pytest
from fake_drive import FakeDrive
from input_bench import Bench
from playwright.sync_api import Browser, Page

from equipment.chromium import watched_tab
from equipment.scene_host import SceneHost


@pytest.fixture
def host() -> Iterator[SceneHost]:
    with SceneHost() as host:
        yield host


@pytest.fixture
def tab(chromium: Browser) -> Iterator[Page]:
    with watched_tab(chromium, 800, 600) as page:
        yield page


@pytest.fixture
def gate() -> Iterator[FakeDrive]:
    with FakeDrive() as gate:
        yield gate


@pytest.fixture
def open_bench(chromium: Browser, gate: FakeDrive) -> Iterator[Callable[..., Bench]]:
    benches: list[Bench] = []

    def open_bench(query: str = "", **kw) -> Bench:
        benches.append(Bench(chromium, gate, query, **kw))
        return benches[-1]

    yield open_bench
    for bench in benches:
        bench.context.close()
    assert [line for bench in benches for line in bench.complaints.unexpected] == []


@pytest.fixture
def bench(open_bench: Callable[..., Bench]) -> Bench:
    return open_bench()
