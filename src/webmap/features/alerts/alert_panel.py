"""The panel with the alerts, on each page."""

import logging
import time
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from webmap.features.alerts.alerts import KINDS, MOST, Alerts

if TYPE_CHECKING:
    from webmap.core.map import Map

log = logging.getLogger("webmap.modules.alerts")


class AlertPanel:
    """A button with the number of new alerts, and their list; a module of maps.

    Args:
        map: The map.
        alerts: The list that all pages share.
    """

    def __init__(self, map: "Map", alerts: Alerts) -> None:
        self.map = map
        self._alerts = alerts
        self._sent = -1
        self._may = map.page.viewer.role != "viewer"
        self.browser_part = map.add_browser_part(
            self,
            "features/alerts/alert_panel.js",
            {"kinds": KINDS, "may": self._may},
            "features/alerts/alert_panel.css",
        )

    def on_ready(self) -> None:
        """Send everything: a page that was loaded again knows no alert."""
        self._sent = -1
        self.poll()

    def poll(self) -> None:
        """Send the page the alerts that changed."""
        if self._sent == self._alerts.version:
            return
        changed = self._alerts.since(self._sent)
        self._sent = self._alerts.version
        self.browser_part.send(
            {
                "alerts": [asdict(alert) for alert in changed],
                "ids": list(self._alerts.listed),
                "dropped": self._alerts.dropped,
            }
        )

    def on_message(self, message: dict[str, Any]) -> None:
        """Acknowledge alerts, or select the robot of an alert."""
        if "acknowledge" in message:
            self._answer(self._acknowledge(message["acknowledge"]))
        elif "select" in message:
            self._answer(self._select(message["select"]))
        else:
            log.warning("%r: an unknown message of the page was ignored", self.map)

    def _answer(self, problem: str) -> None:
        self.browser_part.send({"problem": problem})

    def _acknowledge(self, ids: object) -> str:
        """Acknowledge alerts; return what was wrong, or an empty text."""
        if not self._may:
            return "Viewers cannot acknowledge alerts: sign in as an operator."
        if not isinstance(ids, list) or len(ids) > MOST or not all(map(_is_id, ids)):
            return (
                f"Not acknowledged: a list of at most {MOST} numbers of alerts was "
                f"expected, got {str(ids)[:80]}. Reload the page."
            )
        now, by = time.time(), self.map.page.viewer.name
        missing = [id for id in ids if not self._alerts.acknowledge(id, by, now)]
        self.poll()
        if not missing:
            return ""
        return f"No longer in the list: {len(missing)} of the acknowledged alerts."

    def _select(self, id: object) -> str:
        """Select a robot and show it; return what was wrong, or an empty text."""
        robot = self.map.find_robot(id)
        if robot is None:
            return "This robot is no longer on the page."
        self.map.set_selected(robot)
        if robot.valid:
            self.map.bring_into_sight(robot)
        return ""


def _is_id(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)
