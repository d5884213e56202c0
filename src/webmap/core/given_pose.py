"""The forms in which a program gives a pose."""

from typing import Protocol


class Position(Protocol):
    """Anything with ``x`` and ``y`` in metres."""

    @property
    def x(self) -> float:
        """Metres along x."""

    @property
    def y(self) -> float:
        """Metres along y."""


class Orientation(Protocol):
    """Anything with the components of a quaternion."""

    @property
    def x(self) -> float:
        """The component along x."""

    @property
    def y(self) -> float:
        """The component along y."""

    @property
    def z(self) -> float:
        """The component along z."""

    @property
    def w(self) -> float:
        """The real component."""
