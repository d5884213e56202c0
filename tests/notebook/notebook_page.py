"""A page in Chromium that gives a widget what anywidget's host gives."""

import base64
import json
import queue
from collections.abc import Callable

from fake_comm import FakeComm
from playwright.sync_api import Page

from equipment.waiting import polls

HOST = """
(esm) => {
  const listeners = new Map();
  const traits = {};
  const model = {
    get: (name) => traits[name],
    send: (content) => window.toPython(JSON.stringify(content)),
    on: (event, fn) => listeners.set(event, [...(listeners.get(event) ?? []), fn]),
    off: (event, fn) =>
      listeners.set(event, listeners.get(event).filter((each) => each !== fn)),
  };
  const fire = (event, ...given) => {
    for (const fn of listeners.get(event) ?? []) fn(...given);
  };
  const url = URL.createObjectURL(new Blob([esm], { type: "text/javascript" }));
  const ends = new Map();
  window.host = {
    set: (changes) => {
      Object.assign(traits, changes);
      for (const name of Object.keys(changes)) fire(`change:${name}`);
    },
    show: async (cell) => {
      const { default: widget } = await import(url);
      const el = document.body.appendChild(document.createElement("div"));
      el.id = cell;
      ends.set(cell, widget().render({ model, el }));
    },
    close: (cell) => {
      ends.get(cell)();
      document.getElementById(cell).remove();
    },
    deliver: (content, buffers) => {
      const views = buffers.map((data) => {
        // In JupyterLab they are parts of a longer message.
        const bytes = Uint8Array.from(atob(data), (c) => c.charCodeAt(0));
        const whole = new Uint8Array(bytes.length + 7);
        whole.set(bytes, 3);
        return new DataView(whole.buffer, 3, bytes.length);
      });
      fire("msg:custom", content, views);
    },
  };
}
"""


class NotebookPage:
    """Shows a widget in cells, and carries its messages while a test waits.

    Args:
        tab: The page.
        widget: The widget; its connection is a :class:`FakeComm`.
        style: The style of the notebook.

    """

    def __init__(self, tab: Page, widget: object, style: str = "") -> None:
        self.tab = tab
        self.comm: FakeComm = widget.comm
        self.to_python: list[str] = []
        """What the page has sent, as JSON."""
        html = f"<!doctype html><style>{style}</style><body></body>"
        tab.route(
            "http://notebook.test/",
            lambda route: route.fulfill(body=html, content_type="text/html"),
        )
        tab.goto("http://notebook.test/")
        tab.expose_function("toPython", self._receive)
        tab.evaluate(HOST, widget._esm)
        names = ("sheet", "height", "theme")
        self.set(**{name: getattr(widget, name) for name in names})

    def _receive(self, text: str) -> None:
        self.to_python.append(text)
        self.comm.deliver(json.loads(text))

    def set(self, **traits: object) -> None:
        """Set traits, as a program does."""
        self.tab.evaluate("(traits) => window.host.set(traits)", traits)

    def show(self, cell: str) -> None:
        """Show the widget in a cell."""
        self.tab.evaluate("(cell) => window.host.show(cell)", cell)

    def close(self, cell: str) -> None:
        """Clear the output of a cell."""
        self.tab.evaluate("(cell) => window.host.close(cell)", cell)

    def carry(self) -> None:
        """Deliver what the widget has sent; what the page sends comes by itself."""
        try:
            while True:
                content, buffers, _ = self.comm.sent.get_nowait()
                data = [base64.b64encode(each).decode() for each in buffers]
                self.tab.evaluate(
                    "([content, data]) => window.host.deliver(content, data)",
                    [content, data],
                )
        except queue.Empty:
            self.tab.wait_for_timeout(10)

    def until(self, condition: Callable[[], object]) -> None:
        """Carry messages until a condition is true."""
        for _ in polls("the condition"):
            if condition():
                return
            self.carry()

    def count(self, selector: str) -> int:
        """Return the number of elements, also in the shadow roots of cells."""
        return self.tab.locator(selector).count()
