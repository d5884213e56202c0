"""The scene: SVG and HTML elements as a tree in Python that says what changed."""

from webmap.scene import html, svg
from webmap.scene.bound import BoundElement, Document
from webmap.scene.element import Element
from webmap.scene.events import Event
from webmap.scene.fragment import Added, Change, Changed, Fragment, Removed
from webmap.scene.node import Node, Text

__all__ = [
    "Added",
    "BoundElement",
    "Change",
    "Changed",
    "Document",
    "Element",
    "Event",
    "Fragment",
    "Node",
    "Removed",
    "Text",
    "html",
    "svg",
]
