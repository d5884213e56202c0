"""When a page of the console can be used."""

import time

from playwright.sync_api import Page

READY = """async () => {
  const { page } = await import(document.querySelector("script[type=module]").src);
  const halves = [...page.halves._attached.values()];
  const styles = [...document.querySelectorAll("link[rel=stylesheet]")];
  return halves.every(({ half }) => half) && styles.every(({ sheet }) => sheet);
}"""
"""Whether every module of the page is there and listens, and every style sheet."""


def wait_until_ready(page: Page) -> None:
    """Wait for what the page loads once it knows its modules, each on its own."""
    deadline = time.monotonic() + 30
    while not page.evaluate(READY):
        assert time.monotonic() < deadline, "a module of the page does not come"
        page.wait_for_timeout(50)
