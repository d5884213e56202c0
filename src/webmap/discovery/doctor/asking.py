"""Questions to rosapi, of which only those are asked that every bridge answers.

``get_param_names``, which hangs rosapi for ROS 2, and ``message_details``, which ends
it, are never called.
"""

import time
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from webmap.discovery.doctor.observed import Clock
from webmap.errors import BridgeError
from webmap.ros.calls import Calls
from webmap.ros.decoding import convert
from webmap.ros.messages import Time

PATIENCE = 3.0
PARAMETER = "/rosbridge_websocket:call_services_in_new_thread"

Names = dict[str, tuple[str, ...]]
"""Nodes by topic, where rosapi said so."""


class Asking:
    """Questions to rosapi; when one is not answered no more are asked."""

    def __init__(self, calls: Calls) -> None:
        self._calls = calls
        self._silent = False

    async def clock(self) -> Clock | None:
        """Compare the clocks; the quickest of three answers tells most."""
        found: list[Clock] = []
        for _ in range(3):
            began, wall = time.monotonic(), time.time()
            answer = await self._ask("/rosapi/get_time")
            trip = time.monotonic() - began
            if answer is None:
                break
            try:
                theirs = convert(answer.get("time"), Time).seconds
            except BridgeError:
                break
            found.append(Clock(theirs - (wall + trip / 2), trip))
        # The first call opens the socket, which takes time of its own.
        return min(found, key=lambda each: each.round_trip, default=None)

    async def publishers(self, topics: Iterable[str]) -> Names:
        """Return the nodes that publish on each topic."""
        return await self._nodes("publishers", topics)

    async def subscribers(self, topics: Iterable[str]) -> Names:
        """Return the nodes that listen to each topic."""
        return await self._nodes("subscribers", topics)

    async def threads(self) -> bool | None:
        """Return whether rosbridge says that it calls services in threads."""
        request = {"name": PARAMETER, "default_value": "", "default": ""}
        answer = await self._ask("/rosapi/get_param", request)
        value = "" if answer is None else str(answer.get("value", "")).lower()
        return {"true": True, "false": False}.get(value.strip('"'))

    async def _nodes(self, kind: str, topics: Iterable[str]) -> Names:
        found: Names = {}
        for topic in dict.fromkeys(filter(None, topics)):
            answer = await self._ask(f"/rosapi/{kind}", {"topic": topic})
            names = None if answer is None else answer.get(kind)
            if isinstance(names, list):
                found[topic] = tuple(str(name) for name in names)
        return found

    async def _ask(
        self, service: str, args: Mapping[str, Any] | Sequence[Any] | None = None
    ) -> dict[str, Any] | None:
        if self._silent:
            return None
        try:
            answer = await self._calls.call(service, args, None, PATIENCE)
        except BridgeError as error:
            self._silent = "did not answer" in str(error)
            return None
        return answer if isinstance(answer, dict) else None
