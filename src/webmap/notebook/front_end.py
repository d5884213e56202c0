"""The ES module and the style sheet of the widget, each in one text."""

import functools
from pathlib import Path

from webmap.server.bundles import served_modules, served_sheets

PACKAGE = Path(__file__).parents[1]

FOLDERS = ("notebook", "web", "features/view")

START = "notebook/widget.js"


@functools.cache
def esm() -> str:
    """Return the ES module with all that it imports."""
    sources = _sources(".js")
    # The engine finds pictures there, and not at a server.
    sources["web/access.js"] = sources.pop("notebook/addresses.js")
    start = sources[START].replace('"./addresses.js"', '"../web/access.js"')
    text = served_modules(sources | {START: start}, (START,))[START]
    return text.partition("//# sourceMappingURL=")[0]


@functools.cache
def sheet() -> str:
    """Return the style sheet of the shadow root that contains a map."""
    sheets = served_sheets(_sources(".css"), shared="")
    names = ("web/webmap.css", "features/view/view.css", "notebook/widget.css")
    return "".join(sheets[name] for name in names).replace(":root", ":host")


def _sources(suffix: str) -> dict[str, str]:
    paths = (path for folder in FOLDERS for path in (PACKAGE / folder).rglob("*.*"))
    return {
        path.relative_to(PACKAGE).as_posix(): path.read_text("utf-8")
        for path in sorted(paths)
        if path.suffix == suffix
    }
