"""The HTML of pages: the user's own with additions, or a generated page.

The user's file is changed in three ways only: the base style sheet is inserted first in
the head, so that the user's own rules override it, and the script last; and WebMap's
own files that the page loads by itself get the address of their version.

A page can open its socket before its style sheets are there, if the size of the window
is near that of its map: then its HTML has the element :data:`EARLY`. The text of
``web/opening.js`` takes its place, first in the head. It runs as soon as the HTML
comes; a module would come a round trip later.
"""

import functools
import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from html import escape
from html.parser import HTMLParser

from webmap.server.access import KEY
from webmap.server.bundles import STARTS
from webmap.server.own_files import FOLDERS

NEXT = "webmap-next"
"""The relation of links to the bundles that opening.js makes the browser load."""

EARLY = '<script type="module" async src="_webmap/web/opening.js"></script>'
"""In the HTML of a page that opens its socket early."""

FOLDER = "/_webmap/"
"""The path of WebMap's own files and sockets, under the application's root."""

_MADE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport"
  content="width=device-width, initial-scale=1, interactive-widget=resizes-content">
<title>{title}</title>{first}
<link rel="icon" href="{base}icon.svg" type="image/svg+xml">
<link rel="stylesheet" href="{base}web/webmap.css">
<link rel="stylesheet" href="{base}made_page.css">
{last}
</head>
<body>
<div id="webmap_container"></div>
<noscript>WebMap needs JavaScript.</noscript>
</body>
</html>
"""

# Other types are data, which no policy blocks.
_SCRIPTS = {"", "module", "importmap", "text/javascript", "application/javascript"}
_OWN = re.compile(f"(_webmap/)(?={'|'.join(FOLDERS)})")
_LOADS = {"script": "src", "img": "src", "link": "href", "iframe": "src"}


def base_from(path: str) -> str:
    """Return the URL of WebMap's own files, ending in a slash, for a page.

    It is relative: a proxy in front may add a prefix which nobody has stated.

    Args:
        path: The path of the page from the application's root.

    """
    return relative(path, FOLDER)


def relative(path: str, to: str) -> str:
    """Return a path of the application as a URL relative to another one."""
    return "./" + "../" * (path.count("/") - 1) + to.lstrip("/")


def make_page(
    title: str,
    base: str,
    opening: str,
    key: str | None = None,
    marks: Iterable[str] = (),
) -> str:
    """Return a page with one container that fills the window.

    Args:
        title: The page's title.
        base: The URL of WebMap's own files: that of :func:`base_from`, and a version.
        opening: The script with which the page opens its socket.
        key: The page's key, if it has just signed in.
        marks: The names of empty elements for the page's script.

    """
    return _MADE.format(
        title=escape(title),
        base=escape(base),
        first=_for_script(key, marks) + _opening(base, opening),
        last=_link("modulepreload", base, STARTS[1]) + _script(base, STARTS[1]),
    )


def _opening(base: str, script: str) -> str:
    """Return the elements for the first bundle, and for those that it loads.

    Args:
        base: The URL of WebMap's own files.
        script: The text of the first bundle; "" if the page loads it.

    """
    links = "".join(_link(NEXT, base, name) for name in STARTS[2:])
    if not script:
        return links + _link("modulepreload", base, STARTS[0])
    return f'{links}<script data-from="{escape(base)}{STARTS[0]}">{script}</script>'


def _link(rel: str, base: str, name: str) -> str:
    return f'<link rel="{rel}" href="{escape(base)}{name}">'


def _script(base: str, name: str) -> str:
    return f'<script type="module" src="{escape(base)}{name}"></script>'


def _for_script(key: str | None, marks: Iterable[str]) -> str:
    stated = "" if key is None else f'<meta name="{KEY}" content="{escape(key)}">'
    return stated + "".join(f'<meta name="{mark}">' for mark in marks)


@dataclass(frozen=True, slots=True)
class OwnPage:
    """A user's HTML with WebMap's additions."""

    text: str
    blocked: list[str] = field(default_factory=list)
    """What the Content-Security-Policy will block, in sentences, with line numbers."""


def prepare_page(
    text: str,
    base: str,
    opening: str,
    key: str | None = None,
    marks: Iterable[str] = (),
) -> OwnPage:
    """Insert the base style sheet and the page's script into a user's HTML.

    Args:
        text: The user's whole HTML.
        base: The URL of WebMap's own files: that of :func:`base_from`, and a version.
        opening: The script with which a page with :data:`EARLY` opens its socket.
        key: The page's key, if it has just signed in.
        marks: The names of empty elements for the page's script.

    """
    version = base.rpartition(FOLDER)[2]
    own = text.replace(EARLY, "", 1)
    is_early = own != text
    text, seen = own, _read(own)
    first, last = _for_script(key, marks), ""
    first += _opening(base, opening if is_early else "")
    if not seen.has("web/webmap.css"):
        first += _link("stylesheet", base, "web/webmap.css")
    first += _link("modulepreload", base, STARTS[1])
    if not seen.has("web/page.js"):
        last = "".join(_script(base, name) for name in STARTS[is_early:2])
    if not seen.icon:
        last += f'<link rel="icon" href="{escape(base)}icon.svg" type="image/svg+xml">'
    start, end = seen.head()
    added = [(end, last), (start, first), *((at, version) for at in seen.own)]
    for at, what in sorted(added, key=lambda one: one[0], reverse=True):
        text = text[:at] + what + text[at:]
    return OwnPage(text, seen.blocked)


@functools.lru_cache(maxsize=8)
def _read(text: str) -> "_Reader":
    return _Reader(text)  # it takes milliseconds, for which the browser waits


class _Reader(HTMLParser):
    """Finds the head of a page, the files it loads, and what will be blocked."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.blocked: list[str] = []
        self.icon = False
        self.own: list[int] = []
        """Where the addresses of WebMap's own files have their version."""
        self._loaded: list[str] = []
        self._head_start: int | None = None
        self._head_end: int | None = None
        self._content: int | None = None
        self._lines = [0]
        for line in text.split("\n"):
            self._lines.append(self._lines[-1] + len(line) + 1)
        self._length = len(text)
        self.feed(text)
        self.close()

    def head(self) -> tuple[int, int]:
        """Return the start and the end of the head; without one, where it would be."""
        content = self._length if self._content is None else self._content
        start = content if self._head_start is None else self._head_start
        end = start if self._head_end is None else max(start, self._head_end)
        return start, end

    def has(self, name: str) -> bool:
        """Return whether the page itself loads one of WebMap's own files."""
        return any(url.endswith(f"_webmap/{name}") for url in self._loaded)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._look_at(tag, {name: value or "" for name, value in attrs})
        own = _OWN.search(self.get_starttag_text() or "")
        if tag in _LOADS and own:
            self.own.append(self._here() + own.end())
        if tag == "head" and self._head_start is None:
            self._head_start = self._here() + len(self.get_starttag_text() or "")
        elif tag == "body" and self._head_start is not None and self._head_end is None:
            self._head_end = self._here()
        if tag not in {"html", "head"} and self._content is None:
            self._content = self._here()
        if tag in {"title", "textarea"}:
            self.set_cdata_mode(tag)  # Older Pythons find tags in these too.

    def handle_endtag(self, tag: str) -> None:
        if tag == "head" and self._head_end is None:
            self._head_end = self._here()

    def _here(self) -> int:
        line, column = self.getpos()
        return self._lines[line - 1] + column

    def _look_at(self, tag: str, attributes: dict[str, str]) -> None:
        url = attributes.get(_LOADS.get(tag, ""), "")
        self._loaded.append(url)
        if tag == "link" and "icon" in attributes.get("rel", "").lower().split():
            self.icon = True
        if tag == "style" or "style" in attributes:
            self._block("an inline style", "a .css file")
        kind = attributes.get("type", "").lower()
        if tag == "script" and "src" not in attributes and kind in _SCRIPTS:
            self._block("an inline script", "a .js file")
        if any(name.startswith("on") for name in attributes):
            self._block("a handler in an attribute", "a .js file")
        if tag == "base":
            self._block("a <base> element", "relative URLs")
        if url.lower().startswith(("http:", "https:", "//", "data:")):
            self._block(f"{url[:80]!r}", "a file of the page's folder")

    def _block(self, what: str, instead: str) -> None:
        self.blocked.append(
            f"line {self.getpos()[0]}: {what} is blocked by the Content-Security-"
            f"Policy; use {instead} instead"
        )
