"""The image files that the elements of a robot name, for as long as maps show it."""

import contextlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from webmap.errors import ConfigError
from webmap.scene.element import Element

if TYPE_CHECKING:
    from webmap.core.page import Page
    from webmap.core.page_ports import Publisher


class _Shown(NamedTuple):
    """An image whose file pages can load."""

    name: str
    """The file, as the program has it."""

    file: Path
    url: str
    """What stands in ``href`` in its place."""


class ModelImages:
    """Lets pages load the image files that a robot's elements name.

    A file is looked for in the folder of the page that shows the robot first, as
    :meth:`webmap.Map.add_image` does. The robot is everybody's, so its images can be
    loaded for as long as any map shows it, and not for the time of one page.

    Args:
        root: The robot's own group.

    """

    def __init__(self, root: Element) -> None:
        self._root = root
        self._shown: dict[Element, _Shown] = {}
        self._published: dict[tuple[Publisher, Path], str] = {}

    @property
    def names(self) -> Mapping[Element, str]:
        """What the program wrote as the ``href`` of those that have another now."""
        return {
            image: shown.name
            for image, shown in self._shown.items()
            if image.get("href") == shown.url
        }

    def show(self, page: "Page") -> None:
        """Let a page load them; one that is no file of its folder stays as it is."""
        for image in self._images():
            shown = self._shown.get(image)
            if shown is not None and image.get("href") == shown.url:
                with contextlib.suppress(ConfigError):  # the file is gone since
                    self._publish(page, shown.file)
                continue
            name = image.get("href")
            if not name or name.startswith(("/", "#")):
                continue
            try:
                file = page.image_file(name)
                url = self._publish(page, file)
            except ConfigError:
                continue  # it may be served by others; if not, the page says so
            self._shown[image] = _Shown(name, file, url)
            image.set("href", url)

    def end(self) -> None:
        """Let nobody load them, and have the elements name their files again."""
        for image, name in self.names.items():
            image.set("href", name)
        for (publisher, _), url in self._published.items():
            publisher.withdraw_image(url)
        self._shown.clear()
        self._published.clear()

    def _images(self) -> Iterator[Element]:
        for node in self._root.walk():
            if isinstance(node, Element) and node.tag == "image":
                yield node

    def _publish(self, page: "Page", file: Path) -> str:
        key = (page.publisher, file)
        if key not in self._published:
            self._published[key] = page.publisher.publish_image(file)
        return self._published[key]
