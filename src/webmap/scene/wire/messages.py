"""Messages of a page: typed, bounded, and refused if they are invalid."""

from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta

from webmap.base.errors import WireError
from webmap.base.nesting import MAX_DEPTH, is_too_deep
from webmap.scene.allowed import EVENTS

LONGEST = 16 * 1024
"""The greatest length of a message from a page, in bytes."""

LONGEST_TEXTS = {"name": 64, "value": 8192, "url": 500, "trouble": 2000}
"""The greatest lengths of texts in these messages, in characters; the browser cuts
longer ones."""

MOST_UNSEEN = 1000
"""The greatest number of elements that a page does not show and names."""

PAGE_ID = "^[A-Za-z0-9_-]{8,64}$"
"""The pattern of the name that a page chooses for itself."""

_Id = Annotated[int, Meta(ge=0, le=2**53)]
_Name = Annotated[str, Meta(max_length=LONGEST_TEXTS["name"])]


class PageMessage(
    msgspec.Struct,
    frozen=True,
    kw_only=True,
    tag_field="op",
    forbid_unknown_fields=True,
):
    """Base class of the messages of a page; a message with other fields is refused."""


class PageHello(PageMessage, frozen=True, tag="hello"):
    """The page's identity and size, in the address of its socket or its first message.

    In the address, so that the first picture takes one round trip less.
    """

    page: Annotated[str, Meta(pattern=PAGE_ID)]
    """Chosen by the page and kept through a reload, to find its maps again."""

    url: Annotated[str, Meta(max_length=LONGEST_TEXTS["url"])]
    """Path and query of the page."""

    width: float
    """The width of the window, in pixels."""

    height: float
    """The height of the window, in pixels."""

    dpr: float = 1.0
    """Device pixels per pixel of the page."""

    theme: Literal["light", "dark"] = "light"
    """The preference of the viewer's system."""

    gzip: bool = False
    """Whether the page reads frames that are compressed with gzip."""

    containers: dict[_Name, tuple[float, float]] = {}
    """The width and height of each element with an id in the page, in pixels."""


class ElementEvent(PageMessage, frozen=True, tag="event"):
    """An event of an element with a listener."""

    mount: _Id
    element: _Id
    event: _Name
    x: float = 0.0
    y: float = 0.0
    world_x: float | None = None
    world_y: float | None = None
    key: _Name = ""
    button: int = 0
    delta: float = 0.0
    shift: bool = False
    ctrl: bool = False
    alt: bool = False
    meta: bool = False
    value: Annotated[str, Meta(max_length=LONGEST_TEXTS["value"])] | None = None
    checked: bool | None = None


class ViewReport(PageMessage, frozen=True, tag="view"):
    """The current view of a map: the matrix from the world to pixels, and its size."""

    map_element: _Id
    a: float
    b: float
    c: float
    d: float
    e: float
    f: float
    width: float
    height: float
    left: float
    """Pixels from the left of the window."""

    top: float
    """Pixels from the top of the window."""

    dpr: float = 1.0
    """Pixels of the screen per pixel of the page."""

    follow: _Id = 0
    """The element that the view follows, or 0."""

    applied: _Id = 0
    """The number of the newest operation that the view contains."""


class ModuleReady(PageMessage, frozen=True, tag="ready"):
    """A module's browser part was attached, possibly again after a reload."""

    instance: _Id


class ModuleMessage(PageMessage, frozen=True, tag="module"):
    """A message of a module's browser part to the module."""

    instance: _Id
    data: dict[str, Any]


class Trouble(PageMessage, frozen=True, tag="trouble"):
    """A failure of the page that is logged."""

    text: Annotated[str, Meta(max_length=LONGEST_TEXTS["trouble"])]


class Seen(PageMessage, frozen=True, tag="seen"):
    """The page has applied this frame and all before it."""

    frame: _Id


class Unseen(PageMessage, frozen=True, tag="unseen"):
    """The elements that are drawn as dots and not shown: their layers are off."""

    elements: Annotated[list[_Id], Meta(max_length=MOST_UNSEEN)]


class Resync(PageMessage, frozen=True, tag="resync"):
    """The page could not read a frame and requests the whole state."""


PageEvent = (
    PageHello | ElementEvent | ViewReport | ModuleReady | ModuleMessage | Trouble
)
"""Messages that concern more than the session itself."""

_decoder: msgspec.json.Decoder[PageEvent | Seen | Unseen | Resync] = (
    msgspec.json.Decoder(PageEvent | Seen | Unseen | Resync)
)


def read_message(text: str | bytes) -> PageEvent | Seen | Unseen | Resync:
    """Return the decoded message of a page.

    Raises:
        WireError: If it is too long or not a message that a page may send.

    """
    size = len(text)
    if size > LONGEST:
        raise WireError(f"a page sent {size} characters; at most {LONGEST} are taken")
    try:
        message = _decoder.decode(text)
    except (msgspec.DecodeError, UnicodeError, RecursionError) as error:
        raise WireError(f"a page sent no message that is known: {error}") from error
    if isinstance(message, ModuleMessage) and is_too_deep(message.data):
        raise WireError(f"a page sent a message nested deeper than {MAX_DEPTH} levels")
    if isinstance(message, ElementEvent) and message.event not in EVENTS:
        raise WireError(f"a page sent an unknown event {message.event!r}")
    return message
