"""Bytes between the display process and a browser page, without any socket."""

from webmap.wire.messages import (
    ElementEvent,
    Hello,
    ModuleMessage,
    ModuleReady,
    PageEvent,
    Trouble,
    ViewReport,
    read_hello,
)
from webmap.wire.session import SceneSession

__all__ = [
    "ElementEvent",
    "Hello",
    "ModuleMessage",
    "ModuleReady",
    "PageEvent",
    "SceneSession",
    "Trouble",
    "ViewReport",
    "read_hello",
]
