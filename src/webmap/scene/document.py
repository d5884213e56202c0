"""Elements of a user's own HTML page, found by their ids."""

from typing import Any, Self

from webmap.base.errors import SceneError
from webmap.scene.allowed import format_value
from webmap.scene.element import Element
from webmap.scene.node import Child


class BoundElement(Element):
    """The element with an id in the user's own HTML.

    Children that Python appends follow the page's own content. Setting the text, or
    :meth:`clear`, first removes the page's own content.
    """

    __slots__ = ("dropped", "emptied", "html_id")

    def __init__(self, html_id: str) -> None:
        if not isinstance(html_id, str) or not html_id or html_id.split() != [html_id]:
            raise SceneError(f"an id must be a word, got {html_id!r}")
        super(Element, self).__init__()
        self._prepare("#bound", "html")
        self.html_id = html_id
        self.emptied = False
        self.dropped: dict[str, None] = {}
        """Attributes that were unset; the page's own HTML may have them."""

    def __repr__(self) -> str:
        return f"<element #{self.html_id}>"

    def clear(self) -> Self:
        """Remove everything in the element, including the page's own content."""
        self._empty()
        return super().clear()

    @property
    def text(self) -> str:
        """The text that Python set; setting it replaces the whole content."""
        return Element.text.fget(self)  # type: ignore[attr-defined,no-any-return]

    @text.setter
    def text(self, text: str) -> None:
        self._empty()
        Element.text.fset(self, text)  # type: ignore[attr-defined]

    def _set(self, name: str, value: Any) -> None:
        if name not in ("class", "transform"):
            if format_value(name, value) is not None:
                self.dropped.pop(name, None)
            elif name not in self.dropped:
                self.dropped[name] = None
                self._touch(name)
        super()._set(name, value)

    def _empty(self) -> None:
        if not self.emptied:
            self.emptied = True
            self._touch("emptied")


class Document(Element):
    """The root of a fragment with the bound elements of a page."""

    __slots__ = ()

    def __init__(self) -> None:
        super(Element, self).__init__()
        self._prepare("#document", "html")

    def bind(self, html_id: str) -> BoundElement:
        """Return the element with that id; the same one at every call."""
        for child in self._children:
            if isinstance(child, BoundElement) and child.html_id == html_id:
                return child
        element = BoundElement(html_id)
        self.append(element)
        return element

    def insert(self, index: int, child: Child) -> Self:
        """Insert a bound element; other elements have no place in a user's page.

        Raises:
            SceneError: If ``child`` is not a bound element.

        """
        if not isinstance(child, BoundElement):
            raise SceneError(
                f"{child!r} has no place in the document: append it to an element "
                "of the page, as in page.element('id').append(...)"
            )
        return super().insert(index, child)

    def _set(self, name: str, value: Any) -> None:
        raise SceneError("the document has no attributes: set them on its elements")
