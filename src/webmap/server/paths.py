"""What the paths and queries of requests mean."""

import re
from collections.abc import Mapping

from webmap.server.ports import PageEntry, Site

_PAGE_ID = re.compile(r"[A-Za-z0-9_-]{1,64}")


def find_page(site: Site, path: str) -> PageEntry | None:
    """Return the page at a path, with or without the slash at its start."""
    return site.pages.get("/" + path.removeprefix("/"))


def other_spelling(path: str) -> str:
    """Return a path with the slash at its end taken away, or added."""
    return path[:-1] if path.endswith("/") else path + "/"


def page_id_of(query: Mapping[str, str]) -> str | None:
    """Return what a page calls itself; None if it is not an identifier."""
    page_id = query.get("id", "")
    return page_id if _PAGE_ID.fullmatch(page_id) else None


def name_in_folder(page: PageEntry, path: str) -> str | None:
    """Return a path relative to a page, as the page's HTML would write it.

    Returns:
        None if the page has no files beside it, or the path does not lie there.

    """
    if page.html is None or page.folder is None:
        return None
    base = page.path.rpartition("/")[0] + "/"
    return path[len(base) :] if path.startswith(base) else None
