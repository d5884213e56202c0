"""The classes of an element."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from webmap.errors import SceneError

if TYPE_CHECKING:
    from webmap.scene.element import Element


class Classes:
    """The classes that Python gave to an element, in the order of giving.

    What a page adds by itself (``selected`` on one viewer's map, ``stale``) is not
    among them.
    """

    __slots__ = ("_element",)

    def __init__(self, element: "Element") -> None:
        self._element = element

    def __contains__(self, name: object) -> bool:
        return name in self._element._classes

    def __iter__(self) -> Iterator[str]:
        return iter(self._element._classes)

    def __len__(self) -> int:
        return len(self._element._classes)

    def __str__(self) -> str:
        return " ".join(self._element._classes)

    def add(self, *names: str) -> None:
        """Give the element these classes, if it has not got them yet."""
        self._replace({**self._element._classes, **split_classes(*names)})

    def remove(self, *names: str) -> None:
        """Take these classes from the element, if it has them."""
        gone = split_classes(*names)
        self._replace({n: None for n in self._element._classes if n not in gone})

    def toggle(self, name: str, on: bool | None = None) -> bool:
        """Give or take a class: as ``on`` says, else the other way than it is.

        Returns:
            Whether the element has the class now.

        """
        wanted = name not in self if on is None else on
        (self.add if wanted else self.remove)(name)
        return wanted

    def _replace(self, classes: dict[str, None]) -> None:
        element = self._element
        if classes.keys() != element._classes.keys():
            element._classes = classes
            element._touch("class")


def split_classes(*names: str) -> dict[str, None]:
    """Return the single classes in ``names``, without doubles, in their order.

    Raises:
        SceneError: If a name is empty or not text.

    """
    classes: dict[str, None] = {}
    for name in names:
        if not isinstance(name, str) or not name.strip():
            raise SceneError(f"a class must be a word, got {name!r}")
        classes.update(dict.fromkeys(name.split()))
    return classes
