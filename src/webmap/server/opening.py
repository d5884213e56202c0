"""Opens a page in a browser without revealing the code to other users.

Every user of a machine can read the command line of every process. So the browser gets
the name of a file that only its owner can read, and the file redirects to the page.
"""

import contextlib
import logging
import os
import tempfile
import threading
import webbrowser
from collections.abc import Iterator
from html import escape
from pathlib import Path

from webmap.server.access import CODE
from webmap.server.auth import CODE_LIFE_S

log = logging.getLogger("webmap")

_HTML = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="referrer" content="no-referrer">
<meta http-equiv="refresh" content="0;url={url}">
<title>WebMap</title>
<p>This link opens <a href="{url}">WebMap</a>, once.</p>
</html>
"""


@contextlib.contextmanager
def opened(url: str, code: str) -> Iterator[None]:
    """Open a page in a browser, and keep the file for it while the block runs.

    The file is removed at the end of the block, or when its code has expired.

    Args:
        url: The URL of the page, without a query.
        code: A one-time code that signs in.

    """
    file = _write(_HTML.format(url=escape(f"{url}?{CODE}={code}")))
    if file is None:
        log.warning(
            "no browser is opened, as no file can be written in the home folder or in "
            "%s: open the printed address yourself",
            tempfile.gettempdir(),
        )
        yield
        return
    timer = threading.Timer(CODE_LIFE_S, file.unlink, [True])
    timer.daemon = True
    timer.start()
    # Some browsers return only when they are closed.
    browser = threading.Thread(
        target=webbrowser.open, args=(file.as_uri(),), daemon=True
    )
    browser.start()
    try:
        yield
    finally:
        timer.cancel()
        file.unlink(missing_ok=True)


def _write(html: str) -> Path | None:
    # Browsers installed as snaps cannot read hidden folders or the folder for temporary
    # files.
    for folder in (Path.home(), Path(tempfile.gettempdir())):
        with contextlib.suppress(OSError):
            number, name = tempfile.mkstemp(".html", "webmap-sign-in-", folder)
            with os.fdopen(number, "w", encoding="utf-8") as file:
                file.write(html)
            return Path(name)
    return None
