"""Draw a picture of a part of a page with a number at each button, and their names.

The names are those that Chromium gives to screen readers, so that a picture has the
names of the page. ``tools/screenshots.py`` makes pictures of the manual with this.
"""

import base64
import html
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from PIL import Image
from playwright.sync_api import Page

from webmap.console.robot_looks import LOOKS
from webmap.core.robot_state import STATE_TEXTS

WIDTH = 760
"""The greatest width of a picture in pixels: a page of the docs makes more smaller."""


@dataclass(frozen=True)
class Part:
    """A part of a page that is seen: its name and its box in pixels of the page."""

    name: str
    left: float
    top: float
    right: float
    bottom: float


def parts_of(page: Page, selector: str) -> list[Part]:
    """Return what is seen of a selector's elements, from left to right.

    An element without a name of its own has its title as its name, or its text.
    """
    session = page.context.new_cdp_session(page)
    root = session.send("DOM.getDocument", {"depth": 0})["root"]["nodeId"]
    found = session.send("DOM.querySelectorAll", {"nodeId": root, "selector": selector})
    parts = []
    for node in found["nodeIds"]:
        question = {"nodeId": node, "fetchRelatives": False}
        [answer] = session.send("Accessibility.getPartialAXTree", question)["nodes"]
        if answer["ignored"]:
            continue  # folded, or hidden
        corners = session.send("DOM.getBoxModel", {"nodeId": node})["model"]["border"]
        element = session.send("DOM.resolveNode", {"nodeId": node})["object"]
        text = session.send(
            "Runtime.callFunctionOn",
            {
                "objectId": element["objectId"],
                "functionDeclaration": "function () { return this.innerText; }",
            },
        )["result"]["value"]
        own = [answer.get(key, {}).get("value") for key in ("name", "description")]
        name = next(filter(None, own), " ".join(text.split()))
        parts.append(Part(name, *corners[:2], *corners[4:6]))
    session.detach()
    return sorted(parts, key=lambda part: part.left + part.right)


def cuts(parts: Sequence[Part], left: float, right: float) -> list[float]:
    """Return the edges of strips, which cut no part and are not too wide."""
    strips = -(-(right - left) // WIDTH)
    middles = [(a.right + b.left) / 2 for a, b in pairwise(parts)]
    gaps = [x for x in middles if not any(p.left < x < p.right for p in parts)]
    edges = [left]
    for strip in range(1, int(strips)):
        wanted = left + (right - left) * strip / strips
        edges.append(min(gaps, key=lambda gap: abs(gap - wanted)))
    return [*edges, right]


STYLE = """
  body { margin: 0; background: #fff; color: #131920;
    font: 15px/1.5 system-ui, sans-serif; }
  main { padding: 12px; }
  .strip { position: relative; border: 1px solid #d6dce4; }
  .low { margin-bottom: 34px; }
  b { position: absolute; transform: translate(-50%, -50%); width: 22px; height: 22px;
    border-radius: 11px; background: #131920; color: #fff; text-align: center;
    font: 700 13px/22px system-ui, sans-serif; box-shadow: 0 0 0 2px #fff; }
  .low b::before { content: ""; position: absolute; left: 10px; bottom: 22px;
    width: 2px; height: 10px; background: #131920; }
  ol { margin: 12px 0 0; padding: 0; columns: 2; column-gap: 24px; list-style: none; }
  li { display: flex; gap: 8px; break-inside: avoid; padding: 2px 0; }
  li b { position: static; transform: none; flex: none; box-shadow: none; }
"""


COPY = """([selector, width]) => {
  const holder = document.createElement("div");
  holder.id = "copy";
  const copy = document.querySelector(selector).cloneNode(true);
  copy.open = true;
  copy.querySelector("summary").style.display = "none";
  holder.append(copy);
  holder.style.cssText = `position: absolute; z-index: 99; inset: 0 auto auto 0;
    width: ${width}px; padding: 12px 0; background: var(--webmap-surface)`;
  for (const list of holder.querySelectorAll("ul")) list.style.columns = 2;
  for (const item of holder.querySelectorAll("li")) item.style.breakInside = "avoid";
  document.body.append(holder);
  document.documentElement.style.overflow = document.body.style.overflow = "visible";
}"""

SYMBOLS = """(rows) => {
  const box = document.createElement("details");
  [box.id, box.className] = ["symbols", "legend"];
  box.append(document.createElement("summary"));
  const list = box.appendChild(document.createElement("ul"));
  for (const [symbol, tone, text] of rows) {
    const line = list.appendChild(document.createElement("li"));
    line.dataset.tone = tone;
    const shape = document.querySelector(".row .shape.now").cloneNode(true);
    shape.firstChild.setAttribute("href", `#${symbol}`);
    line.append(shape, text);
  }
  document.body.append(box);
}"""


def strip_of(image: str, box: Part, parts: Mapping[int, Part], scale: float) -> str:
    """Return a piece of a picture as HTML, with the numbers of the parts in it.

    The numbers are below a strip; in a high picture they are at the lower edges of the
    parts.
    """
    low = is_low(box)
    bottom = box.bottom
    if low:  # as far below the parts as above them
        above = min(part.top for part in parts.values()) - box.top
        bottom = max(part.bottom for part in parts.values()) + above
    height = (bottom - box.top) * scale
    marks = ""
    for number, part in parts.items():
        x = ((part.left + part.right) / 2 - box.left) * scale
        half = min(16, (part.bottom - part.top) * scale / 2)
        y = height + 20 if low else (part.bottom - box.top) * scale - half
        marks += f'<b style="left: {x}px; top: {y}px">{number}</b>'
    style = (
        f"width: {(box.right - box.left) * scale}px; height: {height}px; "
        f"background: url({image}) {-box.left * scale}px {-box.top * scale}px / "
        f"{scale * 100}vw no-repeat"
    )
    return f'<div class="strip {"low" if low else ""}" style="{style}">{marks}</div>'


def is_low(box: Part) -> bool:
    """Return whether a picture is cut into strips."""
    return box.bottom - box.top < WIDTH / 4


def draw(page: Page, shot: bytes, parts: Sequence[Part], box: Part) -> Image.Image:
    """Return the picture of a box of a page, with a number at each part.

    A bar is cut into strips, so that it is not made smaller; another picture is.

    Args:
        page: A page of the same size.
        shot: The screenshot of the whole page.
        parts: The parts to number.
        box: The box to show.
    """
    image = f"data:image/png;base64,{base64.b64encode(shot).decode()}"
    low = is_low(box)
    scale = 1 if low else min(1, WIDTH / (box.right - box.left))
    edges = cuts(parts, box.left, box.right) if low else [box.left, box.right]
    strips = ""
    for left, right in pairwise(edges):
        inside = {
            number: part
            for number, part in enumerate(parts, 1)
            if left <= (part.left + part.right) / 2 < right
        }
        piece = Part("", left, box.top, right, box.bottom)
        strips += strip_of(image, piece, inside, scale)
    names = "".join(
        f"<li><b>{number}</b>{html.escape(part.name)}</li>"
        for number, part in enumerate(parts, 1)
    )
    width = scale * max(right - left for left, right in pairwise(edges))
    sheet = page.context.new_page()
    sheet.set_content(
        f'<style>{STYLE}</style><main style="width: {width + 2}px">{strips}'
        f"<ol>{names}</ol></main>"
    )
    drawn = sheet.locator("main").screenshot()
    sheet.close()
    return Image.open(io.BytesIO(drawn)).convert("RGB")


def copy_of(page: Page, selector: str) -> Image.Image:
    """Return the picture of a copy of an element that is unfolded."""
    page.evaluate(COPY, [selector, WIDTH])
    drawn = page.locator("#copy").screenshot()
    return Image.open(io.BytesIO(drawn)).convert("RGB")


def symbols(page: Page) -> Image.Image:
    """Return the picture of all symbols of states on the console, with their texts."""
    rows: dict[tuple[str, str], list[str]] = {}
    for name, (symbol, tone, _) in LOOKS.items():
        text = STATE_TEXTS[name].format(who="Ann", since="10:32", program="/teleop")
        rows.setdefault((symbol, tone), []).append(text)
    page.evaluate(SYMBOLS, [[*key, " / ".join(texts)] for key, texts in rows.items()])
    return copy_of(page, "#symbols")


def box_of(page: Page, selector: str, name: str = "") -> Part:
    """Return the box around all elements of a selector, with a name."""
    found = [each.bounding_box() for each in page.locator(selector).all()]
    boxes = [box for box in found if box is not None]
    return Part(
        name,
        min(box["x"] for box in boxes),
        min(box["y"] for box in boxes),
        max(box["x"] + box["width"] for box in boxes),
        max(box["y"] + box["height"] for box in boxes),
    )
