"""A page with a channel that records its calls."""

import itertools
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from webmap.base.errors import ConfigError, WireError
from webmap.core.base_page import PageEntry
from webmap.core.operators import Viewer
from webmap.core.page import Page


@dataclass
class Channel:
    """Records every call, in order."""

    calls: list[tuple[Any, ...]] = field(default_factory=list)
    mounted: dict[int, Any] = field(default_factory=dict)
    flags: dict[tuple[int, int, str], tuple[bool, bool]] = field(default_factory=dict)
    """For each event with a listener: whether it is prevented and stopped."""
    numbers: Any = field(default_factory=lambda: itertools.count(1))

    def mount(self, fragment, *, under, order=0, within=None):
        if within is not None and within not in self.mounted:
            raise WireError(f"mount {within} is not on the page")
        number = next(self.numbers)
        self.mounted[number] = fragment
        return number

    def unmount(self, mount):
        del self.mounted[mount]

    def set_class(self, mount, name, on):
        self.calls.append(("class", self.mounted[mount], name, on))

    def listen(self, mount, element, event, *, prevent, stop):
        self.flags[mount, element, event] = (prevent, stop)

    def unlisten(self, mount, element, event):
        self.flags.pop((mount, element, event), None)

    def view(self, map_element, operation, *args):
        self.calls.append((operation, *args))

    def attach(self, map_element, instance, module_url, options, css_url=None):
        self.calls.append(("attach", instance, module_url, options))

    def detach(self, instance):
        self.calls.append(("detach", instance))

    def send(self, instance, message):
        self.calls.append(("send", instance, message))

    def error(self, text):
        self.calls.append(("error", text))

    def problem(self, number, text):
        self.calls.append(("error", text, number))

    def mended(self, number):
        self.calls.append(("mended", number))

    @property
    def errors(self) -> list[str]:
        return [call[1] for call in self.calls if call[0] == "error"]


class Publisher:
    def __init__(self) -> None:
        self.images: list[str] = []

    def publish_file(self, path: Path) -> str:
        return f"/_webmap/files/{path.name}"

    def publish_image(self, image: Path) -> str:
        if not image.is_file():
            raise ConfigError(f"there is no file {str(image)!r}")
        self.images.append(image.name)
        return f"/_webmap/images/{image.name}"

    def withdraw_image(self, url: str) -> None:
        self.images.remove(url.rpartition("/")[2])


@pytest.fixture
def publisher() -> Publisher:
    return Publisher()


@pytest.fixture
def channel() -> Channel:
    return Channel()


@pytest.fixture
def make_page(channel: Channel, publisher: Publisher, tmp_path: Path):
    """Make the page of a viewer."""
    entry = PageEntry("/", lambda page: None, None, tmp_path, "test")
    sizes = {"webmap_container": (700, 500)}
    return lambda viewer: Page(entry, channel, viewer, publisher, sizes)


@pytest.fixture
def page(make_page) -> Page:
    return make_page(Viewer("v1", "Ann"))


@pytest.fixture
def container(page: Page):
    return page.element("webmap_container")
