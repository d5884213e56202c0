"""What the makers of SVG and of HTML elements have in common."""

from typing import Any, ClassVar

from webmap.scene.element import Child, Element


class TagMaker:
    """Makes elements with one tag of a namespace."""

    namespace: ClassVar[str]
    """``"svg"`` or ``"html"``."""

    def __init__(self, tag: str) -> None:
        self.tag = tag

    def __call__(
        self, *children: Child, text: str | None = None, **attributes: Any
    ) -> Element:
        """Return a new element.

        Raises:
            SceneError: If an attribute is not allowed.

        """
        return Element(
            self.tag, *children, text=text, namespace=self.namespace, **attributes
        )

    def __repr__(self) -> str:
        return f"<maker of {self.namespace.upper()} {self.tag}>"
