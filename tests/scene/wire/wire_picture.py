"""The picture that a page shows of a session, and random changes of a scene."""

import math
import struct

from hypothesis import strategies as st

from webmap.base.geometry import Affine
from webmap.scene import html, svg
from webmap.scene.document import BoundElement
from webmap.scene.live import Line
from webmap.scene.node import Fragment, Text
from webmap.scene.wire.page_state import flags


def f32(value):
    return struct.unpack("<f", struct.pack("<f", value))[0]


def picture_of(session):
    """Return what a page shows, in the form of ``tests/web/tree.mjs``."""
    return [
        {
            "id": mount.number,
            "fragment": mount.fragment.id,
            "classes": list(mount.classes),
            "listening": {f"{e} {kind}": f for (e, kind), f in mount.listening.items()},
            "within": mount.within,
            "under": mount.under,
            "order": mount.order,
            "root": node_picture(mount.fragment.root),
        }
        for mount in session._mounts.values()
    ]


def node_picture(node):
    picture = {"id": node.id, "tag": node.tag}
    if isinstance(node, Text):
        return {**picture, "data": node.data, "children": []}
    if isinstance(node, BoundElement):
        picture["htmlId"] = node.html_id
        if node.emptied:
            picture["emptied"] = True
    elif node.tag != "#document":
        picture["svg"] = node.namespace == "svg"
    picture |= _values(node)
    picture["children"] = [node_picture(child) for child in node.children]
    return picture


def texts_of(node):
    """Return the attributes that are sent as text."""
    values = node._attributes.items()
    return {name: value for name, value in values if isinstance(value, str)}


def line_of(node):
    """Return the numbers of a line, or None if the element has none."""
    line = node._attributes.get("points")
    if not isinstance(line, Line):
        return None
    return list(struct.unpack(f"<{2 * len(line)}f", line.points))


def _values(node):
    values = {
        "attributes": {k: v or "(empty)" for k, v in texts_of(node).items()},
        "class": str(node.classes),
        "styles": node._styles,
        "transform": _transform(node._transform),
        "events": {
            kind: flags(prevent=prevent, stop=stop)
            for kind, (prevent, stop) in node.listening.items()
        },
    }
    values = {name: value for name, value in values.items() if value}
    if (line := line_of(node)) is not None:
        values["line"] = line
    if node._dots is not None:
        points = struct.unpack(f"<{len(node._dots.points) // 2}h", node._dots.points)
        values["dots"] = {"unit": f32(node._dots.unit), "points": list(points)}
    if node._age is not None:
        measured = node._age.measured
        never = math.isinf(measured)
        values["measured"] = None if never else max(1, round(measured * 1000))
        values |= {"limit": f32(node._age.limit), "shown": node._age.shown}
    if node._map is not None:
        values["map"] = list(node._map)
    return values


def _transform(transform):
    if isinstance(transform, Affine):
        return list(transform.values)
    if isinstance(transform, tuple):
        x, y, yaw = transform
        near = max(abs(x), abs(y)) < 4096
        yaw = f32(math.remainder(yaw, math.tau))
        return [f32(x), f32(y), yaw] if near else [x, y, yaw]
    return transform


class Playground:
    """A few fragments, and random steps that change them."""

    def __init__(self):
        self.fragments = [Fragment(svg.g()), Fragment(svg.svg()), Fragment(html.div())]

    def elements(self, fragment):
        return [node for node in fragment.root.walk() if not isinstance(node, Text)]

    def do(self, step):
        name, which, a, b, number, text = step
        fragment = self.fragments[which % len(self.fragments)]
        elements = self.elements(fragment)
        one, other = elements[a % len(elements)], elements[b % len(elements)]
        getattr(self, name)(fragment, one, other, number, text)

    def add(self, fragment, one, other, number, text):
        if fragment.root.namespace == "svg":
            child = svg.g(svg.path(class_="dot"), svg.title(text), svg.polyline())
        else:
            child = html.p(text, html.strong("x"))
        one.insert(int(number) % (len(one.children) + 1), child)

    def move(self, fragment, one, other, number, text):
        if one not in list(other.walk()) and one.tag != "title":
            one.insert(int(number) % (len(one.children) + 1), other)

    def remove(self, fragment, one, other, number, text):
        if one is not fragment.root:
            one.remove()

    def attribute(self, fragment, one, other, number, text):
        one.set(lang=text, data_name=text or None, tabindex=number)

    def unset(self, fragment, one, other, number, text):
        one.unset("lang", "data-name", "class")
        if one.namespace == "svg":
            one.unset("transform")

    def label(self, fragment, one, other, number, text):
        if one.tag in ("title", "p", "strong"):
            one.text = text

    def classes(self, fragment, one, other, number, text):
        one.classes.toggle(f"c{int(number) % 5}")

    def pose(self, fragment, one, other, number, text):
        if one.tag in ("g", "path", "svg"):
            one.set_pose(number, -number, number / 3)

    def matrix(self, fragment, one, other, number, text):
        if one.tag in ("g", "path", "svg"):
            one.set_matrix(Affine(1, 2, 3, 4, number, 6))

    def transform(self, fragment, one, other, number, text):
        if one.tag in ("g", "path", "svg"):
            one.set(transform="scale(2)")

    def dots(self, fragment, one, other, number, text):
        if one.tag == "path":
            count = int(number) % 4
            one.set_dots(struct.pack(f"<{2 * count}h", *range(-count, count)), 0.001)

    def line(self, fragment, one, other, number, text):
        if one.tag == "polyline":
            one.set_line([(number, i) for i in range(int(number) % 4)])

    def extend(self, fragment, one, other, number, text):
        if one.tag == "polyline":
            one.extend_line([(number, 1.0)], drop=int(number) % 3)

    def points(self, fragment, one, other, number, text):
        if one.tag == "polyline":
            one.set(points=[(1, 2)] if number > 0 else None)

    def age(self, fragment, one, other, number, text):
        one.set_age(abs(number), limit=abs(number), age_text=False)

    def style(self, fragment, one, other, number, text):
        one.set_style("--dot-size", number if int(number) % 2 else None)

    def events(self, fragment, one, other, number, text):
        one.on("click", print, stop=number > 0)
        one.on("keydown", print, prevent=True).remove()


NAMES = [
    name for name in vars(Playground) if name not in ("do", "elements", "__init__")
]
NAMES = sorted(name for name in NAMES if not name.startswith("_"))

steps = st.lists(
    st.tuples(
        st.sampled_from(NAMES),
        st.integers(0, 2),
        st.integers(0, 40),
        st.integers(0, 40),
        st.floats(-9000, 9000, width=32),
        # Without a bracket there is no url(); a scene refuses url().
        st.text(st.characters(codec="utf-8", exclude_characters="\0("), max_size=8),
    ),
    max_size=20,
)

histories = st.lists(
    st.tuples(steps, st.sampled_from(["frame", "look away", "restart", "twice"])),
    min_size=1,
    max_size=6,
)
"""Steps, and the actions of the page after them."""


def play(history, session):
    """Change a scene and return the frames that a page would get."""
    ground = Playground()
    mounts = [session.mount(fragment, under=0) for fragment in ground.fragments]
    frames = []

    def look():
        frame = session.frame(0.0)
        if frame is not None:
            frames.append(frame)
            session.receive(f'{{"op":"seen","frame":{session._frame}}}')

    look()
    for steps_, then in history:
        for step in steps_:
            ground.do(step)
        if then == "restart":
            session.restart()
        elif then == "twice":
            mounts.append(session.mount(ground.fragments[0], under=0, order=-1))
            session.set_class(mounts[-1], "selected", True)
            session.unmount(mounts.pop(0))
            session.listen(mounts[-1], ground.fragments[0].root.id, "click")
        if then != "look away":
            look()
    look()
    return frames
