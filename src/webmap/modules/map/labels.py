"""Points of interest, by their names."""

import logging
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from webmap.core.label_layer import LabelLayer
from webmap.core.labels import (
    ICONS,
    MAX_NAME,
    Label,
    LabelStore,
    label_file,
    new_label,
    read_labels,
)
from webmap.core.robot_and_pose import robot_and_pose
from webmap.errors import ConfigError

if TYPE_CHECKING:
    from webmap.core.map import Map

log = logging.getLogger("webmap.modules.labels")

ORDER = 90.0
"""Under the robots, over everything else."""

MAY_ADD = ("operator", "admin")
"""Roles of viewers who may."""


class Labels:
    """Shows places with their names, upright and as large at every zoom.

    They come from the program, from a file, and from the page, where people add them;
    those are kept on this machine and are on every page that has labels of that name.
    A press on a label offers to send the selected robot there.

    Style them by CSS: ``.label``, with the icon's name and ``kind`` as further classes.

    Args:
        map: The map.
        labels: Tables with ``name``, ``x`` and ``y`` in metres, and if wanted ``icon``,
            ``kind`` (a class) and ``yaw`` in radians.
        file: A YAML or JSON file with such a list.
        name: Which file of the state folder keeps those that are added.
        editable: Whether they can be added, moved and taken away on the page.
        key: The key that begins to add one.

    Raises:
        ConfigError: If a label makes no sense; it is named by its number and its key.

    """

    def __init__(
        self,
        map: "Map",
        labels: Iterable[Mapping[str, Any] | Label] = (),
        *,
        file: str | Path | None = None,
        name: str = "labels",
        editable: bool = True,
        key: str = "l",
    ) -> None:
        if len(key) != 1:
            raise ConfigError(f"Labels: key must be one character, got {key!r}")
        LabelStore(Path(), name)
        configured = read_labels(labels, "labels")
        if file is not None:
            configured = read_labels((*configured, *label_file(file)), "labels")
        self.map = map
        self.may_edit = editable and map.page.viewer.role in MAY_ADD
        self.layer = LabelLayer.shared(name, configured)
        self.layer.show_on(map, order=ORDER)
        self.half = map.add_browser_half(
            self,
            "modules/labels.js",
            {
                "editable": self.may_edit,
                "key": key,
                "icons": list(ICONS),
                "longest": MAX_NAME,
            },
            "modules/labels.css",
        )

    def on_message(self, message: dict[str, Any]) -> None:
        """Add a label, move or take one away, or note where a robot was sent."""
        try:
            if "goal" in message:
                sent = robot_and_pose(self.map, message["goal"])
                if sent is not None:
                    self.map.notify_modules("on_goal_sent", *sent)
            elif not self.may_edit:
                raise ConfigError("only an operator adds, moves and deletes labels")
            elif "add" in message:
                self.layer.add(new_label(message["add"]))
                self.half.send({"done": True})
            elif "move" in message:
                self.layer.move(str(message["move"]), message.get("to"))
                self.half.send({"done": True})
            elif "remove" in message:
                self.layer.remove(str(message["remove"]))
                self.half.send({"done": True})
        except ConfigError as error:
            self.half.send({"refused": str(error)})
