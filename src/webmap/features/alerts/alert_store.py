"""The alerts on disk, so that a restart of WebMap does not forget them."""

import asyncio
import logging
from collections.abc import Callable, Iterable, Sequence

import msgspec

from webmap.base.errors import ConfigError
from webmap.base.lifecycle import lifecycle
from webmap.base.plain_files import read_file, write_file
from webmap.core.robot import Robot
from webmap.core.shift_log import RobotName, shift_log
from webmap.features.alerts.alerts import PERIOD, Alert, Alerts
from webmap.gate.locks import state_folder

log = logging.getLogger("webmap.modules.alerts")

LARGEST = 1 << 20
"""Most bytes of the file."""


class AlertKeeper:
    """Keeps the alerts on disk, and notes in the shift log what becomes of them.

    Args:
        alerts: The alerts.
        robots: Returns the robots that are shown now.
        name: The name of the file.
    """

    def __init__(
        self, alerts: Alerts, robots: Callable[[], Iterable[Robot]], name: str
    ) -> None:
        self._alerts = alerts
        self._robots = robots
        self._file = state_folder() / "alerts" / f"{name}.json"
        self._trouble = ""
        self._task: asyncio.Task[None] | None = None
        alerts.restore(self._load())
        self._version = alerts.version
        self._seen = {id: _state(each) for id, each in alerts.listed.items()}

    def begin(self) -> None:
        """Keep them while the process runs."""
        lifecycle.add(self)

    def start(self, loop: asyncio.AbstractEventLoop) -> None:
        """Begin to look for changes; called in the loop's thread."""
        self._task = loop.create_task(self._look_on())

    async def stop(self) -> None:
        """Keep the last changes, and look no more."""
        if self._task is not None:
            self._task.cancel()
            self._task = None
            await self.look()

    async def look(self) -> None:
        """Note and keep what has changed since the last look."""
        if self._version == self._alerts.version:
            return
        self._version = self._alerts.version
        alerts = list(self._alerts.listed.values())
        self._note(alerts)
        data = msgspec.json.encode(alerts)
        try:
            await asyncio.to_thread(write_file, self._file, data)
            self._trouble = ""
        except OSError as error:
            if str(error) != self._trouble:
                self._trouble = str(error)
                log.error("the alerts are lost at a restart: %s", error)

    def _load(self) -> Sequence[Alert]:
        try:
            data = read_file(self._file, LARGEST, links=False)
            return msgspec.json.decode(data, type=list[Alert])
        except FileNotFoundError:
            return ()
        except (OSError, ConfigError, msgspec.DecodeError, UnicodeDecodeError) as error:
            log.warning("%s cannot be read: %s", self._file, error)
            shift_log.note("log", f"The earlier alerts cannot be read: {error}")
            return ()

    def _note(self, alerts: Iterable[Alert]) -> None:
        bridges = {robot.id: robot.pose_source.bridge for robot in self._robots()}
        seen, self._seen = self._seen, {}
        for alert in alerts:
            ended, count, acknowledged = seen.get(alert.id, (0.0, 0, None))
            self._seen[alert.id] = _state(alert)
            bridge = bridges.get(alert.robot)
            name = "" if bridge is None else bridge.name or bridge.url
            if count < alert.count:
                _add(alert, "began", alert.text, name)
            if alert.ended is not None and ended != alert.ended:
                _add(alert, "over", f"over: {alert.text}", name)
            if acknowledged is None and alert.by is not None:
                _add(alert, "acknowledged", f"acknowledged: {alert.text}", name)

    async def _look_on(self) -> None:
        while True:
            try:
                await self.look()
            except Exception:
                log.exception("the alerts were not kept")
            await asyncio.sleep(PERIOD)


def _state(alert: Alert) -> tuple[float | None, int, float | None]:
    return alert.ended, alert.count, alert.acknowledged


def _add(alert: Alert, event: str, text: str, bridge: str) -> None:
    robot = RobotName(alert.robot, alert.name)
    by = alert.by if event == "acknowledged" else None
    facts = {"alert": alert.kind, "event": event, "bridge": bridge}
    shift_log.note("alert", text, robot=robot, person=by, **facts)
