"""The selected robot goes from place to place."""

import asyncio
import logging
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import msgspec

from webmap.core.route_store import RouteStore, read_name, read_route
from webmap.core.tasks import spawn
from webmap.errors import ConfigError
from webmap.gate.kept.locks import state_folder

if TYPE_CHECKING:
    from webmap.core.map import Map

log = logging.getLogger("webmap.modules.route_tool")


class RouteTool:
    """Routes of waypoints: drawn on the map, kept by name, gone along by a robot.

    An area that is drawn becomes waypoints of sweeps over it, in the page alone.

    The page sends one goal after the other, under the lease that it has: a route goes
    on only as long as its page is there. Routes are kept on the server, in the folder
    of WebMap's state, for each map.

    Args:
        map: The map.
        name: What the map is called; routes of maps of other names are not offered. The
            path of the page if not given.

    """

    def __init__(self, map: "Map", name: str | None = None) -> None:
        self.map = map
        self._store = RouteStore(
            state_folder() / "routes", name or f"page {map.page.entry.path}"
        )
        self.half = map.add_browser_half(
            self,
            "modules/route_tool.js",
            {"saves": map.page.viewer.role != "viewer"},
            "modules/route_tool.css",
        )

    def on_ready(self) -> None:
        """Tell the page which routes there are."""
        self._do(lambda: None)

    def on_message(self, message: dict[str, Any]) -> None:
        """Keep, load or delete a route, as the page asks."""
        op = message.get("op")
        if op == "load":
            self._do(lambda: self._load(read_name(message.get("name"))))
        elif op not in ("save", "delete"):
            log.warning("%r: an unknown message of the page was ignored", self.map)
        elif self.map.page.viewer.role == "viewer":
            self.half.send({"problem": "Who may not drive may not change routes."})
        elif op == "save":
            self._do(lambda: self._save(message))
        else:
            self._do(lambda: self._store.delete(read_name(message.get("name"))))

    def _load(self, name: str) -> dict[str, Any]:
        route = msgspec.to_builtins(self._store.load(name))
        return {"loaded": {"name": name, **route}}

    def _save(self, message: dict[str, Any]) -> dict[str, Any]:
        name = read_name(message.get("name"))
        self._store.save(name, read_route(message.get("route")))
        return {"saved": name}

    def _do(self, work: Callable[[], dict[str, Any] | None]) -> None:
        """Do something with the file in a thread, and tell the page what came of it."""

        async def do() -> None:
            try:
                answer = await asyncio.to_thread(work) or {}
                names = await asyncio.to_thread(self._store.names)
                self.half.send({**answer, "routes": names})
            except ConfigError as error:
                self.half.send({"problem": str(error)})

        spawn(do())
