"""A command that opens the console, and its page in a browser."""

from contextlib import contextmanager

from equipment.chromium import watched_tab
from equipment.webmap_process import webmap


@contextmanager
def shown(chromium, *arguments):
    """Run a command that opens the console, and open its page."""
    command = webmap(*arguments, "--port", "0", "--no-browser")
    with command as url, watched_tab(chromium, 1280, 720) as page:
        page.goto(url)
        yield page
