"""The name of the person at a page, which others see."""

import logging
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any, ClassVar

from webmap import Map

log = logging.getLogger("webmap.console")


class OperatorName:
    """Asks a person for a name and a place, and shows them; a module of maps.

    Everything else works without a name. The name has a way of its own to WebMap: no
    command carries it.

    Args:
        map: The map.
    """

    MAY_SEND: ClassVar[Mapping[str, str]] = {"name": "viewer", "place": "viewer"}

    def __init__(self, map: Map) -> None:
        self.map = map
        self._shown: object = None
        self.browser_part = map.add_browser_part(self, "console/operator_name.js", {})

    def on_ready(self) -> None:
        """Send the name: a page that was loaded again does not know it."""
        self._shown = None
        self.poll()

    def poll(self) -> None:
        """Send the page the name, if it has changed, also by another page."""
        operator = self.map.page.viewer.operator
        if operator != self._shown:
            self._shown = operator
            viewer = self.map.page.viewer
            self.browser_part.send(
                asdict(operator)
                | {"label": str(operator), "role": viewer.role}
                | {"signsOut": viewer.signs_out}
            )

    def on_message(self, message: dict[str, Any]) -> None:
        """Set the name that the page states."""
        name, place = message.get("name"), message.get("place")
        if not isinstance(name, str) or not isinstance(place, str):
            log.warning("%r: an unknown message of the page was ignored", self.map)
            return
        refused = self.map.page.viewer.rename(name, place)
        self.poll()
        self.browser_part.send({"refused": refused})
