"""The connection between a widget and a notebook, without a kernel."""

import queue
from contextvars import ContextVar
from typing import Any, NamedTuple

from comm.base_comm import BaseComm


class Sent(NamedTuple):
    """A message of the widget to the notebook."""

    content: dict[str, Any]
    buffers: list[bytes]
    sent_for: str


request: ContextVar[str] = ContextVar("request", default="none")
"""The message that the kernel processes; a message is sent for one."""


class FakeComm(BaseComm):
    """Keeps what the widget sends until the test reads it."""

    def __init__(self, **options: Any) -> None:
        self.sent: queue.Queue[Sent] = queue.Queue()
        super().__init__(**options)

    def publish_msg(self, msg_type, data=None, metadata=None, buffers=None, **keys):
        if (data or {}).get("method") == "custom":
            self.sent.put(Sent(data["content"], list(buffers or ()), request.get()))

    def deliver(self, content: object) -> None:
        """Deliver a message of the notebook to the widget."""
        data = {"method": "custom", "content": content}
        self.handle_msg({"content": {"data": data}, "buffers": []})
