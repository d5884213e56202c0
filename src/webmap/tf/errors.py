"""What can be wrong with frames."""

from webmap.errors import WebMapError


class TransformError(WebMapError):
    """A transform that is none, or one that cannot be told; the words say why."""


class FrameMissing(TransformError, LookupError):
    """Nobody has told of a frame of that name."""


class NotConnected(TransformError):
    """Both frames are there, and nothing leads from one to the other."""


class NotKnownThen(TransformError):
    """The way is there, and a part of it is not known at that time."""
